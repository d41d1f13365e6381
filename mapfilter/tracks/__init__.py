"""Tracks: what one journey recorded, its files, and dead reckoning."""
