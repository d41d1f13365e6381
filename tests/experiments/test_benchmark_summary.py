"""Figures of a case of the benchmark, out of the rows of its runs."""

from dataclasses import fields
from math import isnan, sqrt

import numpy as np
import pytest
from scipy import stats

from mapfilter.evaluation.stanford import REGIONS
from mapfilter.experiments.benchmarks.cases import CASES
from mapfilter.experiments.benchmarks.results import CaseResult, summarise

CASE = CASES["levels-6"]
Z = 1.959963984540054


def run(**changed):
    return {
        "success": True,
        "wrong": False,
        "switch_m": 100.0,
        "error_mean_m": 2.0,
        "error_67_m": 3.0,
        "error_95_m": 4.0,
        "worst_100m_m": 10.0,
        "seconds": 1.0,
        "km": 1.0,
        "epochs": 100,
        "claimed": 80,
        "within_50m": 80,
        "covered_50": 40,
        "covered_67": 60,
        "covered_95": 76,
        "covered_99": 79,
        "converged": 2,
        "wrong_converged": 0,
        "available": 70,
        "misleading": 1,
        "hazardous": 0,
        "unavailable": 8,
        "unavailable_misleading": 1,
        "protection_m": 21.0,
        "false_converged": 0,
        "false_lost": 0,
        "lost": 0,
    } | changed


def wilson(share, runs):
    centre = (share + Z * Z / (2 * runs)) / (1 + Z * Z / runs)
    half = Z / (1 + Z * Z / runs) * sqrt(share * (1 - share) / runs + (Z / (2 * runs)) ** 2)
    return centre - half, centre + half


def drawn_again(parts, wholes):
    """The percentile bootstrap of scipy, over runs."""
    found = stats.bootstrap(
        (np.array(parts, dtype=float), np.array(wholes, dtype=float)),
        lambda a, b, axis: a.sum(axis=axis) / b.sum(axis=axis),
        paired=True, vectorized=True, n_resamples=4000, method="percentile",
        rng=np.random.default_rng(8),
    )  # fmt: skip
    return found.confidence_interval.low, found.confidence_interval.high


def clustered(parts, wholes):
    """Wilson's interval for as many independent epochs as the scatter of the runs tells."""
    share = sum(parts) / sum(wholes)
    count = len(parts)
    squares = sum((a - share * b) ** 2 for a, b in zip(parts, wholes, strict=True))
    variance = count / (count - 1) * squares / sum(wholes) ** 2
    return wilson(share, share * (1 - share) / variance)


def test_success_wrong_and_their_intervals():
    rows = [run() for _ in range(6)]
    rows += [run(success=False, wrong=True) for _ in range(3)] + [run(success=False)]
    found = summarise(CASE, "bayes", rows)
    assert (found.name, found.filter, found.runs) == ("levels-6", "bayes", 10)
    assert (found.success, found.wrong) == (0.6, 0.3)
    assert (found.success_low, found.success_high) == pytest.approx(wilson(0.6, 10))
    assert (found.wrong_low, found.wrong_high) == pytest.approx(wilson(0.3, 10))


def test_thirty_runs_without_a_fault_may_still_fail_in_one_of_nine():
    found = summarise(CASE, "bayes", [run() for _ in range(30)])
    assert found.success_low == pytest.approx(30 / (30 + Z * Z))
    assert round(found.success_low, 2) == 0.89
    assert found.success_high == 1.0
    # So may the coverage, however many epochs each run has.
    rows = [run(claimed=80, covered_95=80, within_50m=80) for _ in range(30)]
    found = summarise(CASE, "bayes", rows)
    assert found.coverage_95_low == pytest.approx(30 / (30 + Z * Z))
    assert found.within_50m_low == pytest.approx(30 / (30 + Z * Z))


