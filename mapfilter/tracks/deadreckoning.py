"""Dead reckoning, and noise of inertial measurements: Khalaf-Allah 2007, equations (3)-(10)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad

TranslationNoise = Literal["zero_mean", "as_printed"]


def dead_reckon(
    start_east_m: ArrayLike, start_north_m: ArrayLike, step_m: ArrayLike, heading_rad: ArrayLike
) -> tuple[Floats, Floats]:
    """Add up steps from a start: equations (3) and (4); with noisy steps (9) and (10).

    Parameters
    ----------
    start_east_m, start_north_m : array_like, shape (...)
        Where the first interval begins.
    step_m, heading_rad : array_like, shape (..., T)
        Length and direction (counter-clockwise from grid east) of each interval.

    Returns
    -------
    east_m, north_m : ndarray, shape (..., T)
        Where each interval ends.

    Examples
    --------
    >>> east_m, north_m = dead_reckon(10.0, 20.0, [3.0, 4.0], [0.0, np.pi / 2])
    >>> east_m.round(9).tolist(), north_m.round(9).tolist()
    ([13.0, 13.0], [20.0, 24.0])
    """
    step = np.asarray(step_m, dtype=np.float64)
    heading = np.asarray(heading_rad, dtype=np.float64)
    east = np.asarray(start_east_m, dtype=np.float64)[..., np.newaxis]
    north = np.asarray(start_north_m, dtype=np.float64)[..., np.newaxis]
    return (
        east + np.cumsum(step * np.cos(heading), axis=-1),
        north + np.cumsum(step * np.sin(heading), axis=-1),
    )


def steps_between(east_m: ArrayLike, north_m: ArrayLike) -> tuple[Floats, Floats]:
    """Return length and direction of the chords between positions, inverse of :func:`dead_reckon`.

    Standing still has no direction: such a step takes the last one before it, else the first one
    after it, and NaN when nothing ever moves.

    Examples
    --------
    >>> step_m, heading_rad = steps_between([0.0, 3.0, 3.0], [0.0, 4.0, 4.0])
    >>> step_m.tolist(), heading_rad.round(4).tolist()
    ([5.0, 0.0], [0.9273, 0.9273])
    """
    d_east = np.diff(np.asarray(east_m, dtype=np.float64), axis=-1)
    d_north = np.diff(np.asarray(north_m, dtype=np.float64), axis=-1)
    step = np.hypot(d_east, d_north)
    heading = np.where(step > 0, wrap_rad(np.arctan2(d_north, d_east)), np.nan)
    if heading.shape[-1]:
        index = np.where(step > 0, np.arange(step.shape[-1]), -1)
        latest = np.maximum.accumulate(index, axis=-1)
        first = np.argmax(step > 0, axis=-1)[..., np.newaxis]
        source = np.where(latest >= 0, latest, first)
        heading = np.take_along_axis(heading, source, axis=-1)
    return step, heading


def noisy_steps(
    step_m: ArrayLike,
    heading_rad: ArrayLike,
    sigma_trans_m: float,
    sigma_orient_rad: float,
    rng: np.random.Generator,
    *,
    translation_noise: TranslationNoise = "zero_mean",
) -> tuple[Floats, Floats]:
    """Add white Gaussian noise to steps and headings: equations (5)-(8).

    Noise is drawn once per element, translations first; the draws do not depend on the sigmas, so
    that runs of one seed differ only by how much the same noise is scaled.

    Parameters
    ----------
    step_m, heading_rad : array_like, shapes that broadcast
        True steps, such as (T,) or (draws, T).
    sigma_trans_m, sigma_orient_rad : float
        Standard deviations.
    translation_noise : {"zero_mean", "as_printed"}
        Equation (7) prints the true step as the mean of the error that equation (5) *adds* to that
        step, which doubles it. "zero_mean" takes this for a misprint.

    Returns
    -------
    step_m, heading_rad : ndarray, of the broadcast shape
        Steps may be negative; headings lie in [-π, π).
    """
    step, heading = np.broadcast_arrays(
        np.asarray(step_m, dtype=np.float64), np.asarray(heading_rad, dtype=np.float64)
    )
    error_m = sigma_trans_m * rng.standard_normal(step.shape)
    error_rad = sigma_orient_rad * rng.standard_normal(step.shape)
    if translation_noise == "as_printed":
        error_m = error_m + step
    return step + error_m, wrap_rad(heading + error_rad)
