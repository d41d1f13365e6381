"""Lines of a cell plan as typed values; a fault names file, row and field."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mapfilter.errors import Faults
from mapfilter.radio.arrange_cells import Arranged
from mapfilter.radio.cell_layouts import OFFSETS
from mapfilter.radio.cell_rules import (
    ANTENNAS,
    OFFSET,
    OPTIONAL,
    RANGES,
    TECHNOLOGIES,
    antenna_fault,
    assumed_fault,
    id_fault,
    site_fault,
)
from mapfilter.radio.identities import technology
from mapfilter.radio.sexagesimal import sexagesimal_deg
from mapfilter.radio.tables import number, why_no_number

REQUIRED = ("cell", "height_m", "eirp_dbm", "frequency_mhz")
"""Fields without which there is no cell."""
DEFAULT_HINT = "set cells.{}, which is then taken for all cells without one"
"""What to do where a number is missing."""
_TRUE, _FALSE = {"1", "true", "yes", "y"}, {"0", "false", "no", "n"}
_HEMISPHERES = {"lat": "NS", "lon": "EW"}
_LONGEST_SHOWN = 80
_SLASH = "no file can have this name: give the cell that of its raster, as with _"


@dataclass(slots=True)
class Row:
    """A line of the file: its number, its values by field of a cell, and whether any is invalid."""

    line: int
    values: dict[str, Any]
    faulty: bool = False


def row_of(
    where: str,
    line: int,
    given: Mapping[str, str],
    table: Arranged,
    systems: Mapping[str, str],
    faults: Faults,
) -> Row:
    """Return the values of a line that are as they should be.

    Parameters
    ----------
    systems : mapping of str to str
        CRS by the text that rows state; what is not in it was a fault.
    """
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
    if wrong := id_fault(values["id"]):
        refuse("cell", *wrong, _SLASH if any(mark in values["id"] for mark in "/\\") else "")
    if given.get("site") and (wrong := site_fault(values["site"])):
        refuse("site", *wrong)
    for name, allowed in RANGES.items():
        if given.get(name):
            value = parse(name, allowed.expected)
            if value is not None and not allowed.holds(value):
                refuse(name, allowed.expected, given[name], allowed.hint(value))
            elif value is not None:
                values[name] = int(value) if allowed.whole else value
        elif name in REQUIRED:
            refuse(name, allowed.expected, "nothing", DEFAULT_HINT.format(name))
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
        row.faulty = row.faulty or given["crs"] not in systems
        values["crs"] = systems.get(given["crs"], given["crs"])
    return row
