"""Pseudoranges, and the clock, height and lasting errors that each hypothesis carries.

A pseudorange is the distance to a satellite, plus the clock's error, plus the effect of the
antenna's height, plus the satellite's lasting error. Given a hypothesis's path, these are linear
and Gaussian: each hypothesis carries their mean in further rows, and all share one covariance
(:mod:`mapfilter.filters.rao_blackwell`). So a single satellite weighs hypotheses, as soon as the
clock is known better than they are apart.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.filters import rao_blackwell
from mapfilter.filters.rao_blackwell import MixedBelief, SirOptions
from mapfilter.models.motion import clock_noise
from mapfilter.models.ranging import pseudoranges
from mapfilter.models.state import StateLayout
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.gnss.biases import (
    MOST,
    Biases,
    kept_share,
    reflection_deviations_m,
)
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.sky import Sky
from mapfilter.positioning.kalman.models import compiled

LAYOUT = StateLayout(5, 0, 1, clock=2)
"""East and north from the frame's origin, the clock's error and rate, and the height; lasting
errors of satellites (:mod:`mapfilter.positioning.gnss.biases`) stand behind these."""
LINEAR = 3
_NO_RESAMPLING = SirOptions(resample_below=0.0)


@dataclass(frozen=True, eq=False)
class Receiver:
    """Clock, height and lasting errors of a belief; hypotheses carry their differences from it.

    Parameters
    ----------
    time_s, travelled_m : float
        Time and distance travelled at the last comparison.
    mean : (3 + K,) array
        Clock error (m) and rate (m/s), height over the frame's origin (m), and the lasting error
        of each satellite in ``biases`` (m).
    covariance : (3 + K, 3 + K) array
        Shared by all hypotheses.
    used_at_m : float
        Distance travelled when satellites were last used.
    biases : Biases
        Satellites whose lasting errors are held.
    """

    time_s: float
    travelled_m: float
    mean: Floats
    covariance: Floats
    used_at_m: float = -np.inf
    biases: Biases = field(default_factory=Biases)

    def loading(self, sky: Sky) -> Floats:
        """Return what its states add to the pseudoranges of satellites, (m, 3 + K)."""
        found = np.zeros((len(sky.names), self.mean.size))
        found[:, 0] = 1.0
        # Up, and away from the satellite.
        found[:, 2] = -np.sin(sky.elevation_rad)
        if self.biases.names:
            found[np.arange(len(sky.names)), LINEAR + self.biases.index_of(sky.names)] = 1.0
        return found


@dataclass(frozen=True, eq=False)
class Weighed:
    """A belief weighed by pseudoranges.

    Parameters
    ----------
    gain : (N,) array
        Log-likelihood of each hypothesis, such that the belief's total is 0.
    score : float
        Log-likelihood of the belief less the usual one.
    rows : (3 + K, N) array
        Clock, height and lasting errors of the hypotheses afterwards.
    covariance : (3 + K, 3 + K) array
        Of these afterwards, shared by all hypotheses.
    """

    gain: Floats
    score: float
    rows: Floats
    covariance: Floats


def begun(options: GnssOptions, time_s: float, travelled_m: float) -> Receiver:
    """Return a receiver before its first pseudorange."""
    deviations = np.array([options.clock_sd_m, options.drift_sd_mps, options.height_sd_m])
    return Receiver(time_s, travelled_m, np.zeros(LINEAR), np.diag(deviations**2))


def begun_anew(options: GnssOptions, receiver: Receiver) -> Receiver:
    """Return a receiver beside another belief: the same clock, but all its errors are unknown.

    They were estimated given the hypotheses of the belief before, which carried their part of them.
    """
    again = begun(options, receiver.time_s, receiver.travelled_m)
    again.mean[:2] = receiver.mean[:2]
    return replace(again, used_at_m=receiver.used_at_m)


def with_satellites(
    options: GnssOptions, receiver: Receiver, rows: Floats, sky: Sky
) -> tuple[Receiver, Floats]:
    """Return a receiver, and rows (3 + K, N), with a lasting error of each satellite of an epoch.

    Satellites that are not received are left out once their errors are unknown again.
    """
    old = receiver.biases
    known = old.known(options, np.diag(receiver.covariance)[LINEAR:])
    received = np.array([name in sky.names for name in old.names], dtype=np.bool_)
    stay = received | known
    if int(stay.sum()) + len(sky.names) - int(received.sum()) > MOST:
        stay = received
    held = [name for name, one in zip(old.names, stay.tolist(), strict=True) if one]
    names = (*held, *(name for name in sky.names if name not in held))
    reflection_m = np.zeros(len(names))
    reflection_m[: len(held)] = old.reflection_m[stay]
    biases = Biases(names, reflection_m)
    now_m = reflection_deviations_m(options, sky.elevation_rad, sky.sigma_m)
    reflection_m[biases.index_of(sky.names)] = now_m
    index = np.append(np.arange(LINEAR), LINEAR + np.flatnonzero(stay))
    kept, size = index.size, LINEAR + len(names)
    mean = np.append(np.zeros(LINEAR), biases.means_m(options))
    covariance = np.diag(np.append(np.zeros(LINEAR), biases.variances_m2(options)))
    carrying = np.zeros((size, rows.shape[1]))
    mean[:kept], carrying[:kept] = receiver.mean[index], rows[index]
    covariance[:kept, :kept] = receiver.covariance[np.ix_(index, index)]
    return replace(receiver, mean=mean, covariance=covariance, biases=biases), carrying


def moved(
    options: GnssOptions, receiver: Receiver, rows: Floats, time_s: float, travelled_m: float
) -> tuple[Receiver, Floats]:
    """Propagate a receiver since the last comparison; rows have shape (3 + K, N)."""
    elapsed_s = max(time_s - receiver.time_s, 0.0)
    gone_m = max(travelled_m - receiver.travelled_m, 0.0)
    keep, size = kept_share(options, gone_m, elapsed_s), receiver.mean.size
    run = np.diag(np.append(np.ones(LINEAR), np.full(size - LINEAR, keep)))
    run[0, 1] = elapsed_s
    noise = np.zeros((size, size))
    biases = receiver.biases
    noise[LINEAR:, LINEAR:] = np.diag((1 - keep**2) * biases.variances_m2(options))
    # In proportion to time: noise must not depend on how often readings are compared.
    bias, rate = np.diag(clock_noise(1.0)).tolist()
    noise[0, 0] = bias * elapsed_s + rate * elapsed_s**3 / 3
    noise[0, 1] = noise[1, 0] = rate * elapsed_s**2 / 2
    noise[1, 1] = rate * elapsed_s
    noise[2, 2] = options.slope**2 * gone_m
    rows = rows.copy()
    rows[0] += elapsed_s * rows[1]
    rows[LINEAR:] *= keep
    covariance = run @ receiver.covariance @ run.T + noise
    mean = run @ receiver.mean
    mean[LINEAR:] += (1 - keep) * biases.means_m(options)
    after = replace(
        receiver,
        time_s=time_s,
        travelled_m=travelled_m,
        mean=mean,
        covariance=0.5 * (covariance + covariance.T),
    )
    return after, rows


def clock_reset(options: GnssOptions, receiver: Receiver) -> Receiver:
    """Return a receiver with an unknown clock error; rate and height stay."""
    covariance = receiver.covariance.copy()
    covariance[0, :] = covariance[:, 0] = 0.0
    covariance[0, 0] = options.clock_sd_m**2
    return replace(receiver, covariance=covariance)


def centred(receiver: Receiver, rows: Floats, state: Floats32) -> tuple[Receiver, Floats32]:
    """Return the receiver with the mean of the rows added, and hypotheses with the rest."""
    middle = rows.mean(axis=1)
    carrying = np.empty((STATES + len(rows), state.shape[1]), dtype=np.float32)
    carrying[:STATES] = state[:STATES]
    carrying[STATES:] = rows - middle[:, None]
    return replace(receiver, mean=receiver.mean + middle), carrying


def carried(state: Floats32, size: int = LINEAR) -> Floats:
    """Return what hypotheses carry of a receiver's states, shape (size, N).

    This is 0 before the first pseudorange, and where they began beside another receiver.
    """
    if state.shape[0] != STATES + size:
        return np.zeros((size, state.shape[1]))
    return state[STATES:].astype(np.float64)


def near_clock(sky: Sky, receiver: Receiver) -> Receiver:
    """Set an unknown clock to the median difference of pseudoranges and distances."""
    expected_m = np.linalg.norm(sky.satellites_m, axis=1)
    mean = receiver.mean.copy()
    mean[0] = float(np.median(sky.range_m - expected_m))
    return replace(receiver, mean=mean)


def weighed(
    sky: Sky,
    sigma_m: Floats,
    receiver: Receiver,
    place: Floats32,
    log_weight: Floats,
    rows: Floats,
    free: int = 0,
) -> Weighed:
    """Weigh hypotheses by pseudoranges, with clock, height and lasting errors integrated out.

    Parameters
    ----------
    sigma_m : (m,) array
        Standard deviations.
    receiver : Receiver
        At the time of the pseudoranges.
    place : (2, N) array
        East and north of the hypotheses in their frame.
    rows : (3 + K, N) array
        Clock, height and lasting errors of the hypotheses.
    free : int
        Number of readings that an unknown clock explains by itself.
    """
    origin = np.array(sky.origin_m)[:, None]
    size = 2 + len(rows)
    state = np.empty((size, place.shape[1]))
    state[:2] = sky.true_from_grid @ (place.astype(np.float64) - origin)
    state[2:] = rows
    covariance = np.zeros((size, size))
    covariance[2:, 2:] = receiver.covariance
    total = float(np.logaddexp.reduce(log_weight))
    # Weights of 0 become tiny ones, so that differences stay finite.
    weight = np.maximum(log_weight - total, -700.0)
    before = MixedBelief(state, weight, covariance, np.array([0, 1]))
    model = pseudoranges(replace(LAYOUT, size=size), sky.satellites_m, sigma_m)
    slope = receiver.loading(sky)
    known_m = slope @ receiver.mean
    loading = np.zeros((len(sky.names), size))
    # The model itself adds the clock's error.
    loading[:, 4:] = slope[:, 2:]
    rng = np.random.default_rng(0)  # Nothing is drawn.
    after, info = rao_blackwell.update(
        before, compiled(model), sky.range_m - known_m, rng, _NO_RESAMPLING, loading
    )
    gain = after.log_weight - before.log_weight
    best = -0.5 * info.nis if info.used else -np.inf
    score = best - float(gain.max()) + 0.5 * max(len(sky.names) - free, 0)
    return Weighed(gain, score, after.state[2:], after.covariance[2:, 2:])


def agreement(
    sky: Sky,
    sigma_m: Floats,
    receiver: Receiver,
    place: Floats32,
    weight: Floats32,
    rows: Floats,
    free: int = 0,
) -> float:
    """Return the agreement of pseudoranges with a belief taken as one Gaussian.

    This is half of the degrees of freedom less the normalized innovation squared: about 0 where
    they agree, far below where not. Arguments are those of :func:`weighed`, but weights sum to one.
    """
    origin = np.array(sky.origin_m)[:, None]
    flat = sky.true_from_grid @ (place.astype(np.float64) - origin)
    away = sky.satellites_m[:, :2, None] - flat
    up = sky.satellites_m[:, 2, None]
    expected = np.sqrt(away[:, 0] ** 2 + away[:, 1] ** 2 + up**2)
    slope = receiver.loading(sky)
    off = sky.range_m[:, None] - expected - slope @ (rows + receiver.mean[:, None])
    mean = off @ weight
    apart = off - mean[:, None]
    spread = (apart * weight) @ apart.T + slope @ receiver.covariance @ slope.T
    square = float(mean @ np.linalg.solve(spread + np.diag(sigma_m**2), mean))
    return 0.5 * (max(len(sky.names) - free, 0) - square)
