"""Pose files: KITTI (twelve numbers a line) and TUM (time, position, quaternion)."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.clocks.times import LEAST_UNIX_S
from mapfilter.errors import MapfilterError
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.plain.fields import usual_fields
from mapfilter.tracks.readers.plain.headers import stated_fields
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.lines import blocks
from mapfilter.tracks.readers.texts.separated_values import (
    header_names,
    likely_separator,
    split_blanks,
    value_columns,
)
from mapfilter.tracks.readers.texts.text import Text, read_text
from mapfilter.tracks.readers.texts.zipped import has_recording

_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d{1,3})?|[-+]?(nan|inf)", re.IGNORECASE)
_PLACE = re.compile(r"(t|p|pos|position)?[_ .]?x([_ ]?m| ?[\[(].*)?")
_FRAME_S = 0.1
_CROOKED = 0.05


_NAMES = frozenset(
    ["x", "y", "z", "tx", "ty", "tz", "qx", "qy", "qz", "qw", "x_m", "y_m", "z_m", "r11", "r00"]
)
_OF_POSES = frozenset(["time", "qx", "qy", "qz", "qw"])


def _count(text: Text, count: int, is_pose: Callable[[Floats], bool]) -> bool:
    """Return whether most lines have so many numbers and, where the first has others, are poses."""
    lines = _body(text)
    rows = [numbers for line in lines if (numbers := _numbers(line, count)) is not None]
    if len(rows) <= 0.5 * len(lines) or _names_others(lines[0]):
        return False
    # A table of as many other numbers has a header.
    return _numbers(text.first_line, count) is not None or any(map(is_pose, rows))


def _body(text: Text) -> list[str]:
    return [line for line in text.head[:30] if line.strip() and not line.startswith("#")][:20]


def _names_others(line: str) -> bool:
    """Return whether a header names columns none of which is of a pose, or fields of a plain CSV.

    Attitudes are of both.
    """
    words = {word.strip().lower() for word in re.split(r"[,;\s]+", line) if word.strip()}
    if words and all(word[0].isalpha() for word in words) and not words & _NAMES:
        return True
    names = header_names(line, likely_separator(line))
    return bool({*usual_fields(names), *stated_fields(names, (), ())} - _OF_POSES)


def _numbers(line: str, count: int) -> Floats | None:
    """Return the numbers of a line with so many; commas separate, or are decimal ones."""
    for other in " .":
        words = line.replace(",", other).replace(";", " ").split()
        if len(words) == count and all(map(_NUMBER.fullmatch, words)):
            return np.array(words, dtype=float)
    return None


def _has_quaternion(row: Floats) -> bool:
    return _are_units(row[4:])


def _has_rotation(row: Floats) -> bool:
    return _are_units(row.reshape(3, 4)[:, :3])


def _are_units(vectors: Floats) -> bool:
    # Numbers of damaged files may be too large to be squared.
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.linalg.norm(vectors, axis=-1)
    return bool((np.abs(lengths - 1.0) <= _CROOKED).all())


def _comma(text: Text, count: int) -> bytes:
    """Return what a comma stands for: a blank, or a decimal point."""
    lines = (line.replace(",", ".").replace(";", " ") for line in text.head[:30] if "," in line)
    return b"." if any(_numbers(line, count) is not None for line in lines) else b" "


def _is_kitti(text: Text) -> bool:
    return _count(text, 12, _has_rotation)


def _is_tum(text: Text) -> bool:
    return _count(text, 8, _has_quaternion) and _names_place(_body(text)[0])


def _names_place(line: str) -> bool:
    """Return whether a line is no header, or its second column one of positions."""
    if _numbers(line, 8) is not None:
        return True
    separator = likely_separator(line)
    names = line.split(separator) if separator in line else line.split()
    return bool(_PLACE.fullmatch(names[min(1, len(names) - 1)].strip(' "').lower()))


def _parts(
    text: Text, reading: Reading, names: Sequence[str]
) -> Iterator[tuple[Columns, dict[str, Floats]]]:
    """Yield the columns of a text, part by part; blanks, commas or semicolons separate values."""
    comma = _comma(text, len(names))
    for block, first_line in blocks(memoryview(text.data), 1):
        data = split_blanks(block.replace(b",", comma).replace(b";", b" "))
        if b"#" in data:
            data = re.sub(rb"^#.*$", b"", data, flags=re.MULTILINE)
        rows = value_columns(memoryview(data), reading, names, " ", first_line)
        if len(rows):
            yield rows, {name: rows.number(name) for name in names}


def _read_kitti(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    from scipy.spatial.transform import Rotation

    reading.program, reading.clock = "KITTI poses", Clock("monotonic")
    names = [f"r{i}{j}" for i in range(3) for j in range(4)]
    comments = _comments(text.data)
    times = _frame_times(text, reading, comments.size)
    for rows, values in _parts(text, reading, names):
        matrix = np.stack([values[name] for name in names], axis=1).reshape(-1, 3, 4)
        turn = matrix[:, :, :3]
        with np.errstate(invalid="ignore"):
            product = np.einsum("nij,nkj->nik", turn, turn)
            square = np.abs(product - np.eye(3)).max(axis=(1, 2), initial=0.0)
            right = np.einsum("ni,ni->n", np.cross(turn[:, 0], turn[:, 1]), turn[:, 2]) > 0
            good = (square < _CROOKED) & right
        reading.refuse(rows.line[~good], "pose: no rotation matrix")
        if good.any():
            quaternion = Rotation.from_matrix(turn[good]).as_quat()
            frame = rows.line[good] - 1 - np.searchsorted(comments, rows.line[good])
            time_s = _FRAME_S * frame if times is None else times[frame]
            _add_poses(reading, time_s, matrix[good][:, :, 3], quaternion, rows.line[good])


def _comments(data: bytes) -> Ints:
    """Return the numbers of lines that are comments."""
    begins = [found.start() for found in re.finditer(rb"^[ \t]*#", data, re.MULTILINE)]
    feeds = np.flatnonzero(np.frombuffer(data, dtype=np.uint8) == ord("\n"))
    return np.searchsorted(feeds, begins) + 1


def _frame_times(text: Text, reading: Reading, comments: int) -> Floats | None:
    """Return times by ``times.txt`` beside the file, as in KITTI's odometry; None without it."""
    path = Path(reading.path).parent / "times.txt"
    if has_recording(path):
        try:
            aside = Reading(path)
            rows = value_columns(memoryview(split_blanks(read_text(path).data)), aside, ["t"], " ")
            times = rows.number("t")
            if len(times) > text.data.rstrip().count(b"\n") - comments:
                reading.note("times by times.txt")
                return np.asarray(times)
        except MapfilterError:
            pass
    reading.note(f"no times.txt beside the file: a pose every {_FRAME_S:g} s is taken")
    return None


