"""The plan of a sweep: its grid, its batches, its seeds, and what is refused."""

import pickle
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import ConfigError
from mapfilter.experiments.sweep.journeys import filter_rng, imu_rng, radio_rng, route_rng
from mapfilter.experiments.sweep.noises import noise_grid
from mapfilter.experiments.sweep.plan import LONGEST_BATCH, Radio, Reading, SweepPlan
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.custom_filter import CustomFilter
from mapfilter.simulation.journeys import JourneyPlan
from mapfilter.simulation.walking import WalkerModel
from mapfilter.tracks.imu_noise import ImuNoise

SET = Reading("set", CandidateFilter(margin_db=0.0), 22.0)
LIST = Reading("list", CandidateFilter(duplicates="list", threshold=10), 22.0)


def plan(**changed):
    given = {
        "readings": (SET, LIST),
        "databases": ("a", "b"),
        "noises": noise_grid((0.0, 0.2), (0.0, 3.0, 6.0)),
        "radios": (Radio(), Radio("ground truth 7 dB", 7.0)),
        "report_periods_s": (1.0, 16.0),
        "routes": 3,
        "draws": 2,
    }
    return SweepPlan(**{**given, **changed})


def test_a_grid_holds_every_combination_once():
    whole = plan()
    runs = list(whole.select(0, whole.runs))
    assert whole.runs == len(runs) == len(set(runs)) == 2 * 2 * 3 * 6 * 2 * 2 * 2
    assert {run.noise for run in runs} == set(whole.noises)
    assert {(run.radio.name, run.report_period_s) for run in runs} == {
        (radio, period) for radio in ("as_predicted", "ground truth 7 dB") for period in (1.0, 16.0)
    }
    assert all(run.imu_period_s == run.report_period_s for run in runs)
    # A route's runs lie together, so that it is made once.
    places = [(run.radio, run.report_period_s, run.route) for run in runs]
    changes = sum(a != b for a, b in pairwise(places))
    assert changes == 2 * 2 * 3 - 1


@given(st.integers(1, 400), st.integers(1, 300))
def test_batches_hold_all_runs_in_order(routes, draws):
    whole = plan(routes=routes, draws=draws)
    batches = list(whole.batches())
    assert batches[0][0] == 0
    assert batches[-1][1] == whole.runs
    assert all(a[1] == b[0] for a, b in pairwise(batches))
    assert all(0 < end - first <= LONGEST_BATCH for first, end in batches)


def test_a_batch_is_a_part_of_the_whole():
    whole = plan()
    runs = list(whole.select(0, whole.runs))
    assert [run for part in whole.batches() for run in whole.select(*part)] == runs


def drawn(rng):
    return rng.standard_normal(4).tolist()


def seeds_of(some):
    """What each run draws, by the run."""
    return {
        run: [
            drawn(route_rng(some.seed, run.route)),
            drawn(radio_rng(some.seed, run.route, run.radio, run.report_period_s)),
            drawn(imu_rng(some.seed, run)),
            drawn(filter_rng(some.seed, run)),
        ]
        for run in some.select(0, some.runs)
    }


@pytest.mark.parametrize(
    "more",
    [
        {"noises": noise_grid((0.0, 0.1, 0.2), (0.0, 1.0, 3.0, 6.0))},
        {"noises": noise_grid((0.2, 0.0), (6.0, 3.0, 0.0))},
        {"routes": 5, "draws": 4},
        {"databases": ("c", "b", "a")},
        {"readings": (LIST, replace(SET, name="other"), SET)},
        {"report_periods_s": (16.0, 2.0, 1.0)},
        {"radios": (Radio("ground truth 3 dB", 3.0), Radio("ground truth 7 dB", 7.0), Radio())},
    ],
    ids=str,
)
def test_more_rows_change_no_run_that_was_there(more):
    before, after = seeds_of(plan()), seeds_of(plan(**more))
    assert before.items() <= after.items()
    assert len(after) >= len(before)


def test_filters_and_databases_see_the_same_logs_and_noises_others():
    found = seeds_of(plan())
    logs = {}
    for run, (route, radio, imu, filtered) in found.items():
        key = run.radio, run.report_period_s, run.route, run.noise, run.draw
        logs.setdefault(key, set()).add((tuple(route), tuple(radio), tuple(imu)))
        assert filtered not in (route, radio, imu)
    assert all(len(same) == 1 for same in logs.values())
    imus = {(run.noise, run.route, run.draw, run.imu_period_s): tuple(imu)
            for run, (_, _, imu, _) in found.items()}  # fmt: skip
    assert len(set(imus.values())) == len(imus)
    assert len({tuple(filtered) for *_, filtered in found.values()}) == len(found)


