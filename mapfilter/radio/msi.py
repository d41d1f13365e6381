"""Antenna pattern files in the format of MSI Planet (``.msi``, ``.pln``).

One text file holds a header of keywords and two cuts, ``HORIZONTAL n`` and ``VERTICAL n``, each
followed by n lines of angle and loss. Losses are dB below the strongest direction and positive.
Horizontal angles count clockwise from boresight, vertical ones from the horizon in front downwards.
GAIN is in dBd unless dBi is written.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mapfilter._inputs import read_input
from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cell_rules import ANTENNAS, antenna_fault

DBI_OVER_DBD = 2.15
"""Gain of a half-wave dipole over an isotropic antenna, in dB."""

_LARGEST_BYTES = 1 << 20
_LONGEST_VALUE = 200
_SUFFIXES = (".msi", ".pln", ".txt")
_FEWEST_POINTS, _MOST_POINTS = 36, 7200
_LARGEST_GAP_DEG = 15.0
_LARGEST_LOSS_DB = 200.0
_SECTIONS = ("HORIZONTAL", "VERTICAL")
_REAL = r"\d{1,15}+(?:\.\d{1,30}+)?"
_GAIN = re.compile(rf"([+-]?{_REAL})\s{{0,9}}\(?\s{{0,9}}(dbd|dbi)?\s{{0,9}}\)?", re.I | re.A)
_FREQUENCY = re.compile(
    rf"({_REAL})(?:\s{{0,9}}-\s{{0,9}}({_REAL}))?\s{{0,9}}(mhz|ghz)?", re.I | re.A
)
_TILT = re.compile(rf"([+-]?{_REAL})\b.*", re.A)


def read_antennas(folder: Path | str, names: Iterable[str]) -> dict[str, MeasuredAntenna]:
    """Read the antennas that cells name from one folder.

    A name is that of a file in the folder, with or without ``.msi``, ``.pln`` or ``.txt``, in small
    or capital letters; the names of antennas by formula are ignored.

    Raises
    ------
    InputError
        The folder or a file is missing, a name leads out of the folder, or a file is damaged; with
        every fault of every file.
    """
    folder = Path(folder)
    wanted = sorted(set(names) - set(ANTENNAS))
    faults, inside = Faults(), folder.resolve()
    try:
        files = {file.name: file for file in sorted(folder.iterdir()) if file.is_file()}
    except OSError as error:
        hint = "no folder of antennas there"
        raise fail(InputError, str(folder), "a folder", error.strerror or error, hint) from error
    by_lower = {name.lower(): file for name, file in files.items()}
    found: dict[str, MeasuredAntenna] = {}
    for name in wanted:
        file = files.get(name)
        for suffix in ("", *_SUFFIXES):
            file = file or by_lower.get(name.lower() + suffix)
        if (wrong := antenna_fault(name)) is not None:
            faults.add(str(folder), *wrong)
        elif file is None:
            near = difflib.get_close_matches(name, list(files), n=1, cutoff=0.5)
            hint = f"{near[0]} meant" if near else "another folder"
            faults.add(str(folder), f"a pattern file {name}", "none", hint)
        elif not file.resolve().is_relative_to(inside):
            faults.add(str(file), "a file in this folder", "a link out of it")
        else:
            try:
                found[name] = read_msi(file)
            except InputError as error:
                faults.found.extend(error.faults)
    faults.raise_if_any(InputError)
    return found


def read_msi(path: Path | str) -> MeasuredAntenna:
    """Read one antenna.

    The electrical downtilt is the value of ``ELECTRICAL_TILT``, else the number after ``TILT``;
    where ``TILT`` is just the word ``ELECTRICAL``, it is where the vertical cut is strongest. A
    vertical cut whose beam lies as far above the horizon as that tilt is below was counted upwards:
    it is turned over, with a note.
    """
    path = Path(path)
    header, cuts = _sections(path)
    faults = Faults()
    parsed = {name: _cut(path, name, cuts.get(name), faults) for name in _SECTIONS}
    gain_dbi = _gain_dbi(path, header, faults)
    frequency_mhz = _frequency_mhz(path, header, faults)
    faults.raise_if_any(InputError)
    horizontal, vertical = parsed["HORIZONTAL"], parsed["VERTICAL"]
    downtilt_deg = _downtilt_deg(header, vertical)
    notes: tuple[str, ...] = ()
    if _counted_upwards(vertical, downtilt_deg):
        vertical = _sorted_cut(-vertical[0], vertical[1])
        notes = (f"{path}: the vertical cut counts upwards and was turned over",)
    name = header.get("NAME") or path.stem
    return MeasuredAntenna(
        name, *horizontal, *vertical, downtilt_deg, gain_dbi, frequency_mhz, notes=notes
    )


Row = tuple[int, list[str]]


def _sections(path: Path) -> tuple[dict[str, str], dict[str, tuple[int, str, list[Row]]]]:
    """Split a file into its keywords and, by name, each cut's first row, count and rows."""
    data = read_input(path, _LARGEST_BYTES, "an antenna")
    if b"\0" in data:
        raise fail(InputError, str(path), "text", "NUL characters", "no text file, or UTF-16")
    # Comments hold degree signs in any code page; all that counts is ASCII.
    text = data.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    header: dict[str, str] = {}
    cuts: dict[str, tuple[int, str, list[Row]]] = {}
    rows: list[Row] | None = None
    for line, content in enumerate(text.splitlines(), start=1):
        words = content.split()
        if not words:
            continue
        key = words[0].upper()
        if key in _SECTIONS and key not in cuts:
            rows = []
            cuts[key] = (line, " ".join(words[1:]), rows)
        elif rows is not None and not key[0].isalpha():
            if len(rows) <= _MOST_POINTS:
                rows.append((line, words))
        elif key in _SECTIONS:
            raise fail(InputError, f"{path} row {line}", f"one {key}", "another")
        else:
            rows = None
            header.setdefault(key, " ".join(words[1:])[:_LONGEST_VALUE])
    return header, cuts


