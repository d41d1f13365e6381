"""Time differences and timing advances in other units are found by the sites of a plan."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.checks.range_units import range_notes, with_range_notes
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"
EAST_M, NORTH_M = 385_000.0, 6_672_000.0
SITES_M = {"A": (0.0, 0.0), "B": (2000.0, 100.0), "C": (900.0, 1800.0), "D": (300.0, 900.0)}
LIGHT_MPS, LTE_STEP_M, GSM_STEP_M = 299_792_458, 78.07, 553.5


def plan(technology=None):
    cells = (
        Cell(n, n, EAST_M + x, NORTH_M + y, 30.0, None, 44.0, 1800.0, "omni", technology=technology)
        for n, (x, y) in SITES_M.items()
    )
    return CellPlan(CRS, tuple(cells))


def way(far_m=0.0):
    """A walk among the sites."""
    time_s = np.arange(0.0, 300.0, 2.0)
    east_m, north_m = EAST_M + 200 + 5 * time_s + far_m, NORTH_M + 300 + 2 * time_s
    return pd.DataFrame({"time_s": time_s, "east_m": east_m, "north_m": north_m})


def distances_m(truth):
    return {
        name: np.hypot(truth["east_m"] - EAST_M - x, truth["north_m"] - NORTH_M - y).to_numpy()
        for name, (x, y) in SITES_M.items()
    }


def differences(by=1.0, sd_m=30.0):
    truth, rng = way(), np.random.default_rng(5)
    away_m = distances_m(truth)
    rows = [
        pd.DataFrame(
            {
                "time_s": truth["time_s"],
                "cell": name,
                "reference": "A",
                "difference_m": by * (away_m[name] - away_m["A"] + rng.normal(0, sd_m, len(truth))),
            }
        )
        for name in "BCD"
    ]
    return pd.concat(rows)


def advances(step_m, technology=None, far_m=0.0):
    truth = way(far_m)
    steps = np.floor(distances_m(truth)["A"] / step_m).astype(int)
    rows = {"time_s": truth["time_s"], "role": "serving", "cell": "A", "timing_advance": steps}
    return pd.DataFrame(rows | ({"technology": technology} if technology else {}))


NANO, MICRO = 1e9 / LIGHT_MPS, 1e6 / LIGHT_MPS


@pytest.mark.parametrize(
    ("by", "with_truth", "without"),
    [
        (1.0, "", ""),
        (NANO, "times those of the positions (nanoseconds for metres?)", "nanoseconds"),
        (MICRO, "times those of the positions (microseconds", "kilometres or microseconds"),
        (1e-3, "times those of the positions (kilometres", "kilometres or microseconds"),
        # Without positions any sign is possible.
        (-1.0, "times those of the positions (the sign the other way round", ""),
    ],
)
def test_differences_of_distances(by, with_truth, without):
    for truth, told in ((way(), with_truth), (None, without)):
        log = make_log(CRS, tdoa=differences(by), truth=truth)
        notes = range_notes(log, plan())
        assert len(notes) == bool(told)
        assert all(note.startswith("tdoa, difference_m: ") for note in notes)
        assert told in "".join(notes)
        assert with_range_notes(log, plan()).notes == (*log.notes, *notes)


def test_noise_is_no_other_unit():
    log = make_log(CRS, tdoa=differences(sd_m=300.0).assign(sigma_m=300.0))
    assert range_notes(log, plan()) == ()
    # One pair tells nothing: all of a log may be half way between both.
    one = differences(1e-3).query("cell == 'B'")
    assert range_notes(make_log(CRS, tdoa=one), plan()) == ()


@pytest.mark.parametrize(
    ("step_m", "technology", "told"),
    [
        (LTE_STEP_M, "LTE", ""),
        (GSM_STEP_M, "GSM", ""),
        (GSM_STEP_M, None, ""),
        (1.0, "LTE", "metres for steps?"),
        (1.0, None, "metres for steps?"),
        (LTE_STEP_M, None, "steps of LTE, without a technology?"),
        (GSM_STEP_M, "LTE", "steps of GSM?"),
    ],
)
def test_timing_advances_beside_positions(step_m, technology, told):
    # Near enough for metres in the range of steps, or so far that there are several steps.
    far_m = -1000.0 if step_m == 1.0 else 6000.0
    log = make_log(CRS, radio=advances(step_m, technology, far_m), truth=way(far_m))
    notes = range_notes(log, plan())
    assert len(notes) == bool(told)
    assert told in "".join(notes)
    # The plan may state the technology.
    if technology:
        log = make_log(CRS, radio=advances(step_m, None, far_m), truth=way(far_m))
        assert len(range_notes(log, plan(technology))) == bool(told)


def test_timing_advances_beyond_their_range():
    log = make_log(CRS, radio=advances(1.0))
    (note,) = range_notes(log, plan())
    assert "are above 63, the most of GSM (metres for steps, or LTE without a technology?)" in note
    assert range_notes(log, plan("LTE")) == ()
    (note,) = range_notes(make_log(CRS, radio=advances(1.0, far_m=2000.0)), plan("LTE"))
    assert "are above 1282, the most of LTE (metres for steps?)" in note
    assert range_notes(make_log(CRS, radio=advances(GSM_STEP_M)), plan()) == ()


def test_timing_advances_beyond_a_stated_technology_are_refused():
    with pytest.raises(
        InputError, match=r"expected 0\.\.1282 in LTE, .*\(likely: metres for steps\)"
    ):
        make_log(CRS, radio=advances(1.0, "LTE", 2000.0))


def test_a_log_in_another_system_is_not_judged():
    log = make_log("EPSG:32634", tdoa=differences(NANO))
    assert range_notes(log, plan()) == ()
