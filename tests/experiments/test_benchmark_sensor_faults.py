"""Scores of faults of the sensors, by hand: when wrong claims begin, and when they end."""

import numpy as np
import pytest
from walked_line import estimate, line, located

from mapfilter.experiments.benchmarks.journeys import Walk
from mapfilter.experiments.benchmarks.results import summarise
from mapfilter.experiments.benchmarks.scores import score
from mapfilter.experiments.benchmarks.world_cases import FOREIGN, SENSORS
from mapfilter.simulation.worlds.sensor_faults import SENSOR_FAULTS

CASE = SENSORS["motion-ends"]


def row(statuses, errors_m, fault_at_s=2.5):
    table = line(len(statuses) - 1)
    found = located(estimate(table, statuses, errors_m))
    return score(CASE, Walk(table, fault_at_s=fault_at_s), found)


def since_fault(*args, **options):
    scored = row(*args, **options)
    return tuple(scored[f"fault_{name}"] for name in ("wrong_s", "noticed_s", "unnoticed"))


def test_nothing_wrong_is_claimed():
    assert since_fault("SCTTTTT", 10.0) == (None, None, False)
    assert since_fault("SCTLLLL", [0, 0, 0, 90, 90, 90, 90]) == (None, None, False)


def test_50_m_is_not_wrong():
    assert since_fault("SCTTTTT", [0, 0, 0, 50, 50, 50, 50]) == (None, None, False)


def test_a_wrong_claim_ends_with_the_claim():
    assert since_fault("SCTTTLL", [0, 0, 0, 10, 60, 90, 90]) == (1.5, 2.5, False)


def test_a_wrong_claim_ends_within_50_m_again():
    assert since_fault("SCTTTTT", [0, 0, 0, 60, 60, 60, 10]) == (0.5, 3.5, False)


def test_later_wrong_claims_do_not_count():
    assert since_fault("SCTTTTT", [0, 0, 0, 60, 10, 60, 60]) == (0.5, 1.5, False)


def test_a_wrong_claim_that_lasts_is_never_noticed():
    assert since_fault("SCTTTTT", [0, 0, 0, 10, 60, 70, 80]) == (1.5, 3.5, True)


def test_wrong_claims_before_the_fault_do_not_count():
    assert since_fault("SCTTTTT", [0, 90, 90, 10, 10, 10, 10]) == (None, None, False)
    assert since_fault("SCTTTTT", [0, 90, 90, 10, 10, 10, 10], fault_at_s=0.0)[0] == 1.0


def test_when_the_fault_held_stands_in_the_row():
    table = line(3)
    found = located(estimate(table, "SCTT", 10.0))
    scored = score(CASE, Walk(table, fault_at_s=1.5, fault_until_s=2.5), found)
    assert (scored["fault_at_s"], scored["fault_until_s"]) == (1.5, 2.5)
    assert row("SCTT", 10.0)["fault_until_s"] is None


def test_without_a_fault_there_is_no_such_score():
    table = line(3)
    scored = score(CASE, Walk(table), located(estimate(table, "SCTT", 10.0)))
    assert not [name for name in scored if name.startswith("fault_")]
    result = summarise(FOREIGN["levels-6"], "bayes", [scored])
    assert np.isnan([result.fault_wrong, result.fault_unnoticed, result.fault_noticed_s]).all()


def test_runs_are_put_together():
    rows = [
        row("SCTTTTT", 10.0),
        row("SCTTTLL", [0, 0, 0, 10, 60, 90, 90]),
        row("SCTTTTT", [0, 0, 0, 60, 60, 60, 10]),
        row("SCTTTTT", [0, 0, 0, 10, 10, 10, 60]),
    ]
    found = summarise(CASE, "bayes", rows)
    assert (found.fault_wrong, found.fault_unnoticed) == (0.75, 0.25)
    assert (found.fault_noticed_s, found.fault_noticed_max_s) == (3.5, 3.5)
    # Wrong are 0 + 1 + 3 + 1 of 6 + 4 + 6 + 6 claimed epochs.
    assert found.off_50m == pytest.approx(5 / 22)


def test_the_cases_are_the_faults():
    assert list(SENSORS) == list(SENSOR_FAULTS)
    assert all(case.sensor == name for name, case in SENSORS.items())