def _cut(
    path: Path, name: str, cut: tuple[int, str, list[Row]] | None, faults: Faults
) -> tuple[Floats, Floats]:
    """Return the angles, rising within [0, 360), and losses of a cut."""
    empty = np.zeros(0), np.zeros(0)
    if cut is None:
        faults.add(str(path), f"a line {name} 360", "none", "cut off, or no MSI Planet file")
        return empty
    line, stated, rows = cut
    where = f"{path} row {line}, {name}"
    expected = f"{_FEWEST_POINTS}..{_MOST_POINTS} points"
    if not re.fullmatch(r"[0-9]{1,5}", stated) or not _FEWEST_POINTS <= int(stated) <= _MOST_POINTS:
        faults.add(where, expected, repr(stated[:40]))
        return empty
    if len(rows) != int(stated):
        hint = "the file is cut off" if len(rows) < int(stated) else "a wrong count"
        faults.add(where, f"{stated} lines of angle and loss", str(len(rows)), hint)
        return empty
    before = len(faults.found)
    values = [_pair(f"{path} row {at}", words, faults) for at, words in rows]
    if len(faults.found) > before:
        return empty
    angle_deg, loss_db = (np.array(column) for column in zip(*values, strict=True))
    if (loss_db <= 0).all() and (loss_db < 0).any():
        faults.add(where, "losses, 0 or more", "none above 0", "gains given for losses")
    elif not ((loss_db >= 0) & (loss_db <= _LARGEST_LOSS_DB)).all():
        row = rows[int(np.argmax((loss_db < 0) | (loss_db > _LARGEST_LOSS_DB)))]
        hint = "gains given for losses" if loss_db.min() < 0 else ""
        expected = f"a loss in 0..{_LARGEST_LOSS_DB:g} dB"
        faults.add(f"{path} row {row[0]}", expected, row[1][1][:40], hint)
    angle_deg, loss_db = _sorted_cut(angle_deg, loss_db)
    gaps_deg = np.diff(angle_deg, append=angle_deg[0] + 360.0)
    if gaps_deg.max() > _LARGEST_GAP_DEG:
        hint = "half a cut" if gaps_deg.max() >= 90 else "angles left out"
        faults.add(where, "angles all around", f"a gap of {gaps_deg.max():g}°", hint)
    return angle_deg, loss_db


def _pair(where: str, words: list[str], faults: Faults) -> tuple[float, float]:
    """Return an angle and a loss; NaN where they are faulty."""
    try:
        angle, loss = (float(word if word.isascii() and "_" not in word else "?") for word in words)
    except ValueError:
        text = " ".join(words)
        hint = "a decimal comma" if "," in text else ""
        faults.add(where, "an angle and a loss", repr(text[:40]), hint)
        return math.nan, math.nan
    if not (abs(angle) <= 360 and math.isfinite(loss)):
        faults.add(where, "an angle in -360..360 and a finite loss", " ".join(words)[:40])
    return angle, loss


def _sorted_cut(angle_deg: Floats, loss_db: Floats) -> tuple[Floats, Floats]:
    """Bring angles into [0, 360), rising; of equal ones, such as 0 and 360, the first counts."""
    wrapped, first = np.unique(np.mod(angle_deg, 360.0) % 360.0, return_index=True)
    return wrapped, loss_db[first]


def _gain_dbi(path: Path, header: dict[str, str], faults: Faults) -> float | None:
    text = header.get("GAIN", "")
    if not text:
        return None
    match = _GAIN.fullmatch(text.strip())
    if match is None or not -20 <= (gain := float(match[1])) <= 60:
        faults.add(f"{path}, GAIN", "a gain in -20..60 with dBd or dBi", repr(text[:40]))
        return None
    return gain if (match[2] or "").lower() == "dbi" else gain + DBI_OVER_DBD


def _frequency_mhz(path: Path, header: dict[str, str], faults: Faults) -> float | None:
    """Return the frequency, of a band its middle."""
    text = header.get("FREQUENCY", "")
    if not text:
        return None
    match, value = _FREQUENCY.fullmatch(text.strip()), math.nan
    if match is not None:
        scale = 1000.0 if (match[3] or "").lower() == "ghz" else 1.0
        value = (scale * float(match[1]) + scale * float(match[2] or match[1])) / 2
    if not 10 <= value <= 1e5:
        hint = "GHz or Hz given for MHz" if match else ""
        faults.add(f"{path}, FREQUENCY", "MHz in 10..100000", repr(text[:40]), hint)
        return None
    return value


def _downtilt_deg(header: dict[str, str], vertical: tuple[Floats, Floats]) -> float:
    for key in ("ELECTRICAL_TILT", "TILT"):
        match = _TILT.fullmatch(header.get(key, "").strip())
        if match is not None and abs(float(match[1])) <= 90:
            return float(match[1])
    if header.get("TILT", "").upper().startswith("ELECTRICAL"):
        strongest_deg = float(vertical[0][np.argmin(vertical[1])])
        return strongest_deg if strongest_deg <= 90 else 0.0
    return 0.0


def _counted_upwards(vertical: tuple[Floats, Floats], downtilt_deg: float) -> bool:
    """Return whether the beam lies clearly above the horizon although it is tilted down."""
    at_db = np.interp([downtilt_deg, -downtilt_deg], *vertical, period=360.0)
    return bool(downtilt_deg >= 2 and at_db[1] < 1.0 <= at_db[0])
