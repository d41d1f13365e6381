"""Pose files: KITTI (twelve numbers a line) and TUM (time, position, quaternion)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from mapfilter._types import Floats, Ints
from mapfilter.errors import MapfilterError
from mapfilter.tracks.readers.columns import split_blanks, value_columns
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recording import Clock, Reading
from mapfilter.tracks.readers.text import Text, read_text

_FRAME_S = 0.1
_UNIX_S = 1e8
_CROOKED = 0.05


def _count(text: Text, count: int) -> bool:
    lines = [line for line in text.head[:30] if line.strip() and not line.startswith("#")][:20]
    return bool(lines) and sum(_numbers(line) == count for line in lines) > 0.5 * len(lines)


def _numbers(line: str) -> int:
    try:
        return len([float(word) for word in line.replace(",", " ").split()])
    except ValueError:
        return 0


def _is_kitti(text: Text) -> bool:
    return _count(text, 12)


def _is_tum(text: Text) -> bool:
    return _count(text, 8)


def _plain(data: bytes) -> memoryview:
    """Return lines separated by single blanks, comments blanked out."""
    blanks = split_blanks(data.replace(b",", b" "))
    return memoryview(re.sub(rb"^#.*$", b"", blanks, flags=re.MULTILINE))


def _read_kitti(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    reading.program, reading.clock = "KITTI poses", Clock("monotonic")
    names = [f"r{i}{j}" for i in range(3) for j in range(4)]
    rows = value_columns(_plain(text.data), reading, names, " ")
    matrix = np.stack([rows.number(name) for name in names], axis=1).reshape(-1, 3, 4)
    turn, place = matrix[:, :, :3], matrix[:, :, 3]
    with np.errstate(invalid="ignore"):
        square = np.abs(turn @ turn.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
        good = (square < _CROOKED) & (np.linalg.det(turn) > 0)
    reading.refuse(rows.line[~good], "pose: no rotation matrix")
    frame = rows.line - 1
    time_s = _frame_times(frame, reading)
    quaternion = np.full((len(rows), 4), np.nan)
    if good.any():
        quaternion[good] = Rotation.from_matrix(turn[good]).as_quat()
    _add_poses(reading, time_s[good], place[good], quaternion[good], rows.line[good])


def _frame_times(frame: Ints, reading: Reading) -> Floats:
    """Return times by ``times.txt`` beside the file, as in KITTI's odometry, else 10 Hz."""
    path = Path(reading.path).parent / "times.txt"
    if path.is_file():
        try:
            aside = Reading(path)
            rows = value_columns(memoryview(split_blanks(read_text(path).data)), aside, ["t"], " ")
            times = rows.number("t")
            if len(times) > frame.max(initial=-1):
                reading.note("times by times.txt")
                return np.asarray(times[frame])
        except MapfilterError:
            pass
    reading.note(f"no times.txt beside the file: a pose every {_FRAME_S:g} s is taken")
    return np.asarray(_FRAME_S * frame, dtype=np.float64)


def _read_tum(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    names = ["time", "x", "y", "z", "qx", "qy", "qz", "qw"]
    rows = value_columns(_plain(text.data), reading, names, " ")
    time_s = rows.number("time")
    known = time_s[np.isfinite(time_s)]
    unix = bool(len(known)) and float(np.median(known)) > _UNIX_S
    reading.program, reading.clock = "TUM trajectory", Clock("utc" if unix else "monotonic")
    quaternion = np.stack([rows.number(name) for name in names[4:]], axis=1)
    norm = np.linalg.norm(quaternion, axis=1)
    good = ~(np.abs(norm - 1.0) > _CROOKED)
    reading.refuse(rows.line[~good], "pose: no unit quaternion")
    place = np.stack([rows.number(name) for name in names[1:4]], axis=1)
    _add_poses(reading, time_s[good], place[good], quaternion[good], rows.line[good])


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
