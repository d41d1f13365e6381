"""Rows of a cell-plan CSV file as typed values; every fault is told by file, row and field."""

from __future__ import annotations

import csv
import difflib
import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pyproj import CRS

from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import project, projected_crs, unproject
from mapfilter.radio._cell_rules import ANTENNAS, OPTIONAL, RANGES, antenna_fault, id_fault

COLUMNS = (
    "cell", "site", "lat", "lon", "height_m", "azimuth_deg", "downtilt_deg",
    "mechanical_downtilt_deg", "antenna", "beamwidth_deg", "max_attenuation_db",
    "vertical_beamwidth_deg", "side_lobe_db", "eirp_dbm", "frequency_mhz", "indoor",
    "penetration_loss_db", "mcc", "mnc", "lac", "ci", "arfcn", "bsic",
)  # fmt: skip
"""Columns of a file that mapfilter writes, in order."""
_ALLOWED = {*COLUMNS, "east", "north", "crs"}
_REQUIRED = ("cell", "height_m", "eirp_dbm", "frequency_mhz")
_TRUE, _FALSE = {"1", "true", "yes", "y"}, {"0", "false", "no", "n"}
_LARGEST_BYTES = 1 << 28
_NEAR_DEG = 3.0


@dataclass(slots=True)
class Row:
    """One line of the file: its number, its values by field of a cell, and whether any is wrong."""

    line: int
    values: dict[str, Any]
    faulty: bool = False


def read_rows(path: Path, crs: str, faults: Faults) -> list[Row]:
    """Read and check every row; what is wrong is added to ``faults``.

    Raises
    ------
    InputError
        The file cannot be read as a table, or its header is wrong.
    """
    lines = list(_table(path))
    if not lines:
        raise fail(InputError, str(path), "a header line and rows", "nothing", "an empty file")
    header = [name.strip() for name in lines[0][1]]
    _check_header(path, header)
    if len(lines) == 1:
        raise fail(InputError, str(path), "at least one cell", "a header without rows")
    rows = [_Reader(path, line, header, crs, faults).row(texts) for line, texts in lines[1:]]
    systems = {row.values.get("crs", crs) for row in rows}
    if len(systems) > 1:
        faults.add(f"{path}, crs", "one CRS in all rows", ", ".join(sorted(systems)))
    _place(path, rows, crs, faults)
    return rows


def _table(path: Path) -> list[tuple[int, list[str]]]:
    try:
        if path.stat().st_size > _LARGEST_BYTES:
            raise fail(InputError, str(path), "a cell plan of at most 256 MiB", "a larger file")
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        got = f"other bytes at offset {error.start}"
        hint = "saved in a Windows code page, or no text file"
        raise fail(InputError, str(path), "text in UTF-8", got, hint) from error
    except OSError as error:
        raise fail(InputError, str(path), "a readable file", error.strerror or error) from error
    if "\0" in text:
        raise fail(InputError, str(path), "text in UTF-8", "NUL characters", "no text file")
    head = text.split("\n", 1)[0]
    reader = csv.reader(
        io.StringIO(text, newline=""), delimiter=";" if head.count(";") > head.count(",") else ","
    )
    try:
        return [(reader.line_num, row) for row in reader if any(field.strip() for field in row)]
    except csv.Error as error:
        raise fail(InputError, f"{path} row {reader.line_num}", "CSV", error) from error


def _check_header(path: Path, header: list[str]) -> None:
    faults = Faults()
    where = f"{path} header"
    for name in header:
        if name not in _ALLOWED:
            near = difflib.get_close_matches(name.lower(), sorted(_ALLOWED), n=1, cutoff=0.5)
            faults.add(where, "known columns only", repr(name), f"{near[0]} meant" if near else "")
    for name in sorted({name for name in header if header.count(name) > 1}):
        faults.add(where, "each column once", f"{name} {header.count(name)} times")
    wanted = list(_REQUIRED)
    wanted += ["east", "north"] if {"east", "north"} & set(header) else ["lat", "lon"]
    for name in wanted:
        if name not in header:
            faults.add(where, f"a column {name}", "none", "left out or misspelt")
    if {"lat", "lon"} & set(header) and {"east", "north"} & set(header):
        faults.add(where, "lat and lon, or east and north", "both")
    faults.raise_if_any(InputError)


