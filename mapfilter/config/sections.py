"""A configuration file: all its sections, checked by pydantic; unknown keys are errors.

Each section is a noun. Lengths, angles and levels carry their unit in the name. Sections that are
more than the options of something are in modules of their own.
"""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Literal

from pydantic import ValidationInfo, field_validator

from mapfilter.config.fields import (
    Count,
    FilePath,
    FilterName,
    Section,
    with_options,
)
from mapfilter.config.inputs import Area, Cells, Database, Rasters
from mapfilter.config.prediction import Prediction
from mapfilter.config.sweep import SweepSection
from mapfilter.config.track import Track
from mapfilter.config.ways import BuildingsSection, Roads
from mapfilter.evaluation.stanford import IntegrityOptions
from mapfilter.options import Positive, Seed
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.walking import WalkerModel
from mapfilter.tracks.imu_noise import ImuNoise


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

    @field_validator("rasters", mode="after")
    @classmethod
    def _keys_describe_files(cls, rasters: Rasters, given: ValidationInfo) -> Rasters:
        prediction = given.data.get("prediction")
        # Of a section with faults of its own nothing is known.
        calibrates = prediction is None or (
            prediction.model == "survey" and prediction.survey.calibrate is not None
        )
        if rasters.describes_files and rasters.path is None and not calibrates:
            raise ValueError("path, which the other keys describe")
        return rasters

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
