"""Steps of a log from each position of a receiver to the next."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._constants import MAD_TO_SD
from mapfilter._types import Bools, Floats
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.joining.moved import LEAST_STEP_SD_M, MOVING_SD, chords, receiver_noise

_PART_S, _LONGEST_WAY_S = 1.0, 30.0
_CHORD_SCALE = 0.1
"""Straight ways between positions cut corners: a right angle in the middle of one takes 30 %."""

_LEAST_WAYS, _SHARE, _SHORT, _FAR = 10, 0.9, 0.9, 1.5
_LONGEST_USUAL_S = 300.0


def motion_from_positions(
    time_s: Floats, east_m: Floats, north_m: Floats
) -> tuple[pd.DataFrame, ImuNoise]:
    """Return steps and headings from each position to the next, and their errors.

    The way between two positions is parted into equal steps of at most 1 s, so that a filter
    compares each with what it receives and with the streets. The errors of a way are the scatter of
    positions about the straight line between the one before and the one after, which holds turns
    and changes of speed, too; a part of n has them by 1/√n. A way of less than two of its standard
    deviations has no heading. One that lasts longer than 30 s is one step, straight from its begin
    to its end; where positions are renewed by distance only one of more than 300 s, or longer than
    usual, is: others are as straight as those of a fast drive.

    Parameters
    ----------
    time_s : (N,) array
        In order, each once.
    east_m, north_m : (N,) array

    Examples
    --------
    >>> time_s = np.arange(5.0)
    >>> motion, errors = motion_from_positions(time_s, 3 * time_s, 4 * time_s)
    >>> motion.iloc[1].round(4).tolist(), errors.sigma_trans_m
    ([1.0, 5.0, 0.9273, nan], 0.05)
    """
    step_m, heading = chords(east_m, north_m)
    sd_m = 0.0
    if len(time_s) > 2:
        part = (time_s[1:-1] - time_s[:-2]) / (time_s[2:] - time_s[:-2])
        off = [p[1:-1] - (1 - part) * p[:-2] - part * p[2:] for p in (east_m, north_m)]
        scaled = np.abs(off) / np.sqrt(1 + part**2 + (1 - part) ** 2)
        sd_m = MAD_TO_SD * float(np.median(scaled))
    way_sd_m = max(np.sqrt(2) * sd_m, LEAST_STEP_SD_M)
    moving = step_m > MOVING_SD * way_sd_m
    lasted_s = np.diff(time_s)
    whole = _unknown_between(step_m, lasted_s)
    parts = np.where(whole, 1.0, np.ceil(lasted_s / _PART_S)).astype(np.int64)
    way = np.repeat(np.arange(len(parts)), parts)
    # Each part's number in its way, from 1.
    number = np.arange(1, len(way) + 1) - (np.cumsum(parts) - parts)[way]
    at_s = np.where(
        number == parts[way],
        time_s[1:][way],
        time_s[:-1][way] + number * (lasted_s / parts)[way],
    )
    motion = pd.DataFrame(
        {
            "time_s": np.concatenate([time_s[:1], at_s]),
            "step_m": np.concatenate([[0.0], (step_m / parts)[way]]),
            "heading_rad": np.concatenate([[np.nan], np.where(moving, heading, np.nan)[way]]),
            "turn_rad": np.nan,
        }
    )
    # Those of the usual way while moving.
    usual = moving if moving.any() else np.ones(len(parts), dtype=bool)
    count = float(np.median(parts[usual])) if len(parts) else 1.0
    usual_m = float(np.median(step_m[moving])) if moving.any() else way_sd_m
    step_sd_m = max(way_sd_m / np.sqrt(count), LEAST_STEP_SD_M)
    heading_sd = float(np.degrees(np.arctan2(step_sd_m, usual_m / count)))
    return motion, receiver_noise(at_s, step_sd_m, heading_sd, scale=_CHORD_SCALE)


def _unknown_between(step_m: Floats, lasted_s: Floats) -> Bools:
    """Return which ways say nothing of where the receiver was between their ends.

    Some programs renew positions after a distance: nearly all ways then are as long as the median,
    and one takes long where the receiver is slow.
    """
    long = np.asarray(lasted_s > _LONGEST_WAY_S)
    if len(step_m) < _LEAST_WAYS:
        return long
    usual_m = float(np.median(step_m))
    if usual_m <= 0 or np.mean(step_m >= _SHORT * usual_m) < _SHARE:
        return long
    return long & ~((step_m <= _FAR * usual_m) & (lasted_s <= _LONGEST_USUAL_S))
