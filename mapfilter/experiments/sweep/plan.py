"""What a sweep runs: a grid of worlds, noises and filters, and so many runs in each cell of it."""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from math import ceil, isfinite, prod, radians
from typing import Literal

from mapfilter.errors import ConfigError, Faults
from mapfilter.positioning.filter import FilterOptions
from mapfilter.simulation.imu import ImuErrors
from mapfilter.simulation.journeys import JourneyPlan
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.walking import WalkerModel

AS_PREDICTED = "as_predicted"
"""The radio world in which each place is served by the cell predicted best there."""

LONGEST_BATCH = 100
SHORTEST_BATCH = 24
_BATCHES = 64
# Of the plan's shape, the first ones: radio, report period, route.
_JOURNEY_AXES = 3
_MOST_RUNS = 100_000_000


@dataclass(frozen=True, slots=True)
class Noise:
    """How wrong the inertial unit is; see :class:`mapfilter.simulation.imu.ImuErrors`.

    Parameters
    ----------
    sigma_trans_m, sigma_orient_deg : float
        White noise of each step and heading.
    bias_sd_deg : float
        Deviation of a journey's constant heading error.
    drift_deg_per_sqrt_s : float
        Of the heading error's random walk.
    scale : float
        Deviation of a journey's step scale.
    """

    sigma_trans_m: float = 0.2
    sigma_orient_deg: float = 3.0
    bias_sd_deg: float = 0.0
    drift_deg_per_sqrt_s: float = 0.0
    scale: float = 0.0

    def errors(self, others: ImuErrors) -> ImuErrors:
        """Return the same in the units of the simulation, beside errors that are not swept."""
        return replace(
            others,
            sigma_trans_m=self.sigma_trans_m,
            sigma_orient_rad=radians(self.sigma_orient_deg),
            heading_bias_sd_rad=radians(self.bias_sd_deg),
            heading_drift_rad_per_sqrt_s=radians(self.drift_deg_per_sqrt_s),
            step_scale_sd=self.scale,
        )


@dataclass(frozen=True, slots=True)
class Radio:
    """What the phone hears: a set of levels, by name.

    Parameters
    ----------
    name : str
        ``as_predicted``, or that of a set of simulated ground truth levels.
    prediction_error_db : float
        Deviation of the ground truth from the prediction; NaN where it is not known.
    """

    name: str = AS_PREDICTED
    prediction_error_db: float = 0.0

    @property
    def stream(self) -> str:
        """Part of the names of random streams: that of the first release, so that results stay."""
        return self.name.replace("ground truth", "reality")


@dataclass(frozen=True, slots=True)
class Reading:
    """One filter with its options, by the name that tables and figures call it.

    Parameters
    ----------
    name : str
    choice : FilterOptions
    update_length_m : float
        Of the filter; NaN where it knows none.
    """

    name: str
    choice: FilterOptions
    update_length_m: float = float("nan")


@dataclass(frozen=True, slots=True)
class Run:
    """One run's coordinates in the grid."""

    radio: Radio
    report_period_s: float
    route: int
    imu_period_s: float
    noise: Noise
    draw: int
    database: str
    reading: Reading


