"""Cell plans in files: read those of mapfilter, of planning tools and public lists; write them."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import fields
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from mapfilter._annotations import Words
from mapfilter._arguments import Entries, Setting, check_arguments, path_argument
from mapfilter._io import atomic_file
from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.errors import ConfigError, Faults, InputError, fail
from mapfilter.geodesy import projected_crs, unproject
from mapfilter.radio.cell_layouts import COLUMNS, LAYOUTS, SELDOM, Layout
from mapfilter.radio.cell_rules import STATED, check_fields
from mapfilter.radio.cell_table import read_plan
from mapfilter.radio.cells import Cell, CellPlan, check_cells
from mapfilter.radio.plan_frames import is_frame, table_of_frame
from mapfilter.radio.tables import read_table

if TYPE_CHECKING:
    import pandas as pd

_BOUNDS_M = Annotated[
    tuple[float, float, float, float] | None, Words("west, south, east, north in metres")
]


def read_cell_plan(
    path: Path | str | pd.DataFrame,
    crs: str,
    *,
    layout: Layout = "plan",
    columns: Mapping[str, str] | None = None,
    defaults: Mapping[str, float] | None = None,
    bounds_m: Sequence[float] | Floats | None = None,
    plan_crs: str | None = None,
) -> CellPlan:
    """Read a cell plan from a CSV file, a workbook or a table and bring it into ``crs``.

    Commas, semicolons or tabs, UTF-8, one header line; decimal commas where they separate nothing.
    Columns: cell, lat and lon (WGS 84) *or* east and north (in the CRS of a ``crs`` column, which
    may be in feet, with a note; else in ``crs``), which may have the names of logs (``lat_deg``,
    ``lon_deg``, ``east_m``, ``north_m``); height_m, eirp_dbm, frequency_mhz; and when
    wanted site, azimuth_deg, antenna, and the other fields of :class:`Cell`. An empty field takes
    the default; without an azimuth the antenna is omnidirectional.

    Parameters
    ----------
    path : path or pandas.DataFrame
        A file, or such a table, as that of :meth:`CellPlan.to_dataframe`.
    crs : str
        Projected CRS of the plan.
    layout : {"plan", "atoll", "opencellid"}
        Of the columns: as above, those of a planning tool's transmitters, or those of OpenCellID
        and the Mozilla Location Service, whose bad rows are left out with a note. In the latter
        two columns of other names are ignored; those of a planning tool that resemble a field
        without a column are noted. A unit in brackets after a name is checked.
    columns : mapping of str to str, optional
        The file's column by field, where it has another name; other columns are ignored, then.
    defaults : mapping of str to float, optional
        Values of fields that have no column or are empty, with a note; of any field that is a
        number (``indoor``: 0 or 1), except a position.
    bounds_m : four floats, optional
        West, south, east, north: cells beyond them are left out with a note.
    plan_crs : str, optional
        CRS of the east and north of rows that state none; ``crs`` when left out.

    Raises
    ------
    InputError
        The file is missing, empty or no such table; or with file, row (line of the file) and field
        of every fault, and the likely mistake.
    ConfigError
        The path is none, another argument is of another type, or ``columns`` or ``defaults`` have
        a name that is no field.
    """
    check_arguments(
        "read_cell_plan",
        *(() if is_frame(path) else (path_argument("path", path),)),
        keywords=[
            Setting("layout", layout, Layout),
            Entries("columns", columns, str, "a column's name", "the column of each field"),
            Entries("defaults", defaults, Real, "a number", "the value of each field"),
            Setting("bounds_m", bounds_m, _BOUNDS_M),
            Setting("plan_crs", plan_crs, str | None),
        ],
    )
    faults = Faults()
    check_fields("read_cell_plan, columns", columns or {}, LAYOUTS["plan"], faults)
    check_fields("read_cell_plan, defaults", defaults or {}, STATED, faults)
    faults.raise_if_any(ConfigError)
    usual = {name: float(value) for name, value in (defaults or {}).items()}
    table = table_of_frame(path) if is_frame(path) else read_table(Path(path), "a cell plan")
    path = table.path
    frame = projected_crs(crs)
    rows, notes, inactive = read_plan(table, frame, faults, layout, columns, usual, plan_crs)
    known = {each.name for each in fields(Cell)}
    whole = [row for row in rows if not row.faulty]
    if layout == "opencellid" and whole:
        if faults.found:
            # A row may have several faults.
            start = f"{path} row "
            lines = {fault.where.removeprefix(start).partition(",")[0] for fault in faults.found}
            some = number_of(len(lines), "faulty row")
            notes += (f"{some} left out, such as {faults.found[0]}",)
            faults = Faults()
        first = {row.values["id"]: row for row in reversed(whole)}
        repeated = len(whole) - len(first)
        whole = [row for row in whole if first[row.values["id"]] is row]
        if repeated:
            notes += (f"{number_of(repeated, 'row')} left out: cells listed already",)
    if bounds_m is not None:
        west, south, east, north = bounds_m
        inside = [
            row
            for row in whole
            if west <= row.values["east_m"] <= east and south <= row.values["north_m"] <= north
        ]
        if whole and not inside:
            expected = f"cells in {', '.join(f'{value:.0f}' for value in bounds_m)}"
            raise fail(InputError, str(path), expected, "none", "cells of another area")
        if len(inside) < len(whole):
            left_out = len(whole) - len(inside)
            notes += (f"{left_out} of {len(whole)} cells left out: far from the area",)
        whole = inside
    cells = tuple(Cell(**{k: v for k, v in row.values.items() if k in known}) for row in whole)
    if not cells and not faults.found:
        faults.add(str(path), "at least one cell", "none")
    check_cells(cells, lambda i, name: f"{path} row {whole[i].line}, {name}", faults, ranges=False)
    faults.raise_if_any(InputError)
    return CellPlan(crs, cells, notes, inactive)


def write_cell_plan(plan: CellPlan, path: Path | str) -> None:
    """Write a cell plan as CSV that :func:`read_cell_plan` reads back.

    Positions are longitudes and latitudes with nine decimals (0.1 mm); all else is exact.
    """
    lon_deg, lat_deg = unproject(
        plan.crs, [cell.east_m for cell in plan.cells], [cell.north_m for cell in plan.cells]
    )
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    lacking = {name for name in SELDOM if not any(getattr(cell, name) for cell in plan.cells)}
    columns = [name for name in COLUMNS if name not in lacking]
    writer.writerow(columns)
    for cell, lon, lat in zip(plan.cells, lon_deg.tolist(), lat_deg.tolist(), strict=True):
        named = {"cell": cell.id, "lat": f"{lat:.9f}", "lon": f"{lon:.9f}"}
        named["indoor"] = str(int(cell.indoor))
        writer.writerow(named.get(column) or getattr(cell, column) for column in columns)
    with atomic_file(Path(path)) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8")
