"""Patches: proposed changes of a database, as a file that a person reads, edits and accepts."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from mapfilter._inputs import read_input, toml_values
from mapfilter._io import atomic_file
from mapfilter._same import EqualByValue
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import Fault, Faults, InputError, fail
from mapfilter.geodesy import same_crs, shown_crs

FORMAT = "mapfilter patch"
VERSION = 1
_LARGEST_BYTES = 64 << 20

Kind = Literal["offset", "dead", "moved", "turned", "rotated", "swapped", "way"]
Place = tuple[float, float]

_HEAD = """\
# Changes of a radio-route database that journeys propose; nothing is changed by this file alone.
# Set accept = false where you do not agree, then: mapfilter learn DB --accept THIS --out DB2
# log_bayes_factor: natural logarithm of the evidence for the change against the database as it is.
"""
_MEANING = {
    "offset": "levels are higher than predicted by offset_db",
    "dead": "never received where it should be; it is taken out",
    "moved": "stands at east_m, north_m",
    "turned": "points turn_deg further clockwise",
    "rotated": "all sectors of the mast point turn_deg further clockwise",
    "swapped": "the two cells are each other's",
    "way": "journeys went along this line, where the map has no way",
}


@dataclass(frozen=True, eq=False)
class Change(EqualByValue):
    """One proposed change.

    Parameters
    ----------
    kind : str
        ``offset``, ``dead``, ``moved``, ``turned``, ``rotated``, ``swapped`` or ``way``.
    cells : tuple of str
        That it concerns; none for a way.
    offset_db : float
        Added to the predicted levels (``offset``, ``moved``); NaN elsewhere.
    turn_deg : float
        Clockwise (``turned``, ``rotated``).
    east_m, north_m : float
        Of a ``moved`` cell.
    line_m : tuple of (east, north)
        Of a ``way``.
    half_width_m : float
        Of a ``way``.
    log_bayes_factor, probability : float
        Evidence against the database as it is.
    journeys, agreeing : int
        That bear on it; of these, that favour it.
    accept : bool
        Whether it is applied.
    """

    kind: Kind
    cells: tuple[str, ...] = ()
    offset_db: float = math.nan
    turn_deg: float = math.nan
    east_m: float = math.nan
    north_m: float = math.nan
    line_m: tuple[Place, ...] = ()
    half_width_m: float = math.nan
    log_bayes_factor: float = math.nan
    probability: float = math.nan
    journeys: int = 0
    agreeing: int = 0
    accept: bool = True


@dataclass(frozen=True)
class Patch:
    """Changes of one database.

    Parameters
    ----------
    crs : str
        Of places.
    database_sha256 : str
        Of the manifest of the database that the journeys were located with.
    journeys : int
        From which it was learned.
    changes : tuple of Change
    """

    crs: str
    database_sha256: str
    journeys: int
    changes: tuple[Change, ...]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Change(_Strict):
    kind: Kind
    cells: tuple[str, ...] = ()
    offset_db: Annotated[FiniteFloat, Field(ge=-60, le=60)] | None = None
    turn_deg: Annotated[FiniteFloat, Field(ge=-360, le=360)] | None = None
    east_m: FiniteFloat | None = None
    north_m: FiniteFloat | None = None
    line_m: tuple[tuple[FiniteFloat, FiniteFloat], ...] = ()
    half_width_m: Annotated[FiniteFloat, Field(gt=0, le=50)] | None = None
    log_bayes_factor: FiniteFloat | None = None
    probability: Annotated[FiniteFloat, Field(ge=0, le=1)] | None = None
    journeys: Annotated[int, Field(ge=0)] = 0
    agreeing: Annotated[int, Field(ge=0)] = 0
    accept: Annotated[bool, Field(strict=True)] = True


class _Patch(_Strict):
    format: Literal["mapfilter patch"]
    version: Literal[1]
    crs: str
    database_sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    journeys: Annotated[int, Field(ge=0)]
    change: tuple[_Change, ...] = ()


_NEEDS: dict[str, tuple[int, tuple[str, ...]]] = {
    "offset": (1, ("offset_db",)),
    "dead": (1, ()),
    "moved": (1, ("east_m", "north_m")),
    "turned": (1, ("turn_deg",)),
    "rotated": (2, ("turn_deg",)),
    "swapped": (2, ()),
    "way": (0, ("half_width_m",)),
}
"""Cells that a change names (``rotated``: at least), and the fields that it must have."""


def write_patch(patch: Patch, path: Path) -> None:
    """Write a patch as TOML that :func:`read_patch` reads back."""
    lines = [
        _HEAD,
        f"format = {json.dumps(FORMAT)}",
        f"version = {VERSION}",
        f"crs = {json.dumps(patch.crs)}",
        f"database_sha256 = {json.dumps(patch.database_sha256)}",
        f"journeys = {patch.journeys}",
    ]
    for change in patch.changes:
        lines += ["", f"# {_MEANING[change.kind]}", "[[change]]", *_lines(change)]
    with atomic_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _lines(change: Change) -> list[str]:
    found = []
    for one in fields(Change):
        value = getattr(change, one.name)
        if value == () or (isinstance(value, float) and math.isnan(value)):
            continue
        if isinstance(value, float):
            # Hundredths of a decibel and centimetres are more than journeys can tell.
            value = round(value, 6 if one.name == "probability" else 2)
        if one.name == "line_m":
            value = [[round(x, 2), round(y, 2)] for x, y in value]
        # Escapes of JSON in the ASCII form are pairs of surrogates, which TOML has not.
        text = json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        found.append(f"{one.name} = {text}")
    return found


def read_patch(path: Path) -> Patch:
    """Read a patch.

    Raises
    ------
    InputError
        With every fault: no TOML, another file, unknown keys, values out of range, fields that a
        change of its kind lacks.
    """
    data = read_input(path, _LARGEST_BYTES, "a patch")
    try:
        found = toml_values(data.decode())
    except (ValueError, RecursionError) as error:
        raise fail(InputError, str(path), "a patch in TOML", error, "edited, or cut off") from error
    if found.get("format") != FORMAT:
        hint = "another file"
        raise fail(InputError, f"{path}, format", repr(FORMAT), repr(found.get("format")), hint)
    try:
        whole = _Patch.model_validate(found)
    except ValidationError as error:
        raise InputError(tuple(_fault(path, detail) for detail in error.errors())) from None
    faults = Faults()
    for number, change in enumerate(whole.change, start=1):
        _check(change, f"{path}, change {number}", faults)
    faults.raise_if_any(InputError)
    return Patch(
        whole.crs,
        whole.database_sha256,
        whole.journeys,
        tuple(Change(**_known(change)) for change in whole.change),
    )


def check_patch(patch: Patch, database: RadioRouteDatabase, where: str) -> None:
    """Raise InputError where a patch is of another CRS, or names cells that a database lacks."""
    faults = Faults()
    if not same_crs(patch.crs, database.lattice.crs):
        expected = f"{shown_crs(database.lattice.crs)}, the database's"
        faults.add(f"{where}, crs", expected, shown_crs(patch.crs), "a patch of another area")
    for number, change in enumerate(patch.changes, start=1):
        for cell in change.cells:
            if cell not in database.plan:
                expected = "a cell of the database"
                faults.add(f"{where}, change {number}, cells", expected, repr(cell))
    faults.raise_if_any(InputError)


def _known(change: _Change) -> dict[str, Any]:
    return {name: value for name, value in change if value is not None}


def _check(change: _Change, where: str, faults: Faults) -> None:
    cells, needed = _NEEDS[change.kind]
    number = len(change.cells)
    if number != cells and not (change.kind == "rotated" and number > cells):
        more = " or more" if change.kind == "rotated" else ""
        faults.add(f"{where}, cells", f"{cells}{more} for {change.kind!r}", number)
    if len(set(change.cells)) < number:
        faults.add(f"{where}, cells", "each cell once", ", ".join(change.cells))
    for name in needed:
        if getattr(change, name) is None:
            faults.add(f"{where}, {name}", f"a value for {change.kind!r}", "none")
    if change.kind == "way" and len(change.line_m) < 2:
        faults.add(f"{where}, line_m", "two places or more", len(change.line_m))


def _fault(path: Path, detail: Any) -> Fault:
    place = [str(key + 1) if isinstance(key, int) else str(key) for key in detail["loc"]]
    expected = detail["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
    where = ", ".join([str(path), " ".join(place[:2]), *place[2:]])
    return Fault(where, expected, repr(detail["input"])[:80], "edited")


def accepted(changes: Sequence[Change]) -> tuple[Change, ...]:
    """Return the changes that are accepted."""
    return tuple(change for change in changes if change.accept)
