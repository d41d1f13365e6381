"""Gaussian measurements of position and clock, as tables of terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats, Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.models.state import StateLayout
from mapfilter.models.terms import COLUMNS, ERROR_SLOTS, measure_kernel


@dataclass(frozen=True, eq=False)
class GaussianTerms:
    """A :class:`mapfilter.models.state.GaussianMeasurement` made of terms.

    The functions of this room make such objects; :func:`stack` puts several together.

    Parameters
    ----------
    layout : StateLayout
        Meaning of the components of a state.
    rows : (m, 15) array
        One term for each component of the reading.
    noise : (m, m) array
        Covariance of the noise.
    step : (m,) array
        Size of the steps in which a component is reported; 0 where it is continuous. It only
        matters when readings are drawn.
    patterns : (p,) array
        Samples of measured antennas.
    names : tuple of str
        Name of each component, for messages.
    errors : tuple of int
        Components of the state that levels contain besides, in dB.
    """

    layout: StateLayout
    rows: Floats
    noise: Floats
    step: Floats
    patterns: Floats = field(default_factory=lambda: np.zeros(1))
    names: tuple[str, ...] = ()
    errors: tuple[int, ...] = ()

    @property
    def size(self) -> int:
        """Number of components of a reading, m."""
        return int(self.rows.shape[0])

    @cached_property
    def uses(self) -> Ints:
        """Indices of the components of the state that matter."""
        return np.array((*self.layout.uses, *self.errors), dtype=np.int64)

    @cached_property
    def slots(self) -> Ints:
        """Places of east, north, up and clock within :attr:`uses`; -1 for none."""
        up, clock = self.layout.up, self.layout.clock
        last = len(self.layout.uses) - 1
        return np.array([0, 1, -1 if up is None else 2, -1 if clock is None else last])

    def mean(self, state: ArrayLike) -> Floats:
        """Return the expected reading, shape (..., m), for states of shape (..., n)."""
        return self._measure(state, derive=False)[0]

    def jacobian(self, state: ArrayLike) -> Floats:
        """Return the derivative of the mean by the state, shape (..., m, n)."""
        return self._measure(state, derive=True)[1]

    def covariance(self) -> Floats:
        """Return the covariance of the noise, shape (m, m)."""
        return self.noise

    def sample(self, state: ArrayLike, rng: np.random.Generator) -> Floats:
        """Draw readings, shape (..., m); components with a step are rounded down to it."""
        mean = self.mean(state)
        noise = rng.standard_normal(mean.shape) @ np.linalg.cholesky(self.noise).T
        drawn = mean + noise
        stepped = self.step > 0
        if stepped.any():
            size = self.step[stepped]
            # A report of k steps stands for the middle of what it covers.
            drawn[..., stepped] = (np.maximum(np.floor(drawn[..., stepped] / size), 0) + 0.5) * size
        return np.asarray(drawn)

    def _measure(self, state: ArrayLike, *, derive: bool) -> tuple[Floats, Floats]:
        given = np.asarray(state, dtype=np.float64)
        n, m = self.layout.size, self.size
        if given.ndim == 0 or given.shape[-1] != n:
            raise fail(InputError, "state", f"shape (..., {n})", given.shape)
        flat = given.reshape(-1, n)
        points = np.ascontiguousarray(flat[:, self.uses].T)
        lanes = points.shape[1]
        mean = np.empty((m, lanes))
        slope = np.zeros((m, self.uses.size, lanes if derive else 1))
        measure = measure_kernel()
        measure(points, self.slots, self.rows, self.patterns, mean, slope, derive)
        means = np.ascontiguousarray(mean.T).reshape(*given.shape[:-1], m)
        if not derive:
            return means, slope
        jacobian = np.zeros((lanes, m, n))
        jacobian[:, :, self.uses] = slope.transpose(2, 0, 1)
        return means, jacobian.reshape(*given.shape[:-1], m, n)


def stack(measurements: Sequence[GaussianTerms]) -> GaussianTerms:
    """Put measurements of the same state together; their noises are independent.

    Raises
    ------
    InputError
        There are none, or their states differ.
    """
    if not measurements:
        raise fail(InputError, "measurements", "at least one", "none")
    layout = measurements[0].layout
    if any(one.layout != layout for one in measurements):
        raise fail(InputError, "measurements", "states of one layout", "several layouts")
    size = sum(one.size for one in measurements)
    noise, rows = np.zeros((size, size)), np.zeros((size, COLUMNS))
    errors = tuple(sorted({error for one in measurements for error in one.errors}))
    at, samples = 0, 0
    for one in measurements:
        span = slice(at, at + one.size)
        noise[span, span] = one.noise
        rows[span] = one.rows
        rows[span, 10] += samples
        rows[span, ERROR_SLOTS] = _error_slots(one, errors)
        at, samples = at + one.size, samples + one.patterns.size
    step = np.concatenate([one.step for one in measurements])
    patterns = np.concatenate([one.patterns for one in measurements])
    names = sum((one.names for one in measurements), ())
    return GaussianTerms(layout, rows, noise, step, patterns, names, errors)


def _error_slots(one: GaussianTerms, errors: tuple[int, ...]) -> Ints:
    """Return the slots of a measurement's errors, plus one, among those of several; 0 for none."""
    first = len(one.layout.uses)
    slot = np.array([0, *(first + 1 + errors.index(error) for error in one.errors)], dtype=np.int64)
    return np.asarray(slot[np.maximum(one.rows[:, ERROR_SLOTS].astype(np.int64) - first, 0)])


