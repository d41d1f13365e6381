"""Rows of a cell-plan CSV file as typed values; every fault names file, row and field."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import Any

from pyproj import CRS

from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError, fail, listed
from mapfilter.geodesy import degree_fault, project, projected_crs, unproject
from mapfilter.radio.arrange_cells import Arranged, arrange, likely_names, none_of, recognised
from mapfilter.radio.cell_layouts import ALIASES, ATOLL, COLUMNS, LAYOUTS, OFFSETS, Layout
from mapfilter.radio.cell_rules import (
    ANTENNAS,
    OFFSET,
    OPTIONAL,
    RANGES,
    TECHNOLOGIES,
    antenna_fault,
    assumed_fault,
    id_fault,
)
from mapfilter.radio.headings import Heading, places_named, resembling, unit_of
from mapfilter.radio.identities import technology
from mapfilter.radio.sexagesimal import sexagesimal_deg
from mapfilter.radio.tables import number, read_table, why_no_number

_ALLOWED = {*COLUMNS, "east", "north", "crs", *OFFSETS, *chain.from_iterable(ALIASES.values())}
_REQUIRED = ("cell", "height_m", "eirp_dbm", "frequency_mhz")
_DEFAULT_HINT = "set cells.{}, which is then taken for all cells without one"
_TRUE, _FALSE = {"1", "true", "yes", "y"}, {"0", "false", "no", "n"}
_HEMISPHERES = {"lat": "NS", "lon": "EW"}
_NEAR_DEG = 3.0
_OTHER_LAYOUTS: Mapping[Layout, str] = {
    "atoll": "transmitters of Atoll",
    "opencellid": "a list of OpenCellID or the Mozilla Location Service",
}
_TELLING: Mapping[Layout, tuple[str, ...]] = {"atoll": ATOLL["cell"], "opencellid": ("radio",)}
"""Columns of which one is in every list of a layout, and in no plan."""
_LEAST_KNOWN = 3
_JOIN_SITES = (
    "Atoll keeps positions in the table Sites; add them to each transmitter by the name of its "
    "site, or name other columns in cells.columns.east and cells.columns.north"
)
_LONGEST_SHOWN = 80
_MISSPELT = 0.75
"""Least likeness of a short name that is misspelt."""


@dataclass(slots=True)
class Row:
    """A line of the file: its number, its values by field of a cell, and whether any is invalid."""

    line: int
    values: dict[str, Any]
    faulty: bool = False


def read_plan(
    path: Path,
    crs: str,
    faults: Faults,
    layout: Layout = "plan",
    columns: Mapping[str, str] | None = None,
    defaults: Mapping[str, float] | None = None,
) -> tuple[list[Row], tuple[str, ...]]:
    """Read and check every row of a cell plan, or of a list of another layout.

    Faults of rows are added to ``faults``; also returned are remarks on defaults that were used.

    Raises
    ------
    InputError
        The file cannot be read as a table, or its header is wrong.
    """
    table = read_table(path, "a cell plan")
    where, wrong = f"{path} header", Faults()
    if layout == "plan" and not columns:
        _check_layout(where, table.header)
        _check_own_header(where, table.header, wrong)
    arranged = arrange(table, layout, columns or {}, defaults or {}, faults)
    _check_fields(where, layout, arranged.header, table.header, wrong)
    wrong.raise_if_any(InputError)
    if not arranged.rows and not faults.found:
        raise fail(InputError, str(path), "at least one cell", "a header without rows")
    rows = []
    for line, texts in arranged.rows:
        given = {name: text.strip() for name, text in zip(arranged.header, texts, strict=True)}
        rows.append(_row(f"{path} row {line}", line, given, arranged, faults))
    systems = {row.values.get("crs", crs) for row in rows}
    if len(systems) > 1:
        faults.add(f"{path}, crs", "one CRS in all rows", ", ".join(sorted(systems)))
    _place(path, rows, crs, faults)
    return rows, (*arranged.notes, *_moved_from_sites(rows, arranged))


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
    """Check the columns of mapfilter's own layout, in which none has another meaning."""
    for name in header:
        if name not in _ALLOWED:
            hint = "name what it holds in [cells.columns]"
            hint = f"{meant}; else {hint}" if (meant := _meant(name, header)) else hint
            faults.add(where, "known columns only", repr(name), hint)
    for name in sorted({name for name in header if header.count(name) > 1}):
        faults.add(where, "each column once", f"{name} {header.count(name)} times")
    if {"lat", "lon"} & set(header) and {"east", "north"} & set(header):
        faults.add(where, "lat and lon, or east and north", "both")


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
    wanted = list(_REQUIRED)
    if layout == "atoll" and not {"lat", "lon", "east", "north"} & set(fields):
        expected, hint = "a position: X and Y, or LATITUDE and LONGITUDE", _JOIN_SITES
        faults.add(where, expected, none_of(header), hint)
    else:
        wanted += ["east", "north"] if {"east", "north"} & set(fields) else ["lat", "lon"]
    for name in wanted:
        if name not in fields:
            hint = f"left out or misspelt; cells.columns.{name} names a column called otherwise"
            hint += f"; or {_DEFAULT_HINT.format(name)}" if name in RANGES else ""
            if name == "eirp_dbm" and any("power" in one.lower() for one in header):
                what = "the power in dBm plus the antenna gain in dBi less losses"
                hint = f"{what} belongs in it; else {hint}"
            faults.add(where, f"a column {name}", none_of(header), hint)


