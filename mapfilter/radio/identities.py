"""Radio technologies, the largest values of their identifiers, and global cell identities.

3GPP TS 23.003 (identities), 45.005 and 45.010 (GSM), 25.101 and 25.213 (UMTS), 36.101, 36.211 and
36.213 (LTE), 38.104, 38.211 and 38.213 (NR).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from mapfilter._constants import LIGHT_MPS
from mapfilter._types import Floats

LIMITS: dict[str, dict[str, int]] = {
    "GSM": {"arfcn": 1023, "bsic": 63, "lac": 65_535, "ci": 65_535, "timing_advance": 219},
    "UMTS": {"arfcn": 16_383, "bsic": 511, "lac": 65_535, "ci": 2**28 - 1},
    "LTE": {"arfcn": 262_143, "bsic": 503, "lac": 65_535, "ci": 2**28 - 1, "timing_advance": 1282},
    "NR": {
        "arfcn": 3_279_165,
        "bsic": 1007,
        "lac": 2**24 - 1,
        "ci": 2**36 - 1,
        "timing_advance": 3846,
    },
}
"""Largest values of carriers ``arfcn`` (ARFCN, UARFCN, EARFCN, NR-ARFCN), codes ``bsic`` (BSIC,
PSC, PCI), areas ``lac`` (LAC, TAC), identities ``ci`` (CI, ECI, NCI) and timing advances.
"""

UNAVAILABLE = (-1, 2**31 - 1, 2**63 - 1)
"""Numbers by which Android and programs mark what a phone does not know."""

SERVING, NEIGHBOUR = "serving", "neighbour"
"""Roles of reported cells."""

IDENTITY = ("mcc", "mnc", "lac", "ci")
"""Parts of a global cell identity."""
UNIQUE_IN_NETWORK = ("LTE", "NR")
"""Technologies whose cell identity is unique in a network, whatever the tracking area."""

TIMING_STEP_M = {"GSM": LIGHT_MPS * 48 / 13e6 / 2, "LTE": LIGHT_MPS * 16 / 30.72e6 / 2}
"""Distance of a step of timing advance: 553.5 m and 78.07 m; in NR it depends on the numerology."""

BARS_DBM: dict[str, tuple[float, float, float, float]] = {
    "GSM": (-107, -103, -97, -89),
    "UMTS": (-115, -105, -95, -85),
    "LTE": (-115, -105, -95, -85),
    "NR": (-110, -90, -80, -65),
}
"""Least level (RSSI, RSCP, RSRP, SS-RSRP) of one to four bars on Android, unless the operator has
set others."""

_NETWORK = re.compile(r"^(\d{3})(\d{2,3})(\D+\d+(?:\D+\d+)?)$", re.ASCII)
"""MCC and MNC as one number, before one or two others."""
_SPLIT = re.compile(r"[-_:;,/| .]+")
_FAMILIES = {
    "GSM": ("GSM", "GPRS", "EDGE", "2G"),
    "UMTS": ("UMTS", "WCDMA", "HSPA", "HSPA+", "HSPAP", "HSDPA", "HSUPA", "DC-HSPA", "3G"),
    "LTE": ("LTE", "LTE+", "LTE-A", "LTE_CA", "LTE CA", "4G", "4G+"),
    "NR": ("NR", "5G", "5G SA", "5G NSA", "5G-SA", "5G-NSA", "NR SA", "NR NSA", "NRNSA", "ENDC"),
    "CDMA": ("CDMA", "EVDO", "1XRTT", "EHRPD"),
    "TDSCDMA": ("TDSCDMA", "TD-SCDMA", "TD_SCDMA"),
    "WIFI": ("WIFI", "WLAN"),
    "BLE": ("BLE", "BEACON"),
}
_FAMILY = {word: family for family, words in _FAMILIES.items() for word in words}


def technology(word: str) -> str | None:
    """Return GSM, UMTS, LTE, NR, … for a word of a file; None where not known.

    Examples
    --------
    >>> [technology(word) for word in ("LTE+", "hspa", "4G", "?")]
    ['LTE', 'UMTS', 'LTE', None]
    """
    return _FAMILY.get(word.strip().upper())


def parted_network(text: str) -> str:
    """Return the text of an identity with MCC and MNC apart, where they are one number.

    Only where a text is known to be an identity: site, sector and carrier look alike.

    Examples
    --------
    >>> parted_network("26201-1234-5678"), parted_network("310410:9751830")
    ('262-01-1234-5678', '310-410:9751830')
    >>> parted_network("262-01-1234-5678")
    '262-01-1234-5678'
    """
    return _NETWORK.sub(r"\1-\2\3", text.strip())


def parse_cgi(text: str) -> tuple[int, int, int | None, int] | None:
    """Return mcc, mnc, lac and ci of a CGI ``MCC-MNC-LAC-CI``, or ECGI or NCGI ``MCC-MNC-CI``.

    Parts are decimal, with any separator; None for other texts. The lac of an ECGI is None.

    Examples
    --------
    >>> parse_cgi("262-01-1234-5678"), parse_cgi("302:720:9751830"), parse_cgi("B12-3")
    ((262, 1, 1234, 5678), (302, 720, None, 9751830), None)
    """
    words = [word for word in _SPLIT.split(text.strip()) if word]
    if len(words) not in (3, 4) or not all(w.isascii() and w.isdigit() for w in words):
        return None
    if max(map(len, words)) > 11:
        return None
    mcc, mnc, *area, ci = map(int, words)
    return mcc, mnc, area[0] if area else None, ci


def limit_fault(family: str | None, name: str, value: float | None) -> str:
    """Return what was expected of an identifier that a technology does not have, or ""."""
    most = LIMITS.get(family or "", {}).get(name)
    return f"0..{most} in {family}" if most is not None and (value or 0) > most else ""


def levels_of_bars(bars: Sequence[float] | Floats, family: str) -> tuple[Floats, Floats, Floats]:
    """Return the levels that bars mean: middle (dBm), width of the step (dB), and censoring.

    No bar is any level below the first threshold (censored -1), four bars any level from the last
    one on (censored 1), and both have no width. Other numbers give NaN.

    Examples
    --------
    >>> [part.tolist() for part in levels_of_bars([0, 1, 3, 4], "LTE")]
    [[-115.0, -110.0, -90.0, -85.0], [0.0, 10.0, 10.0, 0.0], [-1.0, 0.0, 0.0, 1.0]]
    """
    least = np.array(BARS_DBM[family], dtype=np.float64)
    low = np.concatenate([least[:1], least])
    high = np.concatenate([least, least[-1:]])
    given = np.asarray(bars, dtype=np.float64)
    known = np.isin(given, np.arange(5.0))
    at = np.where(known, given, 0).astype(np.int64)
    nothing = np.where(known, 0.0, np.nan)
    censored = (at == 4).astype(np.float64) - (at == 0)
    return (low + high)[at] / 2 + nothing, (high - low)[at] + nothing, censored + nothing
