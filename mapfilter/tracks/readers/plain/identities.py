"""Identities of cells in a plain CSV: decimal or hexadecimal parts, one text, nodes and sectors."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.radio.identities import IDENTITY
from mapfilter.radio.transmitter_lists import CELLS_OF_NODE
from mapfilter.tracks.readers.plain.mapped import Mapped
from mapfilter.tracks.readers.recorded.identities import available, parse_identities

_HEX = re.compile(r"[0-9A-F]{1,9}", re.ASCII | re.IGNORECASE)
_LEAST_LETTERS = 0.5
"""Share of different numbers with a letter: of hexadecimal ones of four digits 0.85 have one."""
_LARGEST_MCC = 999


def cell_identities(mapped: Mapped) -> dict[str, Floats]:
    """Return mcc, mnc, lac and ci of each row, NaN where missing.

    A cell of an eNodeB, given by the numbers of both, has the identity of LTE that these make. What
    a text of an identity holds fills what has no column of its own.
    """
    mapped = _without_hexadecimals(_with_whole_networks(mapped))
    identity = {name: mapped.whole(name) for name in IDENTITY}
    identity |= _networks(identity["mcc"], identity["mnc"])
    for name in {"eci", "nci"}.intersection(mapped.columns("ci")[1:]):
        # Beside a whole identity a small number is that of the cell within its node.
        whole = available(*mapped.rows.whole(name))
        small = (identity["ci"] < CELLS_OF_NODE) & (whole >= CELLS_OF_NODE)
        identity["ci"] = np.where(small, whole, identity["ci"])
    if mapped.has("enodeb"):
        identity["ci"] = _of_nodes(mapped, identity["ci"])
    if mapped.has("cgi"):
        texts = mapped.texts("cgi")
        given = parse_identities(texts)
        _note_others(mapped, "cgi", texts, np.isnan(given["ci"]), "identities (262-01-1234-5678)")
        identity = {
            name: np.where(np.isnan(values), given[name], values)
            for name, values in identity.items()
        }
    return identity


def roles(mapped: Mapped, identified: Bools) -> np.ndarray:
    """Return the role of each row: as it is stated, else serving where a cell is identified."""
    stated = mapped.rows.mapped(_role, *mapped.names("role"))
    others = np.array([role is None for role in stated], dtype=bool)
    texts = mapped.texts("role")
    _note_others(mapped, "role", texts, others, "roles (serving, neighbour)")
    serving = np.asarray(stated == "serving", dtype=bool)
    serving |= identified & np.asarray(stated != "neighbour", dtype=bool)
    return np.array(["neighbour", "serving"], dtype=object)[serving.astype(np.int64)]


def _role(word: str) -> str | None:
    """Return the role that a word means, "" where it is missing, None for other words."""
    word = word.strip().lower()
    known = {"": "", "serving": "serving", "s": "serving", "n": "neighbour"}
    known |= dict.fromkeys(("true", "yes", "1"), "serving")
    known |= dict.fromkeys(("false", "no", "0"), "neighbour")
    known |= dict.fromkeys(("neighbour", "neighbor", "neighboring", "neighbouring"), "neighbour")
    return known.get(word)


def _without_hexadecimals(mapped: Mapped) -> Mapped:
    """Return columns whose hexadecimal numbers without a mark have one."""
    rows = mapped.rows
    for field in ("lac", "ci"):
        for name in mapped.columns(field):
            every = {word.strip() for word in set(rows.texts(name))}
            # Other words stand for missing values.
            words = {word for word in every if _HEX.fullmatch(word) or re.search(r"\d", word)}
            if not words or not all(map(_HEX.fullmatch, words)):
                continue
            note = f"{name}: taken for hexadecimal numbers"
            letters = sum(not word.isdigit() for word in words)
            # Later parts of a large file may hold few of them.
            if letters >= _LEAST_LETTERS * len(words) or note in rows.reading.notes:
                rows = rows.rewritten(r"^\s*([0-9A-Fa-f]+)\s*$", r"0x\1", name)
                rows.reading.note(note)
    return replace(mapped, rows=rows)


def _with_whole_networks(mapped: Mapped) -> Mapped:
    """Return columns whose codes of country and network are one number, as 24491 for 244-91."""
    rows = mapped.rows
    for name in mapped.columns("mcc"):
        rows = rows.rewritten(r"^\s*(\d{3})[-/_ ,.](\d{1,3})\s*$", r"\1\2", name)
    return replace(mapped, rows=rows)


def _networks(number: Floats, mnc: Floats) -> dict[str, Floats]:
    """Return mcc and mnc of numbers that hold both: an mcc of three digits, and the others."""
    both = np.isnan(mnc) & (number > _LARGEST_MCC)
    digits = np.select([number >= 100_000, number >= 10_000], [1000.0, 100.0], 10.0)
    network = {"mcc": np.where(both, number // digits, number)}
    return network | {"mnc": np.where(both, number % digits, mnc)}


def _of_nodes(mapped: Mapped, ci: Floats) -> Floats:
    """Return identities made of those of nodes and their cells, where they are not whole."""
    node = mapped.whole("enodeb")
    cell = np.where(np.isnan(mapped.whole("sector")), ci, mapped.whole("sector"))
    parts = (node > 0) & (cell >= 0) & (cell < CELLS_OF_NODE)
    return np.where(parts & ~(ci >= CELLS_OF_NODE), CELLS_OF_NODE * node + cell, ci)


def _note_others(
    mapped: Mapped, field: str, texts: np.ndarray, others: Bools, expected: str
) -> None:
    """Note the texts of a field that are not understood."""
    others = others & (texts != "")
    if others.any():
        at = int(np.argmax(others))
        first = f"first {str(texts[at])[:40]!r} in line {mapped.rows.line[at]}"
        name = mapped.rows.find(*mapped.names(field))
        mapped.rows.reading.count(
            lambda n: (
                f"{name}: {number_of(n, 'value is', 'values are')} no {expected}, "
                f"taken as missing ({first})"
            ),
            int(others.sum()),
            key=f"{name}, no {expected}",
            source=int(mapped.rows.line[0]),
            ignored=True,
        )
