"""How much each repeated report speaks for a radio that stands still, by hand."""

from dataclasses import replace
from math import nan

import pytest
from made_watch import report

from mapfilter.positioning.epochs import ReportRow
from mapfilter.positioning.sensors.stale_radio import STALE_NATS, repeated_nats


@pytest.mark.parametrize(
    ("levels", "moved_m", "nats"),
    [
        # 0.12 nats a metre for each level of at most three ...
        (1, 10.0, 1.2), (2, 5.0, 1.2), (3, 5.0, 1.8), (4, 5.0, 1.8), (7, 5.0, 1.8),
        # ... up to 1.9, or to 0.9 for each.
        (1, 15.0, 1.8), (1, 16.0, 1.9), (2, 8.0, 1.9), (3, 7.0, 2.52), (3, 8.0, 2.7),
        (7, 100.0, 2.7), (2, 0.0, 0.0),
    ],
)  # fmt: skip
def test_a_repeated_report_gains_by_its_levels_and_metres(levels, moved_m, nats):
    rows = report(range(-90, -90 + levels))
    again = tuple(replace(row) for row in rows)
    assert repeated_nats(0.0, rows, again, moved_m) == pytest.approx(nats)
    assert repeated_nats(3.0, rows, again, moved_m) == pytest.approx(3.0 + nats)


def test_three_levels_are_stale_with_the_third_repeat_far_apart():
    rows, nats, repeats = report([-70.0, -80.0, -90.0]), 0.0, 0
    while nats < STALE_NATS:
        nats, repeats = repeated_nats(nats, rows, rows, 10.0), repeats + 1
    assert (repeats, nats) == (3, pytest.approx(8.1))


ROW = ReportRow("serving", "A", 60, 1, -70.0, 0, 3.0)


@pytest.mark.parametrize(
    "change",
    [
        {"role": "neighbour"}, {"cell": "B"}, {"cell": None}, {"arfcn": 61}, {"bsic": 2},
        {"level_dbm": -71.0}, {"level_dbm": nan}, {"censored": 1}, {"timing_advance": 4.0},
        {"timing_advance": nan},
    ],
)  # fmt: skip
@pytest.mark.parametrize("at", [0, 1])
def test_whatever_differs_is_another_report(change, at):
    other = replace(ROW, role="neighbour", cell="C", level_dbm=-80.0)
    before = [ROW, other]
    now = list(before)
    now[at] = replace(now[at], **change)
    if now == before:
        now[at] = replace(now[at], role="serving")
    assert repeated_nats(5.0, tuple(before), tuple(now), 10.0) == 0.0
    assert repeated_nats(5.0, tuple(now), tuple(before), 10.0) == 0.0


def test_a_row_more_is_another_report():
    assert repeated_nats(5.0, (ROW,), (ROW, ROW), 10.0) == 0.0
    assert repeated_nats(5.0, (ROW, ROW), (ROW,), 10.0) == 0.0
    assert repeated_nats(5.0, (), (ROW,), 10.0) == 0.0


def test_what_is_missing_in_both_is_equal_and_no_level_speaks_for_nothing():
    bare = replace(ROW, level_dbm=nan, timing_advance=nan)
    again = replace(bare)
    assert repeated_nats(5.0, (bare,), (again,), 10.0) == 0.0
    assert repeated_nats(5.0, (ROW, bare), (ROW, again), 10.0) == pytest.approx(6.2)
    beyond = replace(ROW, censored=-1)
    assert repeated_nats(5.0, (beyond,), (beyond,), 10.0) == 0.0
