"""Zhang (2006): timing advances and levels of GSM by Kalman-type filters."""
