"""Technologies of cells in a plain CSV, in columns whose names may mean something else."""

from __future__ import annotations

from dataclasses import replace

from mapfilter.radio.identities import technology
from mapfilter.tracks.readers.plain.mapped import Mapped
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.numbers import MISSING

_MAYBE = (
    *("networktype", "network_technology", "access_technology", "radio_type", "radiotype"),
    *("cell_technology", "cell_type", "celltype", "nettype", "system", "mode", "type"),
)
_CELLS, _MOSTLY = ("cell", "cgi", "ci", "level_dbm", "bars"), 0.5
_UNKNOWN = frozenset(word.lower() for word in (*MISSING, "unknown"))


def with_technologies(mapped: Mapped, reading: Reading) -> Mapped:
    """Return columns with a type of cells as their technology, where its words are technologies.

    Beside cells without one; a column ``type`` may also hold roles, or kinds of antennas.
    """
    if mapped.has("technology") or not any(map(mapped.has, _CELLS)):
        return mapped
    owned = {column.lower() for column in mapped.own.values()}
    for name in _MAYBE:
        if mapped.rows.names.count(name) != 1 or name in owned:
            continue
        words = {str(word).strip() for word in set(mapped.rows.texts(name))}
        words = {word for word in words if word.lower() not in _UNKNOWN}
        meant = sum(technology(word) is not None for word in words)
        # Later parts of a large file are read as the first one.
        if meant > _MOSTLY * len(words) or reading.columns.get("technology") == name:
            reading.note(f"{name}: taken for the technology of cells, by its words")
            return replace(mapped, stated={**mapped.stated, "technology": name})
    return mapped
