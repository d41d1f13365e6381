"""The scene of Fritsche & Klein (2009): network, satellites, motion and what the paper leaves open.

Positions of base stations, their antennas' directions, and the satellites are only drawn in the
paper (Fig. 1), not printed. The default layout is a choice that brings out its Table III.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
from annotated_types import Ge, Gt, Le

from mapfilter._annotations import Words
from mapfilter._inputs import read_input, toml_values
from mapfilter._types import Floats
from mapfilter.errors import ConfigError, Faults, InputError, fail
from mapfilter.experiments.papers.paper import true_states
from mapfilter.models.gaussian import GaussianTerms, stack
from mapfilter.models.motion import (
    LinearMotion,
    clock_motion,
    constant_velocity,
    scaled,
    together,
)
from mapfilter.models.ranging import pseudoranges, timing_advances
from mapfilter.models.signal_strength import levels
from mapfilter.models.state import MOVING, MOVING_CLOCK, StateLayout
from mapfilter.options import Options, Positive

Combination = Literal["gsm", "hybrid1", "hybrid2"]
COMBINATIONS: tuple[Combination, ...] = ("gsm", "hybrid1", "hybrid2")

INTERVAL_S = 0.48
_LARGEST_BYTES = 1 << 20
START = (-200.0, 8.84, -200.0, 8.84, 0.0, 0.0)
"""x(0): east, its rate, north, its rate, bias, drift."""

ACCELERATION_MPS2 = 1e-2
LOSS_AT_KM_DB, EXPONENT, EIRP_DBM = 132.8, 3.8, 50.0
MAX_ATTENUATION_DB, BEAMWIDTH_RAD = 20.0, float(np.radians(60.0))
SIGMA_RSS_DB, SIGMA_TA_M, SIGMA_PR_M = 8.0, 300.0, 15.0

POSITION_SD_M, VELOCITY_SD_MPS = 200.0, 10.0
BIAS_HALF_M, DRIFT_HALF_MPS = 300e3, 10.0
"""The clock is initialised uniformly between minus and plus these."""

MOTION_FACTOR, CLOCK_FACTOR = 100.0, 5.0
"""Ratios of the process noise that the filters assume to the true one."""

SITES_EAST_M = (750.0, 957.0, 1523.0, 1730.0, 1164.0, 391.0, 184.0)
SITES_NORTH_M = (1000.0, 1773.0, 1207.0, 1980.0, 2545.0, 2338.0, 1566.0)
SITES_M = tuple(zip(SITES_EAST_M, SITES_NORTH_M, strict=True))
Numbers = Annotated[tuple[float, ...], Words("finite numbers")]


@dataclass(frozen=True)
class Layout(Options):
    """Where the base stations and satellites are.

    Parameters
    ----------
    sites_m : tuple of (east, north)
        Base stations; one antenna each.
    boresights_deg : tuple of float
        Their directions, counter-clockwise from east.
    serving : int
        Index of the site that measures the timing advance.
    satellite_azimuths_deg : tuple of float
        Clockwise from north; the first is that of Hybrid 1.
    satellite_elevation_deg, satellite_distance_m : float
        Of all satellites, as seen from the origin.
    steps : int
        Of 0.48 s each.
    """

    sites_m: Annotated[tuple[tuple[float, float], ...], Words("pairs of finite numbers")] = SITES_M
    boresights_deg: Numbers = (270.0, 270.0, 270.0, 150.0, 30.0, 30.0, 270.0)
    serving: Annotated[int, Ge(0)] = 0
    satellite_azimuths_deg: Numbers = (12.0, 190.0)
    satellite_elevation_deg: Annotated[float, Gt(0), Le(90)] = 45.0
    satellite_distance_m: Positive = 2e7
    steps: Annotated[int, Ge(1), Le(10_000)] = 300

    def check(self, faults: Faults) -> None:
        """Add faults of fields that do not go together."""
        count = len(self.sites_m)
        if count != len(self.boresights_deg) or not count:
            faults.add("layout", "one direction for each site", f"{len(self.boresights_deg)}")
        if not self.serving < count:
            faults.add("layout, serving", f"a site in 0..{count - 1}", self.serving)
        if len(self.satellite_azimuths_deg) < 2:
            got = len(self.satellite_azimuths_deg)
            faults.add("layout, satellite_azimuths_deg", "two or more", got)

    def satellites_m(self, count: int) -> Floats:
        """Return the positions of the first satellites in east, north, up, shape (count, 3)."""
        azimuth = np.radians(self.satellite_azimuths_deg[:count])
        elevation = np.radians(self.satellite_elevation_deg)
        flat = np.cos(elevation) * np.stack([np.sin(azimuth), np.cos(azimuth)], axis=-1)
        up = np.full((len(azimuth), 1), np.sin(elevation))
        return self.satellite_distance_m * np.hstack([flat, up])


def read_layout(path: Path) -> Layout:
    """Read a layout from TOML; fields left out are as by default.

    Raises
    ------
    InputError
        The file cannot be read, is no TOML, or holds what is no layout.
    """
    try:
        given = toml_values(read_input(path, _LARGEST_BYTES, "TOML").decode())
    except (ValueError, RecursionError) as error:
        raise fail(InputError, str(path), "TOML", error) from error
    known = [field.name for field in fields(Layout)]
    if unknown := sorted(set(given) - set(known)):
        raise fail(InputError, str(path), f"keys among {', '.join(known)}", ", ".join(unknown))
    try:
        return Layout(**given)
    except ConfigError as error:
        faults = (replace(fault, where=f"{path}, {fault.where}") for fault in error.faults)
        raise InputError(tuple(faults)) from None


def hard_layout(distance_m: float = 1000.0) -> Layout:
    """Return a layout in which linearisation fails: all antennas look at the serving station.

    The six other sites stand around the serving one, at 0°, 60° ... 300°; the serving antenna looks
    back along the road. There are 400 steps.
    """
    angles = np.radians(60.0 * np.arange(6))
    east_m, north_m = Layout().sites_m[0]
    ring = [(east_m + distance_m * np.cos(a), north_m + distance_m * np.sin(a)) for a in angles]
    return Layout(
        ((east_m, north_m), *((float(east), float(north)) for east, north in ring)),
        (225.0, *(float((180.0 + 60.0 * index) % 360.0) for index in range(6))),
        steps=400,
    )


class Scene(NamedTuple):
    """State, motion and measurements of a combination.

    ``truth`` is how the car and its clock really move, ``assumed`` what filters assume, with 100
    and 5 times the noise; measured are pseudoranges, timing advance and levels, in this order; the
    covariance is P(0|0).
    """

    layout: StateLayout
    truth: LinearMotion
    assumed: LinearMotion
    measurement: GaussianTerms
    first_covariance: Floats


def scene(
    method: Combination,
    layout: Layout,
    cross_term: Literal["as_printed", "textbook"] = "as_printed",
) -> Scene:
    """Return the scene of a method: GSM alone, or with one or two satellites."""
    satellites = COMBINATIONS.index(method)
    state = MOVING_CLOCK if satellites else MOVING
    car = constant_velocity(INTERVAL_S, ACCELERATION_MPS2)
    truth, assumed = [car], [scaled(car, MOTION_FACTOR)]
    first = np.array([POSITION_SD_M, VELOCITY_SD_MPS] * 2) ** 2
    if satellites:
        clock = clock_motion(INTERVAL_S, cross_term=cross_term)
        truth, assumed = [*truth, clock], [*assumed, scaled(clock, CLOCK_FACTOR)]
        first = np.append(first, np.array([BIAS_HALF_M, DRIFT_HALF_MPS]) ** 2 / 3)
    measured = measurements(state, layout, satellites)
    return Scene(state, together(truth), together(assumed), measured, np.diag(first))


def measurements(state: StateLayout, layout: Layout, satellites: int) -> GaussianTerms:
    """Return pseudoranges, the serving station's timing advance and all levels."""
    serving = [layout.sites_m[layout.serving]]
    received = levels(
        state,
        layout.sites_m,
        SIGMA_RSS_DB,
        loss_at_km_db=LOSS_AT_KM_DB,
        exponent=EXPONENT,
        eirp_dbm=EIRP_DBM,
        boresight_rad=np.radians(layout.boresights_deg),
        beamwidth_rad=BEAMWIDTH_RAD,
        max_attenuation_db=MAX_ATTENUATION_DB,
    )
    parts = [timing_advances(state, serving, SIGMA_TA_M), received]
    if satellites:
        parts.insert(0, pseudoranges(state, layout.satellites_m(satellites), SIGMA_PR_M))
    return stack(parts)


