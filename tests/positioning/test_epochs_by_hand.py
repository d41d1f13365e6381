"""A log's tables merged into epochs, row by row, and the headings that turns add up to."""

from dataclasses import fields, replace
from math import inf, isnan, nan

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import ConfigError
from mapfilter.positioning import merging as tested
from mapfilter.positioning.epochs import (
    Difference,
    Epoch,
    GnssFix,
    Pseudorange,
    ReportRow,
    headed,
    serving_cell,
)
from mapfilter.positioning.merging import epoch_columns, epochs, make_epoch
from mapfilter.tracks.log import make_log
from mapfilter.tracks.schema import TABLES as KNOWN

CRS = "EPSG:32632"


def table(columns, *rows):
    return pd.DataFrame(rows, columns=columns.split())


TABLES = {
    "motion": table(
        "time_s step_m heading_rad turn_rad",
        (2.0, 1.5, 0.1, 0.3), (1.0, 1.25, nan, 0.4), (2.0, 2.0, 0.2, nan),
    ),
    "radio": table(
        "time_s role cell arfcn bsic level_dbm censored timing_advance",
        (2.0, "serving", "A", None, None, -70.0, 0, 3),
        (2.0, "neighbour", None, 61, 5, -110.0, -1, None),
        (4.0, "serving", "A", None, None, None, None, None),
    ),
    "gnss": table(
        "time_s east_m north_m var_east_m2 var_north_m2 cov_east_north_m2",
        (2.0, 4e5, 5e6, 9.0, 16.0, 1.0), (2.0, 4.2e5, 5e6, 9.0, 16.0, 1.0),
        (2.0, 4.1e5, 5.1e6, nan, nan, nan),
    ),
    "pseudoranges": table(
        "time_s satellite pseudorange_m sigma_m x_m y_m z_m",
        (3.0, "G01", 2.1e7, 3.0, 1e7, 2e7, 3e6), (3.0, "G02", 2.2e7, nan, 2e7, 1e7, 4e6),
    ),
    "tdoa": table(
        "time_s cell reference difference_m sigma_m reference_sigma_m",
        (1.0, "A", "B", 120.0, 30.0, 20.0),
    ),
}  # fmt: skip


def same(found, expected):
    """Whether two rows are equal, NaN for NaN."""
    assert type(found) is type(expected)
    for name in expected.__slots__:
        one, other = getattr(found, name), getattr(expected, name)
        both_unknown = isinstance(other, float) and isnan(other) and isnan(one)
        assert both_unknown or one == other, name


@pytest.mark.parametrize("at_once", [1, 2, 20_000])
def test_rows_of_one_time_are_one_epoch_in_the_order_of_the_file(monkeypatch, at_once):
    monkeypatch.setattr(tested, "_AT_ONCE", at_once)
    first, second, third, fourth = epochs(make_log(CRS, **TABLES))
    assert [one.time_s for one in (first, second, third, fourth)] == [1.0, 2.0, 3.0, 4.0]
    (step,) = first.motion
    assert (step.step_m, step.turn_rad) == (1.25, 0.4)
    assert isnan(step.heading_rad)
    assert first.tdoa == (Difference("A", "B", 120.0, 30.0, 20.0),)
    assert (first.radio, first.gnss, first.pseudoranges) == ((), None, ())
    assert [one.step_m for one in second.motion] == [1.5, 2.0]
    assert [one.heading_rad for one in second.motion] == pytest.approx([0.1, 0.2])
    assert second.motion[0].turn_rad == 0.3
    assert [one.sampling_sd_m for one in second.motion] == [0.0, 0.0]
    serving, neighbour = second.radio
    assert serving == ReportRow("serving", "A", None, None, -70.0, 0, 3.0)
    same(neighbour, ReportRow("neighbour", None, 61, 5, -110.0, -1, nan))
    # Of several fixes of one time the last counts.
    same(second.gnss, GnssFix(4.1e5, 5.1e6))
    same(third.pseudoranges[0], Pseudorange("G01", 2.1e7, 3.0, (1e7, 2e7, 3e6)))
    same(third.pseudoranges[1], Pseudorange("G02", 2.2e7, nan, (2e7, 1e7, 4e6)))
    assert third.motion == second.tdoa == ()
    same(fourth.radio[0], ReportRow("serving", "A", None, None, nan, 0, nan))


def test_rows_out_of_order_and_what_a_table_may_lack():
    log = make_log(CRS, motion=TABLES["motion"].assign(sampling_sd_m=[0.25, 0.5, nan]))
    first, second = epochs(log)
    assert [one.sampling_sd_m for one in (*first.motion, *second.motion)] == [0.5, 0.25, 0.0]
    # Tables of a log are in order; those of one that was changed may not be.
    turned = replace(log, motion=log.motion.iloc[[2, 0, 1]].reset_index(drop=True))
    found = epochs(turned)
    assert [one.time_s for one in found] == [1.0, 2.0]
    assert [one.step_m for one in found[0].motion] == [1.25]
    assert [one.step_m for one in found[1].motion] == [2.0, 1.5]
    backwards = replace(log, motion=log.motion.iloc[[1, 0]].reset_index(drop=True))
    assert [(one.time_s, one.motion[0].step_m) for one in epochs(backwards)] == [
        (1.0, 1.25), (2.0, 1.5),
    ]  # fmt: skip


