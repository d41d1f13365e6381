"""The cell plan: position, antenna, power and identity of every cell."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from mapfilter._arguments import shown
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import project, projected_crs, same_crs, short_crs, unproject
from mapfilter.radio.cell_rules import (
    OPTIONAL,
    POINTED,
    RANGES,
    antenna_fault,
    assumed_fault,
    id_fault,
    looks_like_radians,
    site_fault,
    technology_faults,
)

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell of a network.

    Parameters
    ----------
    id, site : str
        Names of the cell and of the place that it shares with other cells.
    east_m, north_m : float
        Position in the plan's CRS.
    height_m : float
        Antenna height above ground.
    azimuth_deg : float or None
        Boresight, degrees clockwise from true north; None for an omnidirectional antenna.
    eirp_dbm : float
        Radiated power at boresight, antenna gain included, of what phones report: in LTE and NR of
        one subcarrier, which is 28 to 35 dB below that of the carrier
        (:mod:`mapfilter.radio.reported_power`).
    antenna : str
        ``"sector"``, ``"omni"``, ``"3gpp"`` or the name of a pattern file.
    downtilt_deg : float
        Electrical downtilt: the beam below the horizon, alike all around; of effect only where the
        vertical pattern is known.
    mechanical_downtilt_deg : float
        The whole antenna leans forward by this much; of effect as above.
    beamwidth_deg : float
        Horizontal full width at half power, φ3dB.
    max_attenuation_db : float
        Largest attenuation off boresight, A_m.
    vertical_beamwidth_deg : float or None
        Vertical full width at half power; None when only the horizontal pattern is known.
    side_lobe_db : float
        Largest attenuation of the vertical pattern, SLA_V.
    indoor : bool
        Whether the antenna hangs inside a building.
    penetration_loss_db : float
        Loss of an indoor cell's signal on its way out.
    mcc, mnc, lac, ci : int or None
        Global identity: LAC or TAC; CI, ECI or NCI.
    arfcn, bsic : int or None
        Carrier (ARFCN, UARFCN, EARFCN, NR-ARFCN) and code (BSIC, PSC, PCI): all that identifies a
        reported neighbour.
    technology : str or None
        "GSM", "UMTS", "LTE" or "NR"; it limits identity, carrier and code. None where unknown.
    assumed : str
        Names of fields that hold usual values, as this cell's own are unknown: some of
        ``height_m``, ``azimuth_deg`` and ``eirp_dbm``, separated by blanks. An unknown azimuth
        is that of an omnidirectional antenna.
    """

    id: str
    site: str
    east_m: float
    north_m: float
    height_m: float
    azimuth_deg: float | None
    eirp_dbm: float
    frequency_mhz: float
    antenna: str = "sector"
    downtilt_deg: float = 0.0
    mechanical_downtilt_deg: float = 0.0
    beamwidth_deg: float = 65.0
    max_attenuation_db: float = 25.0
    vertical_beamwidth_deg: float | None = None
    side_lobe_db: float = 20.0
    indoor: bool = False
    penetration_loss_db: float = 0.0
    mcc: int | None = None
    mnc: int | None = None
    lac: int | None = None
    ci: int | None = None
    arfcn: int | None = None
    bsic: int | None = None
    technology: str | None = None
    assumed: str = ""

    @property
    def assumes(self) -> frozenset[str]:
        """Names of the fields that hold usual values."""
        return frozenset(self.assumed.split())