def _row(where: str, line: int, given: Mapping[str, str], table: Arranged, faults: Faults) -> Row:
    """Return the values of a line that are as they should be."""
    row = Row(line, {})
    values = row.values

    def refuse(name: str, expected: str, got: str, hint: str = "") -> None:
        faults.add(f"{where}, {table.shown.get(name, name)}", expected, got, hint)
        row.faulty = True

    def parse(name: str, expected: str) -> float | None:
        text = given[name]
        value = number(text, decimal_comma=table.decimal_comma)
        if value is None and name in _HEMISPHERES:
            value = sexagesimal_deg(text, _HEMISPHERES[name])
        if value is None:
            got = repr(text[:_LONGEST_SHOWN]) if text else "nothing"
            if text.lower().lstrip("+-") in ("nan", "inf", "infinity"):
                got = text
            why = why_no_number(text)
            if name == "azimuth_deg" and not (why or any(map(str.isdigit, text))):
                why = "to be left empty where the antenna is omnidirectional"
            refuse(name, expected, got, why)
        return value

    values["id"], values["site"] = given["cell"], given.get("site") or given["cell"]
    for name, key in (("cell", "id"), ("site", "site")):
        if wrong := id_fault(values[key]):
            refuse(name, *wrong)
    for name, allowed in RANGES.items():
        if given.get(name):
            value = parse(name, allowed.expected)
            if value is not None and not allowed.holds(value):
                refuse(name, allowed.expected, given[name], allowed.hint(value))
            elif value is not None:
                values[name] = int(value) if allowed.whole else value
        elif name in _REQUIRED:
            refuse(name, allowed.expected, "nothing", _DEFAULT_HINT.format(name))
        elif name in OPTIONAL:
            values[name] = None
    for name in ("lat", "lon", "east", "north"):
        if name in given:
            values[name] = parse(name, "degrees" if name in _HEMISPHERES else "a number")
    for name in OFFSETS:
        if given.get(name):
            value = parse(name, OFFSET.expected)
            if value is not None and not OFFSET.holds(value):
                refuse(name, OFFSET.expected, given[name], OFFSET.hint(value))
            values[name] = value
    values.setdefault("azimuth_deg", None)
    indoor = given.get("indoor", "").lower()
    if indoor not in _TRUE | _FALSE | {""}:
        refuse("indoor", "1 or 0, true or false, yes or no", repr(given["indoor"]))
    values["indoor"] = indoor in _TRUE
    antenna = given.get("antenna") or ("sector" if given.get("azimuth_deg") else "omni")
    values["antenna"] = antenna.lower() if antenna.lower() in ANTENNAS else antenna
    if wrong := antenna_fault(values["antenna"]):
        refuse("antenna", *wrong)
    stated = given.get("technology", "")
    values["technology"] = technology(stated) if stated else None
    if stated and values["technology"] not in TECHNOLOGIES:
        values["technology"] = None
        refuse("technology", f"one of {', '.join(TECHNOLOGIES)}, or nothing", repr(stated))
    values["assumed"] = " ".join(given.get("assumed", "").split())
    if wrong := assumed_fault(values["assumed"]):
        refuse("assumed", *wrong)
    if given.get("crs"):
        try:
            values["crs"] = projected_crs(given["crs"], f"{where}, crs")
        except InputError as error:
            faults.found.extend(error.faults)
            row.faulty = True
    return row