def test_shares_are_pooled_over_epochs_and_their_intervals_are_of_runs():
    claimed, held, near = [10, 80, 60, 0], [10, 40, 57, 0], [5, 80, 60, 0]
    rows = [
        run(claimed=c, covered_95=h, within_50m=n, covered_50=c // 10, covered_67=c // 5)
        for c, h, n in zip(claimed, held, near, strict=True)
    ]
    found = summarise(CASE, "bayes", rows)
    assert found.claimed == pytest.approx(150 / 400)
    assert found.coverage_95 == pytest.approx(107 / 150)
    assert found.coverage_50 == pytest.approx(15 / 150)
    assert found.coverage_67 == pytest.approx(30 / 150)
    assert found.within_50m == pytest.approx(145 / 150)
    # The run without any claim is no cluster.
    expected = clustered(held[:3], claimed[:3])
    assert (found.coverage_95_low, found.coverage_95_high) == pytest.approx(expected)
    expected = clustered(near[:3], claimed[:3])
    assert (found.within_50m_low, found.within_50m_high) == pytest.approx(expected)
    # Epochs of a run are alike: 150 of them tell less than 150 independent ones.
    apart = wilson(107 / 150, 150)
    assert found.coverage_95_high - found.coverage_95_low > 1.5 * (apart[1] - apart[0])


def test_errors_are_means_over_successful_runs():
    rows = [
        run(error_mean_m=2.0, error_67_m=4.0, error_95_m=6.0),
        run(error_mean_m=4.0, error_67_m=8.0, error_95_m=12.0),
        run(success=False, wrong=True, error_mean_m=900.0, error_67_m=900.0, error_95_m=900.0),
        run(success=False, error_mean_m=None, error_67_m=None, error_95_m=None),
    ]
    found = summarise(CASE, "bayes", rows)
    assert (found.error_mean_m, found.error_67_m, found.error_95_m) == (3.0, 6.0, 9.0)


def test_metres_until_converged_are_of_all_that_did():
    rows = [run(switch_m=100.0 * (i + 1), success=i % 2 == 0) for i in range(10)]
    rows.append(run(success=False, switch_m=None))
    found = summarise(CASE, "bayes", rows)
    assert (found.switch_mean_m, found.switch_p90_m) == (550.0, 900.0)


def test_the_worst_100_m_are_of_all_that_claimed():
    rows = [run(worst_100m_m=float(i + 1), success=i < 5) for i in range(20)]
    rows.append(run(success=False, worst_100m_m=None))
    found = summarise(CASE, "bayes", rows)
    assert (found.worst_100m_mean_m, found.worst_100m_95_m) == (10.5, 19.0)


def test_events_by_journey_and_by_kilometre():
    rows = [
        run(km=0.5, false_converged=2, false_lost=1, lost=3),
        run(km=1.5, false_converged=1, false_lost=0, lost=1),
        run(km=2.0, false_converged=0, false_lost=0, lost=0),
    ]
    found = summarise(CASE, "bayes", rows)
    assert found.false_converged_per_journey == 1.0
    assert found.false_converged_per_km == 0.75
    assert found.false_lost_per_journey == pytest.approx(1 / 3)
    assert found.false_lost_per_km == 0.25
    assert found.lost_per_km == 1.0


def test_seconds_are_the_median_and_windows_the_mean():
    rows = [run(seconds=s, window_median_m=w) for s, w in ((1, 10.0), (2, None), (9, 30.0))]
    found = summarise(CASE, "bayes", rows)
    assert (found.seconds_per_track, found.window_median_m) == (2.0, 20.0)
    assert isnan(summarise(CASE, "bayes", [run()]).window_median_m)


def test_runs_that_claim_nothing():
    names = ("claimed", "within_50m", "covered_50", "covered_67", "covered_95", "converged")
    nothing = dict.fromkeys(names, 0) | dict.fromkeys((*REGIONS, "covered_99", "protection_m"))
    lost = dict.fromkeys(("switch_m", "error_mean_m", "error_67_m", "error_95_m", "worst_100m_m"))
    found = summarise(CASE, "bayes", [run(success=False, **nothing, **lost) for _ in range(5)])
    assert (found.success, found.wrong, found.claimed) == (0.0, 0.0, 0.0)
    assert isnan(found.coverage_95)
    assert isnan(found.within_50m)
    assert (found.coverage_95_low, found.coverage_95_high) == (0.0, 1.0)
    assert isnan(found.worst_100m_mean_m)
    assert isnan(found.error_mean_m)
    assert isnan(found.coverage_99)
    assert isnan(found.protection_m)
    assert (found.epochs_available, found.converged) == (0, 0)
    assert (found.hazardous_low, found.hazardous_high) == (0.0, 1.0)


def test_intervals_of_shares_draw_runs_again():
    rng = np.random.default_rng(6)
    claimed = rng.integers(20, 400, 30)
    held = rng.binomial(claimed, rng.beta(8, 2, 30))
    rows = [
        run(claimed=int(c), covered_50=int(h), covered_99=int(h), within_50m=int(h))
        for c, h in zip(claimed, held, strict=True)
    ]
    found = summarise(CASE, "bayes", rows)
    low, high = drawn_again(held, claimed)
    for name in ("coverage_50", "coverage_99", "within_50m"):
        assert getattr(found, f"{name}_low") == pytest.approx(low, abs=0.006)
        assert getattr(found, f"{name}_high") == pytest.approx(high, abs=0.006)
    assert found.off_50m == pytest.approx(1 - found.within_50m)
    assert found.off_50m_low == pytest.approx(1 - found.within_50m_high)


def test_a_run_without_a_99_percent_radius_does_not_count_for_it():
    rows = [run(claimed=80, covered_99=76), run(claimed=900, covered_99=None)]
    assert summarise(CASE, "bayes", rows).coverage_99 == pytest.approx(76 / 80)


def test_wrong_converged_is_a_share_of_all_converged():
    rows = [run(converged=3, wrong_converged=1), run(converged=1), run(converged=0)]
    found = summarise(CASE, "bayes", rows)
    assert (found.converged, found.wrong_converged) == (4, 0.25)
    none = summarise(CASE, "bayes", [run(converged=1) for _ in range(40)])
    assert none.wrong_converged_high == pytest.approx(Z * Z / (40 + Z * Z))


def test_regions_are_counted_over_the_runs_with_levels():
    without = dict.fromkeys((*REGIONS, "protection_m"))
    rows = [
        run(), run(available=10, misleading=0, hazardous=5, unavailable=5), run(**without),
    ]  # fmt: skip
    found = summarise(CASE, "bayes", rows)
    counted = {name: getattr(found, f"epochs_{name}") for name in REGIONS}
    assert list(counted.values()) == [80, 1, 5, 13, 2]
    assert found.hazardous == pytest.approx(5 / 101)
    assert found.misleading == pytest.approx(1 / 101)
    assert found.available == pytest.approx(80 / 101)
    # An error above the level is one, whether the position was available or not.
    assert found.exceeded == pytest.approx(8 / 101)
    assert found.protection_m == 21.0


def test_a_median_level_counts_infinite_ones():
    rows = [run(protection_m=level) for level in (9.0, None, None)]
    assert summarise(CASE, "bayes", rows).protection_m == float("inf")


def test_every_figure_of_a_case_depends_on_its_rows():
    """No figure is left at a constant: rows that differ in all columns change all of them."""
    rng = np.random.default_rng(4)

    def rows(seed_shift):
        made = []
        for i in range(12):
            change = {
                name: float(rng.uniform(1, 100)) + seed_shift
                for name, value in run().items()
                if isinstance(value, float)
            }
            counts = np.sort(rng.integers(1 + seed_shift, 40 + seed_shift, 7))
            names = (
                "covered_50", "covered_67", "covered_95", "covered_99", "within_50m", "claimed",
                "epochs",
            )  # fmt: skip
            change |= {name: int(count) for name, count in zip(names, counts, strict=True)}
            change |= {
                name: int(rng.integers(1, 9)) for name in ("lost", "false_lost", "false_converged")
            }
            change |= {name: int(rng.integers(1, 90)) for name in REGIONS}
            change["converged"] = int(rng.integers(9, 90))
            change["wrong_converged"] = int(rng.integers(1, 9))
            change |= {"success": i % (2 + seed_shift) == 0, "wrong": i % (3 + seed_shift) == 1}
            change |= {
                "fault_noticed_s": float(rng.uniform(1, 9)) if i % (2 + seed_shift) else None,
                "fault_unnoticed": i % (3 + seed_shift) == 1,
            }
            made.append(run(**change, window_median_m=float(rng.uniform(1, 9))))
        return made

    one, other = summarise(CASE, "bayes", rows(0)), summarise(CASE, "bayes", rows(1))
    same = [
        field.name
        for field in fields(CaseResult)
        if getattr(one, field.name) == getattr(other, field.name)
    ]
    assert same == ["name", "filter", "runs"]
    assert not any(isnan(getattr(one, f.name)) for f in fields(CaseResult)[2:])
