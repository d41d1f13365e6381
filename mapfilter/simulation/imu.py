"""What an inertial unit reports of a true path: white noise, bias, drift and a scale error."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import pandas as pd

from mapfilter.errors import ConfigError, Faults
from mapfilter.geodesy import wrap_rad
from mapfilter.tracks.deadreckoning import TranslationNoise, noisy_steps, steps_between


@dataclass(frozen=True, slots=True)
class ImuErrors:
    """How wrong the inertial unit is.

    The first two are Khalaf-Allah 2007, equations (5)-(8): white, drawn once per interval. The
    others last through a journey, and are zero in that paper.

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

    def __post_init__(self) -> None:
        faults = Faults()
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "translation_noise":
                if value not in ("zero_mean", "as_printed"):
                    faults.add(f"imu, {field.name}", "zero_mean or as_printed", repr(value))
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
    step, heading = steps_between(truth["east_m"], truth["north_m"])
    bias_rad = errors.heading_bias_sd_rad * rng.standard_normal()
    scale = np.exp(errors.step_scale_sd * rng.standard_normal())
    walk_rad = np.cumsum(np.sqrt(np.diff(time)) * rng.standard_normal(step.shape))
    step, heading = noisy_steps(
        step * scale,
        heading + bias_rad + errors.heading_drift_rad_per_sqrt_s * walk_rad,
        errors.sigma_trans_m,
        errors.sigma_orient_rad,
        rng,
        translation_noise=errors.translation_noise,
    )
    turn = wrap_rad(np.diff(heading, prepend=np.nan))
    return pd.DataFrame(
        {"time_s": time[1:], "step_m": step, "heading_rad": heading, "turn_rad": turn}
    )
