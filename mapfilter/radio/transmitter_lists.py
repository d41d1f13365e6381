"""Columns of planning tools that state a field by other means: bands, node numbers, activity."""

from __future__ import annotations

import re
from collections.abc import Mapping

_INACTIVE = frozenset({"no", "n", "0", "false", "non", "nein", "nee", "faux", "falsch", "falso"})
CELLS_OF_NODE = 256
"""An E-UTRAN cell identity is that of the eNodeB, times 256, and the cell's own (TS 36.413)."""
_NUMBER = re.compile(r"\d+(?:[.,]\d+)?")
_LOWEST_MHZ, _HIGHEST_MHZ = 400, 6000


def band_mhz(name: str) -> float | None:
    """Return the frequency that a band is called by; None without exactly one.

    Examples
    --------
    >>> band_mhz("LTE 800"), band_mhz("E-UTRA 3 (1800 MHz)"), band_mhz("880-915"), band_mhz("B20")
    (800.0, 1800.0, None, None)
    """
    numbers = {float(text.replace(",", ".")) for text in _NUMBER.findall(name)}
    found = [number for number in numbers if _LOWEST_MHZ <= number <= _HIGHEST_MHZ]
    return found[0] if len(found) == 1 else None


def is_inactive(values: Mapping[str, str]) -> bool:
    """Return whether a row is that of a transmitter that is switched off."""
    return values.get("active", "").casefold() in _INACTIVE


def stated_otherwise(values: Mapping[str, str]) -> dict[str, str]:
    """Return the fields that a row lacks and that its other columns state.

    Examples
    --------
    >>> stated_otherwise({"enodeb": "4001", "cell_number": "7", "band": "LTE 800"})
    {'frequency_mhz': '800', 'ci': '1024263'}
    >>> stated_otherwise({"cell_number": "30417"}), stated_otherwise({"cell_number": "S1_1"})
    ({'ci': '30417'}, {})
    """
    found = {}
    frequency = values.get("frequency_mhz", "")
    # A column of bands that is named for the frequency has words, where a number has none.
    named = any(map(str.isalpha, frequency))
    band = frequency if named else values.get("band", "")
    if (named or not frequency) and (mhz := band_mhz(band)) is not None:
        found["frequency_mhz"] = f"{mhz:g}"
    node, number = (_whole(values.get(name, "")) for name in ("enodeb", "cell_number"))
    if not values.get("ci") and number is not None:
        of_node = node is not None and number < CELLS_OF_NODE
        found["ci"] = str(CELLS_OF_NODE * node + number if of_node and node else number)
    return found


def _whole(text: str) -> int | None:
    return int(text) if text.isascii() and text.isdigit() else None
