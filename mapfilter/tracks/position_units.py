"""What turns degrees and radii of positions into metres and standard deviations."""

from __future__ import annotations

METRES_PER_DEGREE = 111_195.0
"""Of a great circle of the mean earth: for differences, not for places."""

RADIUS_68 = 1.515
"""Radius of 68 % of a two-dimensional normal distribution, in standard deviations."""

UERE_M = 4.0
"""Radius of 68 % of the errors of a receiver's positions, for a dilution of precision (HDOP) of 1.
"""
