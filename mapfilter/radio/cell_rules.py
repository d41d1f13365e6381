"""Allowed values of each field of a cell, and the mistake that a wrong value suggests."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapfilter.errors import Faults
from mapfilter.radio.identities import LIMITS, limit_fault
from mapfilter.radio.reported_power import ASSUMABLE

POINTED = ("sector", "3gpp")
"""Antennas that need an azimuth."""
ANTENNAS = (*POINTED, "omni")
"""Antennas given by formula; any other name is that of a pattern file."""
_LONGEST_ID = 128
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")


@dataclass(frozen=True, slots=True)
class Range:
    """An interval that a number must lie in, and others that suggest a mistake; NaN is in none."""

    low: float
    high: float
    unit: str = ""
    above_low: bool = False
    whole: bool = False
    mistakes: tuple[tuple[float, float, str], ...] = ()

    @property
    def expected(self) -> str:
        """The range in words."""
        kind = "a whole number" if self.whole else f"{self.unit or 'a number'}"
        if self.above_low:
            return f"{kind} > {self.low:g} and ≤ {self.high:g}"
        high = f"{self.high:.12g}" if self.whole else f"{self.high:g}"
        return f"{kind} in {self.low:g}..{high}"

    def hint(self, value: float) -> str:
        """Return the likely mistake behind a value that is not in the range, if one is known."""
        return next((text for low, high, text in self.mistakes if low <= value <= high), "")

    def holds(self, value: Any) -> bool:
        """Return whether ``value`` lies in the range."""
        if isinstance(value, bool) or not isinstance(value, int | float | np.number):
            return False
        inside = bool(self.low <= value <= self.high) and not (self.above_low and value == self.low)
        return inside and not (self.whole and value != int(value))


OFFSET = Range(-1000, 1000, "metres")
"""Of an antenna from its site, along east or north."""

RANGES: dict[str, Range] = {
    "east_m": Range(-1e8, 1e8, "finite metres"),
    "north_m": Range(-1e8, 1e8, "finite metres"),
    "height_m": Range(0, 1000, "metres", above_low=True, mistakes=((0, 0, "height left out"),)),
    "azimuth_deg": Range(
        *(0, 360, "degrees clockwise from true north"),
        mistakes=(
            (-180, 0, "counted from -180; add 360"),
            (360, 400, "gons given for degrees"),
        ),
    ),
    "downtilt_deg": Range(-90, 90, "degrees"),
    "mechanical_downtilt_deg": Range(-90, 90, "degrees"),
    "beamwidth_deg": Range(0, 360, "degrees", above_low=True),
    "vertical_beamwidth_deg": Range(0, 180, "degrees", above_low=True),
    "max_attenuation_db": Range(0, 100, "dB"),
    "side_lobe_db": Range(0, 100, "dB"),
    "eirp_dbm": Range(
        -30, 80, "dBm", mistakes=((80, np.inf, "watts or milliwatts given for dBm"),)
    ),
    "frequency_mhz": Range(
        *(100, 7000, "MHz"),
        mistakes=((0.1, 7, "GHz given for MHz"), (1e8, np.inf, "Hz given for MHz")),
    ),
    "penetration_loss_db": Range(0, 100, "dB"),
    "mcc": Range(0, 999, whole=True),
    "mnc": Range(0, 999, whole=True),
    "lac": Range(0, 2**24 - 1, whole=True),
    "ci": Range(0, 2**36 - 1, whole=True),
    "arfcn": Range(0, 3_279_165, whole=True, mistakes=((1e8, np.inf, "Hz given for a carrier"),)),
    "bsic": Range(0, 1007, whole=True),
}
"""The range of each numeric field of a cell."""

STATED = (*(name for name in RANGES if name not in ("east_m", "north_m")), "indoor")
"""Fields of a plan that one number may stand for in all cells without one."""
OPTIONAL = frozenset(
    {"azimuth_deg", "vertical_beamwidth_deg", "mcc", "mnc", "lac", "ci", "arfcn", "bsic"}
)
"""Numeric fields that may be None."""
TECHNOLOGIES = tuple(LIMITS)
"""Technologies of a cell that can be stated; they limit its identity, carrier and code."""
_LIMITED = ("arfcn", "bsic", "lac", "ci")


def id_fault(value: Any) -> tuple[str, str] | None:
    """Return (expected, found) when ``value`` is no id of a cell, else None.

    Ids become file names, so separators, ``..`` and control characters are refused.
    """
    expected = f"an id of 1..{_LONGEST_ID} characters without /, \\, .. and control characters"
    if wrong := _name_fault(value, expected):
        return wrong
    return (expected, repr(value)) if "/" in value or "\\" in value or ".." in value else None


def site_fault(value: Any) -> tuple[str, str] | None:
    """Return (expected, found) when ``value`` is no name of a site, else None."""
    return _name_fault(value, f"a name of 1..{_LONGEST_ID} characters without control characters")


def _name_fault(value: Any, expected: str) -> tuple[str, str] | None:
    if not isinstance(value, str):
        return expected, type(value).__name__
    if not value.strip():
        return expected, "nothing"
    if value != value.strip():
        return "no blanks around it", repr(value)
    if len(value) > _LONGEST_ID:
        return expected, f"{len(value)} characters"
    return (expected, repr(value)) if _CONTROL.search(value) else None


def check_fields(where: str, names: Iterable[str], known: Iterable[str], faults: Faults) -> None:
    """Note names that are none of the known fields, with the one that is probably meant."""
    listed = list(known)
    for name in names:
        if name not in listed:
            near = difflib.get_close_matches(name, listed, n=1)
            hint = f"{near[0]} meant" if near else ""
            expected = "fields of a cell" if near else f"fields of a cell ({', '.join(listed)})"
            faults.add(where, expected, repr(name), hint)


def antenna_fault(value: Any) -> tuple[str, str] | None:
    """Return (expected, found) when ``value`` names no antenna, else None.

    A pattern's name becomes a file name, so the rules of ids hold.
    """
    wrong = id_fault(value)
    if wrong is None:
        return None
    return f"{', '.join(ANTENNAS)}, or the name of a pattern file in one folder", wrong[1]


def assumed_fault(value: Any) -> tuple[str, str] | None:
    """Return (expected, found) when ``value`` names other fields than may be assumed, else None."""
    expected = f"nothing, or some of {', '.join(ASSUMABLE)} with blanks between them"
    if not isinstance(value, str):
        return expected, type(value).__name__
    return None if set(value.split()) <= set(ASSUMABLE) else (expected, repr(value))


def technology_faults(technology: Any, value: Callable[[str], Any]) -> list[tuple[str, str, Any]]:
    """Return (field, expected, found) of an unknown technology, or of what a known one lacks."""
    if technology is None:
        return []
    if technology not in TECHNOLOGIES:
        return [("technology", f"one of {', '.join(TECHNOLOGIES)}, or nothing", repr(technology))]
    limited = ((name, limit_fault(technology, name, value(name))) for name in _LIMITED)
    return [(name, expected, value(name)) for name, expected in limited if expected]


def looks_like_radians(azimuths: list[float]) -> bool:
    """Return whether azimuths are more likely radians than degrees.

    True when there are at least two different ones, none beyond 2π, and most are no whole or half
    numbers.
    """
    values = np.asarray(azimuths, dtype=np.float64)
    values = values[np.isfinite(values)]
    if len(np.unique(values)) < 2 or np.abs(values).max() > 2 * np.pi + 1e-6:
        return False
    fractional = np.abs(2 * values - np.round(2 * values)) > 1e-9
    return bool(fractional.mean() > 0.5)
