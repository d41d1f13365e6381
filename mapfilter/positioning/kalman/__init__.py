"""Kalman-type filters over GNSS, timing advances, levels and dead reckoning; no map."""
