"""What an inertial unit reports of a true path: noise, white or lasting, bias, drift and scale."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, get_args

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.errors import ConfigError, Faults
from mapfilter.geodesy import wrap_rad
from mapfilter.tracks.deadreckoning import TranslationNoise, noisy_steps, steps_between

Turns = Literal["headings", "gyro"]
"""Where turns come from: differences of the reported headings, or a gyro of its own."""

_CHOICES = {"translation_noise": get_args(TranslationNoise), "turns": get_args(Turns)}


@dataclass(frozen=True, slots=True)
class ImuErrors:
    """Errors of the inertial unit.

    The first two are Khalaf-Allah 2007, equations (5)-(8): white, drawn once per interval. The
    others are zero in that paper.

    Parameters
    ----------
    sigma_trans_m : float
        Standard deviation of a step.
    sigma_orient_rad : float
        Standard deviation of a heading.
    heading_bias_sd_rad : float
        The journey's constant heading error is normal with this deviation.
    heading_drift_rad_per_sqrt_s : float
        The heading error also walks at random: its deviation after t seconds is this times √t.
    step_scale_sd : float
        The journey's steps are all multiplied by exp(N(0, this)).
    translation_noise : {"zero_mean", "as_printed"}
        See :func:`mapfilter.tracks.deadreckoning.noisy_steps`.
    heading_correlation_s : float
        Time over which heading errors are correlated by 1/e; 0 for white ones.
    step_scale_wander_sd, step_scale_correlation_s : float
        The step scale also wanders within the journey: standard deviation of its logarithm, and
        the time over which it is correlated by 1/e.
    turns : {"headings", "gyro"}
        With "headings", a turn is the difference of two reported headings, so that errors cancel
        when turns are added up. A gyro's errors accumulate.
    gyro_noise_rad_per_sqrt_s : float
        Angle random walk of the gyro.
    gyro_bias_sd_rad_per_s : float
        Its rate is off by a constant of the journey that is normal with this deviation.

    Raises
    ------
    ConfigError
        A value is negative or not finite.
    """

    sigma_trans_m: float = 0.2
    sigma_orient_rad: float = float(np.radians(3.0))
    heading_bias_sd_rad: float = 0.0
    heading_drift_rad_per_sqrt_s: float = 0.0
    step_scale_sd: float = 0.0
    translation_noise: TranslationNoise = "zero_mean"
    heading_correlation_s: float = 0.0
    step_scale_wander_sd: float = 0.0
    step_scale_correlation_s: float = 15.0
    turns: Turns = "headings"
    gyro_noise_rad_per_sqrt_s: float = 0.0
    gyro_bias_sd_rad_per_s: float = 0.0

    def __post_init__(self) -> None:
        faults = Faults()
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in _CHOICES:
                if value not in _CHOICES[field.name]:
                    expected = " or ".join(_CHOICES[field.name])
                    faults.add(f"imu, {field.name}", expected, repr(value))
            elif not (np.isfinite(value) and value >= 0):
                faults.add(f"imu, {field.name}", "a finite number >= 0", value)
            elif field.name.endswith("_rad") and value > 2 * np.pi:
                faults.add(f"imu, {field.name}", "radians", value, "degrees given for radians")
        faults.raise_if_any(ConfigError)


def noisy_motion(truth: pd.DataFrame, errors: ImuErrors, rng: np.random.Generator) -> pd.DataFrame:
    """Return the motion table that an inertial unit would make of a true path.

    Parameters
    ----------
    truth : pandas.DataFrame
        time_s, east_m, north_m at the unit's ticks.
    errors : ImuErrors
    rng : numpy.random.Generator
        The draws do not depend on ``errors``.

    Returns
    -------
    motion : pandas.DataFrame
        One row for each interval between two ticks, at the time it ends: step_m and heading_rad of
        the chord with errors, and turn_rad, the change since the last heading (NaN at first).
    """
    time = truth["time_s"].to_numpy(dtype=np.float64)
    true_step, true_heading = steps_between(truth["east_m"], truth["north_m"])
    bias_rad = errors.heading_bias_sd_rad * rng.standard_normal()
    scale = np.exp(errors.step_scale_sd * rng.standard_normal())
    walk_rad = np.cumsum(np.sqrt(np.diff(time)) * rng.standard_normal(true_step.shape))
    white = errors.heading_correlation_s == 0
    step, heading = noisy_steps(
        true_step * scale,
        true_heading + bias_rad + errors.heading_drift_rad_per_sqrt_s * walk_rad,
        errors.sigma_trans_m,
        errors.sigma_orient_rad if white else 0.0,
        rng,
        translation_noise=errors.translation_noise,
    )
    lasting_rad = errors.sigma_orient_rad * _lasting(time[1:], errors.heading_correlation_s, rng)
    if not white:
        heading = wrap_rad(heading + lasting_rad)
    wander = _lasting(time[1:], errors.step_scale_correlation_s, rng)
    # What wanders is the length of a true step, not its white noise.
    step = step + true_step * scale * np.expm1(errors.step_scale_wander_sd * wander)
    gyro_rad = _gyro_turns(time, true_heading, errors, rng)
    turn = gyro_rad if errors.turns == "gyro" else wrap_rad(np.diff(heading, prepend=np.nan))
    return pd.DataFrame(
        {"time_s": time[1:], "step_m": step, "heading_rad": heading, "turn_rad": turn}
    )


def _lasting(time_s: Floats, correlation_s: float, rng: np.random.Generator) -> Floats:
    """Draw a stationary Gauss-Markov process of unit variance, correlated by exp(-Δt/τ)."""
    white: Floats = rng.standard_normal(time_s.shape)
    if not time_s.size or correlation_s == 0:
        return white
    kept = np.exp(-np.diff(time_s) / correlation_s)
    fresh = np.sqrt(-np.expm1(-2 * np.diff(time_s) / correlation_s))
    process = white.copy()
    for i in range(1, process.size):
        process[i] = kept[i - 1] * process[i - 1] + fresh[i - 1] * white[i]
    return process


def _gyro_turns(
    time_s: Floats, heading_rad: Floats, errors: ImuErrors, rng: np.random.Generator
) -> Floats:
    """Return the turns that a gyro measures; the first interval has none before it."""
    noise, rate = rng.standard_normal(heading_rad.shape), rng.standard_normal()
    turn = np.diff(heading_rad, prepend=np.nan)
    between_s = np.diff(time_s)
    turn += errors.gyro_noise_rad_per_sqrt_s * np.sqrt(between_s) * noise
    turn += errors.gyro_bias_sd_rad_per_s * rate * between_s
    return np.asarray(wrap_rad(turn))