def places(where: str, given: ArrayLike, faults: Faults) -> Floats:
    """Check positions of transmitters: (m, 2) in a plane or (m, 3); return them as (m, 3)."""
    found = np.atleast_2d(np.asarray(given, dtype=np.float64))
    if found.ndim != 2 or found.shape[1] not in (2, 3) or not len(found):
        faults.add(where, "positions, shape (m, 2) or (m, 3)", f"shape {found.shape}")
        return np.zeros((1, 3))
    if not np.isfinite(found).all():
        faults.add(where, "finite metres", "NaN or infinity")
    return np.hstack([found, np.zeros((len(found), 3 - found.shape[1]))])


def deviations(where: str, given: ArrayLike, size: int, faults: Faults) -> Floats:
    """Check standard deviations: one for all, or ``size`` of them, each above 0."""
    found = np.asarray(given, dtype=np.float64)
    if found.shape not in ((), (size,)):
        faults.add(where, f"one deviation or {size}", f"shape {found.shape}")
        return np.ones(size)
    if not (np.isfinite(found) & (found > 0)).all():
        faults.add(where, "deviations above 0", np.array2string(found, threshold=8))
    return np.broadcast_to(found, (size,)).astype(np.float64)


def checked_covariance(given: ArrayLike, size: int, faults: Faults) -> Floats:
    """Check that ``covariance_m2`` is a symmetric positive definite matrix of a size."""
    where, found = "covariance_m2", np.array(given, dtype=np.float64)
    if found.shape != (size, size) or not np.isfinite(found).all():
        faults.add(where, f"finite numbers, shape ({size}, {size})", f"shape {found.shape}")
        return np.eye(size)
    # As by np.allclose, which takes longer than all else here.
    if not (np.abs(found - found.T) <= 1e-9 * np.abs(found.T)).all():
        faults.add(where, "a symmetric matrix", "one that is not", "a factor for a covariance")
        return np.eye(size)
    found = 0.5 * (found + found.T)
    try:
        np.linalg.cholesky(found)
    except np.linalg.LinAlgError:
        lowest = float(np.linalg.eigvalsh(found)[0])
        faults.add(where, "a positive definite matrix", f"an eigenvalue of {lowest:.3g}")
        return np.eye(size)
    return found


def terms(
    layout: StateLayout, kind: float, places_m: Floats, columns: Floats | None = None
) -> Floats:
    """Return rows of a kind at places, heights counted from the receiver's own where it has one."""
    rows = np.zeros((len(places_m), COLUMNS))
    rows[:, 0] = kind
    rows[:, 1:4] = places_m
    if layout.up is None:
        rows[:, 3] -= layout.height_m
    if columns is not None:
        rows[:, 4 : 4 + columns.shape[1]] = columns
    return rows


def independent(
    faults: Faults,
    layout: StateLayout,
    rows: Floats,
    sigma: Floats,
    name: str,
    step: float = 0.0,
    patterns: Floats | None = None,
) -> GaussianTerms:
    """Return a measurement of independent components, or raise its faults."""
    faults.raise_if_any(InputError)
    names = tuple(f"{name} {index}" for index in range(len(rows)))
    samples = np.zeros(1) if patterns is None else patterns
    steps = np.full(len(rows), float(step))
    return GaussianTerms(layout, rows, np.diag(sigma**2), steps, samples, names)
