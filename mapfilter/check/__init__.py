"""Checks of inputs against each other: plausibility of levels, azimuths, positions."""
