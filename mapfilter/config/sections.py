"""The sections of a configuration file, checked by pydantic; unknown keys are errors.

Each section is a noun. Lengths, angles and levels carry their unit in the name.
"""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field

from mapfilter.config.fields import (
    Columns,
    Count,
    FilePath,
    Files,
    FilterName,
    Pair,
    Section,
    with_columns,
    with_options,
)
from mapfilter.config.inputs import Area, Cells, Database, Rasters
from mapfilter.config.prediction import Prediction
from mapfilter.config.ways import BuildingsSection, Roads
from mapfilter.evaluation.stanford import IntegrityOptions
from mapfilter.options import Below1, Degrees, NotNegative, Positive, Seed
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.walking import WalkerModel
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.readers.csv_fields import FIELDS as RECORDED_FIELDS
from mapfilter.tracks.schema import Without


def _axis_values(value: Any) -> Any:
    """Take one number for a list of one."""
    return [value] if isinstance(value, int | float) else value


def _each_once(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(set(values)) < len(values):
        raise ValueError("every value once")
    return values


def _format_name(value: str) -> str:
    """Check the name of a format of recordings; "" is none."""
    if not value:
        return value
    # Here, as few commands name one, and it imports all readers.
    from mapfilter.tracks.readers.formats import FORMATS

    if value not in (names := [known.name for known in FORMATS]):
        raise ValueError(f"one of {', '.join(names)}")
    return value


def _no_zero(value: float) -> float:
    if value == 0:
        raise ValueError("a number other than 0")
    return value


Factor = Annotated[float, AfterValidator(_no_zero)]
_T = TypeVar("_T")
Axis = Annotated[
    tuple[_T, ...],
    BeforeValidator(_axis_values),
    Field(strict=False, min_length=1),
    AfterValidator(_each_once),
]


@with_options(CandidateFilter, optional=True)
class ReadingSection(Section):
    """``[[sweep.readings]]``: a named filter, with the keys of the candidate filter that differ."""

    name: Annotated[str, Field(min_length=1)]
    filter: FilterName | None = None
    update_length_m: NotNegative | None = None


def _names_once(readings: tuple[ReadingSection, ...]) -> tuple[ReadingSection, ...]:
    if len({(reading.name, reading.update_length_m) for reading in readings}) < len(readings):
        raise ValueError("readings of different names")
    return readings


class SweepSection(Section):
    """``[sweep]``: axes of the grid, how many runs, and the filters that are compared.

    An axis without values takes the value of its section.

    Parameters
    ----------
    sigma_trans_m, sigma_orient_deg, bias_sd_deg, drift_deg_per_sqrt_s, scale : list of float
        Values of the key of ``[imu]`` with this name.
    prediction_error_db : list of float, optional
        Standard deviations of the ground truth from the prediction, in place of
        ``journeys.radio``.
    report_period_s : list of float, optional
        Values of ``journeys.report_period_s``.
    imu_period_s : list of float, optional
        Values of ``imu.period_s``.
    update_length_m : list of float, optional
        Values of ``filter.update_length_m``.
    databases : list of Path
        Databases that are compared; by default that of ``[database]``.
    readings : list of section
        Filters that are compared, each as ``[[sweep.readings]]`` with a ``name`` and the keys of
        ``[filter]`` that differ (the filter's name is called ``filter`` there). Options in sections
        of their own, such as ``[filter.bayes]``, are the same for all.
    routes : int
        Routes that each point of the grid is run on.
    draws : int
        Runs on each route, which differ in noise.
    seed : int
        Seed of routes and noise.
    """

    sigma_trans_m: Axis[NotNegative] | None = None
    sigma_orient_deg: Axis[Degrees] | None = None
    bias_sd_deg: Axis[Degrees] | None = None
    drift_deg_per_sqrt_s: Axis[NotNegative] | None = None
    scale: Axis[Below1] | None = None
    prediction_error_db: Axis[NotNegative] | None = None
    report_period_s: Axis[Positive] | None = None
    imu_period_s: Axis[Positive] | None = None
    update_length_m: Axis[NotNegative] | None = None
    databases: Files = ()
    readings: Annotated[
        tuple[ReadingSection, ...], Field(strict=False), AfterValidator(_names_once)
    ] = ()
    routes: Count = 40
    draws: Count = 10
    seed: Seed = 0


@with_options(BayesFilter, without=("smooth",))
class BayesSection(Section):
    """``[filter.bayes]``: the filters "bayes" and "grid": assumed errors, weights, particles."""


@with_options(GridFilter, without=[one.name for one in fields(BayesFilter)])
class GridSection(Section):
    """``[filter.grid]``: what the filter "grid" has besides the options of ``[filter.bayes]``."""


@with_options(KalmanFilter, without=("method", "smooth"))
class KalmanSection(Section):
    """``[filter.kalman]``: the filters "ekf", "iekf", "rbukf", "ukf" and "ckf"."""


@with_options(ReportModel, WalkerModel)
class Journeys(Section):
    """``[journeys]``: routes along the streets and what the phone reports on them.

    Parameters
    ----------
    count : int
        Number of routes.
    draws : int
        Logs of each route, which differ in noise.
    length_m : float
        Length of a route.
    speed_mps : float
        Speed of the walking profile.
    nlos_satellites : bool
        Whether satellites behind buildings are received by reflections, in those cases of evaluate
        that have satellites.
    seed : int
        Seed of routes and noise.
    """

    count: Count = 1
    draws: Count = 1
    length_m: Positive = 1940.0
    speed_mps: Positive = 1.4
    nlos_satellites: bool = False
    seed: Seed = 0


@with_options(ImuNoise)
class Imu(Section):
    """``[imu]``: errors of simulated dead reckoning."""


@with_columns(*RECORDED_FIELDS)
class TrackColumns(Columns):
    """``[track.columns]``: names of the columns of a plain CSV recording.

    Each key is a field; its value is the name of its column in the file.
    """


class TrackFactors(Columns):
    """``[track.factors]``: numbers by which columns of motion are multiplied.

    For turns that run clockwise (-1) or lengths in another unit (0.3048 for feet). 1 takes a column
    as it is, although the positions of the log contradict it. They count for track logs, too.

    Parameters
    ----------
    step_m : float, optional
        Factor of the lengths of steps.
    heading_rad : float, optional
        Factor of headings.
    turn_rad : float, optional
        Factor of turns, or of those made of yaw rates.
    """

    step_m: Factor | None = None
    heading_rad: Factor | None = None
    turn_rad: Factor | None = None


@with_options(WalkOptions)
class TrackWalk(Section):
    """``[track.walk]``: steps and headings made of the raw sensors of a walker's phone."""


class Track(Section):
    """``[track]``: a log, a folder of logs, or recordings of other programs.

    All keys but ``path``, ``without`` and ``factors`` are for recordings.

    Parameters
    ----------
    path : Path, optional
        The log, a folder of logs, a recording, or a folder of recordings of one journey; by default
        ``journeys`` in the output folder.
    without : list of str
        What the filter does not receive.
    recordings : list of Path
        Further recordings of the same journey.
    truth : list of Path
        Recordings whose positions are the truth, and no measurements.
    format : str
        Format of the recordings, as for ``mapfilter convert``; found by their content otherwise.
    zone : str
        Zone of local times that state none, such as "Europe/Brussels" or "+01:00".
    origin : (float, float), optional
        Longitude and latitude at which a local frame of metres has its origin.
    course_motion : bool
        Make motion from the speed and course of a receiver, else from its positions, where nothing
        else gives it.
    steps : bool
        Make steps and headings of the raw sensors of a phone where nothing else gives motion.
    """

    path: FilePath | None = None
    without: Annotated[tuple[Without, ...], Field(strict=False)] = ()
    recordings: Files = ()
    truth: Files = ()
    format: Annotated[str, AfterValidator(_format_name)] = ""
    zone: str = ""
    origin: Pair | None = None
    course_motion: bool = False
    steps: bool = True
    walk: TrackWalk = TrackWalk()
    columns: TrackColumns = TrackColumns()
    factors: TrackFactors = TrackFactors()


@with_options(CandidateFilter)
class FilterSection(Section):
    """``[filter]``: which filter; most options are those of the filter "candidate".

    Parameters
    ----------
    name : str
        "bayes", "grid", "candidate" or a custom filter as ``package.module:Name`` (its code is
        run); without a map "ekf", "iekf", "rbukf", "ukf" or "ckf".
    smooth : bool
        Smooth the track by the whole log: all filters but "candidate" and custom ones.
    """

    name: FilterName = "bayes"
    smooth: bool = False
    bayes: BayesSection = BayesSection()
    grid: GridSection = GridSection()
    kalman: KalmanSection = KalmanSection()


class Output(Section):
    """``[output]``: where results go, and what is drawn.

    Parameters
    ----------
    dir : Path
        Folder of the results.
    pictures : {"none", "first", "all"}
        Logs whose pictures are drawn; a database, a survey and a benchmark get theirs unless this
        is "none".
    """

    dir: FilePath = Path("out")
    pictures: Literal["none", "first", "all"] = "first"


@with_options(IntegrityOptions)
class IntegritySection(Section):
    """``[integrity]``: protection levels of replays and benchmarks."""


class Config(Section):
    """All sections; each command takes what it needs."""

    area: Area = Area()
    cells: Cells = Cells()
    buildings: BuildingsSection = BuildingsSection()
    roads: Roads = Roads()
    prediction: Prediction = Prediction()
    rasters: Rasters = Rasters()
    database: Database = Database()
    journeys: Journeys = Journeys()
    imu: Imu = Imu()
    track: Track = Track()
    filter: FilterSection = FilterSection()
    integrity: IntegritySection = IntegritySection()
    sweep: SweepSection = SweepSection()
    output: Output = Output()

    @property
    def rasters_path(self) -> Path:
        """Where the predicted rasters are."""
        return self.rasters.path or self.output.dir / "rxlev.tif"

    @property
    def ground_truth_path(self) -> Path:
        """Where the rasters of the simulated ground truth are."""
        return self.rasters.ground_truth or self.output.dir / "rxlev-ground-truth.tif"

    @property
    def surveyed_plan(self) -> Path | None:
        """Where the plan that belongs to a survey's rasters is: None where they are others."""
        surveyed = self.prediction.model == "survey" and self.rasters.path is None
        return self.output.dir / "cells.csv" if surveyed else None

    @property
    def deviation_path(self) -> Path:
        """Where a survey's deviations are: beside its rasters."""
        return self.rasters_path.with_name(f"{self.rasters_path.stem}-deviation.tif")

    @property
    def readings_path(self) -> Path:
        """Where a survey's readings are: beside its rasters."""
        return self.rasters_path.with_name(f"{self.rasters_path.stem}-readings.parquet")

    @property
    def database_path(self) -> Path:
        """Where the radio-route database is."""
        return self.database.path or self.output.dir / "database"

    @property
    def pictures_path(self) -> Path:
        """Where the pictures of a survey and of a database are."""
        return self.output.dir / "pictures"

    @property
    def track_path(self) -> Path:
        """Where the log or logs are."""
        return self.track.path or self.output.dir / "journeys"
