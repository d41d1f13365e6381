"""Dead reckoning of pedestrians as phones and their data sheets have it: steps and headings.

Steps are counted, not measured: the reported distance is the number of steps of an interval times
an assumed step length. Step detectors of phones miss some per cent of the steps (Kang, Huang & Qi
2018, *A novel walking detection and step counting algorithm using unconstrained smartphones*,
Sensors 18(1): 95.7 % are counted); lengths are within 8 % after a calibration of the person
(Weinberg 2002, AN-602) and farther off without one.

Gyros of phones have zero-rate offsets of 1 to 5 deg/s at first and a noise of 4 to 15 mdeg/s/√Hz
(data sheets of Bosch BMI160, STMicroelectronics LSM6DSO, InvenSense ICM-20948); after calibration
at rest, some tenths of a degree per second remain and wander with temperature. Cars, rails and
reinforced concrete turn a compass while one passes them (Afzal, Renaudin & Lachapelle 2011,
*Magnetic field based heading estimation for pedestrian navigation environments*, IPIN); headings of
phones indoors have a root-mean-square error of 17 degrees with the best of methods, and more with
others (Navigation 71(1), 2024, navi.632).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from annotated_types import Ge, Gt, Le, Lt

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.options import Below1, NotNegative, Options, Positive, Share
from mapfilter.simulation.worlds.phone import headings_rad
from mapfilter.simulation.worlds.sinusoids import gauss_markov

_RISE_S = 3.0


@dataclass(frozen=True, slots=True)
class InertialModel(Options):
    """Errors of a phone's dead reckoning; defaults are those of the foreign world.

    Parameters
    ----------
    period_s : float
        Length of an interval of dead reckoning.
    headings : {"compass", "fused"}
        A compass errs about the true heading. Fused headings integrate a gyro and are drawn
        towards the compass slowly.
    heading_sd_deg : float
        Standard deviation of the compass.
    heading_white : float
        Share of its variance that is white; the rest lasts.
    heading_correlation_s : float
        Time over which the rest is correlated by 1/e.
    bias_sd_deg : float
        Standard deviation of the journey's constant heading error.
    drift_deg_per_sqrt_s : float
        Random walk of the heading error.
    scale_sd : float
        Standard deviation of the logarithm of the journey's step scale.
    step_range : float
        The assumed step length is off by a uniform draw within ± this fraction, too.
    step_m : float
        A pedestrian's true step length.
    step_wander : float
        Standard deviation of the true step length about its mean, as a fraction.
    step_correlation_s : float
        Time over which that is correlated by 1/e.
    missed : float
        Share of the steps that are not counted.
    gyro_sd_deg_per_min : float
        Standard deviation of the gyro's rate error at the start.
    gyro_walk_deg_per_min : float
        Random walk of that rate: its standard deviation after a minute.
    gyro_noise_deg_per_sqrt_s : float
        Angle random walk of the gyro and the swaying hand.
    fusion_s : float
        Time constant with which fused headings follow the compass.
    disturbed_every_m : float
        Mean distance between two magnetic disturbances; 0 for none.
    disturbance_deg : float
        By which they turn the heading, to either side.
    disturbance_s : float
        How long each lasts.

    Raises
    ------
    ConfigError
        With every value that is out of range.
    """

    period_s: Positive = 1.0
    headings: Literal["compass", "fused"] = "compass"
    heading_sd_deg: NotNegative = 6.0
    heading_white: Share = 0.5
    heading_correlation_s: Positive = 8.0
    bias_sd_deg: NotNegative = 0.0
    drift_deg_per_sqrt_s: NotNegative = 0.0
    scale_sd: Below1 = 0.0
    step_range: Below1 = 0.0
    step_m: Annotated[float, Gt(0.2), Lt(2)] = 0.7
    step_wander: Below1 = 0.03
    step_correlation_s: Positive = 20.0
    missed: Annotated[float, Ge(0), Le(0.5)] = 0.01
    gyro_sd_deg_per_min: NotNegative = 0.0
    gyro_walk_deg_per_min: NotNegative = 0.0
    gyro_noise_deg_per_sqrt_s: NotNegative = 0.1
    fusion_s: Positive = 120.0
    disturbed_every_m: NotNegative = 0.0
    disturbance_deg: NotNegative = 40.0
    disturbance_s: Positive = 20.0


def motion_table(
    truth: pd.DataFrame, model: InertialModel, rng: np.random.Generator
) -> pd.DataFrame:
    """Return the motion table that a phone makes of a true walk.

    Parameters
    ----------
    truth : pandas.DataFrame
        time_s, east_m, north_m.

    Returns
    -------
    pandas.DataFrame
        One row for each interval, at the time it ends: step_m, heading_rad, and turn_rad since the
        interval before (NaN at first).
    """
    time = truth["time_s"].to_numpy(dtype=np.float64)
    count = int(np.floor((time[-1] - time[0]) / model.period_s + 1e-9)) + 1
    tick_s = time[0] + np.arange(count) * model.period_s
    east, north = (np.interp(tick_s, time, truth[name]) for name in ("east_m", "north_m"))
    moved = np.hypot(np.diff(east), np.diff(north))
    heading = headings_rad(east, north)[1:]
    # Streams are apart, so that one error can be switched off without changing another.
    steps_rng, compass_rng, gyro_rng, field_rng = rng.spawn(4)
    reported = counted_m(moved, tick_s[1:], model, steps_rng)
    compass = compass_error_rad(tick_s[1:], model, compass_rng)
    rate = gyro_error_rad(tick_s[1:], model, gyro_rng)
    disturbed = disturbance_rad(moved, tick_s[1:], model, field_rng)
    if model.headings == "compass":
        measured = wrap_rad(heading + compass + disturbed)
        turn = wrap_rad(np.diff(measured, prepend=np.nan))
    else:
        error = _fused(rate, compass, model)
        measured = wrap_rad(heading + error + disturbed)
        turn = wrap_rad(np.diff(heading, prepend=np.nan) + rate)
    return pd.DataFrame(
        {"time_s": tick_s[1:], "step_m": reported, "heading_rad": measured, "turn_rad": turn}
    )


def counted_m(
    moved_m: Floats, time_s: Floats, model: InertialModel, rng: np.random.Generator
) -> Floats:
    """Return the reported distance of each interval: counted steps times the assumed length.

    Parameters
    ----------
    moved_m : (N,) array
        True distance of each interval.
    time_s : (N,) array
        When it ends.
    """
    scale = float(np.exp(model.scale_sd * rng.standard_normal()))
    scale *= 1.0 + model.step_range * float(rng.uniform(-1.0, 1.0))
    wander = gauss_markov(time_s, model.step_correlation_s, rng)
    taken = np.cumsum(moved_m / (model.step_m * np.exp(model.step_wander * wander)))
    # One starts somewhere within a step.
    steps = np.diff(np.floor(taken + rng.random()), prepend=0.0).astype(np.int64)
    counted = rng.binomial(np.maximum(steps, 0), 1.0 - model.missed)
    return np.asarray(counted * model.step_m * scale, dtype=np.float64)


def compass_error_rad(time_s: Floats, model: InertialModel, rng: np.random.Generator) -> Floats:
    """Return the error of the compass: white, lasting, constant, and a random walk."""
    white = rng.standard_normal(time_s.shape)
    lasting = gauss_markov(time_s, model.heading_correlation_s, rng)
    share = model.heading_white
    error = model.heading_sd_deg * (np.sqrt(share) * white + np.sqrt(1.0 - share) * lasting)
    error += model.bias_sd_deg * rng.standard_normal()
    walk = np.cumsum(rng.standard_normal(time_s.shape)) * np.sqrt(model.period_s)
    return np.asarray(np.radians(error + model.drift_deg_per_sqrt_s * walk))


def gyro_error_rad(time_s: Floats, model: InertialModel, rng: np.random.Generator) -> Floats:
    """Return the error of the gyro's turn in each interval: its rate error, which walks; noise."""
    minutes = model.period_s / 60.0
    walk = np.sqrt(minutes) * np.cumsum(rng.standard_normal(time_s.shape))
    rate = model.gyro_sd_deg_per_min * rng.standard_normal() + model.gyro_walk_deg_per_min * walk
    noise = np.sqrt(model.period_s) * rng.standard_normal(time_s.shape)
    return np.asarray(np.radians(rate * minutes + model.gyro_noise_deg_per_sqrt_s * noise))


