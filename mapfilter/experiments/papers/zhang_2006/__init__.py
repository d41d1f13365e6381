"""Zhang, Knedlik & Loffeld (2006): bounds for timing advance and levels in GSM, and filters."""
