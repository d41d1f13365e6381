"""Sentences of NMEA by hand: checksums, kinds and lines, and programs that write wrong ones."""

from functools import reduce
from pathlib import Path

import numpy as np
import pytest

from mapfilter.tracks.readers.nmea_sentences import sentences
from mapfilter.tracks.readers.recorded.reading import Reading


def total(text):
    return reduce(lambda a, b: a ^ b, text.encode(), 0)


def summed(text, by=0):
    """Return a sentence with its checksum, or one that differs by some bits."""
    return f"${text}*{total(text) ^ by:02X}"


def read(*lines, kinds=(b"RMC",)):
    reading = Reading(Path("a.nmea"))
    found = sentences("\n".join(lines).encode(), kinds, reading)
    refused = {why: np.concatenate(some).tolist() for why, some in reading._refused.items()}
    return {kind: (b"\n".join(part), at.tolist()) for kind, (part, at) in found.items()}, (
        refused,
        reading.rows,
        reading.notes,
    )


def test_sentences_of_a_kind_and_their_lines():
    """By the last three letters of their names, of any talker; `!` begins those of ships."""
    lines = ["", summed("GPRMC,1"), summed("GNRMC,2"), summed("GPGGA,3"), "!AIVDM,4", "text", " "]
    found, (refused, rows, notes) = read(*lines, kinds=(b"RMC", b"GGA", b"GSA"))
    assert found == {
        b"RMC": (b"GPRMC,1\nGNRMC,2", [2, 3]),
        b"GGA": (b"GPGGA,3", [4]),
        b"GSA": (b"", []),
    }
    assert refused == {"no NMEA sentence": [6]}
    assert (rows, notes) == (5, [])


@pytest.mark.parametrize(
    ("line", "is_right"),
    [
        (summed("GPRMC,1"), True),
        (summed("GPRMC,1").lower().replace("$gprmc", "$GPRMC"), True),
        (summed("GPRMC,1") + "  ", True),
        ("12:00:01 " + summed("GPRMC,1"), True),
        # A checksum may be missing, or a star stand before the sentence.
        ("$GPRMC,1", True),
        ("* $GPRMC,1", True),
        (summed("GPRMC,1", by=1), False),
        (summed("GPRMC,1", by=16), False),
        ("$GPRMC,1*", False),
        ("$GPRMC,1*G0", False),
        # The last star counts.
        (summed("GPRMC,*1"), True),
    ],
)
def test_checksums(line, is_right):
    found, (refused, _, _) = read(line)
    assert found[b"RMC"][1] == [1] * is_right
    assert refused == ({} if is_right else {"checksum is wrong": [1]})


def test_checksums_of_one_digit():
    """Some programs write 5 for 05; another digit is wrong."""
    text = "GPRMC,b"
    digit = total(text)
    assert digit == 5
    assert read(f"${text}*{digit}")[0][b"RMC"] == (text.encode(), [1])
    assert read(f"${text}*{digit}\n")[0][b"RMC"] == (text.encode(), [1])
    assert read(f"${text}*{digit ^ 1}")[0][b"RMC"] == (b"", [])
    assert read(f"${text}*{digit}0")[0][b"RMC"] == (b"", [])


@pytest.mark.parametrize(
    ("wrong", "right", "taken"),
    [
        # Ten or more of a kind, and more than 95 % of it.
        (10, 0, True),
        (9, 0, False),
        (19, 1, False),
        (20, 1, True),
    ],
)
def test_a_program_that_writes_wrong_checksums(wrong, right, taken):
    lines = [summed("GPRMC,right")] * right + [summed("GPRMC,wrong", by=3)] * wrong
    found, (refused, _, notes) = read(*lines, kinds=(b"RMC", b"GGA"))
    of_wrong = list(range(right + 1, right + wrong + 1))
    if taken:
        assert found[b"RMC"] == (b"\n".join([b"GPRMC,wrong"] * wrong), of_wrong)
        assert (refused, notes) == ({}, [f"RMC: nearly all {wrong} checksums are wrong; taken"])
    else:
        assert found[b"RMC"][1] == list(range(1, right + 1))
        assert (refused, notes) == ({"checksum is wrong": of_wrong}, [])
