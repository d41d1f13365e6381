"""The radio network: cell plans, antennas, the RXLEV scale."""
