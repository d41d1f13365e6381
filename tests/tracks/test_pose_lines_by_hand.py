"""Lines of poses by hand: their numbers, headers, comments, clocks and the times beside them."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.poses import (
    KITTI,
    TUM,
    _are_units,
    _comma,
    _comments,
    _names_others,
    _names_place,
    _numbers,
    _quaternion,
    _tum_clock,
)
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.text import Text

POSE = "1 2 3 0 0 0 1"
STILL = "1 0 0 0 0 1 0 0 0 0 1 {}"


def text(*lines, path="a.txt"):
    return Text(Path(path), "\n".join([*lines, ""]).encode())


@pytest.mark.parametrize(
    ("line", "count", "numbers"),
    [
        ("1 2 3", 3, [1, 2, 3]),
        ("1,2,3", 3, [1, 2, 3]),
        ("1;2;3", 3, [1, 2, 3]),
        # Commas separate if that gives the right number, else they are decimal ones.
        ("1,5 2,5 -3,25", 3, [1.5, 2.5, -3.25]),
        ("1,5;2,5;3", 3, [1.5, 2.5, 3]),
        ("1,5 2", 3, [1, 5, 2]),
        ("-.5 +2. 1e-3", 3, [-0.5, 2, 1e-3]),
        ("1E+123 0 0", 3, [1e123, 0, 0]),
        ("1e1234 0 0", 3, None),
        ("1 2", 3, None),
        ("1 2 3 4", 3, None),
        ("1 2 x", 3, None),
        ("1 2 3m", 3, None),
        ("", 3, None),
    ],
)
def test_numbers_of_a_line(line, count, numbers):
    found = _numbers(line, count)
    assert (None if found is None else found.tolist()) == numbers


def test_missing_numbers_are_numbers():
    assert np.isnan(_numbers("nan -NaN", 2)).all()
    assert _numbers("inf -Inf", 2).tolist() == [np.inf, -np.inf]


@pytest.mark.parametrize(
    ("lengths", "are"),
    [
        ([1.0, 1.0], True),
        ([0.96, 1.04], True),
        ([0.94, 1.0], False),
        ([1.0, 1.06], False),
        ([1e200, 1.0], False),
        ([np.nan, 1.0], False),
    ],
)
def test_units_are_of_length_1_but_for_5_percent(lengths, are):
    assert _are_units(np.array(lengths)[:, None] * [0.6, 0.0, -0.8]) == are


@pytest.mark.parametrize(
    ("line", "are_others"),
    [
        ("0.0 1 2 3 0 0 0 1", False),
        ("time x y z qx qy qz qw", False),
        ("r11 r12 r13 tx", False),
        ("alpha beta gamma", True),
        ("time,lat,lon,speed", True),
        # A field of a plain CSV, but for times and attitudes, which poses have, too.
        ("time,x,y,speed_mps,qx,qy,qz,qw", True),
        ("t_s tx ty tz qx qy qz qw", False),
    ],
)
def test_headers_of_other_tables(line, are_others):
    assert _names_others(line) == are_others


@pytest.mark.parametrize(
    ("line", "is_place"),
    [
        ("0.0 1 2 3 0 0 0 1", True),
        *((f"time {name} b c d e f g", True) for name in ("x", "tx", "px", "X_m", "pos_x", "t.x")),
        *((f"time {name} b c d e f g", False) for name in ("ax", "speed", "y", "x2", "xy")),
        ("time,position x [m],y,z,qx,qy,qz,qw", True),
        ('"time","x (m)","y","z","qx","qy","qz","qw"', True),
        ("x", True),
        ("time", False),
    ],
)
def test_the_second_column_is_a_place(line, is_place):
    assert _names_place(line) == is_place


@pytest.mark.parametrize(
    ("lines", "comma"),
    [
        (["0 1 2"], b" "),
        (["0,1,2"], b" "),
        (["0,5 1 2,5"], b"."),
        (["0,5;1;2,5"], b"."),
        (["# a, b", "0 1 2", "0,5 1 2"], b"."),
        (["0 1 2"] * 30 + ["0,5 1 2"], b" "),
        (["0 1 2"] * 29 + ["0,5 1 2"], b"."),
    ],
)
def test_what_a_comma_stands_for(lines, comma):
    assert _comma(text(*lines), 3) == comma


@pytest.mark.parametrize(
    ("data", "lines"),
    [
        (b"# a\n1 2\n  # b\n3 4 # c\n\t#d", [1, 3, 5]),
        (b"1 2\n3 4\n", []),
        (b"\n\n#\n", [3]),
    ],
)
def test_lines_that_are_comments(data, lines):
    assert _comments(data).tolist() == lines


@pytest.mark.parametrize(
    ("lines", "order"),
    [
        (["# time x y z qw qx qy qz"], "wxyz"),
        (["# time x y z q_w q_x q_y q_z"], "wxyz"),
        (["# a", "time,tx,ty,tz,QX,QY,QZ,QW"], "xyzw"),
        (["# time x y z w x y z"], "xyzw"),
        (["0 " + POSE], "xyzw"),
        ([f"{i} {POSE}" for i in range(29)] + ["# qw qx qy qz"], "wxyz"),
        ([f"{i} {POSE}" for i in range(30)] + ["# qw qx qy qz"], "xyzw"),
    ],
)
def test_the_order_of_quaternions(lines, order):
    assert _quaternion(text(*lines)) == [f"q{axis}" for axis in order]


@pytest.mark.parametrize(
    ("times", "kind"),
    [
        (["0.5", "1.5"], "monotonic"),
        (["1777629600.5", "1777629601,5"], "utc"),
        # By the median, as one may be damaged.
        (["1777629600.5", "3", "1777629602.5"], "utc"),
        (["1777629600.5", "3", "4"], "monotonic"),
        (["# 1777629600", "3"], "monotonic"),
        (["time", "# x"], "monotonic"),
    ],
)
def test_large_times_are_unix_times(times, kind):
    assert _tum_clock(text(*(f"{time} {POSE}" for time in times))) == kind


def count(format_, *lines):
    return format_.matches(text(*lines))


def test_most_of_the_first_20_lines_are_poses():
    pose, other = f"0 {POSE}", "1 2 3"
    assert count(TUM, pose, pose, other)
    assert not count(TUM, pose, other)
    assert count(TUM, *[pose] * 11, *[other] * 30)
    assert not count(TUM, *[pose] * 10, *[other] * 30)
    # Comments and blank lines are none, of 30.
    assert count(TUM, *["# x", ""] * 14, pose)
    assert not count(TUM, *["# x", ""] * 15, pose)
    assert not count(TUM)


def test_a_table_with_a_header_has_unit_quaternions_or_rotations():
    """Where no header is, any numbers are taken for poses."""
    head = "time tx ty tz qx qy qz qw"
    assert count(TUM, head, *[f"0 {POSE}"] * 3)
    assert not count(TUM, head, *["0 1 2 3 4 5 6 7"] * 3)
    assert count(TUM, *["0 1 2 3 4 5 6 7"] * 3)
    assert count(TUM, head, *["0 1 2 3 4 5 6 7"] * 3, f"0 {POSE}")
    head = "r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz"
    assert count(KITTI, head, *[STILL.format(5)] * 3)
    assert not count(KITTI, head, *["1 2 3 4 5 6 7 8 9 1 2 3"] * 3)


def poses(folder, *lines, times=None):
    """Return seconds and z of the poses of a KITTI file, and the notes on it."""
    if times is not None:
        (folder / "times.txt").write_text("\n".join(map(str, times)) + "\n")
    found = Reading(folder / "00.txt")
    KITTI.read(text(*lines, path=folder / "00.txt"), found, ReadOptions())
    (rows,) = found.tables["poses"]
    return rows["time_s"].tolist(), rows["z_m"].tolist(), found.notes


NO_TIMES = "no times.txt beside the file: a pose every 0.1 s is taken"


def test_frames_are_lines_without_comments(tmp_path):
    bad = STILL.format(9).replace("1 0 0 0", "2 0 0 0")
    lines = ["# a", STILL.format(5), " # b", bad, STILL.format(6), "# c", STILL.format(7)]
    found = poses(tmp_path, *lines)
    assert found == (pytest.approx([0, 0.2, 0.3]), [5, 6, 7], [NO_TIMES])
    # A time of each; one is too few.
    found = poses(tmp_path, *lines, times=[1, 2.5, 4, 8])
    assert found == ([1, 4, 8], [5, 6, 7], ["times by times.txt"])
    found = poses(tmp_path, *lines, times=[1, 2.5, 4])
    assert found == (pytest.approx([0, 0.2, 0.3]), [5, 6, 7], [NO_TIMES])


@pytest.mark.parametrize(
    ("matrix", "is_pose"),
    [
        ("1 0 0 0 0 1 0 0 0 0 1 5", True),
        # Squares of lengths, and products of axes, by 0.05.
        ("1.02 0 0 0 0 1 0 0 0 0 1 5", True),
        ("1.03 0 0 0 0 1 0 0 0 0 1 5", False),
        ("0.98 0 0 0 0 1 0 0 0 0 1 5", True),
        ("0.97 0 0 0 0 1 0 0 0 0 1 5", False),
        ("1 0.04 0 0 0 1 0 0 0 0 1 5", True),
        ("1 0.06 0 0 0 1 0 0 0 0 1 5", False),
        # Left-handed ones are mirror images.
        ("0 1 0 0 1 0 0 0 0 0 1 5", False),
        ("0 1 0 0 1 0 0 0 0 0 -1 5", True),
        ("nan 0 0 0 0 1 0 0 0 0 1 5", False),
    ],
)
def test_rotations_are_orthonormal(tmp_path, matrix, is_pose):
    _, places, _ = poses(tmp_path, STILL.format(4), matrix)
    assert places == [4, 5][: 1 + is_pose]


def test_rows_of_tum():
    lines = [f"{i}.5,{i},2,3,0,0,0.6,0.8" for i in range(3)]
    found = Reading(Path("a.txt"))
    TUM.read(text("# x", *lines, "4,9,9,9,0,0,0.6,0.9"), found, ReadOptions())
    (rows,) = found.tables["poses"]
    names = ["time_s", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"]
    assert rows[names].to_numpy().tolist() == [[i + 0.5, i, 2, 3, 0, 0, 0.6, 0.8] for i in range(3)]
    assert found.program == "TUM trajectory"
    assert [lines[0].tolist() for lines in found._refused.values()] == [[5]]
    moment = datetime(2026, 5, 1, 10, tzinfo=UTC).timestamp()
    found = Reading(Path("a.txt"))
    TUM.read(text(f"{moment:.0f} {POSE}"), found, ReadOptions())
    assert found.clock.kind == "utc"
    assert found.tables["poses"][0]["time_s"].tolist() == [moment]