def _place(path: Path, rows: list[Row], crs: str, faults: Faults) -> None:
    """Give every row its east and north in ``crs``, and check that the CRS is used there."""
    some = [row.values for row in rows]
    some = [v for v in some if v.get("lat") is not None and v.get("lon") is not None]
    east_m, north_m = project(crs, [v["lon"] for v in some], [v["lat"] for v in some])
    for values, east, north in zip(some, east_m.tolist(), north_m.tolist(), strict=True):
        values["east_m"], values["north_m"] = east, north
    for row in rows:
        values, names, wrong = row.values, "lat, lon", None
        if "lat" in values:
            if values["lat"] is not None and values["lon"] is not None:
                wrong = _place_fault(values["lat"], values["lon"], crs)
        elif values["east"] is not None and values["north"] is not None:
            names, own = "east, north", values.get("crs", crs)
            values["east_m"], values["north_m"] = values["east"], values["north"]
            if own != crs:
                moved = project(crs, *unproject(own, values["east"], values["north"]))
                values["east_m"], values["north_m"] = map(float, moved)
            wrong = _metre_fault(values["east"], values["north"], own)
        if wrong is not None:
            faults.add(f"{path} row {row.line}, {names}", *wrong)
            row.faulty = True


def _moved_from_sites(rows: list[Row], table: Arranged) -> tuple[str, ...]:
    """Move cells from the places of their sites by what they lie beside these; return a note."""
    moved, farthest_m = 0, 0.0
    for row in rows:
        east_m, north_m = (row.values.get(name) or 0.0 for name in OFFSETS)
        if not row.faulty and (east_m or north_m):
            row.values["east_m"] += east_m
            row.values["north_m"] += north_m
            moved, farthest_m = moved + 1, max(farthest_m, math.hypot(east_m, north_m))
    if not moved:
        return ()
    names = " and ".join(table.shown.get(name, name) for name in OFFSETS if name in table.header)
    some = number_of(moved, "cell lies", "cells lie")
    return (f"{some} beside the place of the site, by {names}, up to {farthest_m:.3g} m",)


_FOOT_M = 0.3048


def _metre_fault(east: float, north: float, crs: str) -> tuple[str, str, str] | None:
    expected, got = f"metres where {crs} is used", f"{east:g}, {north:g}"
    if max(abs(east), abs(north)) <= 180 and (_near(crs, east, north) or _near(crs, north, east)):
        return expected, got, "degrees given for metres"
    lon_deg, lat_deg = unproject(crs, east, north)
    if _near(crs, float(lon_deg), float(lat_deg)):
        return None
    places = ((north, east), (_FOOT_M * east, _FOOT_M * north))
    swapped, in_feet = (_near(crs, *map(float, unproject(crs, *place))) for place in places)
    if in_feet and not swapped:
        return expected, got, "feet given for metres"
    return expected, got, "east and north swapped, or another CRS"


def _place_fault(lat: float, lon: float, crs: str) -> tuple[str, str, str] | None:
    wrong = degree_fault(lat, lon)
    if wrong is not None or _near(crs, lon, lat):
        return wrong
    hint = "a cell of another place, or another CRS"
    if abs(lon) <= 90 and _near(crs, lat, lon):
        hint = "longitude and latitude swapped"
    return f"a place where {crs} is used", f"{lat:g}, {lon:g}", hint


@lru_cache(maxsize=16)
def _area_of_use(crs: str) -> Any:
    return CRS.from_user_input(crs).area_of_use


def _near(crs: str, lon_deg: float, lat_deg: float) -> bool:
    """Return whether a place lies in, or within a few degrees of, the area a CRS is made for."""
    area = _area_of_use(crs)
    if not (math.isfinite(lon_deg) and math.isfinite(lat_deg)):
        return False
    if area is None:
        return True
    middle = area.west + ((area.east - area.west) % 360) / 2
    half = ((area.east - area.west) % 360) / 2 or 180.0
    offset = (lon_deg - middle + 180) % 360 - 180
    south, north = area.south - _NEAR_DEG, area.north + _NEAR_DEG
    return bool(abs(offset) <= half + _NEAR_DEG and south <= lat_deg <= north)
