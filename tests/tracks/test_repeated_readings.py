"""Equal rows of a report: two neighbours without an identity, or one report delivered twice."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.tracks.log import make_log
from mapfilter.tracks.readers.formats import read_recording

CRS = "EPSG:32635"
LEVELS = (-70.5, -80.5, -80.5, -80.5, -91.5)


def report(time_s=0.0, levels_dbm=LEVELS, **columns):
    """A report of a serving cell and neighbours of which levels alone are known."""
    rows = pd.DataFrame({"time_s": time_s, "level_dbm": levels_dbm})
    rows["role"] = ["serving"] + ["neighbour"] * (len(rows) - 1)
    rows["cell"] = ["A"] + [None] * (len(rows) - 1)
    return rows.assign(**columns)


def kept(rows):
    log = make_log(CRS, radio=rows)
    dropped = [note for note in log.notes if "duplicate" in note]
    return log.radio["level_dbm"].tolist(), dropped


def test_neighbours_without_an_identity_and_of_equal_level_are_readings_of_their_own():
    assert kept(report()) == (list(LEVELS), [])
    assert kept(report(arfcn=[1, 7, 7, 7, 8])) == (list(LEVELS), [])


@pytest.mark.parametrize("times", [2, 3])
@pytest.mark.parametrize("by_rows", [False, True])
def test_a_report_that_is_delivered_several_times_is_one(times, by_rows):
    rows = pd.concat([report(0.0), report(1.0)], ignore_index=True)
    again = rows.loc[rows.index.repeat(times)] if by_rows else pd.concat([rows] * times)
    levels, notes = kept(again)
    assert levels == [*LEVELS, *LEVELS]
    assert notes == [f"radio: {(times - 1) * 10} exact duplicate rows dropped"]


def test_only_the_report_that_is_delivered_twice_loses_readings():
    levels, notes = kept(pd.concat([report(0.0), report(1.0), report(1.0), report(2.0)]))
    assert levels == [*LEVELS] * 3
    assert notes == ["radio: 5 exact duplicate rows dropped"]


def test_neighbours_of_known_codes_are_told_apart_by_these():
    known = report(bsic=pd.array([None, 7, 7, 8, None], dtype="Int64"))
    levels, _ = kept(known)
    assert levels == [-70.5, -80.5, -80.5, -91.5]
    # One identified neighbour that came once: the others did, too.
    assert kept(pd.concat([report(), report()[:1], report(bsic=9)[4:]]))[0].count(-80.5) == 3


def test_without_a_serving_cell_all_readings_have_to_come_twice():
    others = report()[1:]
    assert kept(others) == (list(LEVELS[1:]), [])
    assert kept(pd.concat([others, others]))[0] == list(LEVELS[1:])
    assert kept(report(levels_dbm=[-70.5, -80.5, -80.5])[1:]) == ([-80.5, -80.5], [])


def test_rows_of_other_tables_are_dropped_as_before():
    truth = pd.DataFrame({"time_s": [0.0, 1.0, 1.0], "east_m": 5e5, "north_m": 6.67e6})
    assert len(make_log(CRS, truth=truth).truth) == 2


def test_many_reports_keep_and_lose_as_by_hand():
    rng = np.random.default_rng(20)
    parts, expected = [], []
    for time_s in range(300):
        levels = [-60.0, *np.sort(rng.integers(-90, -80, rng.integers(1, 7)))[::-1].astype(float)]
        parts += [report(float(time_s), levels)] * int(rng.integers(1, 4))
        expected += levels
    assert kept(pd.concat(parts))[0] == expected


@pytest.mark.parametrize("times", [1, 2])
def test_recordings_keep_equal_neighbours(tmp_path, times):
    rows = pd.concat([report(1.7e9 + k, mcc=244, mnc=91, lac=1) for k in range(20)])
    rows["ci"] = rows["cell"].map({"A": 7}).astype("Int64")
    rows = rows.drop(columns="cell").rename(columns={"time_s": "time"})
    path = tmp_path / "phone.csv"
    pd.concat([rows] * times).to_csv(path, index=False)
    radio = read_recording(path).tables["radio"]
    assert len(radio) == len(rows)
    log = mf.read_log(path)
    assert sorted(log.radio["level_dbm"]) == sorted(LEVELS * 20)
