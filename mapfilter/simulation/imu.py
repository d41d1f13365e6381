"""Simulated dead reckoning: a true path with white or correlated noise, bias, drift and scale."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.tracks.deadreckoning import noisy_steps, steps_between
from mapfilter.tracks.imu_noise import ImuNoise


def noisy_motion(truth: pd.DataFrame, noise: ImuNoise, rng: np.random.Generator) -> pd.DataFrame:
    """Return the motion table that an inertial unit would make of a true path.

    Parameters
    ----------
    truth : pandas.DataFrame
        time_s, east_m, north_m at the unit's ticks.
    rng : numpy.random.Generator
        The draws do not depend on ``noise``.

    Returns
    -------
    pandas.DataFrame
        One row for each interval between two ticks, at the time it ends: step_m and heading_rad of
        the chord with errors, and turn_rad, the change since the last heading (NaN at first).
    """
    time = truth["time_s"].to_numpy(dtype=np.float64)
    true_step, true_heading = steps_between(truth["east_m"], truth["north_m"])
    sigma_rad = float(np.radians(noise.sigma_orient_deg))
    drift_rad = float(np.radians(noise.drift_deg_per_sqrt_s))
    bias_rad = float(np.radians(noise.bias_sd_deg)) * rng.standard_normal()
    scale = np.exp(noise.scale * rng.standard_normal())
    walk_rad = np.cumsum(np.sqrt(np.diff(time)) * rng.standard_normal(true_step.shape))
    white = noise.heading_correlation_s == 0
    step, heading = noisy_steps(
        true_step * scale,
        true_heading + bias_rad + drift_rad * walk_rad,
        noise.sigma_trans_m,
        sigma_rad if white else 0.0,
        rng,
        translation_noise=noise.translation_noise,
    )
    lasting_rad = sigma_rad * _lasting(time[1:], noise.heading_correlation_s, rng)
    if not white:
        heading = wrap_rad(heading + lasting_rad)
    wander = _lasting(time[1:], noise.step_scale_correlation_s, rng)
    # The length of a true step wanders, not its white noise.
    step = step + true_step * scale * np.expm1(noise.step_scale_wander * wander)
    gyro_rad = _gyro_turns(time, true_heading, noise, rng)
    turn = gyro_rad if noise.turns == "gyro" else wrap_rad(np.diff(heading, prepend=np.nan))
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
    time_s: Floats, heading_rad: Floats, noise: ImuNoise, rng: np.random.Generator
) -> Floats:
    """Return the turns that a gyro measures; the first interval has none before it."""
    white, rate = rng.standard_normal(heading_rad.shape), rng.standard_normal()
    turn = np.diff(heading_rad, prepend=np.nan)
    between_s = np.diff(time_s)
    turn += float(np.radians(noise.gyro_noise_deg_per_sqrt_s)) * np.sqrt(between_s) * white
    turn += float(np.radians(noise.gyro_bias_deg_per_s)) * rate * between_s
    return np.asarray(wrap_rad(turn))
