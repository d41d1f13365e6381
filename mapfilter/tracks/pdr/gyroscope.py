"""The noise and the bias of a gyroscope, by what it reads while nothing moves.

Rests are those of the accelerometer, so that a noisy gyroscope does not hide them. A phone in the
hand still sways there, slowly: its noise is that of differences from sample to sample, and its bias
is known no better than it sways.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from mapfilter._constants import MAD_TO_SD
from mapfilter._types import Bools, Floats, Ints
from mapfilter.tracks.pdr.signals import RATE_HZ, Signals, gyroscope_samples

WALK_RAD_PER_SQRT_S = float(np.radians(0.15))
"""Random walk of a usual gyroscope's yaw, with what swinging and its scale add to it."""
RATE_SD_RADPS = float(np.radians(0.1))
"""Standard deviation of a usual gyroscope's constant rate error before anything is measured."""
UNSEEN_SD_RADPS = float(np.radians(0.5))
"""The same where nothing showed it over a whole recording, as data sheets of phones have it."""
_LARGE_WALK_RAD_PER_SQRT_S, _LARGE_BIAS_RADPS = 2 * WALK_RAD_PER_SQRT_S, float(np.radians(0.5))
"""From which on errors are noted."""
_QUIET_RADPS, _NOISY = 0.02, 1.5
"""What a device may sway at rest, and times its noise that one second of this may look like."""
MOST_BIAS_RADPS, _APART_RADPS = 0.1, 0.05
"""Largest rate at rest that is a bias and no turn, 6 deg/s, and the largest beside it."""
_FEWEST_S, _FEWEST_SAMPLES, _SHOWN = 3, 50, 3.0
"""Seconds at rest that show a bias, samples that show noise, and deviations that are no chance."""
_WIDTH = int(RATE_HZ)


@dataclass(frozen=True, eq=False)
class Gyroscope:
    """What a recording shows of its gyroscope.

    Parameters
    ----------
    bias_radps : (3,) array
        Rate at rest in the axes of the device; 0 where rests show none.
    noise_rad_per_sqrt_s : float
        Random walk of an angle by the white noise of its rate; 0 where no rest shows it.
    """

    bias_radps: Floats = field(default_factory=lambda: np.zeros(3))
    noise_rad_per_sqrt_s: float = 0.0

    @property
    def walk_rad_per_sqrt_s(self) -> float:
        """Random walk of the yaw: a usual one, and the noise."""
        return float(np.hypot(WALK_RAD_PER_SQRT_S, self.noise_rad_per_sqrt_s))

    @property
    def notes(self) -> tuple[str, ...]:
        """A note where errors are unusually large."""
        return error_notes(self.walk_rad_per_sqrt_s, float(np.linalg.norm(self.bias_radps)))

    def without_bias(self, signals: Signals) -> Signals:
        """Return signals less the bias."""
        rate = signals.rate_radps
        if rate is None or not self.bias_radps.any():
            return signals
        return replace(signals, rate_radps=rate - self.bias_radps)

    def rates_at_rest(
        self, rate_radps: Floats, up_radps: Floats, quiet: Bools, count: int
    ) -> tuple[Floats, Floats]:
        """Return the yaw rate and its standard deviation in each second in which nothing moved.

        Parameters
        ----------
        rate_radps : (N, 3) array
            In the axes of the device, at :data:`mapfilter.tracks.pdr.signals.RATE_HZ`.
        up_radps : (N,) array
            The rate about the vertical.
        quiet : (N,) array of bool
            Where the accelerometer shows a rest.
        count : int
            Number of seconds.

        Returns
        -------
        rates, sds : (count,) array
            NaN elsewhere.
        """
        rates, sds = np.full(count, np.nan), np.full(count, np.nan)
        second, _, sway = _rests(rate_radps, quiet, self.noise_rad_per_sqrt_s)
        up = np.array([up_radps[k * _WIDTH : (k + 1) * _WIDTH].mean() for k in second])
        inside = (second < count) & (np.abs(up) < _APART_RADPS)
        own = self.noise_rad_per_sqrt_s
        slow = np.sqrt(np.maximum(sway**2 - own**2 * RATE_HZ, 0.0) + own**2)
        rates[second[inside]] = up[inside]
        sds[second[inside]] = np.maximum(slow[inside], 1e-4)
        return rates, sds


