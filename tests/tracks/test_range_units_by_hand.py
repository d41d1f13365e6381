"""Units of timing advances and time differences by hand: how many rows, and how near a factor."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.identities import TIMING_STEP_M
from mapfilter.tracks.checks.range_units import range_notes
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"
EAST_M, NORTH_M = 385_000.0, 6_672_000.0


def plan(apart_m=1000.0):
    cells = (
        Cell(n, n, EAST_M + x, NORTH_M, 30.0, None, 44.0, 1800.0, "omni")
        for n, x in (("A", 0.0), ("B", apart_m))
    )
    return CellPlan(CRS, tuple(cells))


def way(away_m):
    """Positions straight to the north of A, a second apart."""
    time_s = np.arange(float(len(away_m)))
    return pd.DataFrame({"time_s": time_s, "east_m": EAST_M, "north_m": NORTH_M + away_m})


def test_a_step_of_timing_advance_is_a_bit_of_gsm_and_16_basic_units_of_lte():
    """TS 45.010: 48/13 µs there and back; TS 36.213: 16 / (15000 · 2048) s."""
    assert TIMING_STEP_M["GSM"] == pytest.approx(553.46, abs=0.01)
    assert TIMING_STEP_M["LTE"] == pytest.approx(78.07, abs=0.01)


def advances(steps, family):
    rows = {"time_s": np.arange(float(len(steps))), "role": "serving", "cell": "A"}
    rows |= {"timing_advance": np.asarray(steps, dtype=float)}
    return pd.DataFrame(rows | ({} if family is None else {"technology": family}))


def notes(steps, family, away_m=None):
    truth = None if away_m is None else way(np.asarray(away_m, dtype=float))
    return range_notes(make_log(CRS, radio=advances(steps, family), truth=truth), plan())


def test_advances_are_judged_of_20_rows_on():
    away_m = np.linspace(100.0, 500.0, 20)
    (note,) = notes(np.round(away_m), "LTE", away_m)
    assert "distances of the steps are 78.1 times those of the positions (metres for" in note
    assert notes(np.round(away_m)[:19], "LTE", away_m[:19]) == ()


@pytest.mark.parametrize(
    ("times", "told"),
    [(1.24, True), (1.26, False), (1 / 1.24, True), (1 / 1.27, False), (1 / 78.07, False)],
)
def test_metres_for_steps_are_within_a_quarter_of_the_distances(times, told):
    away_m = np.linspace(300.0, 900.0, 30)
    assert bool(notes(np.round(times * away_m), "LTE", away_m)) == told


@pytest.mark.parametrize(
    ("away_m", "family", "cause"),
    [
        # Steps of 78 m with a mean of 2 and more, where those of GSM are expected.
        (160.0, "GSM", "(steps of LTE?)"),
        (160.0, None, "(steps of LTE, without a technology?)"),
        (150.0, "GSM", ""),
        (1200.0, "LTE", ""),
    ],
)
def test_steps_of_another_technology(away_m, family, cause):
    steps = np.append(np.full(40, np.floor(away_m / 78.07)), [2.0])
    found = notes(steps, family, np.full(41, away_m))
    assert len(found) == bool(cause)
    assert cause in "".join(found)


def test_steps_of_gsm_where_those_of_lte_are_expected():
    away_m = np.full(30, 2300.0)
    (note,) = notes(np.full(30, 4), "LTE", away_m)
    assert note.endswith("0.136 times those of the positions (steps of GSM?)")


@pytest.mark.parametrize(("beyond", "told"), [(15, False), (16, True)])
def test_more_than_half_beyond_63_are_no_steps_of_gsm(beyond, told):
    steps = np.repeat([64.0, 63.0], [beyond, 30 - beyond])
    found = notes(steps, "GSM")
    assert bool(found) == told
    if told:
        assert "53% of 30 are above 63, the most of GSM (metres for steps?)" in found[0]


def differences(values):
    rows = {"time_s": np.arange(float(len(values))), "cell": "B", "reference": "A"}
    return pd.DataFrame(rows | {"difference_m": np.asarray(values, dtype=float)})


@pytest.mark.parametrize(
    ("beyond", "apart_m", "told"), [(5, 1000.0, False), (6, 1000.0, True), (6, 49.0, False)]
)
def test_a_quarter_of_differences_beyond_the_distance_of_sites_are_another_unit(
    beyond, apart_m, told
):
    """Without deviations, three times √2 · 100 m are errors."""
    most_m = apart_m + 3 * 2**0.5 * 100
    values = np.repeat([most_m + 1, most_m - 1], [beyond, 20 - beyond])
    found = range_notes(make_log(CRS, tdoa=differences(values)), plan(apart_m))
    assert bool(found) == told
    assert range_notes(make_log(CRS, tdoa=differences(values[:19])), plan(apart_m)) == ()
