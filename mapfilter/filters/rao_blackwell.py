"""The Rao-Blackwellised particle filter: particles for some components, Gaussians for the others.

Given the path of the sampled components (position), the others (receiver clock, velocity,
shadowing) are linear and Gaussian: each particle carries their mean by a Kalman filter, exactly
(Doucet, de Freitas, Murphy & Russell 2000; Schön, Gustafsson & Nordlund 2005). As all particles
share transition, noise and slopes, they share one covariance and one gain; only means differ.

With ``S = Φ P Φᵀ + Q`` over the whole state and s the sampled components, a step is
``x' = Φ x + G ε``, ``G = S[:, s] S[s, s]^(-T/2)``, ``P' = S - G Gᵀ``, with one normal number in ε
for each sampled component: what is drawn of them corrects the others. A reading
``y = h(x_s) + C x + v`` weighs by its density with covariance ``C P Cᵀ + R``.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan
from typing import Annotated

import numpy as np
from annotated_types import Ge, Le
from numpy.typing import ArrayLike

from mapfilter._kernels import draw_key
from mapfilter._types import Floats, Floats32, Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.filters._rao_blackwell import (
    Entries,
    Weighing,
    copies,
    gains,
    means,
    move,
    propagate,
    sums,
    weigh_kernel,
)
from mapfilter.filters.gaussian import Gaussian, factor_of
from mapfilter.filters.kalman import Taken
from mapfilter.filters.resampling import normalise, systematic
from mapfilter.filters.trials import CompiledMeasurement
from mapfilter.options import Options, Share

_LOG_TWO_PI = float(np.log(2 * np.pi))


@dataclass(frozen=True, slots=True)
class SirOptions(Options):
    """Resampling of the particles.

    Parameters
    ----------
    resample_below : float
        Share of the effective sample size below which particles are resampled; 1 does so at every
        reading (sampling importance resampling, SIR).
    regularise : float
        Width of the kernel that jitters copies, as a share of the best one for normal beliefs
        (Musso, Oudjane & Le Gland 2001); 0 for none.
    """

    resample_below: Share = 1.0
    regularise: Annotated[float, Ge(0), Le(2)] = 0.0


SIR = SirOptions()
"""Resampled at every reading."""

REGULARISED = SirOptions(0.5, 0.5)
"""Resampled where half of the particles carry the weight, copies jittered."""


@dataclass(frozen=True, eq=False)
class MixedBelief:
    """Particles of the whole state, with the covariance that all share.

    Parameters
    ----------
    state : (n, N) array
        Sampled components, and means of the others.
    log_weight : (N,) array
        Logarithms of weights that sum to one.
    covariance : (n, n) array
        Of the components that are not sampled, given the sampled ones, whose rows are 0.
    sampled : (d,) integer array
        Which components are sampled.
    """

    state: Floats
    log_weight: Floats
    covariance: Floats
    sampled: Ints

    def weights(self) -> Floats32:
        """Return weights that sum to one, shape (N,)."""
        weight = np.empty(self.log_weight.size, dtype=np.float32)
        normalise(self.log_weight.copy(), weight)
        return weight

    def mean(self) -> Floats:
        """Return the mean of the whole state, shape (n,)."""
        return np.asarray(means(self.state, self.weights()))

    def moments(self) -> Gaussian:
        """Return mean and covariance of the whole state."""
        mean, spread = sums(self.state, self.weights())
        return Gaussian(mean, spread + self.covariance)


def init(
    mean: ArrayLike,
    covariance: ArrayLike,
    sampled: ArrayLike,
    count: int,
    rng: np.random.Generator,
) -> MixedBelief:
    """Draw so many first particles of the sampled components from a Gaussian belief.

    Raises
    ------
    InputError
        No such components, no particles, or a covariance that is none.
    """
    centre = np.array(mean, dtype=np.float64)
    chosen = np.unique(np.asarray(sampled, dtype=np.int64))
    if not chosen.size or chosen[0] < 0 or chosen[-1] >= centre.size:
        raise fail(InputError, "sampled", f"indices in 0..{centre.size - 1}", chosen)
    if count < 2:
        raise fail(InputError, "particles", "at least 2", count)
    factor_of(covariance, centre.size)
    start = MixedBelief(
        np.tile(centre[:, None], count),
        np.full(count, -np.log(count)),
        np.array(covariance, dtype=np.float64),
        chosen,
    )
    still = np.eye(centre.size)
    return predict(start, still, np.zeros_like(still), rng)


def predict(
    belief: MixedBelief, transition: Floats, process: Floats, rng: np.random.Generator
) -> MixedBelief:
    """Return the belief after linear motion, ``x' = Φ x + w``, w normal with covariance Q.

    Φ and Q are (n, n); Q may be singular.

    Raises
    ------
    InputError
        Sizes that do not fit.
    """
    n = belief.state.shape[0]
    if transition.shape != (n, n) or process.shape != (n, n):
        expected, got = f"two matrices {n} x {n}", f"{transition.shape}, {process.shape}"
        raise fail(InputError, "motion", expected, got)
    phi, sampled = np.ascontiguousarray(transition), belief.sampled
    gain, covariance = propagate(belief.covariance, phi, process, sampled)
    moved = move(belief.state, Entries.of(transition - np.eye(n)), gain, draw_key(rng))
    return MixedBelief(moved, belief.log_weight, covariance, sampled)


def update(
    belief: MixedBelief,
    measurement: CompiledMeasurement,
    reading: ArrayLike,
    rng: np.random.Generator,
    options: SirOptions = SIR,
    loading: Floats | None = None,
) -> tuple[MixedBelief, Taken]:
    """Return the belief after a reading, and the outcome of the update.

    Parameters
    ----------
    belief : MixedBelief
        Before the reading.
    measurement : CompiledMeasurement
        Of the components it depends on, positions are sampled; the clock need not be.
    reading : (m,) array_like
        NaN where absent.
    rng : numpy.random.Generator
        Draws are made only where particles are resampled.
    options : SirOptions
        When to resample.
    loading : (m, n) array, optional
        Linear contribution of components that are not sampled, such as shadowing, to the reading:
        ``y = h(x) + loading x + v``.

    Returns
    -------
    belief : MixedBelief
        As it was where the reading is empty, or so far off that no particle keeps any weight.
    taken : Taken
        Evidence, and the normalised innovation squared of the particle that explains it best.

    Raises
    ------
    InputError
        Sizes that do not fit, infinite readings, or a dependence that is not linear on components
        that are not sampled.
    """
    given = np.asarray(reading, dtype=np.float64)
    slope = _slopes(belief, measurement, given, loading)
    present = np.isfinite(given)
    if not present.any():
        return belief, Taken(0.0, 0.0)
    rows, noise = measurement.rows, measurement.noise
    if not present.all():
        rows, noise = rows[present], noise[np.ix_(present, present)]
        slope, given = slope[present], given[present]
        loading = None if loading is None else loading[present]
    inverse, gain, covariance, log_root = gains(slope, belief.covariance, noise)
    if not isfinite(log_root):
        raise fail(InputError, "measurement, noise", "a positive definite covariance", noise)
    corrected = np.flatnonzero(gain.any(axis=1))
    weighing = Weighing(
        measurement.slots,
        measurement.uses,
        np.ascontiguousarray(rows),
        measurement.patterns,
        given,
        inverse,
        corrected,
        np.ascontiguousarray(gain[corrected]),
        Entries.of(np.zeros((0, 0)) if loading is None else loading),
    )
    log_weight, state = belief.log_weight.copy(), belief.state.copy()
    least = weigh_kernel()(measurement.measure, weighing, state, log_weight)
    weight = np.empty(log_weight.size, dtype=np.float32)
    total, effective = normalise(log_weight, weight)
    if not isfinite(total):
        return belief, Taken(nan, nan)
    evidence = total - log_root - 0.5 * given.size * _LOG_TWO_PI
    after = MixedBelief(state, log_weight, covariance, belief.sampled)
    if effective < options.resample_below * log_weight.size:
        after = _resampled(after, weight, rng, options)
    return after, Taken(float(evidence), float(least))


def _resampled(
    belief: MixedBelief, weight: Floats32, rng: np.random.Generator, options: SirOptions
) -> MixedBelief:
    count, sampled = weight.size, belief.sampled
    chosen = np.empty(count, dtype=np.int32)
    systematic(weight, rng.random(), chosen)
    state = copies(belief.state, chosen)
    if options.regularise > 0:
        d = sampled.size
        width = options.regularise * (4.0 / (count * (d + 2))) ** (1.0 / (d + 4))
        _, spread = sums(np.ascontiguousarray(belief.state[sampled]), weight)
        gain = np.zeros((belief.state.shape[0], d))
        gain[sampled] = width * factor_of(0.5 * (spread + spread.T), d)
        state = move(state, Entries.of(np.zeros((0, 0))), gain, draw_key(rng))
    return MixedBelief(state, np.full(count, -np.log(count)), belief.covariance, sampled)


def _slopes(
    belief: MixedBelief, measurement: CompiledMeasurement, given: Floats, loading: Floats | None
) -> Floats:
    """Return the derivative of a reading by the components that are not sampled, shape (m, n)."""
    n, m = belief.state.shape[0], measurement.rows.shape[0]
    faults = Faults()
    if given.shape != (m,):
        faults.add("reading", f"shape ({m},)", given.shape)
    if np.isinf(given).any():
        faults.add("reading", "finite numbers, or NaN where absent", "infinity")
    if measurement.uses.size and measurement.uses.max() >= n:
        faults.add("measurement", f"a state of {n} components", measurement.uses.max() + 1)
    if loading is not None and loading.shape != (m, n):
        faults.add("loading", f"shape ({m}, {n})", loading.shape)
    faults.raise_if_any(InputError)
    places = measurement.uses[[slot for slot in measurement.slots[:3].tolist() if slot >= 0]]
    if missing := sorted(set(places.tolist()) - set(belief.sampled.tolist())):
        raise fail(InputError, "sampled", "all components that positions are", f"not {missing}")
    mean, slope = np.empty((m, 1)), np.zeros((m, measurement.uses.size, 1))
    point = np.ascontiguousarray(belief.state[measurement.uses, :1])
    rows, patterns = np.ascontiguousarray(measurement.rows), measurement.patterns
    measurement.measure(point, measurement.slots, rows, patterns, mean, slope, True)
    whole = np.zeros((m, n))
    whole[:, measurement.uses] = slope[:, :, 0]
    if loading is not None:
        whole += loading
    whole[:, belief.sampled] = 0.0
    return whole
