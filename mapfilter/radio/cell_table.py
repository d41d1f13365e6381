"""A cell-plan CSV file: its header, and its rows as cells at their places."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from itertools import chain
from typing import NamedTuple

from mapfilter.errors import Faults, InputError, fail, listed
from mapfilter.radio.arrange_cells import arrange, likely_names, none_of, recognised
from mapfilter.radio.cell_layouts import (
    ALIASES,
    ATOLL,
    COLUMNS,
    LAYOUTS,
    OFFSETS,
    POSITIONS,
    TRANSLATED,
    Layout,
)
from mapfilter.radio.cell_places import move_from_sites, place_rows
from mapfilter.radio.cell_rows import DEFAULT_HINT, REQUIRED, Row, row_of
from mapfilter.radio.cell_rules import RANGES
from mapfilter.radio.headings import Heading, places_named, resembling, unit_of
from mapfilter.radio.plan_systems import stated_systems, unit_notes
from mapfilter.radio.tables import MOST_TITLES, Table

_PLACES = {name: field for field, names in POSITIONS.items() for name in names}
_ALLOWED = {*COLUMNS, *_PLACES, "crs", *OFFSETS, *chain.from_iterable(ALIASES.values())}
_OTHER_LAYOUTS: Mapping[Layout, str] = {
    "atoll": "transmitters of Atoll",
    "opencellid": "a list of OpenCellID or the Mozilla Location Service",
}
_TELLING: Mapping[Layout, tuple[str, ...]] = {
    "atoll": (*ATOLL["cell"], *TRANSLATED["cell"]),
    "opencellid": ("radio",),
}
"""Columns of which one is in every list of a layout, and in no plan."""
_LEAST_KNOWN = 3
_JOIN_SITES = (
    "Atoll keeps positions in the table Sites; add them to each transmitter by the name of its "
    "site, or name other columns in cells.columns.east and cells.columns.north"
)
_LEAST_FOREIGN, _SETTINGS_SHOWN = 5, 6
"""Columns of other names by which a list is another tool's; how many are named."""
_POWERS = ("power", "puissance", "leistung")
_MISSPELT = 0.75
"""Least likeness of a short name that is misspelt."""


class PlanRows(NamedTuple):
    """Rows of a cell plan, remarks on what was filled in, and cells that are switched off."""

    rows: list[Row]
    notes: tuple[str, ...]
    inactive: tuple[str, ...]


def read_plan(
    table: Table,
    crs: str,
    faults: Faults,
    layout: Layout = "plan",
    columns: Mapping[str, str] | None = None,
    defaults: Mapping[str, float] | None = None,
    own_crs: str | None = None,
) -> PlanRows:
    """Read and check every row of a cell plan, or of a list of another layout.

    Faults of rows are added to ``faults``. ``own_crs`` is that of rows that state none.

    Raises
    ------
    InputError
        Its header is wrong.
    """
    path = table.path
    where, wrong = f"{path} header", Faults()
    if layout == "plan" and not columns:
        _check_titles(where, table)
        _check_layout(where, table.header)
        _check_own_header(where, table.header, wrong)
    arranged = arrange(table, layout, columns or {}, defaults or {}, faults)
    _check_fields(where, layout, arranged.header, table.header, wrong)
    wrong.raise_if_any(InputError)
    if not arranged.rows and not faults.found:
        raise fail(InputError, str(path), "at least one cell", "a header without rows")
    lines = [
        {name: text.strip() for name, text in zip(arranged.header, texts, strict=True)}
        for _, texts in arranged.rows
    ]
    stated = (given.get("crs", "") for given in lines)
    known = stated_systems(stated, f"{path}, {arranged.shown.get('crs', 'crs')}", faults)
    if own_crs is not None:
        if not {"east", "north"} <= set(arranged.header):
            hint = "degrees are in WGS 84: leave it out"
            raise fail(InputError, "cells.crs", "positions as east and north", "none", hint)
        known |= stated_systems([own_crs], "cells.crs", faults)
        lines = [{**given, "crs": given.get("crs") or own_crs} for given in lines]
    rows = [
        row_of(f"{path} row {line}", line, given, arranged, known, faults)
        for (line, _), given in zip(arranged.rows, lines, strict=True)
    ]
    systems = {row.values.get("crs", crs) for row in rows}
    if len(systems) > 1:
        faults.add(f"{path}, crs", "one CRS in all rows", ", ".join(sorted(systems)))
    placed = [row for row in rows if row.values.get("crs", crs) in {crs, *known.values()}]
    place_rows(path, placed, crs, faults)
    notes = (*arranged.notes, *unit_notes(known), *move_from_sites(rows, arranged))
    return PlanRows(rows, notes, arranged.inactive)


def _check_titles(where: str, table: Table) -> None:
    """Raise InputError where the header is below lines of a title that hold the separator."""
    if _ALLOWED.intersection(table.header):
        return
    for line, texts in table.rows[:MOST_TITLES]:
        if "cell" in (names := {text.strip() for text in texts}) and len(names & _ALLOWED) > 2:
            got, hint = listed(table.header), f"a title above it: delete the lines above row {line}"
            raise fail(InputError, where, "columns of a cell plan", got, hint)