def _read_tum(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    names = ["time", "x", "y", "z", *_quaternion(text)]
    reading.program, reading.clock = "TUM trajectory", Clock(_tum_clock(text))
    for rows, values in _parts(text, reading, names):
        quaternion = np.stack([values[f"q{axis}"] for axis in "xyzw"], axis=1)
        norm = np.linalg.norm(quaternion, axis=1)
        good = ~(np.abs(norm - 1.0) > _CROOKED)
        reading.refuse(rows.line[~good], "pose: no unit quaternion")
        place = np.stack([values[name] for name in names[1:4]], axis=1)
        _add_poses(reading, values["time"][good], place[good], quaternion[good], rows.line[good])


def _quaternion(text: Text) -> list[str]:
    """Return the parts of quaternions in the order of the header: the scalar may be the first."""
    heads = (re.findall(r"\bq_?([wxyz])\b", line.lower()) for line in text.head[:30])
    order = next((head for head in heads if sorted(head) == [*"wxyz"]), "xyzw")
    return [f"q{axis}" for axis in order]


def _tum_clock(text: Text) -> Literal["utc", "monotonic"]:
    """Return the clock by the times at the file's beginning: Unix times are large."""
    comma = _comma(text, 8).decode()
    words = [line.replace(",", comma).replace(";", " ").split()[:1] for line in text.head]
    known = [float(word[0]) for word in words if word and _NUMBER.fullmatch(word[0])]
    return "utc" if known and float(np.median(known)) > LEAST_UNIX_S else "monotonic"


def _add_poses(
    reading: Reading, time_s: Floats, place: Floats, quaternion: Floats, lines: Ints
) -> None:
    columns = {"time_s": time_s, **dict(zip(("x_m", "y_m", "z_m"), place.T, strict=True))}
    columns |= dict(zip(("qx", "qy", "qz", "qw"), quaternion.T, strict=True))
    reading.add("poses", columns, lines)


KITTI = Format(
    "kitti",
    "a KITTI pose file",
    "visual and lidar odometry, SLAM (KITTI poses)",
    "poses; times of ``times.txt`` beside the file, else every 0.1 s",
    _is_kitti,
    _read_kitti,
)
TUM = Format(
    "tum",
    "a TUM trajectory",
    "visual and lidar odometry, SLAM, evo (TUM trajectories)",
    "poses with times",
    _is_tum,
    _read_tum,
)