class Trials(NamedTuple):
    """Drawn trials: true states (T, K, n) and readings (T, K, m) at k = 1 ... K, and first guesses.

    Guesses, (T, n), are where filters begin.
    """

    states: Floats
    readings: Floats
    first_means: Floats


def draw(given: Scene, trials: int, steps: int, rng: np.random.Generator) -> Trials:
    """Draw trials: true states, readings, and first guesses.

    Guesses of position and velocity are normal about the truth with P(0|0), those of the clock's
    bias and drift uniform with the variance of P(0|0). With more than a few trials the sample's
    mean and covariance are made exactly those, which lessens the chance in averages.
    """
    n = given.layout.size
    start = np.array(START[:n])
    states = true_states(given.truth, start, trials, steps, rng)
    readings = given.measurement.sample(states, rng)
    deviation = np.sqrt(np.diagonal(given.first_covariance))
    unit = rng.standard_normal((trials, n))
    unit[:, 4:] = rng.uniform(-np.sqrt(3), np.sqrt(3), (trials, n - 4))
    if trials > 4 * n:
        # The sample's moments are made those of P(0|0), which early errors depend on.
        unit = unit - unit.mean(axis=0)
        unit = unit @ np.linalg.inv(np.linalg.cholesky(np.cov(unit.T, bias=True))).T
    return Trials(states, readings, start + unit * deviation)
