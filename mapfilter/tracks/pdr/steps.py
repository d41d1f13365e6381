"""Steps of a walker: when, how long, and whether at all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter.tracks.pdr.options import STEP_FACTOR
from mapfilter.tracks.pdr.signals import RATE_HZ

BAND_HZ = (0.5, 2.6)
_PROMINENCE_MPS2 = 1.5
_HEIGHT_MPS2 = 0.3
_SHORTEST_S, _LONGEST_S = 0.3, 1.5
_LEAST_STEPS = 3
_NEIGHBOURS, _LEAST_SHARE = 7, 0.35
_AROUND_S = 0.4
_STILL_MPS2, _STILL_S = 0.3, 1.0


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps in the order of time.

    Parameters
    ----------
    index : (K,) array of int
        The sample at which the body rises fastest, once in each step.
    swing_mps2 : (K,) array
        Range of the vertical acceleration around it, slow and fast parts filtered out.
    """

    index: Ints
    swing_mps2: Floats


def vertical_swing(force_up_mps2: Floats) -> Floats:
    """Return vertical accelerations in the band of human steps, 0.5 to 2.6 Hz."""
    # Slow to import (it imports scipy.stats), and few commands need it.
    from scipy.signal import butter, sosfiltfilt

    sos = butter(2, BAND_HZ, btype="band", fs=RATE_HZ, output="sos")
    swing: Floats = sosfiltfilt(sos, force_up_mps2)
    return swing


def find_steps(force_up_mps2: Floats) -> Steps:
    """Find steps in the upward specific force.

    A step is a peak of the vertical acceleration with a prominence of 1.5 m/s², 0.3 s or more
    from the next one, and with 0.35 of the prominence of its neighbours. Fewer than three in a
    row, with at most 1.5 s between them, are no walk.

    Parameters
    ----------
    force_up_mps2 : (N,) array
        At :data:`mapfilter.tracks.pdr.signals.RATE_HZ`; the device's axes do not matter.
    """
    # Slow to import (one imports scipy.stats), and few commands need them.
    from scipy.ndimage import median_filter
    from scipy.signal import find_peaks

    swing = vertical_swing(force_up_mps2)
    peaks, found = find_peaks(
        swing,
        height=_HEIGHT_MPS2,
        prominence=_PROMINENCE_MPS2,
        distance=int(_SHORTEST_S * RATE_HZ),
    )
    if peaks.size:
        # What the filter adds before the first and after the last step is smaller than they.
        usual = median_filter(found["prominences"], _NEIGHBOURS, mode="nearest")
        peaks = peaks[found["prominences"] > _LEAST_SHARE * usual]
    run = np.concatenate([[0], np.cumsum(np.diff(peaks) > _LONGEST_S * RATE_HZ)])[: len(peaks)]
    index = peaks[np.bincount(run)[run] >= _LEAST_STEPS] if peaks.size else peaks
    around = int(_AROUND_S * RATE_HZ)
    parts = (swing[max(0, i - around) : i + around] for i in index)
    ranges = np.array([np.ptp(part) for part in parts], dtype=np.float64)
    return Steps(index.astype(np.int64), ranges)


def step_lengths(swing_mps2: Floats, factor: float = STEP_FACTOR) -> Floats:
    """Return lengths in metres by the model of Weinberg: ``factor · swing^(1/4)``.

    Source: H. Weinberg, Using the ADXL202 in pedometer and personal navigation applications,
    Analog Devices application note AN-602, 2002.

    Examples
    --------
    >>> step_lengths(np.array([1.0, 16.0]), factor=0.4).tolist()
    [0.4, 0.8]
    """
    lengths: Floats = factor * np.maximum(swing_mps2, 0.0) ** 0.25
    return lengths


def still(force_mps2: Floats) -> Bools:
    """Return where the device does not move: one second of force, all within 0.3 m/s²."""
    width = int(_STILL_S * RATE_HZ)
    kernel = np.ones(width) / width
    mean = np.stack([np.convolve(part, kernel, "same") for part in force_mps2.T], axis=1)
    square = np.convolve(((force_mps2 - mean) ** 2).sum(axis=1), kernel, "same")
    quiet: Bools = square < _STILL_MPS2**2
    return quiet