def _check_layout(where: str, header: tuple[str, ...]) -> None:
    """Raise InputError where a header is that of another layout."""
    own = recognised(header, LAYOUTS["plan"])
    for layout, what in _OTHER_LAYOUTS.items():
        known = recognised(header, LAYOUTS[layout])
        told = recognised(header, {"": _TELLING[layout]})
        if told and len(set(known) - set(own)) >= _LEAST_KNOWN:
            expected = f"columns of a cell plan ({', '.join(COLUMNS[:4])}, …)"
            hint = f'{what}: set cells.layout = "{layout}"'
            raise fail(InputError, where, expected, listed(known), hint)


def _check_own_header(where: str, header: tuple[str, ...], faults: Faults) -> None:
    """Check the columns of mapfilter's own layout, in which none has another meaning.

    Raises
    ------
    InputError
        Most columns are another tool's.
    """
    _check_tool(where, header)
    for name in header:
        if name not in _ALLOWED:
            hint = "name what it holds in [cells.columns]"
            hint = f"{meant}; else {hint}" if (meant := _meant(name, header)) else hint
            faults.add(where, "known columns only", repr(name), hint)
    for name in sorted({name for name in header if header.count(name) > 1}):
        faults.add(where, "each column once", f"{name} {header.count(name)} times")
    for names in POSITIONS.values():
        if len(several := [name for name in names if name in header]) > 1:
            faults.add(where, "one column of them", " and ".join(several))
    placed = {_PLACES[name] for name in header if name in _PLACES}
    if {"lat", "lon"} & placed and {"east", "north"} & placed:
        faults.add(where, "lat and lon, or east and north", "both")


def _check_tool(where: str, header: tuple[str, ...]) -> None:
    """Raise InputError, with what settings read it, where most columns are another tool's."""
    others = [name for name in header if name and name not in _ALLOWED]
    if len(others) < _LEAST_FOREIGN or 2 * len(others) <= len(header):
        return
    meant: dict[str, str] = {}
    for name in others:
        field = _meant(name, header).partition(" meant")[0]
        if field == "antenna":
            low = name.lower()
            field = "height_m" if "height" in low else "antenna" if _of_patterns(low) else ""
        if field and field not in meant:
            meant[field] = name
    settings = [f'{field} = "{name}"' for field, name in meant.items()]
    known = set(recognised(header, LAYOUTS["atoll"]))
    places = set(recognised(header, {"": (*LAYOUTS["atoll"]["lat"], *LAYOUTS["atoll"]["east"])}))
    such = f", such as {', '.join(settings[:_SETTINGS_SHOWN])}" if settings else ""
    hint = f"those of another tool: name the ones of use in [cells.columns]{such}"
    hint += "; others are ignored then"
    if places and len(known) >= _LEAST_FOREIGN:
        hint += f'; or set cells.layout = "atoll", which knows {len(known)} of them'
    expected = f"columns of a cell plan ({', '.join(COLUMNS[:4])}, …)"
    raise fail(InputError, where, expected, listed(others), hint)


def _of_patterns(name: str) -> bool:
    return name == "antenna" or any(word in name for word in ("model", "pattern", "type", "name"))


def _meant(name: str, header: tuple[str, ...]) -> str:
    """Return the absent column that an unknown one resembles, with its unit; "" for none."""
    if name.lower() in _ALLOWED - set(header):
        return f"{name.lower()} meant"
    heading = Heading.of(name)
    has = [field for field, names in LAYOUTS["plan"].items() if set(names) & set(header)]
    wanted = likely_names("plan", has)
    same = [field for field, names in wanted.items() if places_named([heading], field, names)]
    alike = [field for _, field in resembling([heading], (), wanted)]
    if not (same or alike):
        # Short names are misspelt, too: latt.
        near = difflib.get_close_matches(name.lower(), sorted(wanted), n=1, cutoff=_MISSPELT)
        alike = [field for field in near if field[0] == name[0].lower()]
    field = next(iter(same or alike), "")
    unit = f", in {unit_of(field)}" if unit_of(field) else ""
    return f"{field} meant{unit}" if field else ""


def _check_fields(
    where: str, layout: Layout, fields: tuple[str, ...], header: tuple[str, ...], faults: Faults
) -> None:
    """Check that every field is there without which there is no cell."""
    wanted = list(REQUIRED)
    if layout == "atoll" and not {"lat", "lon", "east", "north"} & set(fields):
        expected, hint = "a position: X and Y, or LATITUDE and LONGITUDE", _JOIN_SITES
        faults.add(where, expected, none_of(header), hint)
    else:
        wanted += ["east", "north"] if {"east", "north"} & set(fields) else ["lat", "lon"]
    for name in wanted:
        if name not in fields:
            hint = f"left out or misspelt; cells.columns.{name} names a column called otherwise"
            hint += f"; or {DEFAULT_HINT.format(name)}" if name in RANGES else ""
            powers = (word in one.lower() for one in header for word in _POWERS)
            if name == "eirp_dbm" and any(powers):
                what = "the power in dBm plus the antenna gain in dBi less losses"
                hint = f"{what} belongs in it; else {hint}"
            faults.add(where, f"a column {name}", none_of(header), hint)
