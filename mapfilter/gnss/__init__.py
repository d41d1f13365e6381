"""Satellites: almanacs, where they stand, and which of them are seen."""
