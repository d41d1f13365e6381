"""The walk of all made recordings: 60 s in Helsinki, a row every 2 s."""

import numpy as np

START_UTC_S = 1_777_629_600
"""2026-05-01 10:00:00 UTC."""


COUNT = 30
STEP_S = 2.0
TIMES_S = START_UTC_S + STEP_S * np.arange(COUNT)
# 3 m a second along a street, with a bend.
LAT_DEG = 60.1700 + 4.0e-5 * np.arange(COUNT)
LON_DEG = 24.9400 + 6.0e-5 * np.maximum(0, np.arange(COUNT) - 12)
LEVEL_DBM = -80 - np.arange(COUNT) % 7
SPEED_MPS = 2.2


def clock(index: int, layout: str = "%Y-%m-%dT%H:%M:%SZ", shift_s: float = 0.0) -> str:
    """Return the time of a row as text."""
    moment = np.datetime64(int(TIMES_S[index] + shift_s), "s").item()
    return str(moment.strftime(layout))
