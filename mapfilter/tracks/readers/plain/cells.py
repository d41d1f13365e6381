"""Cells in a plain CSV: identities, carriers, levels and bars."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats
from mapfilter.radio.cell_layouts import OF_CARRIERS
from mapfilter.radio.identities import BARS_DBM, levels_of_bars, technology
from mapfilter.tracks.readers.plain.fields import FIELDS
from mapfilter.tracks.readers.plain.identities import cell_identities, roles
from mapfilter.tracks.readers.plain.mapped import Mapped
from mapfilter.tracks.readers.recorded.identities import add_radio, without_zeros
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.kept_rows import only
from mapfilter.tracks.readers.texts.numbers import MISSING

_IMPLIED = {**OF_CARRIERS, **dict.fromkeys(("eci", *FIELDS["enodeb"]), "LTE"), "nci": "NR"}
"""Technologies of columns: the carrier, or the identity, has a name of its own in each."""
_NONE = (*MISSING, "-1", "2147483647", "9223372036854775807")
"""Texts of columns of other technologies than a row's: missing ones, and Android's marks."""


def add_cells(mapped: Mapped, reading: Reading, time_s: Floats) -> None:
    """Add the rows that hold a cell or a level."""
    if not any(map(mapped.has, ("level_dbm", "bars", "ci", "cell", "cgi", "enodeb"))):
        return
    identity = without_zeros(cell_identities(mapped))
    columns = {
        **identity,
        "time_s": time_s,
        "level_dbm": _levels(mapped),
        "level_step_db": mapped.number("level_step_db"),
        **{name: mapped.whole(name) for name in ("arfcn", "bsic", "timing_advance")},
    }
    if (mapped.texts("technology") != "").any():
        columns["technology"] = mapped.rows.mapped(technology, *mapped.names("technology"))
    elif (implied := _implied(mapped)) is not None:
        columns["technology"] = implied
    if "rssi" in mapped.names("level_dbm") and "technology" in columns:
        # Of GSM it is the level, of others a sum over all cells.
        gsm = np.isnan(columns["level_dbm"]) & (columns["technology"] == "GSM")
        columns["level_dbm"] = np.where(gsm, mapped.rows.number("rssi"), columns["level_dbm"])
    if mapped.has("bars"):
        _add_bars(mapped, columns)
    cell = mapped.texts("cell")
    identified = (cell != "") | ~np.isnan(identity["ci"])
    there = identified | ~np.isnan(columns["level_dbm"])
    if (cell != "").any():
        columns["cell"] = cell
    columns["role"] = roles(mapped, identified)
    add_radio(reading, *only(columns, mapped.rows.line, there))


def _levels(mapped: Mapped) -> Floats:
    """Return levels, those of some technologies from columns of their own."""
    level = mapped.number("level_dbm")
    for name in mapped.columns("level_dbm")[1:]:
        level = np.where(np.isnan(level), mapped.rows.number(name), level)
    return level


def _implied(mapped: Mapped) -> np.ndarray | None:
    """Return the technology of each row by its columns' names; None if they state none.

    That of a row in which such a column holds something; None for the others, and where columns of
    several technologies do.
    """
    columns = [name for field in ("arfcn", "ci", "enodeb") for name in mapped.columns(field)]
    stating = [name for name in columns if name in _IMPLIED]
    if not stating:
        return None
    held = {
        family: np.any(
            [~mapped.rows.flags(name, true=_NONE) for name in stating if _IMPLIED[name] == family],
            axis=0,
        )
        for family in dict.fromkeys(_IMPLIED[name] for name in stating)
    }
    single = np.sum(list(held.values()), axis=0) == 1
    families = np.full(len(mapped.rows), None, dtype=object)
    for family, rows in held.items():
        families[rows & single] = family
    return families


def _add_bars(mapped: Mapped, columns: dict[str, np.ndarray]) -> None:
    """Give rows without a level that of their bars, as in LTE where the technology is unknown."""
    bars = mapped.number("bars")
    families = columns.get("technology", np.full(len(bars), None, dtype=object))
    families = np.array([one if one in BARS_DBM else "LTE" for one in families], dtype=object)
    names = ("level_dbm", "level_step_db", "censored")
    found = {name: columns.get(name, np.zeros(len(bars))).copy() for name in names}
    without = np.isnan(columns["level_dbm"])
    for family in BARS_DBM:
        of = without & (families == family)
        for name, values in zip(names, levels_of_bars(bars[of], family), strict=True):
            found[name][of] = values
    columns |= found
