"""NMEA 0183: the sentences of a file by their kind, those with right checksums."""

from __future__ import annotations

from collections.abc import Collection
from string import hexdigits

import numpy as np
from numpy.typing import NDArray

from mapfilter._types import Bools, Ints
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.lines import blocks

_LINE_FEED = 10
_DIGITS = np.array([int(c, 16) if (c := chr(i)) in hexdigits else -1 for i in range(256)])
_MANY, _NEARLY_ALL = 10, 0.95
"""Wrong checksums of a kind from which on they are the program's, and their least share."""

_Collected = tuple[list[bytes], list[Ints]]


def sentences(
    data: bytes, kinds: Collection[bytes], reading: Reading
) -> dict[bytes, tuple[list[bytes], Ints]]:
    """Return the sentences of some kinds with right checksums, and the line of each.

    Some programs write wrong checksums throughout: a kind of which nearly none is right is taken.

    Parameters
    ----------
    data : bytes
        Of the file.
    kinds : collection of bytes
        The last three letters of their names, such as RMC of GNRMC.
    reading : Reading
        Counts the lines, and those that are refused.

    Returns
    -------
    dict of bytes to (list of bytes, (N,) array of int)
        Parts of several sentences, separated by line feeds, and the lines of all N of them.
    """
    found: dict[bytes, _Collected] = {kind: ([], []) for kind in kinds}
    wrong: dict[bytes, _Collected] = {kind: ([], []) for kind in kinds}
    for block, first_line in blocks(memoryview(data), 1):
        code = np.frombuffer(block + b"\n   ", dtype=np.uint8)
        ends = np.flatnonzero(code == _LINE_FEED)
        starts = np.concatenate([[0], ends[:-1] + 1])
        number = first_line + np.arange(len(starts))
        dollar = _first(code == ord("$"), starts, ends)
        other = _first(code == ord("!"), starts, ends) >= 0
        blank = np.add.reduceat(code > ord(" "), np.minimum(starts, ends)) == 0
        blank |= starts == ends
        reading.rows += int((~blank).sum())
        reading.refuse(number[~blank & (dollar < 0) & ~other], "no NMEA sentence")
        # Of the talker and the kind, GNRMC, the last three letters.
        at = np.minimum(dollar[:, None] + [3, 4, 5], len(code) - 1)
        letters = np.where(dollar[:, None] >= 0, code[at], 0).astype(np.uint8)
        star = _last(code == ord("*"), starts, ends)
        star = np.where(star > dollar, star, -1)
        good = (star < 0) | (_given(code, star) == _total(code, dollar, star))
        stops = np.where(star < 0, ends, star)
        for kind in kinds:
            of = (letters == np.frombuffer(kind, dtype=np.uint8)).all(axis=1)
            for mask, (lines, numbers) in ((of & good, found[kind]), (of & ~good, wrong[kind])):
                if mask.any():
                    spans = zip((dollar[mask] + 1).tolist(), stops[mask].tolist(), strict=True)
                    lines.append(b"\n".join(block[first:last].strip() for first, last in spans))
                    numbers.append(number[mask])
    for kind, (lines, numbers) in wrong.items():
        count = sum(map(len, numbers))
        if count >= _MANY and count > _NEARLY_ALL * (count + sum(map(len, found[kind][1]))):
            reading.note(f"{kind.decode()}: nearly all {count} checksums are wrong; taken")
            found[kind] = (lines, numbers)
        else:
            reading.refuse(_joined(numbers), "checksum is wrong")
    return {kind: (lines, _joined(numbers)) for kind, (lines, numbers) in found.items()}


def _first(mask: Bools, starts: Ints, ends: Ints) -> Ints:
    """Return the first place of each line where a mask holds, -1 where there is none."""
    places = np.append(np.flatnonzero(mask), len(mask))
    found = places[np.searchsorted(places, starts)]
    return np.where(found < ends, found, -1)


def _last(mask: Bools, starts: Ints, ends: Ints) -> Ints:
    """Return the last place of each line where a mask holds, -1 where there is none."""
    places = np.concatenate([[-1], np.flatnonzero(mask)])
    found = places[np.searchsorted(places, ends) - 1]
    return np.where(found >= starts, found, -1)


def _given(code: NDArray[np.uint8], star: Ints) -> Ints:
    """Return the checksum of one or two hexadecimal digits after a star, -1 without one."""
    high, low = (_DIGITS[code[np.minimum(star + i, len(code) - 1)]] for i in (1, 2))
    return np.where(high < 0, -1, np.where(low < 0, high, 16 * high + low))


def _total(code: NDArray[np.uint8], dollar: Ints, star: Ints) -> Ints:
    """Return the exclusive or of all bytes between two places."""
    total = np.bitwise_xor.accumulate(code)
    return np.asarray(total[np.maximum(star, 1) - 1] ^ total[np.maximum(dollar, 0)], dtype=np.int64)


def _joined(numbers: list[Ints]) -> Ints:
    return np.concatenate(numbers) if numbers else np.zeros(0, dtype=np.int64)
