"""Scores of single runs of the benchmark, by hand on a straight walk of 10 m/s."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from walked_line import estimate, line, located, walked

from mapfilter.evaluation.stanford import IntegrityOptions
from mapfilter.experiments.benchmarks.cases import CASES
from mapfilter.experiments.benchmarks.scores import score, score_window

USUAL, SMOOTH = CASES["levels-6"], CASES["smooth-6"]
RECOVERY, CELL = CASES["recovery-levels"], CASES["recovery-cell"]


def row(statuses, errors_m, case=USUAL, **more):
    table = line(len(statuses) - 1)
    return score(case, walked(table), located(estimate(table, statuses, errors_m, **more)))


@pytest.mark.parametrize(
    ("error_m", "success", "wrong"),
    [(0, True, False), (50, True, False), (50.01, False, True), (400, False, True)],
)
def test_success_is_at_most_50_m_off_where_it_converged(error_m, success, wrong):
    scored = row("SSCTT", [900, 900, error_m, 10, 10])
    assert (scored["success"], scored["wrong"]) == (success, wrong)
    assert scored["switch_m"] == 20.0


def test_what_comes_later_changes_neither_success_nor_wrong():
    scored = row("SCTT", [900, 10, 300, 300])
    assert (scored["success"], scored["wrong"]) == (True, False)
    scored = row("SCTT", [900, 300, 10, 10])
    assert (scored["success"], scored["wrong"]) == (False, True)


def test_a_run_that_never_converges_is_neither_right_nor_wrong():
    scored = row("SSSS", 5.0)
    assert (scored["success"], scored["wrong"]) == (False, False)
    names = ("switch_m", "error_mean_m", "error_67_m", "error_95_m", "worst_100m_m")
    assert [scored[name] for name in names] == [None] * 5
    assert (scored["claimed"], scored["epochs"]) == (0, 4)


def test_errors_count_from_where_it_converged():
    # 900 m before it do not count: the mean of 0, 10, 20, 30; 67 % of four are three.
    scored = row("SSSCTTT", [900, 900, 900, 0, 10, 20, 30])
    found = [scored[name] for name in ("error_mean_m", "error_67_m", "error_95_m")]
    assert found == pytest.approx([15.0, 20.0, 30.0])


def test_smoothed_tracks_count_from_the_start():
    errors = [40, 40, 40, 0, 10, 20, 30]
    scored = row("SSSCTTT", errors, SMOOTH)
    found = [scored[name] for name in ("error_mean_m", "error_67_m", "error_95_m")]
    # Ordered: 0 10 20 30 40 40 40; 67 % of seven are five.
    assert found == pytest.approx([180 / 7, 40.0, 40.0])
    assert (scored["success"], scored["switch_m"]) == (True, 30.0)
    assert row("SSC", [np.nan, 20, 10], SMOOTH)["error_mean_m"] == pytest.approx(15.0)


def test_claims_are_taken_over():
    scored = row("SCTLTT", [900, 60, 25, 0, 5, 5], radii_m=(10, 20, 30))
    assert scored["case"] == "levels-6"
    assert scored["seconds"] == 0.5
    assert scored["km"] == pytest.approx(0.05)
    names = ("epochs", "claimed", "within_50m", "covered_50", "covered_67", "covered_95")
    assert [scored[name] for name in names] == [6, 4, 3, 2, 2, 3]
    assert [scored[name] for name in ("false_converged", "false_lost", "lost")] == [1, 1, 1]
    assert scored["worst_100m_m"] == pytest.approx(19.0)


# A displacement: 20 s of 10 m/s to the east, 500 m at once to the north, 60 s to the east.
TRUTH = pd.DataFrame(
    {
        "time_s": np.arange(81.0),
        "east_m": np.concatenate([10.0 * np.arange(21), 200.0 + 10.0 * np.arange(60)]),
        "north_m": np.concatenate([np.zeros(21), np.full(60, 500.0)]),
    }
)


def recovered(errors_m, case=RECOVERY, statuses=None, **more):
    statuses = statuses or "C" + 80 * "T"
    found = estimate(TRUTH, statuses, errors_m, **more)
    return score(case, walked(TRUTH, 20.0), located(found))


def errors_after(*parts):
    """Errors of the 60 epochs after the displacement, as (how many, how far off)."""
    after = np.concatenate([np.full(count, float(error_m)) for count, error_m in parts])
    assert after.size == 60
    return np.concatenate([np.zeros(21), after])


def test_recovery_is_within_50_m_again_for_10_s():
    scored = recovered(errors_after((15, 500), (45, 20)))
    assert scored["success"] is True
    assert scored["wrong"] is False
    # The displacement itself is not travelled: from the first epoch after it, 15 steps.
    assert scored["switch_m"] == pytest.approx(150.0)
    assert scored["error_mean_m"] == pytest.approx(20.0)


def test_a_metre_is_enough_to_ask_for_a_recovery():
    near = recovered(errors_after((60, 20)), replace(RECOVERY, recovery_within_m=1.0))
    assert (near["success"], near["switch_m"]) == (True, 0.0)


def test_being_near_for_less_than_10_s_is_no_recovery():
    # Ten epochs are 9 s.
    scored = recovered(errors_after((15, 500), (10, 20), (5, 200), (30, 30)))
    assert scored["switch_m"] == pytest.approx(300.0)
    assert scored["error_mean_m"] == pytest.approx(30.0)
    scored = recovered(errors_after((15, 500), (11, 20), (5, 200), (29, 30)))
    assert scored["switch_m"] == pytest.approx(150.0)
    # From there on, what was lost again counts, too.
    assert scored["error_mean_m"] == pytest.approx((11 * 20 + 5 * 200 + 29 * 30) / 45)


def test_a_recovery_too_late_is_none_and_not_wrong():
    late = errors_after((35, 500), (25, 20))
    scored = recovered(late)
    assert (scored["success"], scored["wrong"]) == (False, False)
    assert scored["switch_m"] == pytest.approx(350.0)
    # With cells alone there are 700 m.
    assert recovered(late, CELL)["success"] is True
    assert recovered(errors_after((30, 500), (30, 20)))["success"] is True
    assert recovered(errors_after((31, 500), (29, 20)))["success"] is False


def test_far_off_at_the_end_is_wrong():
    scored = recovered(errors_after((60, 500)))
    assert (scored["success"], scored["wrong"], scored["switch_m"]) == (False, True, None)
    assert scored["error_mean_m"] is None
    # Found again, and lost in the end.
    scored = recovered(errors_after((5, 500), (40, 20), (15, 90)))
    assert (scored["success"], scored["wrong"]) == (True, True)
    # Near at the end, but not for long enough.
    scored = recovered(errors_after((55, 500), (5, 20)))
    assert (scored["success"], scored["wrong"], scored["switch_m"]) == (False, False, None)


def test_an_unknown_position_is_not_wrong():
    errors = errors_after((30, 500), (30, 500))
    errors[-3:] = np.nan
    assert recovered(errors)["wrong"] is False


def test_a_displacement_that_is_never_noticed_needs_no_metres():
    assert recovered(errors_after((60, 20)))["switch_m"] == pytest.approx(0.0)


def test_before_a_displacement_claims_count_and_after_it_none():
    errors = errors_after((60, 500))
    scored = recovered(errors, statuses="CT" + 18 * "T" + "T" + 5 * "T" + 55 * "L")
    assert scored["km"] == pytest.approx(0.2)
    assert (scored["epochs"], scored["claimed"], scored["within_50m"]) == (21, 21, 21)
    assert (scored["lost"], scored["false_lost"], scored["false_converged"]) == (0, 0, 0)


def test_epochs_within_the_displacement_do_not_shorten_the_way_back():
    """With epochs at every half second, the carried 500 m are still not travelled."""
    time_s = np.arange(0.0, 80.5, 0.5)
    errors = np.where(time_s <= 20.0, 0.0, np.where(time_s < 36.0, 500.0, 20.0))
    statuses = "C" + (time_s.size - 1) * "T"
    scored = recovered(errors, statuses=statuses, time_s=time_s)
    assert scored["switch_m"] == pytest.approx(150.0)


def test_a_window_of_two_minutes():
    table = line(400)
    errors = np.full(401, 7.0)
    errors[100:220] = np.tile([10.0, 20.0, 30.0], 40)
    errors[220] = 10_000.0
    found = located(estimate(table, "C" + 400 * "T", errors))
    assert score_window(walked(table), found, 100.0) == {"window_median_m": 20.0}
    # What was not claimed is not known.
    statuses = 160 * "S" + "C" + 240 * "T"
    errors[100:160] = 500.0
    found = located(estimate(table, statuses, errors))
    assert score_window(walked(table), found, 100.0) == {"window_median_m": 20.0}
    found = located(estimate(table, 401 * "S", errors))
    assert score_window(walked(table), found, 100.0) == {"window_median_m": None}


def test_the_end_of_a_window_is_not_in_it():
    table = line(400)
    # 60 epochs of 10 m and 60 of 30 m; an epoch more at either end would tip the median.
    errors = np.where(np.arange(401) < 160, 10.0, 30.0)
    found = located(estimate(table, "C" + 400 * "T", errors))
    assert score_window(walked(table), found, 100.0) == {"window_median_m": 20.0}


def test_claimed_epochs_are_counted_in_the_regions_of_the_stanford_diagram():
    # Available, misleading, hazardous, unavailable, both; searching epochs do not count.
    errors_m = [900, 5, 30, 60, 5, 90, 5]
    levels_m = [10, 20, 20, 20, 80, 80, np.inf]
    scored = row("SCTTTTT", errors_m, levels_m=levels_m)
    names = ("available", "misleading", "hazardous", "unavailable", "unavailable_misleading")
    assert [scored[name] for name in names] == [1, 1, 1, 2, 1]
    assert scored["protection_m"] == 50.0
    assert sum(epochs for _, _, epochs in scored["stanford"]) == 6
    # With another alert limit the same levels are of use, or not.
    wide = score(
        USUAL,
        walked(line(6)),
        located(estimate(line(6), "SCTTTTT", errors_m, levels_m=levels_m)),
        IntegrityOptions(alert_limit_m=85.0),
    )
    assert [wide[name] for name in names] == [2, 2, 1, 1, 0]


def test_after_a_displacement_levels_do_not_count():
    table = line(9)
    found = estimate(table, "CTTTTTTTTT", 5.0, levels_m=20.0)
    scored = score(RECOVERY, walked(table, 4.0), located(found))
    assert scored["available"] == 5


def test_filters_without_levels_have_no_regions():
    scored = row("SCTT", [900, 5, 5, 5])
    assert (scored["available"], scored["protection_m"], scored["covered_99"]) == (None, None, None)
    assert scored["stanford"] == []
    assert row("SCTT", 5.0, wide_m=[1, 9, 4, 9])["covered_99"] == 2


def test_levels_that_are_mostly_infinite_have_no_median():
    scored = row("CTTT", 5.0, levels_m=[np.inf, np.inf, np.inf, 20.0])
    assert scored["protection_m"] is None
    assert (scored["available"], scored["unavailable"]) == (1, 3)
