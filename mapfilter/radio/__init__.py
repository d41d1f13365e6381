"""What the network is and how it is heard: cell plans, levels, rasters, the RXLEV scale."""
