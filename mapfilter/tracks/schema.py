"""The tables of a track log: columns with units, ranges and likely mistakes, and kinds of readings.

Every table has ``time_s``, seconds after the log's start. Headings are radians counter-clockwise
from grid east; positions are metres in the log's projected CRS. :mod:`mapfilter.tracks.tables`
checks tables.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, nextafter, pi
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.radio.identities import NEIGHBOUR as NEIGHBOUR
from mapfilter.radio.identities import SERVING as SERVING
from mapfilter.radio.level_quantity import TENTHS, are_tenths, likely_of_positive

Kind = Literal["motion", "serving", "neighbour", "gnss", "pseudorange", "tdoa"]
"""Kinds of measurements that a log may hold, each in one table of :data:`TABLES`."""
Without = Literal["gnss", "fixes", "pseudoranges", "ta", "tdoa", "neighbours", "radio"]
"""What can be left out of a log: tables by their names, and parts of tables."""

SATELLITE = r"[GRECJIS]\d{2}"
"""A satellite's name as in RINEX: the letter of its constellation and two digits."""

PLACE = ("x_m", "y_m", "z_m")
"""Position of a satellite, earth-centred."""
LEAST_PLACE_M, MOST_PLACE_M = 2.0e7, 5.5e7
"""Distances of a satellite from the earth's centre that are possible."""

MISSING_SIGNS = (-9999.0, -99999.0, -999999.0)
"""Numbers by which other programs mean that a value is missing; here its field is empty."""

