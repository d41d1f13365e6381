"""Plan of a sweep: a grid of radio worlds, inertial noises and filters, and runs in each cell."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from math import ceil, isfinite, prod

import numpy as np

from mapfilter._same import EqualByValue
from mapfilter.errors import ConfigError, Faults
from mapfilter.experiments.sweep.noises import GYRO_ERRORS, NOISE_AXES
from mapfilter.positioning import BUILT_IN
from mapfilter.positioning.bayes.options import GridFilter
from mapfilter.positioning.filter import FilterOptions
from mapfilter.simulation.journeys import JourneyPlan
from mapfilter.simulation.reports import ReportModel
from mapfilter.tracks.imu_noise import ImuNoise

AS_PREDICTED = "as_predicted"
"""The radio world in which each place is served by the cell predicted best there."""

_OF_PARTICLES = ("max_particles", "min_search_particles", "min_particles")

LONGEST_BATCH = 100
SHORTEST_BATCH = 24
_BATCHES = 64
# Of the plan's shape, the first ones: radio, report period, route.
_JOURNEY_AXES = 3
_MOST_RUNS = 100_000_000


@dataclass(frozen=True, slots=True)
class Radio:
    """Levels that the phone receives: ``as_predicted``, or a simulated ground truth by its name.

    ``prediction_error_db`` is its deviation from the prediction; NaN where that is unknown.
    """

    name: str = AS_PREDICTED
    prediction_error_db: float = 0.0

    @property
    def stream(self) -> str:
        """Part of the names of random streams: that of the first release, so that results stay."""
        return self.name.replace("ground truth", "reality")


@dataclass(frozen=True, slots=True, eq=False)
class Reading(EqualByValue):
    """A filter with its options, its name in tables, and its update length; NaN without one."""

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
    noise: ImuNoise
    draw: int
    database: str
    reading: Reading

    @property
    def noises(self) -> tuple[float, ...]:
        """Errors of dead reckoning, in the order of :data:`NOISE_AXES`."""
        return tuple(getattr(self.noise, name) for name in NOISE_AXES)


@dataclass(frozen=True)
class SweepPlan:
    """A grid of runs.

    Parameters
    ----------
    readings : tuple of Reading
        Filters, each of another name or update length.
    databases : tuple of str
        Names of the radio-route databases.
    noises : tuple of ImuNoise
        Their ``period_s`` is replaced by that of ``imu_periods_s``.
    imu_periods_s : tuple of float
        None takes each report period.
    routes, draws : int
        Routes, and runs on each of them with every setting; they differ in noise only.
    reports : ReportModel
        Its period and ``radio`` are replaced by the grid's.
    varied : tuple of (str, float)
        Options in which this plan differs from others of the same sweep, by dotted key; they become
        columns of the table.

    Raises
    ------
    ConfigError
        With everything that is wrong: an axis without values or with a value twice, more than 1e8
        runs.
    """

    readings: tuple[Reading, ...]
    databases: tuple[str, ...] = ("database",)
    noises: tuple[ImuNoise, ...] = (ImuNoise(),)
    radios: tuple[Radio, ...] = (Radio(),)
    report_periods_s: tuple[float, ...] = (1.0,)
    imu_periods_s: tuple[float, ...] | None = None
    routes: int = 1
    draws: int = 100
    journey: JourneyPlan = field(default_factory=JourneyPlan)
    reports: ReportModel = field(default_factory=ReportModel)
    seed: int = 0
    varied: tuple[tuple[str, float], ...] = ()

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

    def batches(self) -> Iterator[tuple[int, int]]:
        """Yield first run and end of each batch: together all runs, in order.

        A batch holds whole journeys, or an equal share of one journey's runs: what is received on a
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
            place = map(int, np.unravel_index(number, self.shape))
            radio, period, route, imu, noise, draw, database, reading = place
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
    def effective(self) -> SweepPlan:
        """The plan without numbers of particles on a grid, and errors of turns that none uses."""
        readings = tuple(replace(one, choice=_effective(one.choice)) for one in self.readings)
        if all(self._uses_turns(noise) for noise in self.noises):
            return replace(self, readings=readings)
        without = dict.fromkeys(GYRO_ERRORS, 0.0)
        return replace(
            self,
            readings=readings,
            noises=tuple(
                one if self._uses_turns(one) else replace(one, **without)  # type: ignore[arg-type]
                for one in self.noises
            ),
        )

    def _uses_turns(self, noise: ImuNoise) -> bool:
        """Return whether a filter may use turns of their own: a custom one, beside headings."""
        own = (type(reading.choice) for reading in self.readings)
        paths = {f"{one.__module__}:{one.__qualname__}" for one in own}
        return noise.turns == "gyro" and not paths <= set(BUILT_IN.values())

    @property
    def as_json(self) -> str:
        """The whole plan as JSON, always in the same form."""
        return json.dumps(_plain(self), sort_keys=True)

    @property
    def digest(self) -> str:
        """SHA-256 of the plan."""
        return hashlib.sha256(self.as_json.encode()).hexdigest()


def _effective(choice: FilterOptions) -> FilterOptions:
    """Return the options of a filter with those at their defaults that it does not read."""
    if not isinstance(choice, GridFilter):
        return choice
    usual = GridFilter()
    return replace(choice, **{name: getattr(usual, name) for name in _OF_PARTICLES})


def _plain(value: object) -> object:
    """Return a part of a plan as JSON values; dataclasses name their kind."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        inner = {one.name: _plain(getattr(value, one.name)) for one in fields(value)}
        return {"kind": type(value).__name__, **inner}
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if isinstance(value, str | int | None):
        return value
    if isinstance(value, float):
        return repr(value)
    if callable(value):
        return f"{value.__module__}:{getattr(value, '__qualname__', type(value).__qualname__)}"
    return {str(key): _plain(item) for key, item in dict(value).items()}  # type: ignore[call-overload]
