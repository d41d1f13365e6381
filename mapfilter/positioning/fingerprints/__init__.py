"""Positions from single reports: fingerprints, without motion."""
