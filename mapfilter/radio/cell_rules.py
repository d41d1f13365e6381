"""What each field of a cell may hold, and the mistake that a wrong value suggests."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

POINTED = ("sector", "3gpp")
"""Antennas that need an azimuth."""
ANTENNAS = (*POINTED, "omni")
"""Antennas given by formula; any other name is that of a pattern file."""
_LONGEST_ID = 128
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")

Hint = Callable[[Any], str]


@dataclass(frozen=True, slots=True)
class Range:
    """An interval that a number must lie in, in words and in numbers; NaN lies in none."""

    low: float
    high: float
    unit: str = ""
    above_low: bool = False
    whole: bool = False
    hint: Hint = lambda _value: ""

    @property
    def expected(self) -> str:
        """The range in words."""
        kind = "a whole number" if self.whole else f"{self.unit or 'a number'}"
        if self.above_low:
            return f"{kind} > {self.low:g} and ≤ {self.high:g}"
        return f"{kind} in {self.low:g}..{self.high:g}"

    def holds(self, value: Any) -> bool:
        """Tell whether ``value`` lies in the range."""
        if isinstance(value, bool) or not isinstance(value, int | float | np.number):
            return False
        inside = bool(self.low <= value <= self.high) and not (self.above_low and value == self.low)
        return inside and not (self.whole and value != int(value))


def _frequency_hint(value: float) -> str:
    if value >= 1e8:
        return "Hz given for MHz"
    return "GHz given for MHz" if 0.1 <= value <= 7 else ""


def _eirp_hint(value: float) -> str:
    return "watts or milliwatts given for dBm" if value > 80 else ""


def _height_hint(value: float) -> str:
    return "height left out" if value == 0 else ""


def _arfcn_hint(value: float) -> str:
    return "EARFCN given for ARFCN" if value > 1023 else ""


def _azimuth_hint(value: float) -> str:
    return "counted from -180; add 360" if -180 <= value < 0 else ""


RANGES: dict[str, Range] = {
    "east_m": Range(-1e8, 1e8, "finite metres"),
    "north_m": Range(-1e8, 1e8, "finite metres"),
    "height_m": Range(0, 1000, "metres", above_low=True, hint=_height_hint),
    "azimuth_deg": Range(0, 360, "degrees clockwise from true north", hint=_azimuth_hint),
    "downtilt_deg": Range(-90, 90, "degrees"),
    "mechanical_downtilt_deg": Range(-90, 90, "degrees"),
    "beamwidth_deg": Range(0, 360, "degrees", above_low=True),
    "vertical_beamwidth_deg": Range(0, 180, "degrees", above_low=True),
    "max_attenuation_db": Range(0, 100, "dB"),
    "side_lobe_db": Range(0, 100, "dB"),
    "eirp_dbm": Range(-30, 80, "dBm", hint=_eirp_hint),
    "frequency_mhz": Range(100, 7000, "MHz", hint=_frequency_hint),
    "penetration_loss_db": Range(0, 100, "dB"),
    "mcc": Range(0, 999, whole=True),
    "mnc": Range(0, 999, whole=True),
    "lac": Range(0, 2**24 - 1, whole=True),
    "ci": Range(0, 2**36 - 1, whole=True),
    "arfcn": Range(0, 1023, whole=True, hint=_arfcn_hint),
    "bsic": Range(0, 63, whole=True),
}
"""The range of each numeric field of a cell."""

OPTIONAL = frozenset(
    {"azimuth_deg", "vertical_beamwidth_deg", "mcc", "mnc", "lac", "ci", "arfcn", "bsic"}
)
"""Numeric fields that may be None."""


def id_fault(value: Any) -> tuple[str, str] | None:
    """Return (expected, found) when ``value`` is no id of a cell or site, else None.

    Ids end up in file names and in tables, so separators, ``..`` and control characters are out.
    """
    expected = f"an id of 1..{_LONGEST_ID} characters without /, \\, .. and control characters"
    if not isinstance(value, str):
        return expected, type(value).__name__
    if not value.strip():
        return expected, "nothing"
    if value != value.strip():
        return "an id without blanks around it", repr(value)
    if len(value) > _LONGEST_ID:
        return expected, f"{len(value)} characters"
    if "/" in value or "\\" in value or ".." in value or _CONTROL.search(value):
        return expected, repr(value)
    return None


def antenna_fault(value: Any) -> tuple[str, str] | None:
    """Return (expected, found) when ``value`` names no antenna, else None.

    A pattern's name becomes a file name, so it has to be what an id has to be.
    """
    if isinstance(value, str) and value in ANTENNAS:
        return None
    wrong = id_fault(value)
    if wrong is None:
        return None
    return f"{', '.join(ANTENNAS)}, or the name of a pattern file in one folder", wrong[1]


def looks_like_radians(azimuths: list[float]) -> bool:
    """Tell whether azimuths are more likely radians than degrees.

    True when there are at least two different ones, none beyond 2π, and most are no whole or half
    numbers.
    """
    values = np.asarray(azimuths, dtype=np.float64)
    values = values[np.isfinite(values)]
    if len(np.unique(values)) < 2 or np.abs(values).max() > 2 * np.pi + 1e-6:
        return False
    fractional = np.abs(2 * values - np.round(2 * values)) > 1e-9
    return bool(fractional.mean() > 0.5)