def disturbance_rad(
    moved_m: Floats, time_s: Floats, model: InertialModel, rng: np.random.Generator
) -> Floats:
    """Return by how much magnetic disturbances turn the heading, with flanks of 3 s."""
    found = np.zeros(time_s.shape)
    if model.disturbed_every_m == 0 or not time_s.size:
        return found
    walked = np.cumsum(moved_m)
    number = int(rng.poisson(walked[-1] / model.disturbed_every_m))
    begins_s = np.interp(rng.uniform(0.0, walked[-1], number), walked, time_s)
    sides = rng.choice([-1.0, 1.0], number)
    for begin_s, side in zip(begins_s, sides, strict=True):
        rises = (time_s - begin_s) / _RISE_S
        falls = (begin_s + model.disturbance_s - time_s) / _RISE_S
        shape = np.clip(np.minimum(rises, falls), 0.0, 1.0)
        found = np.where(shape > 0, side * shape, found)
    return np.asarray(np.radians(model.disturbance_deg) * found)


def _fused(rate_rad: Floats, compass_rad: Floats, model: InertialModel) -> Floats:
    """Return the error of headings that integrate a gyro and follow the compass slowly."""
    follow = 1.0 - np.exp(-model.period_s / model.fusion_s)
    error, found = float(compass_rad[0]) if compass_rad.size else 0.0, np.empty(rate_rad.shape)
    for i in range(rate_rad.size):
        error += float(rate_rad[i])
        error += follow * (float(compass_rad[i]) - error)
        found[i] = error
    return found