def test_another_seed_is_another_sweep():
    one, other = seeds_of(plan()), seeds_of(plan(seed=1))
    assert all(a != b for run in one for a, b in zip(one[run], other[run], strict=True))


def test_every_fault_of_a_plan_in_one_message():
    with pytest.raises(ConfigError) as caught:
        plan(
            readings=(SET, SET),
            databases=(),
            noises=(ImuNoise(), ImuNoise()),
            report_periods_s=(inf,),
            routes=0,
            draws=0,
            seed=-1,
        )
    text = str(caught.value)
    for told in (
        "readings",
        "databases",
        "noise: expected every value once",
        "period",
        "routes",
        "draws",
        "seed",
    ):
        assert told in text


def test_a_plan_that_would_never_end_is_refused():
    with pytest.raises(ConfigError, match="at most"):
        plan(routes=1_000_000, draws=1_000_000)


def test_digest_changes_with_everything_that_changes_runs():
    changes = (
        {},
        {"seed": 1},
        {"draws": 3},
        {"journey": JourneyPlan(length_m=900.0)},
        {"readings": (SET,)},
        {"readings": (replace(SET, choice=CandidateFilter(threshold=2, margin_db=0.0)), LIST)},
        {"noises": (ImuNoise(translation_noise="as_printed"),)},
        {"noises": (ImuNoise(turns="gyro"),)},
        {"journey": JourneyPlan(walker=WalkerModel(beside="pavement"))},
        {"journey": JourneyPlan(walker=WalkerModel(stop_every_m=300.0))},
        {"imu_periods_s": (1.0,)},
    )
    assert len({plan(**change).digest for change in changes}) == len(changes)
    assert plan().digest == plan().digest


@dataclass(frozen=True)
class ByTurns(CandidateFilter):
    """A filter that a user made of a built-in one."""


@pytest.mark.parametrize(
    ("turns", "choice", "used"),
    [
        ("headings", CandidateFilter(), False),
        ("gyro", CandidateFilter(), False),
        ("headings", ByTurns(), False),
        ("gyro", ByTurns(), True),
        ("gyro", CustomFilter("my_filter:MyFilter"), True),
    ],
)
def test_errors_of_turns_count_where_a_custom_filter_may_use_them(turns, choice, used):
    noise = ImuNoise(turns=turns, gyro_noise_deg_per_sqrt_s=1.0, gyro_bias_deg_per_s=0.1)
    readings = (SET, Reading("other", choice))
    (found,) = plan(noises=(noise,), readings=readings).effective.noises
    assert (found == noise) is used
    assert (found == ImuNoise(turns=turns)) is not used


def test_a_plan_is_sent_to_workers_as_it_is():
    whole = plan()
    sent = pickle.loads(pickle.dumps(whole))
    assert sent == whole
    assert hash(sent) == hash(whole)
    assert len(pickle.dumps(whole)) < 5000


def test_an_axis_of_a_grid_may_be_one_number():
    assert noise_grid(sigma_orient_deg=3, scale=0.1) == noise_grid(
        sigma_orient_deg=[3], scale=(0.1,)
    )
    assert len(noise_grid(np.array([0.0, 0.2]), np.float64(3.0))) == 2
    assert noise_grid(np.array(0.2)) == noise_grid(0.2)


@pytest.mark.parametrize(
    ("axes", "expected"),
    [
        ({"sigma_orient_deg": ()}, "noise_grid, sigma_orient_deg: expected numbers, found none"),
        ({"scale": "0.1"}, "noise_grid, scale: expected numbers, found '0.1'"),
        ({"scale": [0.1, None]}, "noise_grid, scale: expected numbers, found None"),
        ({"others": 3.0}, "noise_grid, others: expected ImuNoise, found 3.0"),
    ],
)
def test_axes_without_numbers_are_named(axes, expected):
    """A grid without noises would be swept with the usual one."""
    with pytest.raises(ConfigError) as caught:
        noise_grid(**axes)
    assert str(caught.value) == expected
