"""How far positions are from the true ones."""

import numpy as np


def error_m(log, located):
    """Return how far a fix is from the truth of a log, or each epoch of an estimate."""
    east_m = np.interp(located.time_s, log.truth["time_s"], log.truth["east_m"])
    north_m = np.interp(located.time_s, log.truth["time_s"], log.truth["north_m"])
    return np.hypot(located.east_m - east_m, located.north_m - north_m)