class _Reader:
    """Turns the texts of one line into values."""

    def __init__(self, path: Path, line: int, header: list[str], crs: str, faults: Faults) -> None:
        self._path, self._line, self._header = path, line, header
        self._crs, self._faults = crs, faults
        self._row = Row(line, {})

    def row(self, texts: list[str]) -> Row:
        if len(texts) != len(self._header):
            hint = (
                "a decimal comma, or an unquoted separator"
                if len(texts) > len(self._header)
                else "the line is cut off"
            )
            self._fault("fields", str(len(self._header)), str(len(texts)), hint)
            return self._row
        given = {name: text.strip() for name, text in zip(self._header, texts, strict=True)}
        values = self._row.values
        values["id"] = self._identifier("cell", given["cell"])
        values["site"] = self._identifier("site", given.get("site") or given["cell"])
        for name in RANGES:
            if name not in ("east_m", "north_m"):
                self._number(name, given.get(name, ""))
        for name in ("lat", "lon", "east", "north"):
            if name in given:
                values[name] = self._parse(name, given[name], "a number")
        values.setdefault("azimuth_deg", None)
        values["indoor"] = self._truth("indoor", given.get("indoor", ""))
        default = "omni" if not given.get("azimuth_deg") else "sector"
        values["antenna"] = self._antenna(given.get("antenna", ""), default)
        if given.get("crs"):
            try:
                values["crs"] = projected_crs(given["crs"], f"{self._path} row {self._line}, crs")
            except InputError as error:
                self._faults.found.extend(error.faults)
                self._row.faulty = True
        return self._row

    def _fault(self, name: str, expected: str, got: str, hint: str = "") -> None:
        self._faults.add(f"{self._path} row {self._line}, {name}", expected, got, hint)
        self._row.faulty = True

    def _identifier(self, name: str, text: str) -> str:
        if wrong := id_fault(text):
            self._fault(name, *wrong)
        return text

    def _antenna(self, text: str, default: str) -> str:
        name = text or default
        if name.lower() in ANTENNAS:
            return name.lower()
        if wrong := antenna_fault(name):
            self._fault("antenna", *wrong)
        return name

    def _number(self, name: str, text: str) -> None:
        allowed = RANGES[name]
        if not text:
            if name in _REQUIRED:
                self._fault(name, allowed.expected, "nothing")
            elif name in OPTIONAL:
                self._row.values[name] = None
            return
        value = self._parse(name, text, allowed.expected)
        if value is None:
            return
        if not allowed.holds(value):
            self._fault(name, allowed.expected, text, allowed.hint(value))
        else:
            self._row.values[name] = int(value) if allowed.whole else value

    def _parse(self, name: str, text: str, expected: str) -> float | None:
        try:
            value = float("?" if "_" in text else text)
        except ValueError:
            hint = "a decimal comma" if text.replace(",", "", 1).lstrip("-").isdigit() else ""
            self._fault(name, expected, repr(text) if text else "nothing", hint)
            return None
        if not math.isfinite(value):
            self._fault(name, expected, text)
            return None
        return value

    def _truth(self, name: str, text: str) -> bool:
        if text.lower() not in _TRUE | _FALSE | {""}:
            self._fault(name, "1 or 0, true or false, yes or no", repr(text))
        return text.lower() in _TRUE


def _place(path: Path, rows: list[Row], crs: str, faults: Faults) -> None:
    """Give every row its east and north in ``crs``, checking that they lie where the CRS is for."""
    for row in rows:
        if {"lat", "lon"} <= row.values.keys():
            fields, wrong = "lat, lon", _from_degrees(row.values, crs)
        elif {"east", "north"} <= row.values.keys():
            fields, wrong = "east, north", _from_metres(row.values, crs)
        else:
            row.faulty = True
            continue
        if wrong is not None:
            faults.add(f"{path} row {row.line}, {fields}", *wrong)
            row.faulty = True


def _from_degrees(values: dict[str, Any], crs: str) -> tuple[str, str, str] | None:
    lat, lon = values["lat"], values["lon"]
    if lat is None or lon is None:
        return None
    east_m, north_m = project(crs, lon, lat)
    values["east_m"], values["north_m"] = float(east_m), float(north_m)
    return _degree_fault(lat, lon, crs)


def _from_metres(values: dict[str, Any], crs: str) -> tuple[str, str, str] | None:
    east, north, own = values["east"], values["north"], values.get("crs", crs)
    if east is None or north is None:
        return None
    values["east_m"], values["north_m"] = east, north
    if own != crs:
        east_m, north_m = project(crs, *unproject(own, east, north))
        values["east_m"], values["north_m"] = float(east_m), float(north_m)
    return _metre_fault(east, north, own)


def _metre_fault(east: float, north: float, crs: str) -> tuple[str, str, str] | None:
    expected, got = f"metres where {crs} is used", f"{east:g}, {north:g}"
    if max(abs(east), abs(north)) <= 180 and (_near(crs, east, north) or _near(crs, north, east)):
        return expected, got, "degrees given for metres"
    lon_deg, lat_deg = unproject(crs, east, north)
    if _near(crs, float(lon_deg), float(lat_deg)):
        return None
    return expected, got, "east and north swapped, or another CRS"


def _degree_fault(lat: float, lon: float, crs: str) -> tuple[str, str, str] | None:
    got = f"{lat:g}, {lon:g}"
    if abs(lat) > 180 or abs(lon) > 180:
        return "degrees in -90..90 and -180..180", got, "metres given for degrees"
    if abs(lat) > 90:
        return "degrees in -90..90 and -180..180", got, "longitude and latitude swapped"
    if _near(crs, lon, lat):
        return None
    swapped = abs(lon) <= 90 and _near(crs, lat, lon)
    hint = (
        "longitude and latitude swapped" if swapped else "a cell of another place, or another CRS"
    )
    return f"a place where {crs} is used", got, hint


def _near(crs: str, lon_deg: float, lat_deg: float) -> bool:
    """Tell whether a place lies in, or within a few degrees of, the area a CRS is made for."""
    area = CRS.from_user_input(crs).area_of_use
    if not (math.isfinite(lon_deg) and math.isfinite(lat_deg)):
        return False
    if area is None:
        return True
    middle = area.west + ((area.east - area.west) % 360) / 2
    half = ((area.east - area.west) % 360) / 2 or 180.0
    offset = (lon_deg - middle + 180) % 360 - 180
    south, north = area.south - _NEAR_DEG, area.north + _NEAR_DEG
    return abs(offset) <= half + _NEAR_DEG and south <= lat_deg <= north
