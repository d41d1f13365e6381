"""Abbreviated zones behind times, such as CEST: as offsets from UTC where only one is meant."""

from __future__ import annotations

import re
from datetime import datetime
from zoneinfo import ZoneInfo

import pyarrow as pa
import pyarrow.compute as pc

from mapfilter.clocks.local_times import parse_zone

_OFFSETS = {
    **dict.fromkeys(("WET",), "+00:00"),
    **dict.fromkeys(("CET", "WEST", "MEZ"), "+01:00"),
    **dict.fromkeys(("CEST", "EET", "MESZ", "SAST"), "+02:00"),
    **dict.fromkeys(("EEST", "MSK"), "+03:00"),
    **dict.fromkeys(("JST", "KST"), "+09:00"),
    **dict.fromkeys(("AEST",), "+10:00"),
    **dict.fromkeys(("AEDT",), "+11:00"),
    **dict.fromkeys(("NZST",), "+12:00"),
    **dict.fromkeys(("NZDT",), "+13:00"),
    **dict.fromkeys(("EDT",), "-04:00"),
    **dict.fromkeys(("PDT",), "-07:00"),
    **dict.fromkeys(("AKDT",), "-08:00"),
    **dict.fromkeys(("AKST",), "-09:00"),
}
"""Names that the time zone database (and in German the law) has for one offset only."""
_SEVERAL = {
    "AST": "America/Halifax",
    "BST": "Europe/London",
    "CDT": "America/Chicago",
    "CST": "America/Chicago or Asia/Shanghai",
    "EST": "America/New_York",
    "HST": "Pacific/Honolulu",
    "IST": "Asia/Kolkata, Asia/Jerusalem or Europe/Dublin",
    "MDT": "America/Denver",
    "MST": "America/Denver",
    "PKT": "Asia/Karachi",
    "PST": "America/Los_Angeles",
    "SGT": "Asia/Singapore",
    "WIB": "Asia/Jakarta",
}
"""Names that several zones have, or had, and a zone or some that may be meant."""
_BEHIND = r"^(?P<time>.*\d)\s*\b(?P<name>[A-Z]{3,4}|[A-Z]{5})$"
_NAME = re.compile(r"\d\s*\b([A-Z]{3,5})$", re.ASCII)
_KNOWN = ("UTC", "GMT")
_YEAR = 2026


def with_offsets(column: pa.ChunkedArray, zone: str) -> tuple[pa.ChunkedArray, list[str]]:
    """Return texts of times with offsets for the names of zones behind them, and notes on these.

    A name that several zones have is replaced where the given zone has it.

    Parameters
    ----------
    column : pyarrow.ChunkedArray of str
        Without blanks around.
    zone : str
        As of ``--zone``; "" for none.

    Examples
    --------
    >>> found, notes = with_offsets(pa.chunked_array([["2026-05-13 10:00:00 CEST"]]), "")
    >>> found.to_pylist(), notes
    (['2026-05-13 10:00:00+02:00'], ['time: CEST taken for UTC+02:00'])
    >>> with_offsets(pa.chunked_array([["2026-05-13 10:00:00 EST"]]), "")[0].to_pylist()
    ['2026-05-13 10:00:00 EST']
    """
    names = pc.struct_field(pc.extract_regex(column, _BEHIND), "name")
    notes = []
    for name in sorted(set(pc.unique(names).to_pylist()) - {None, *_KNOWN}):
        if offset := _OFFSETS.get(name) or _names_of(zone).get(name, ""):
            column = pc.replace_substring_regex(column, rf"\s*\b{name}$", offset)
            notes.append(f"time: {name} taken for UTC{offset}")
    return column, notes


def named_zone_hint(text: str) -> str:
    """Return what to do about a time with the name of a zone that is not read; "" for others.

    Examples
    --------
    >>> named_zone_hint("2026-05-13 10:00:00 EST")
    'EST is of several zones; --zone America/New_York, or write the offset (10:00:00-05:00)'
    """
    found = _NAME.search(text.strip())
    if found is None or found[1] in (*_KNOWN, *_OFFSETS):
        return ""
    name = found[1]
    if name in _SEVERAL:
        return (
            f"{name} is of several zones; --zone {_SEVERAL[name]}, or write the offset "
            "(10:00:00-05:00)"
        )
    return f"{name} is no known zone; write the offset (10:00:00+02:00)"


def _names_of(zone: str) -> dict[str, str]:
    """Return the names of a zone's times in a year, by their offsets."""
    rules = parse_zone(zone) if zone else None
    found = {}
    for month in (1, 7) if isinstance(rules, ZoneInfo) else ():
        moment = datetime(_YEAR, month, 1, tzinfo=rules)
        offset = f"{moment:%z}"
        found[moment.tzname() or ""] = f"{offset[:3]}:{offset[3:5]}"
    return found
