"""The columns of a track log's tables: types, units, ranges and likely mistakes.

Every table has ``time_s``, seconds after the log's start. Headings are radians counter-clockwise
from grid east; positions are metres in the log's projected CRS.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

TABLES = ("motion", "radio", "gnss", "pseudoranges", "tdoa", "truth")
"""The tables of a log, in the order in which they are stored."""

OPTIONAL = ("pseudoranges", "tdoa")
"""Tables that are stored only where they hold something."""

SATELLITE = r"[GRECJIS]\d{2}"
"""A satellite's name as in RINEX: the letter of its constellation and two digits."""

SERVING = "serving"
NEIGHBOUR = "neighbour"

MISSING_SIGNS = (-9999.0, -99999.0, -999999.0)
"""Numbers by which other programs mean that a value is missing; here its field is empty."""

_TURN_RAD = 2 * np.pi + 1e-9
# 2.0**63 itself is one more than an int64 holds.
_LARGEST_ID = float(np.nextafter(2.0**63, 0.0))


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a table.

    Parameters
    ----------
    name : str
        With its unit.
    kind : {"number", "integer", "text"}
        A float64 (missing: NaN), a nullable Int64, or text (missing: None).
    required : bool
        Whether the column must be there and hold a value in every row.
    low, high : float
        Inclusive range of a value.
    expected, hint : str
        What an error message says of a value outside the range.
    """

    name: str
    kind: Literal["number", "integer", "text"] = "number"
    required: bool = False
    low: float = -np.inf
    high: float = np.inf
    expected: str = "a finite number"
    hint: str = ""


_TIME = Column(
    "time_s", required=True, low=-1e11, high=1e11, expected="seconds", hint="milliseconds for s"
)
_EAST = Column("east_m", required=True, low=-1e8, high=1e8, expected="metres east")
_NORTH = Column("north_m", required=True, low=-1e8, high=1e8, expected="metres north")

SCHEMA: dict[str, tuple[Column, ...]] = {
    "motion": (
        _TIME,
        Column("step_m", low=-1e6, high=1e6, expected="metres"),
        Column(
            "heading_rad",
            low=-_TURN_RAD,
            high=_TURN_RAD,
            expected="radians in -2π..2π",
            hint="degrees given for radians",
        ),
        Column(
            "turn_rad",
            low=-_TURN_RAD,
            high=_TURN_RAD,
            expected="radians in -2π..2π",
            hint="degrees given for radians",
        ),
    ),
    "radio": (
        _TIME,
        Column("role", kind="text", required=True, expected="serving or neighbour"),
        Column("cell", kind="text", expected="a cell id"),
        Column("arfcn", kind="integer", low=0, high=3_279_165, expected="a carrier number"),
        Column("bsic", kind="integer", low=0, high=1007, expected="a BSIC or PCI"),
        Column(
            "level_dbm",
            low=-200,
            high=0,
            expected="dBm in -200..0",
            hint="raw RXLEV given for dBm",
        ),
        Column("censored", kind="integer", low=-1, high=1, expected="-1, 0 or 1"),
        Column("timing_advance", kind="integer", low=0, high=3846, expected="steps >= 0"),
    ),
    "gnss": (
        _TIME,
        _EAST,
        _NORTH,
        Column("var_east_m2", low=0, expected="square metres >= 0"),
        Column("var_north_m2", low=0, expected="square metres >= 0"),
        Column("cov_east_north_m2", expected="square metres"),
    ),
    "pseudoranges": (
        _TIME,
        Column("satellite", kind="text", required=True, expected="a name such as G07 or E19"),
        Column(
            "pseudorange_m",
            low=1.5e7,
            high=6e7,
            expected="metres in 1.5e7..6e7",
            hint="kilometres or seconds for metres, or a leap second or week in the times",
        ),
        Column("sigma_m", low=1e-3, high=1e5, expected="metres in 0.001..100000"),
        *(
            Column(name, low=-6e7, high=6e7, expected="metres from the earth's centre")
            for name in ("x_m", "y_m", "z_m")
        ),
    ),
    "tdoa": (
        _TIME,
        Column("cell", kind="text", required=True, expected="a cell id"),
        Column("reference", kind="text", required=True, expected="a cell id"),
        Column(
            "difference_m",
            low=-2e5,
            high=2e5,
            expected="metres in -200000..200000",
            hint="nanoseconds given for metres",
        ),
        Column("sigma_m", low=1e-3, high=1e5, expected="metres in 0.001..100000"),
        Column("reference_sigma_m", low=1e-3, high=1e5, expected="metres in 0.001..100000"),
    ),
    "truth": (
        _TIME,
        _EAST,
        _NORTH,
        Column(
            "way_id", kind="integer", low=-_LARGEST_ID, high=_LARGEST_ID, expected="a way's number"
        ),
    ),
}
"""The columns of each table, in the order in which they are stored."""
