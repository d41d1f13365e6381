"""Timing advances of several technologies in one log."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.timing_steps import with_one_step, with_plan_technologies
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"
LTE_M = 299_792_458 / 30.72e6 * 8
HERE = (386_200.0, 6_673_600.0)
SITES = {
    "A": (385_000.0, 6_672_000.0),
    "B": (388_000.0, 6_672_000.0),
    "C": (385_500.0, 6_676_000.0),
}


def log(technology, advances=(7, 9, 1, 2), **columns):
    rows = {"time_s": np.arange(4.0), "role": "serving", "cell": "A", "level_dbm": -80.0}
    rows |= {"timing_advance": list(advances), "technology": technology} | columns
    return make_log(CRS, radio=pd.DataFrame(rows))


def kept(found):
    return found.radio["timing_advance"].astype(object).where(lambda given: given.notna(), None)


@pytest.mark.parametrize(
    ("technology", "expected", "note"),
    [
        (["LTE", "LTE", "GSM", "LTE"], [7, 9, None, 2], "1 of GSM left out, beside those of LTE"),
        (["GSM", "LTE", "GSM", "GSM"], [7, None, 1, 2], "1 of LTE left out, beside those of GSM"),
        (["LTE", None, "NR", "LTE"], [7, None, None, 2],
         "1 of NR, 1 of no stated technology left out, beside those of LTE"),
        (["NR"] * 4, [None] * 4, "4 of NR left out: their steps are not known"),
    ],
)  # fmt: skip
def test_steps_of_one_length_stay(technology, expected, note):
    given = log(technology)
    found = with_one_step(given, BayesFilter())
    assert kept(found).tolist() == expected
    assert found.notes == (*given.notes, f"timing advance: {note}")
    others = given.radio.drop(columns="timing_advance")
    pd.testing.assert_frame_equal(found.radio.drop(columns="timing_advance"), others)


@pytest.mark.parametrize("technology", ["LTE", "GSM", None])
def test_of_one_technology_or_none_all_stay(technology):
    given = log(technology)
    assert with_one_step(given, BayesFilter()) is given


def test_reports_without_a_timing_advance_do_not_count():
    given = log(["LTE", "NR", "NR", "GSM"], (7, None, None, None))
    assert with_one_step(given, BayesFilter()) is given


def test_a_step_that_was_set_is_that_of_all():
    given = log(["LTE", "LTE", "GSM", "NR"])
    assert with_one_step(given, BayesFilter(timing_step_m=78.07)) is given
    assert with_one_step(given, mf.CandidateFilter()) is given


def test_a_phone_of_two_networks_is_located_as_by_the_timing_advances_of_one():
    cells = tuple(
        Cell(name, name, *place, 30.0, None, 50.0, 1800.0, "omni") for name, place in SITES.items()
    )
    rows = [
        {"time_s": float(second), "role": "serving", "cell": name, "technology": technology,
         "timing_advance": int(np.hypot(*np.subtract(HERE, place)) / step_m)}
        for second in range(40)
        for name, place in SITES.items()
        for technology, step_m in (("LTE", LTE_M), ("GSM", 553.5))
        if technology == "LTE" or second % 4 == 0
    ]  # fmt: skip
    radio = pd.DataFrame(rows)
    motion = pd.DataFrame({"time_s": np.arange(40.0), "step_m": 0.0, "heading_rad": 0.0})
    filter_ = mf.KalmanFilter().over_sites(CellPlan(CRS, cells))
    alone = radio[radio["technology"] == "LTE"]
    both, one = (
        mf.locate(make_log(CRS, radio=table, motion=motion), filter=filter_, seed=0)
        for table in (radio, alone)
    )
    assert any("of GSM left out, beside those of LTE" in note for note in both.log.notes)
    for track in (both, one):
        last = track.to_dataframe().iloc[-1]
        assert np.hypot(last["east_m"] - HERE[0], last["north_m"] - HERE[1]) < 200


def lte_plan(**technology_of):
    cells = (
        Cell(name, name, *place, 30.0, None, 30.0, 1800.0, "omni",
             technology=technology_of.get(name, "LTE"))
        for name, place in SITES.items()
    )  # fmt: skip
    return CellPlan(CRS, tuple(cells))


def test_timing_advances_without_a_technology_are_in_steps_of_the_plans_cells():
    rows = [
        {"time_s": float(second), "role": "serving", "cell": name,
         "timing_advance": int(np.hypot(*np.subtract(HERE, place)) / LTE_M)}
        for second in range(40)
        for name, place in SITES.items()
    ]  # fmt: skip
    motion = pd.DataFrame({"time_s": np.arange(40.0), "step_m": 0.0, "heading_rad": 0.0})
    given = make_log(CRS, radio=pd.DataFrame(rows), motion=motion)
    track = mf.locate(given, filter=mf.KalmanFilter().over_sites(lte_plan()), seed=0)
    last = track.to_dataframe().iloc[-1]
    assert np.hypot(last["east_m"] - HERE[0], last["north_m"] - HERE[1]) < 200
    assert "timing advance: steps of 78.07 m, by technology" in track.log.notes


def test_what_a_report_states_goes_before_the_plan():
    given = log(["GSM", None, None, None], (7, 9, 1, None), cell=["A", "A", "C", "A"])
    found = with_plan_technologies(given, lte_plan(C=None)).radio["technology"]
    assert found.astype(object).where(found.notna(), None).tolist() == ["GSM", "LTE", None, None]


def test_a_log_stays_as_it_is_where_the_plan_tells_no_technology():
    given = log(None, (7, None, 1, 2), cell=["C", "A", "C", "elsewhere"])
    assert with_plan_technologies(given, lte_plan(C=None)) is given