def test_rows_that_repeat_themselves_are_one_object():
    rows = [(float(k), "serving", "A", -80.0) for k in range(4)]
    log = make_log(CRS, radio=table("time_s role cell level_dbm", *rows))
    found = [one.radio[0] for one in epochs(log)]
    assert all(one is found[0] for one in found)


def test_no_log_is_refused():
    with pytest.raises(ConfigError, match="log"):
        epochs(TABLES)
    assert epochs(make_log(CRS)) == []


def test_rows_of_an_epoch_have_the_columns_after_the_time():
    assert epoch_columns("gnss") == (
        "east_m", "north_m", "var_east_m2", "var_north_m2", "cov_east_north_m2",
    )  # fmt: skip
    assert epoch_columns("radio")[0] == "role"
    assert epoch_columns("radio")[-1] == "timing_advance"
    assert epoch_columns("motion")[-1] == "sampling_sd_m"


def test_an_epoch_of_rows_as_they_arrive():
    found = make_epoch(
        7.0,
        {
            "motion": [(1.5, 0.1, nan), (2.0, 0.2, 0.3, 0.5), (2.0, 0.2, 0.3, nan)],
            "radio": [("serving", "A", None, None, None, None, None),
                      ("neighbour", "B", 61, 5, -90, 1, 2)],
            "gnss": [],
            "pseudoranges": [("G01", 2.1e7, 3.0, 1e7, 2e7, 3e6)],
            "tdoa": [("A", "B", 120.0)],
        },
    )  # fmt: skip
    assert (found.time_s, found.gnss) == (7.0, None)
    assert [one.sampling_sd_m for one in found.motion] == [0.0, 0.5, 0.0]
    same(found.radio[0], ReportRow("serving", "A", None, None, nan, 0, nan))
    assert found.radio[1] == ReportRow("neighbour", "B", 61, 5, -90.0, 1, 2.0)
    assert found.pseudoranges[0].place_m == (1e7, 2e7, 3e6)
    same(found.tdoa[0], Difference("A", "B", 120.0, nan, nan))


@pytest.mark.parametrize(
    ("last", "repeats"),
    [
        (GnssFix(1.0, 2.0, 4.0, 9.0, nan), True),
        (None, False),
        (GnssFix(1.0, 2.0, 4.0, 9.0, 0.0), False),
        (GnssFix(1.0, 2.5, 4.0, 9.0, nan), False),
        (GnssFix(nan, 2.0, 4.0, 9.0, nan), False),
        (GnssFix(1.0, 2.0, 4.0, nan, nan), False),
    ],
)
def test_a_fix_repeats_another_to_the_last_digit(last, repeats):
    assert GnssFix(1.0, 2.0, 4.0, 9.0, nan).repeats(last) is repeats


@pytest.mark.parametrize(
    ("given", "measured"),
    [
        ({}, False),
        ({"motion": (tested.MotionStep(1.0, 0.0),)}, False),
        ({"radio": (ReportRow("serving", "A", None, None, nan, 0),)}, True),
        ({"gnss": GnssFix(1.0, 2.0)}, True),
        ({"gnss": nan}, False),
        ({"pseudoranges": (Pseudorange("G01", 1.0, 1.0, (0.0, 0.0, 0.0)),)}, True),
        ({"tdoa": (Difference("A", "B", 1.0),)}, True),
    ],
)
def test_motion_alone_is_no_measurement(given, measured):
    assert Epoch(1.0, **given).measured is measured


@pytest.mark.parametrize(
    ("step", "before_rad", "heading_rad", "after_rad"),
    [
        # A compass; turns from what was known, or from 0; a first step without a turn.
        (tested.MotionStep(1.0, 0.7, 0.2), 2.0, 0.7, 0.7),
        (tested.MotionStep(1.0, nan, 0.2), 2.0, 2.2, 2.2),
        (tested.MotionStep(1.0, nan, 0.2), nan, 0.2, 0.2),
        (tested.MotionStep(1.0, nan), nan, 0.0, 0.0),
        (tested.MotionStep(1.0, inf, inf), nan, 0.0, 0.0),
        # Neither heading nor turn, or a displacement to all sides: the heading stays as it was.
        (tested.MotionStep(1.0, nan), 2.0, nan, 2.0),
        (tested.MotionStep(1.0, nan, 0.2, 5.0), 2.0, nan, 2.0),
        (tested.MotionStep(1.0, nan, nan, 5.0), nan, nan, nan),
    ],
)
def test_turns_add_up_to_a_heading(step, before_rad, heading_rad, after_rad):
    found, known_rad = headed(step, before_rad)
    assert found.heading_rad == pytest.approx(heading_rad, nan_ok=True)
    assert known_rad == pytest.approx(after_rad, nan_ok=True)
    assert (found.step_m, found.sampling_sd_m) == (1.0, 0.0)
    kept = [found.turn_rad, found.spread_m]
    np.testing.assert_array_equal(kept, [step.turn_rad, step.spread_m])


def test_the_first_serving_cell_that_is_named_counts():
    rows = [("neighbour", "N"), ("serving", None), ("serving", "A"), ("serving", "B")]
    report = tuple(ReportRow(role, cell, None, None, nan, 0) for role, cell in rows)
    assert serving_cell(Epoch(1.0, radio=report)) == "A"
    assert serving_cell(Epoch(1.0, radio=report[:2])) is None


def test_fields_of_an_epoch_are_called_as_tables_of_a_log():
    """As are those of an epoch that a device sends."""
    named = [one.name for one in fields(Epoch)]
    assert named == ["time_s", *(name for name, table in KNOWN.items() if table.kinds)]