@dataclass(frozen=True)
class SweepPlan:
    """A grid of runs.

    Parameters
    ----------
    readings : tuple of Reading
        Filters; their names with their update lengths tell them apart.
    databases : tuple of str
        Names of the radio-route databases.
    noises : tuple of Noise
    radios : tuple of Radio
    report_periods_s : tuple of float
    imu_periods_s : tuple of float
        None takes each report period.
    routes, draws : int
        Routes, and runs on each of them with every setting; they differ in noise only.
    length_m, profile, speed_mps
        Of the journeys; see :class:`mapfilter.simulation.journeys.JourneyPlan`.
    reports : ReportModel
        Its period and ``radio`` are replaced by the grid's.
    imu : ImuErrors
        Those of its errors that are not in ``noises``.
    walker : WalkerModel
    seed : int

    Raises
    ------
    ConfigError
        With everything that is wrong: an axis without values or with a value twice, a noise that
        is impossible, more than 1e8 runs.
    """

    readings: tuple[Reading, ...]
    databases: tuple[str, ...] = ("database",)
    noises: tuple[Noise, ...] = (Noise(),)
    radios: tuple[Radio, ...] = (Radio(),)
    report_periods_s: tuple[float, ...] = (1.0,)
    imu_periods_s: tuple[float, ...] | None = None
    routes: int = 1
    draws: int = 100
    length_m: float = 1940.0
    profile: Literal["walking", "driving"] = "walking"
    speed_mps: float = 1.4
    reports: ReportModel = field(default_factory=ReportModel)
    imu: ImuErrors = field(default_factory=ImuErrors)
    walker: WalkerModel = field(default_factory=WalkerModel)
    seed: int = 0

    def __post_init__(self) -> None:
        faults = Faults()
        named = [(reading.name, repr(reading.update_length_m)) for reading in self.readings]
        axes: dict[str, Sequence[object]] = {
            "readings": named,
            "databases": self.databases,
            "noise": self.noises,
            "prediction_error_db": [radio.name for radio in self.radios],
            "report_period_s": self.report_periods_s,
            "imu_period_s": (1.0,) if self.imu_periods_s is None else self.imu_periods_s,
        }
        for name, values in axes.items():
            if not values:
                faults.add(f"sweep, {name}", "at least one value", "none")
            elif len(set(values)) < len(values):
                twice = next(value for value in values if list(values).count(value) > 1)
                faults.add(f"sweep, {name}", "every value once", f"{twice} twice")
        for name in ("routes", "draws"):
            if getattr(self, name) < 1:
                faults.add(f"sweep, {name}", "at least 1", getattr(self, name))
        for period_s in (*self.report_periods_s, *(self.imu_periods_s or ())):
            if not (isfinite(period_s) and period_s > 0):
                faults.add("sweep, period", "seconds > 0", period_s)
        for noise in self.noises:
            try:
                noise.errors(self.imu)
            except ConfigError as error:
                faults.found.extend(error.faults)
        try:
            _ = self.journey
        except ConfigError as error:
            faults.found.extend(error.faults)
        if self.seed < 0:
            faults.add("sweep, seed", "a whole number >= 0", self.seed)
        if not faults.found and self.runs > _MOST_RUNS:
            faults.add("sweep", f"at most {_MOST_RUNS:.0e} runs", f"{self.runs:.1e}")
        faults.raise_if_any(ConfigError)

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the grid's axes, the one that changes fastest last."""
        return (
            len(self.radios),
            len(self.report_periods_s),
            self.routes,
            1 if self.imu_periods_s is None else len(self.imu_periods_s),
            len(self.noises),
            self.draws,
            len(self.databases),
            len(self.readings),
        )

    @property
    def runs(self) -> int:
        """Runs in all."""
        return prod(self.shape)

    @property
    def journey(self) -> JourneyPlan:
        """How far and how fast each journey goes."""
        return JourneyPlan(
            length_m=self.length_m,
            profile=self.profile,
            speed_mps=self.speed_mps,
            walker=self.walker,
        )

    def batches(self) -> Iterator[tuple[int, int]]:
        """Yield first run and end of each batch: together all runs, in order.

        A batch holds whole journeys, or an equal share of one journey's runs: what is heard on a
        journey is made anew in each of its batches.
        """
        wanted = min(max(self.runs // _BATCHES, SHORTEST_BATCH), LONGEST_BATCH)
        own = prod(self.shape[_JOURNEY_AXES:])
        if own <= wanted:
            size = wanted // own * own
            for first in range(0, self.runs, size):
                yield first, min(first + size, self.runs)
            return
        shares = ceil(own / wanted)
        for journey in range(0, self.runs, own):
            for share in range(shares):
                yield journey + own * share // shares, journey + own * (share + 1) // shares

    def select(self, first: int, end: int) -> Iterator[Run]:
        """Yield the runs of a batch. Those of one route lie together, however long their grid."""
        for number in range(first, end):
            rest, place = number, []
            for length in reversed(self.shape):
                rest, index = divmod(rest, length)
                place.append(index)
            reading, database, draw, noise, imu, route, period, radio = place
            period_s = self.report_periods_s[period]
            yield Run(
                self.radios[radio],
                period_s,
                route,
                period_s if self.imu_periods_s is None else self.imu_periods_s[imu],
                self.noises[noise],
                draw,
                self.databases[database],
                self.readings[reading],
            )

    @property
    def told(self) -> str:
        """All of the plan as JSON, in one form only."""
        return json.dumps(_told(self), sort_keys=True)

    @property
    def digest(self) -> str:
        """SHA-256 of the plan."""
        return hashlib.sha256(self.told.encode()).hexdigest()


def noise_grid(
    sigma_trans_m: Sequence[float] = (0.2,),
    sigma_orient_deg: Sequence[float] = (3.0,),
    bias_sd_deg: Sequence[float] = (0.0,),
    drift_deg_per_sqrt_s: Sequence[float] = (0.0,),
    scale: Sequence[float] = (0.0,),
) -> tuple[Noise, ...]:
    """Return every combination, the last axis changing fastest.

    Examples
    --------
    >>> [noise.sigma_orient_deg for noise in noise_grid((0.0, 0.2), (0, 3))]
    [0.0, 3.0, 0.0, 3.0]
    """
    axes = sigma_trans_m, sigma_orient_deg, bias_sd_deg, drift_deg_per_sqrt_s, scale
    return tuple(Noise(*map(float, values)) for values in itertools.product(*axes))


def _told(value: object) -> object:
    """Return a plan's part as JSON knows it; the kind of each dataclass is told, too."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        inner = {one.name: _told(getattr(value, one.name)) for one in fields(value)}
        return {"kind": type(value).__name__, **inner}
    if isinstance(value, tuple | list):
        return [_told(item) for item in value]
    if isinstance(value, str | int | None):
        return value
    if isinstance(value, float):
        return repr(value)
    return {str(key): _told(item) for key, item in dict(value).items()}  # type: ignore[call-overload]