def gyroscope_at_rest(
    sensors: Mapping[str, pd.DataFrame], stretches: Sequence[Signals], quiet: Sequence[Bools]
) -> Gyroscope:
    """Return what a gyroscope shows while the accelerometer does not move.

    Parameters
    ----------
    sensors : mapping of str to pandas.DataFrame
        Tables of :data:`mapfilter.tracks.sensors.SENSOR_COLUMNS`.
    stretches : sequence of Signals
    quiet : sequence of (N,) bool arrays
        Where nothing moves in each of them.
    """
    samples = gyroscope_samples(sensors)
    if samples is None:
        return Gyroscope()
    noise = _noise(*samples, stretches, quiet)
    rests = [
        _rests(part.rate_radps, still, noise)
        for part, still in zip(stretches, quiet, strict=True)
        if part.rate_radps is not None
    ]
    means = np.concatenate([mean for _, mean, _ in rests]) if rests else np.zeros((0, 3))
    means = means[np.linalg.norm(means, axis=1) < MOST_BIAS_RADPS]
    if len(means) < _FEWEST_S:
        return Gyroscope(noise_rad_per_sqrt_s=noise)
    return Gyroscope(shown_bias(means, noise), noise)


def shown_bias(rates: Floats, noise: float) -> Floats:
    """Return the median of rates at rest; 0 where it may be that of a usual gyroscope.

    What is so small is left to the smoother of the yaw.

    Parameters
    ----------
    rates : (N, D) array
    noise : float
        Least deviation of a rate.

    Examples
    --------
    >>> shown_bias(np.radians([[0.9, 0.1], [1.0, 0.1], [1.1, 0.1]]), 0.001).round(4).tolist()
    [0.0175, 0.0017]
    >>> shown_bias(np.radians([[0.2], [-0.3], [0.1]]), 0.001).tolist()
    [0.0]
    """
    usual: Floats = np.median(rates, axis=0)
    apart = MAD_TO_SD * np.median(np.abs(rates - usual), axis=0)
    sd = np.sqrt((apart**2 + noise**2) / len(rates) + RATE_SD_RADPS**2)
    return usual if (np.abs(usual) > _SHOWN * sd).any() else np.zeros_like(usual)


def _noise(
    time_s: Floats, rate_radps: Floats, stretches: Sequence[Signals], quiet: Sequence[Bools]
) -> float:
    """Return the random walk of the angle by noise from sample to sample at rest."""
    at_rest = np.zeros(len(time_s), dtype=np.bool_)
    for part, still in zip(stretches, quiet, strict=True):
        at = np.rint((time_s - part.time_s[0]) * RATE_HZ).astype(np.int64)
        inside = (at >= 0) & (at < len(still))
        at_rest[inside] |= still[at[inside]]
    whole = at_rest[2:] & at_rest[1:-1] & at_rest[:-2]
    if whole.sum() < _FEWEST_SAMPLES:
        return 0.0
    sd = sample_noise(np.diff(rate_radps, 2, axis=0)[whole])
    return sd * float(np.sqrt(np.median(np.diff(time_s))))


def sample_noise(bends: Floats) -> float:
    """Return the white noise of samples by their second differences.

    What changes slowly from sample to sample does not count.

    Parameters
    ----------
    bends : (N,) or (N, D) array
        Second differences; of D axes the root mean square counts. 0 without any.

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(0.0, 2.0, 9000)
    >>> round(sample_noise(np.diff(np.linspace(0.0, 50.0, 9000) + noise, 2)), 1)
    2.0
    """
    if not bends.size:
        return 0.0
    usual = np.median(np.abs(bends), axis=0)
    return MAD_TO_SD * float(np.sqrt(np.mean(usual**2) / 6.0))


def error_notes(
    walk_rad_per_sqrt_s: float, bias_radps: float = 0.0, *, of: str = "gyroscope"
) -> tuple[str, ...]:
    """Return a note on the errors of turns at rest where they are unusually large."""
    found = []
    if bias_radps >= _LARGE_BIAS_RADPS:
        found.append(f"a bias of {np.degrees(bias_radps):.2g} deg/s, which is subtracted")
    if walk_rad_per_sqrt_s >= _LARGE_WALK_RAD_PER_SQRT_S:
        drift_deg = float(np.degrees(walk_rad_per_sqrt_s))
        found.append(f"noise by which headings drift {drift_deg:.2g} deg/sqrt(s)")
    return (f"{of}: unusually large errors: {', and '.join(found)}",) if found else ()


def _rests(rate_radps: Floats, quiet: Bools, noise: float) -> tuple[Ints, Floats, Floats]:
    """Return the seconds in which nothing moves, their mean rates and how far they scatter."""
    count = len(quiet) // _WIDTH
    parts = rate_radps[: count * _WIDTH].reshape(count, _WIDTH, 3)
    sway = parts.std(axis=1).max(axis=1)
    most = np.hypot(_QUIET_RADPS, _NOISY * noise * np.sqrt(RATE_HZ))
    at_rest = quiet[: count * _WIDTH].reshape(count, _WIDTH).all(axis=1) & (sway < most)
    return np.flatnonzero(at_rest), parts.mean(axis=1)[at_rest], sway[at_rest]