@dataclass(frozen=True, repr=False)
class CellPlan:
    """The cells of an area, in one projected CRS; checked when it is made.

    Parameters
    ----------
    crs : str
        Projected CRS in metres.
    cells : tuple of Cell
        Ids are unique. A database of roads alone has none.
    notes : tuple of str
        What was filled in or left out when it was read.
    inactive : tuple of str
        Ids of cells that its file has and switches off; they are none of ``cells``.
    """

    crs: str
    cells: tuple[Cell, ...]
    notes: tuple[str, ...] = field(default=(), compare=False)
    inactive: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        faults = Faults()
        try:
            object.__setattr__(self, "crs", projected_crs(self.crs, "cell plan, crs"))
        except InputError as error:
            faults.found.extend(error.faults)
        object.__setattr__(self, "cells", _as_cells(self.cells))
        check_cells(self.cells, lambda i, name: f"cell {self.cells[i].id!r}, {name}", faults)
        faults.raise_if_any(InputError)

    def __repr__(self) -> str:
        """Return the numbers of cells and sites, and the CRS, in one line."""
        sites = len({cell.site for cell in self.cells})
        held = f"{number_of(len(self.cells), 'cell')} at {number_of(sites, 'site')}"
        return f"<CellPlan: {held}, {short_crs(self.crs)}>"

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids in the plan's order."""
        return tuple(cell.id for cell in self.cells)

    @property
    def middle_deg(self) -> tuple[float, float] | None:
        """Latitude and longitude of the middle of all cells, WGS 84; None without any."""
        if not self.cells:
            return None
        places_m = [(cell.east_m, cell.north_m) for cell in self.cells]
        lon_deg, lat_deg = unproject(self.crs, *np.mean(places_m, axis=0))
        return float(lat_deg), float(lon_deg)

    @cached_property
    def _positions(self) -> Mapping[str, int]:
        return {cell.id: i for i, cell in enumerate(self.cells)}

    @cached_property
    def ids_by_carrier(self) -> Mapping[tuple[int, int], tuple[str, ...]]:
        """Ids of the cells on each carrier and code (``arfcn``, ``bsic``), in the plan's order."""
        found: dict[tuple[int, int], tuple[str, ...]] = {}
        for cell in self.cells:
            if cell.arfcn is not None and cell.bsic is not None:
                key = (cell.arfcn, cell.bsic)
                found[key] = (*found.get(key, ()), cell.id)
        return found

    def to_dataframe(self) -> pd.DataFrame:
        """Return a row for each cell, as :func:`mapfilter.read_cell_plan` takes it."""
        from mapfilter.radio.plan_frames import plan_frame

        return plan_frame(self)

    def to_geodataframe(self) -> gpd.GeoDataFrame:
        """Return the same with points in the CRS of the plan."""
        import geopandas as gpd

        places_m = np.array([(cell.east_m, cell.north_m) for cell in self.cells]).reshape(-1, 2)
        points = gpd.points_from_xy(*places_m.T)
        return gpd.GeoDataFrame(self.to_dataframe(), geometry=points, crs=self.crs)

    def __len__(self) -> int:
        return len(self.cells)

    def __iter__(self) -> Iterator[str]:
        """Go over the ids, as ``in`` and ``[]`` take them; ``cells`` are the cells themselves."""
        return iter(self.ids)

    def __contains__(self, cell_id: object) -> bool:
        return cell_id in self._positions

    def __getitem__(self, cell_id: str) -> Cell:
        return self.cells[self.index(cell_id)]

    def index(self, cell_id: str) -> int:
        """Return the place of a cell in ``cells``; an unknown id is an InputError."""
        try:
            return self._positions[cell_id]
        except KeyError:
            raise fail(InputError, "cell plan", "a cell of the plan", repr(cell_id)) from None

    def to_crs(self, crs: str) -> CellPlan:
        """Return the same plan in another projected CRS; azimuths keep meaning true north."""
        target = projected_crs(crs)
        if same_crs(self.crs, target):
            return self
        lon_deg, lat_deg = unproject(
            self.crs, [cell.east_m for cell in self.cells], [cell.north_m for cell in self.cells]
        )
        east_m, north_m = project(target, lon_deg, lat_deg)
        moved = zip(self.cells, east_m.tolist(), north_m.tolist(), strict=True)
        cells = tuple(replace(c, east_m=e, north_m=n) for c, e, n in moved)
        return CellPlan(target, cells, self.notes, self.inactive)


def _as_cells(given: object) -> tuple[Cell, ...]:
    """Return cells as a tuple; InputError for what is no cell."""
    table = hasattr(given, "columns")
    cells = tuple(given) if isinstance(given, Iterable) and not table else (given,)
    wrong = [one for one in cells if not isinstance(one, Cell)]
    if wrong:
        hint = "a table; read_cell_plan reads it" if table else ""
        raise fail(InputError, "cell plan", "cells, each a Cell", shown(wrong[0]), hint)
    return tuple(one for one in cells if isinstance(one, Cell))


def check_cells(
    cells: tuple[Cell, ...],
    where: Callable[[int, str], str],
    faults: Faults,
    *,
    ranges: bool = True,
) -> None:
    """Note the faults of cells: of each field (unless checked already), and of all together."""
    first: dict[str, int] = {}
    for i, cell in enumerate(cells):
        if ranges:
            _check_fields(cell, partial(where, i), faults)
        for name, expected, got in technology_faults(cell.technology, partial(getattr, cell)):
            faults.add(where(i, name), expected, got, "another technology")
        if cell.antenna in POINTED and cell.azimuth_deg is None:
            expected = "an azimuth, as the antenna is a sector"
            hint = "azimuth left out, or the antenna is omni"
            faults.add(where(i, "azimuth_deg"), expected, "nothing", hint)
        if cell.id in first:
            hint = "a row given twice"
            if cell != cells[first[cell.id]]:
                hint = "a cell of several carriers or antennas; give each its own id, or keep one"
            faults.add(where(i, "cell"), "an id used once", repr(cell.id), hint)
        first.setdefault(cell.id, i)
    azimuths = [cell.azimuth_deg for cell in cells if cell.azimuth_deg is not None]
    if looks_like_radians(azimuths):
        got = ", ".join(f"{azimuth:g}" for azimuth in azimuths[:3]) + ", …, none above 2π"
        hint = "radians given for degrees"
        faults.add(where(0, "azimuth_deg"), "degrees in 0..360", got, hint)


def _check_fields(cell: Cell, where: Callable[[str], str], faults: Faults) -> None:
    for name, wrong in (("id", id_fault(cell.id)), ("site", site_fault(cell.site))):
        if wrong:
            faults.add(where(name), *wrong)
    if wrong := antenna_fault(cell.antenna):
        faults.add(where("antenna"), *wrong)
    if wrong := assumed_fault(cell.assumed):
        faults.add(where("assumed"), *wrong)
    for name, allowed in RANGES.items():
        value = getattr(cell, name)
        if not allowed.holds(value) and not (value is None and name in OPTIONAL):
            hint = allowed.hint(value) if isinstance(value, int | float) else ""
            faults.add(where(name), allowed.expected, value, hint)
