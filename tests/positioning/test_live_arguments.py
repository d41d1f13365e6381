"""What a live application gives to a filter by mistake is refused by its name."""

from collections import deque
from dataclasses import replace

import numpy as np
import pytest

import mapfilter as mf
from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.epoch_checks import check_epoch
from mapfilter.positioning.epochs import Pseudorange, ReportRow

FILTERS = {
    "bayes": mf.BayesFilter(max_particles=600, min_search_particles=300, min_particles=200),
    "candidate": mf.CandidateFilter(),
    "ekf": mf.KalmanFilter(),
}
STEP = MotionStep(1.4, 0.3)
EPOCH = mf.Epoch(0.0, (STEP,), (ReportRow("serving", "W", None, None, -70.0, 0),))


@pytest.fixture(params=FILTERS)
def positioner(request, database):
    return FILTERS[request.param].over(database)


@pytest.mark.parametrize("rng", [0, None, np.random.RandomState(0)])
def test_random_numbers_come_from_a_generator(positioner, rng):
    with pytest.raises(mf.MapfilterError, match=r"^rng: expected a numpy.random.Generator, found"):
        positioner.step(positioner.begin(), EPOCH, rng)


def test_a_known_start_takes_a_generator(database):
    west, south, east, north = database.lattice.bounds_m
    with pytest.raises(
        mf.MapfilterError, match=r"^rng: expected a numpy.random.Generator, found 0"
    ):
        FILTERS["bayes"].over(database).begin_at((west + east) / 2, (south + north) / 2, 10.0, 0)


@pytest.mark.parametrize("other", ["bayes", "candidate", "ekf", None])
def test_a_state_is_one_of_the_filter(positioner, database, other):
    state = None if other is None else FILTERS[other].over(database).begin()
    if type(state) is type(positioner.begin()):
        state = (state,)
    with pytest.raises(mf.MapfilterError, match=r"^state: expected a state of this .*, found a "):
        positioner.step(state, EPOCH, np.random.default_rng(0))


@pytest.mark.parametrize("name", ["motion", "radio", "pseudoranges", "tdoa"])
def test_rows_that_can_be_gone_over_once_are_refused(positioner, name):
    given = replace(EPOCH, **{name: iter(getattr(EPOCH, name))})
    with pytest.raises(mf.MapfilterError, match=f"^epoch, {name}: expected a tuple of"):
        positioner.step(positioner.begin(), given, np.random.default_rng(0))


@pytest.mark.parametrize("kind", [list, deque])
def test_rows_may_be_any_sequence(positioner, kind):
    given = replace(EPOCH, motion=kind(EPOCH.motion), radio=kind(EPOCH.radio))
    (_, found), (_, expected) = (
        positioner.step(positioner.begin(), epoch, np.random.default_rng(0))
        for epoch in (given, EPOCH)
    )
    assert found == expected
    with pytest.raises(mf.MapfilterError, match=r"^epoch, motion\[0\].step_m: expected"):
        check_epoch(replace(given, motion=kind([replace(STEP, step_m=None)])))
    with pytest.raises(mf.MapfilterError, match=r"^epoch, motion: .*, found 'step'"):
        check_epoch(replace(given, motion="step"))


@pytest.mark.parametrize("field", ["step_m", "heading_rad", "turn_rad"])
def test_an_array_of_one_number_is_no_number(positioner, field):
    given = replace(EPOCH, motion=(replace(STEP, **{field: np.array([0.5])}),))
    with pytest.raises(mf.MapfilterError, match=rf"^epoch, motion\[0\].{field}: expected"):
        positioner.step(positioner.begin(), given, np.random.default_rng(0))


def test_numbers_of_numpy_are_numbers(positioner):
    given = replace(EPOCH, motion=(replace(STEP, step_m=np.array(1.4)), STEP))
    _, output = positioner.step(positioner.begin(), given, np.random.default_rng(0))
    assert output.fix.time_s == 0.0


@pytest.mark.parametrize("kind", [tuple, list, np.array])
def test_the_place_of_a_satellite_may_be_an_array(kind):
    given = Pseudorange("G07", 2.2e7, 5.0, kind([2.6e7, 0.0, 0.0]))
    check_epoch(mf.Epoch(0.0, pseudoranges=(given,)))
    for wrong in (given.place_m[:2], kind([2.6e7, 0.0, 1e12]), np.array(2.6e7), np.zeros((3, 2))):
        with pytest.raises(mf.MapfilterError, match=r"^epoch, pseudoranges\[0\].place_m"):
            check_epoch(mf.Epoch(0.0, pseudoranges=(replace(given, place_m=wrong),)))


@pytest.mark.parametrize(
    ("kinds", "found"),
    [
        ("motion", "'motion'"),
        (["motion", "moton"], "'moton'"),
        ([3], "3"),
        (3, "3"),
        (None, "None"),
        ([["motion"]], r"\['motion'\]"),
    ],
)
@pytest.mark.parametrize("name", ["bayes", "ekf"])
def test_kinds_of_a_journey_are_those_of_logs(database, name, kinds, found):
    with pytest.raises(mf.MapfilterError, match=f"^kinds: expected a collection .*, found {found}"):
        FILTERS[name].over(database).begin(kinds)


def test_times_that_go_backwards_are_refused(positioner):
    rng, state = np.random.default_rng(0), positioner.begin()
    for time_s in (10.0, 11.0, 11.0):
        state, _ = positioner.step(state, replace(EPOCH, time_s=time_s), rng)
    told = r"^epoch, time_s: expected 11.0 or later, as the epoch before is of that .*, found 10.5"
    with pytest.raises(mf.MapfilterError, match=told):
        positioner.step(state, replace(EPOCH, time_s=10.5), rng)


def test_times_count_before_anything_is_located(positioner):
    rng, empty = np.random.default_rng(0), mf.Epoch(10.0)
    state, _ = positioner.step(positioner.begin(), empty, rng)
    with pytest.raises(mf.MapfilterError, match=r"^epoch, time_s: expected 10.0 or later, "):
        positioner.step(state, mf.Epoch(9.0), rng)