_TURN_RAD = 2 * pi + 1e-9
# 2.0**63 itself is one more than an int64 holds.
_LARGEST_ID = nextafter(2.0**63, 0.0)
_DEGREES, _SIGMA = "degrees given for radians", "metres in 0.001..100000"
_NANOSECONDS = "nanoseconds given for metres"
_RANGE_HINT = (
    "kilometres or seconds for metres, or times that are off by a leap second, by hours (time "
    "zone) or by weeks"
)


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a table: its inclusive range, and ``expected`` and ``hint`` of messages.

    Numbers are float64 (missing: NaN), integers nullable Int64, and text is None where missing.
    Columns that are ``required`` hold a value in every row; ``optional`` ones are only in tables
    in which they were given. Headings that wind may count on beyond a turn.
    ``mistake`` returns the hint where it depends on the values.
    """

    name: str
    low: float = -inf
    high: float = inf
    expected: str = "a finite number"
    hint: str = ""
    kind: Literal["number", "integer", "text"] = "number"
    required: bool = False
    optional: bool = False
    winds: bool = False
    mistake: Callable[[Floats], str] | None = None

    def likely(self, values: ArrayLike) -> str:
        """Return the likely mistake behind numbers out of range, by all that are given."""
        if self.mistake is None:
            return self.hint
        return self.mistake(np.atleast_1d(np.asarray(values, dtype=np.float64)))


@dataclass(frozen=True, slots=True)
class Table:
    """One table of a log.

    Parameters
    ----------
    kinds : tuple of str
        Kinds of measurements in its rows, by ``role`` where there are several; none for the truth.
    columns : tuple of Column
        In the order in which they are stored.
    optional : bool
        Whether it is stored only where it holds something.
    """

    kinds: tuple[Kind, ...]
    columns: tuple[Column, ...]
    optional: bool = False


def _level_mistake(levels: Floats) -> str:
    if (levels > 0).any():
        return likely_of_positive(levels)
    known = levels[np.isfinite(levels)]
    return TENTHS if known.size and are_tenths(known.min(), known.max()) else ""


def _text(name: str, expected: str, *, required: bool = False) -> Column:
    return Column(name, expected=expected, kind="text", required=required)


def _integer(name: str, low: float, high: float, expected: str) -> Column:
    return Column(name, low, high, expected, kind="integer")


_TIME = Column("time_s", -1e11, 1e11, "seconds", "milliseconds for s", required=True)
_EAST = Column("east_m", -1e8, 1e8, "metres east", required=True)
_NORTH = Column("north_m", -1e8, 1e8, "metres north", required=True)

TABLES: dict[str, Table] = {
    "motion": Table(
        ("motion",),
        (
            _TIME,
            Column("step_m", -1e6, 1e6, "metres"),
            Column(
                *("heading_rad", -_TURN_RAD, _TURN_RAD, "radians in -2π..2π", _DEGREES), winds=True
            ),
            Column("turn_rad", -_TURN_RAD, _TURN_RAD, "radians in -2π..2π", _DEGREES),
            Column("sampling_sd_m", 0, 1e6, "metres >= 0", optional=True),
        ),
    ),
    "radio": Table(
        ("serving", "neighbour"),
        (
            _TIME,
            _text("role", "serving or neighbour", required=True),
            _text("cell", "a cell id"),
            _integer("arfcn", 0, 3_279_165, "a carrier number"),
            _integer("bsic", 0, 1007, "a BSIC or PCI"),
            Column("level_dbm", -200, 0, "dBm in -200..0", mistake=_level_mistake),
            _integer("censored", -1, 1, "-1, 0 or 1"),
            replace(
                _integer("timing_advance", 0, 3846, "steps in 0..3846"), hint="metres for steps"
            ),
            replace(_text("technology", "GSM, UMTS, LTE or NR"), optional=True),
            Column("level_step_db", 0, 60, "dB in 0..60", optional=True),
            *(
                replace(_integer(name, 0, most, "a whole number >= 0"), optional=True)
                for name, most in (
                    ("mcc", 999),
                    ("mnc", 999),
                    ("lac", 2**24 - 1),
                    ("ci", 2**36 - 1),
                )
            ),
        ),
    ),
    "gnss": Table(
        ("gnss",),
        (
            _TIME,
            _EAST,
            _NORTH,
            Column("var_east_m2", 0, 1e16, "square metres in 0..1e16"),
            Column("var_north_m2", 0, 1e16, "square metres in 0..1e16"),
            Column("cov_east_north_m2", -1e16, 1e16, "square metres in -1e16..1e16"),
        ),
    ),
    "pseudoranges": Table(
        ("pseudorange",),
        (
            _TIME,
            _text("satellite", "a name such as G07 or E19", required=True),
            Column("pseudorange_m", 1.5e7, 6e7, "metres in 1.5e7..6e7", _RANGE_HINT),
            Column("sigma_m", 1e-3, 1e5, _SIGMA),
            *(Column(name, -6e7, 6e7, "metres from the earth's centre") for name in PLACE),
        ),
        optional=True,
    ),
    "tdoa": Table(
        ("tdoa",),
        (
            _TIME,
            _text("cell", "a cell id", required=True),
            _text("reference", "a cell id", required=True),
            Column("difference_m", -2e5, 2e5, "metres in -200000..200000", _NANOSECONDS),
            Column("sigma_m", 1e-3, 1e5, _SIGMA),
            Column("reference_sigma_m", 1e-3, 1e5, _SIGMA),
        ),
        optional=True,
    ),
    "truth": Table(
        (),
        (
            _TIME,
            _EAST,
            _NORTH,
            _integer("way_id", -_LARGEST_ID, _LARGEST_ID, "a way's number"),
        ),
    ),
}
"""The tables of a log, in the order in which they are stored.

Each is also a field of :class:`mapfilter.tracks.log.TrackLog`, and an argument of
:func:`mapfilter.tracks.log.make_log`.
"""

SCHEMA: dict[str, tuple[Column, ...]] = {name: table.columns for name, table in TABLES.items()}
"""The columns of each table, in the order in which they are stored."""

OPTIONAL = tuple(name for name, table in TABLES.items() if table.optional)
"""Tables that are stored only where they hold something."""

ALL_KINDS: frozenset[Kind] = frozenset(kind for table in TABLES.values() for kind in table.kinds)
"""All kinds of measurements."""
