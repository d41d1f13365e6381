"""Steps of zero that levels do not show as a rest, and steps whose speed is no walker's."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from made_town import Town, slowed, walk_log
from true_places import error_m

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.positioning.bayes.beliefs.belief_changes import carried_on
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.step_units import (
    asks_for_unit,
    hold_after_takeover,
    is_unit_open,
    log_odds_of_unit,
    unit_of_next_m,
)
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.merging import epochs
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.sensors.watching import watched
from mapfilter.serving.state_file import decode, encode
from mapfilter.tracks.checks.speeds import speed_fault
from mapfilter.tracks.log import make_log

CELLS = tuple("ABCDEFG")
FOOT_M = 0.3048
TOWN = Town.of(1)
AREA = BayesFilter().over_area(TOWN.area())


def report(levels_dbm):
    return tuple(
        ReportRow("serving" if cell == "A" else "neighbour", cell, None, None, float(level), 0)
        for cell, level in zip(CELLS, levels_dbm, strict=False)
    )


def rested(levels_of, seconds, cells=7, pace_mps=1.4):
    """Hear a report each second; return all states of the rest."""
    rest, found = Rest(0.0, pace_mps=pace_mps), []
    for second in range(seconds):
        rest = rest.heard(float(second), report(levels_of(second)[:cells]))
        found.append(rest)
    return found


def fading(rng, slow_db=2.0):
    """Levels at rest: slow fading of some dB, and noise."""
    lasting, mean = rng.normal(0, slow_db, 7), rng.uniform(-100, -70, 7)

    def levels(_second):
        nonlocal lasting
        lasting = 0.98 * lasting + 0.2 * slow_db * rng.normal(size=7)
        return np.round(mean + lasting + rng.normal(0, 3.3, 7))

    return levels


def wandering(rng):
    """Levels on a walk: each wanders by 6 dB in 20 s."""
    mean = rng.uniform(-100, -70, 7)

    def levels(_second):
        nonlocal mean
        mean = mean + 1.3 * rng.normal(size=7)
        return np.round(mean + rng.normal(0, 2.0, 7))

    return levels


def test_stops_of_a_minute_and_of_20_are_no_doubt():
    for seed in range(10):
        found = rested(fading(np.random.default_rng(seed)), 1200 if seed < 3 else 60)
        assert not any(one.is_doubtful for one in found), seed
        assert found[-1].left_nats < -3


def test_a_walk_without_steps_is_in_doubt_within_a_minute():
    """Levels alone tell it of most walks; certain it is much later."""
    doubted, certain = [], []
    for seed in range(20):
        found = rested(wandering(np.random.default_rng(seed)), 200)
        doubted.append(next((k for k, one in enumerate(found) if one.is_doubtful), 999))
        certain.append(next((k for k, one in enumerate(found) if one.is_carried), 999))
    assert np.median(doubted) <= 40
    assert np.mean(np.array(doubted) < 60) > 0.75
    assert np.median(certain) > np.median(doubted) + 20


def test_there_is_no_doubt_before_45_m_nor_where_levels_could_not_show_a_rest():
    levels = wandering(np.random.default_rng(1))
    kept = [levels(k) for k in range(200)]
    found = rested(kept.__getitem__, 200)
    assert any(one.is_doubtful for one in found)
    assert not any(one.is_doubtful for one in found[:32])
    assert not any(one.is_doubtful for one in rested(kept.__getitem__, 200, pace_mps=0.2))
    assert not any(one.is_doubtful for one in rested(kept.__getitem__, 60, cells=1))
    nameless = rested(lambda _: np.full(7, np.nan), 200)
    assert not any(one.is_doubtful for one in nameless)


def test_a_rest_that_is_shown_late_ends_the_doubt():
    """Something stands before the phone for the first half minute."""
    still = np.linspace(-100, -70, 7)
    found = rested(lambda k: still + (7.0 * (-1) ** np.arange(7) if 12 < k < 42 else 0.0), 400)
    doubted = [one.is_doubtful for one in found]
    assert any(doubted)
    assert not found[-1].is_carried
    assert not doubted[-1]
    # Doubt ends later than it would have begun.
    ends = len(doubted) - doubted[::-1].index(True)
    assert found[ends].left_nats <= -5


def zero_after(log, from_s, until_s=np.inf):
    motion = log.motion.copy()
    late = (motion["time_s"] > from_s) & (motion["time_s"] <= until_s)
    motion.loc[late, "step_m"] = 0.0
    return make_log(log.crs, motion=motion, radio=log.radio, truth=log.truth)


def followed(log, seed, positioner=AREA):
    rng, found = np.random.default_rng(seed), []
    truth = {name: log.truth[name].to_numpy() for name in ("time_s", "east_m", "north_m")}
    state = positioner.begin_at(truth["east_m"][0], truth["north_m"][0], 5.0, rng)
    for epoch in epochs(log):
        state, output = positioner.step(state, epoch, rng)
        fix = output.fix
        off_m = error_m(log, fix)
        found.append((fix.time_s, fix.status, off_m, {one.reason for one in output.unused}, state))
    return found


SEED = 7
"""Of a walk whose levels change soon."""


def without_doubt(positioner):
    return replace(positioner, holds=replace(positioner.holds, watched=False))


def test_a_position_that_may_have_been_left_is_lost_with_a_reason():
    claimed = {}
    for name, positioner in (("doubt", AREA), ("none", without_doubt(AREA))):
        wrong = 0
        for seed in (1, 2, 3, 4):
            found = followed(
                zero_after(walk_log(TOWN, seed, error_db=3.0), 100.0), seed, positioner
            )
            wrong += sum(
                off_m > 50 and status in (Status.CONVERGED, Status.TRACKING)
                for _, status, off_m, _, _ in found
            )
            if name == "doubt":
                first = next(row for row in found if row[0] > 100 and row[1] is Status.LOST)
                assert Reason.MOTION_STUCK in first[3]
        claimed[name] = wrong
    assert claimed["doubt"] < 0.8 * claimed["none"]


def test_once_steps_are_counted_again_some_hypotheses_were_carried_on():
    """The true position, 175 m away, has hypotheses near it, and the state can be saved."""
    log = zero_after(walk_log(TOWN, SEED, error_db=3.0), 100.0, 135.0)
    found = followed(log, SEED)
    before = [row for row in found if row[0] <= 135.0][-1]
    after = next(row for row in found if row[0] > 135.0)
    rest = before[4].watch.rest
    assert rest.is_doubtful
    assert after[1] is Status.LOST
    spread = [float(row[4].belief.state[:2].std()) for row in (before, after)]
    assert spread[1] > spread[0] + 30
    again = decode(encode({"state": before[4]}), "made")["state"]
    assert again.watch.rest == rest


@pytest.mark.parametrize("status", [Status.SEARCHING, Status.OUTSIDE])
def test_a_search_stays_one_after_a_rest_in_doubt(status):
    rng = np.random.default_rng(1)
    state = AREA.begin_at(500_450.0, 4_500_450.0, 5.0, rng)
    state, _ = AREA.step(state, Epoch(1.0, (MotionStep(5.0, 0.0),)), rng)
    rest = replace(Rest(1.0, pace_mps=1.4), is_doubtful=True)
    belief = replace(state.belief, status=Status.SEARCHING)
    state = replace(state, belief=belief, status=status, watch=state.watch._replace(rest=rest))
    before_m = state.belief.state[:2].std()
    for time_s in (30.0, 31.0):
        state, output = AREA.step(state, Epoch(time_s, (MotionStep(5.0, 0.0),)), rng)
        assert state.belief.state[:2].std() > before_m + 5
        assert output.fix.status is status


def test_the_doubt_of_a_rest_ends_where_its_levels_have_shown_it():
    """Next to no hypothesis is carried on, and nothing of the doubt remains."""
    rng = np.random.default_rng(1)
    state = AREA.begin_at(500_450.0, 4_500_450.0, 5.0, rng)
    state, _ = AREA.step(state, Epoch(1.0, (MotionStep(5.0, 0.0),)), rng)
    doubtful = replace(Rest(1.0, pace_mps=1.4), is_doubtful=True)
    for left_nats, status in ((9.0, Status.UNCERTAIN), (-9.0, Status.TRACKING)):
        rest = replace(doubtful, left_nats=left_nats)
        rested = replace(state, watch=state.watch._replace(rest=rest))
        _, output = AREA.step(rested, Epoch(30.0, (MotionStep(5.0, 0.0),)), rng)
        assert output.fix.status is status


@pytest.mark.parametrize("left_nats", [-2.0, 2.0])
def test_as_many_hypotheses_are_carried_on_as_the_levels_of_the_rest_say(left_nats):
    rng = np.random.default_rng(1)
    state = AREA.begin_at(500_450.0, 4_500_450.0, 5.0, rng)
    rest = replace(Rest(1.0, pace_mps=1.4), left_nats=left_nats)
    after = carried_on(state.belief, rest, 100.0, rng)
    share = np.mean(np.any(after.state != state.belief.state, axis=0))
    # Four standard errors of 1000 hypotheses or more.
    assert state.belief.count >= 1000
    assert share == pytest.approx(1 / (1 + np.exp(-left_nats)), abs=0.04)


def test_hypotheses_are_carried_on_as_far_as_a_walk_of_the_missed_pace_spreads():
    rng = np.random.default_rng(2)
    state = AREA.begin_at(500_450.0, 4_500_450.0, 5.0, rng)
    # 40 of 140 m were measured, so 1 m/s is missed; all have left, by their levels.
    rest = replace(Rest(1.0, pace_mps=1.4), left_nats=50.0, measured_m=40.0)
    after = carried_on(state.belief, rest, 100.0, rng)
    moved_m = (after.state - state.belief.state)[:2]
    # A direction that lasts for 60 s: 2 * 60 * (100 - 60 * (1 - exp(-100 / 60))) m² on the whole.
    assert (moved_m**2).mean() == pytest.approx(6159.9 / 2, rel=4 / np.sqrt(state.belief.count))
    assert moved_m.mean() == pytest.approx(0.0, abs=5.0)


def test_the_pace_before_a_rest_is_in_metres():
    rng = np.random.default_rng(1)
    state = AREA.begin_at(500_450.0, 4_500_450.0, 5.0, rng)
    state = replace(state, hold=Hold(step_unit_m=FOOT_M))
    for second in range(62):
        step = MotionStep(4.4 if second < 60 else 0.0, 0.0)
        state, _ = AREA.step(state, Epoch(float(second), (step,)), rng)
    assert state.watch.pace.speed_mps == pytest.approx(4.4, rel=0.05)
    assert state.watch.rest.pace_mps == pytest.approx(FOOT_M * state.watch.pace.speed_mps)


def test_a_measured_position_leaves_no_doubt():
    state = SimpleNamespace(
        watch=SimpleNamespace(rest=replace(Rest(0.0), is_doubtful=True)),
        sources={"gnss": SimpleNamespace(used_at_m=100.0)},
        reckoning=SimpleNamespace(travelled_m=100.0),
    )
    assert not AREA.beliefs.may_have_left(state)
    state.sources["gnss"].used_at_m = 99.0
    assert AREA.beliefs.may_have_left(state)
    assert not without_doubt(AREA).beliefs.may_have_left(state)


@pytest.mark.parametrize(
    ("speed_mps", "unit_m"),
    [(1.3, 1.0), (0.7, 1.0), (2.5, 1.0), (4.4, FOOT_M), (0.41, 1 / FOOT_M), (9.0, 1.0)],
)
def test_the_unit_with_which_a_speed_is_a_walkers(speed_mps, unit_m):
    assert Pace(rows=30, interval_s=1.0, speed_mps=speed_mps).other_unit_m == pytest.approx(unit_m)
    assert Pace(rows=29, interval_s=1.0, speed_mps=speed_mps).other_unit_m == 1.0
    fast = Pace(rows=30, interval_s=1.0, speed_mps=speed_mps, fastest_mps=9.1)
    assert fast.other_unit_m == 1.0


@pytest.mark.parametrize("speed_mps", [0.15, 0.41, 0.7, 2.5, 2.7, 4.4, 7.9, 8.2, 9.0])
def test_notes_on_a_log_name_the_unit_that_the_filter_tries(speed_mps):
    rows = pd.DataFrame({"time_s": np.arange(60.0), "step_m": speed_mps, "heading_rad": 0.0})
    unit_m = Pace(rows=60, interval_s=1.0, speed_mps=speed_mps).other_unit_m
    fault = speed_fault(rows)
    assert ("lengths in feet" in fault) == (unit_m < 1)
    assert ("metres taken for feet" in fault) == (unit_m > 1)


def test_a_row_of_a_vehicle_ends_the_question_of_the_unit():
    """But not rows of 2.2 m that come two at a time, a millisecond apart."""
    watch, times = SensorWatch(), [k + apart for k in range(40) for apart in (0.0, 0.001)]
    for time_s in times:
        watch, _, _ = watched(watch, Epoch(time_s, (MotionStep(2.2, 0.1 * time_s),)))
    assert watch.pace.other_unit_m == pytest.approx(FOOT_M)
    watch, _, _ = watched(watch, Epoch(40.0, (MotionStep(12.0, 0.0),)))
    assert watch.pace.other_unit_m == 1.0


def test_lengths_are_read_in_the_unit():
    hold = Hold(step_unit_m=FOOT_M)
    assert hold.read(MotionStep(10.0, 0.5)).step_m == pytest.approx(3.048)
    assert hold.read(MotionStep(10.0, np.nan, 0.1, 20.0)).spread_m == pytest.approx(6.096)
    assert {one.step_unit_m for one in hold.straight_on(0.0, 2.0)} == {FOOT_M}


def unit_state(unit_m=1.0, alternatives=0, alternative=None):
    hold = Hold(step_unit_m=unit_m)
    return SimpleNamespace(hold=hold, alternatives=alternatives, alternative=alternative)


SEARCH, FOUND = (SimpleNamespace(status=one) for one in (Status.SEARCHING, Status.TRACKING))


def test_which_unit_the_next_alternative_reads():
    assert unit_of_next_m(unit_state(), SEARCH, FOOT_M) == FOOT_M
    assert unit_of_next_m(unit_state(alternatives=1), SEARCH, FOOT_M) == 1.0
    assert unit_of_next_m(unit_state(FOOT_M, 1), SEARCH, FOOT_M) == 1.0
    assert unit_of_next_m(unit_state(), SEARCH, 1.0) == 1.0
    assert [unit_of_next_m(unit_state(1.0, k), FOUND, FOOT_M) for k in range(3)] == [1, 1, FOOT_M]
    found = [unit_of_next_m(unit_state(FOOT_M, k), FOUND, FOOT_M) for k in range(3)]
    assert found == [FOOT_M, FOOT_M, 1.0]
    # Beside a search every other one, beside a position every third, however many there were.
    for unit_m, main, units in (
        (1.0, SEARCH, [FOOT_M, 1.0] * 4),
        (FOOT_M, SEARCH, [1.0] * 8),
        (1.0, FOUND, [1.0, 1.0, FOOT_M] * 3),
        (FOOT_M, FOUND, [FOOT_M, FOOT_M, 1.0] * 3),
    ):
        states = [unit_state(unit_m, k) for k in range(len(units))]
        assert [unit_of_next_m(state, main, FOOT_M) for state in states] == units


def test_when_an_alternative_in_another_unit_starts_and_holds_a_belief_back():
    assert asks_for_unit(unit_state(), SEARCH, FOOT_M)
    assert not asks_for_unit(unit_state(), SEARCH, 1.0)
    assert not asks_for_unit(unit_state(), FOUND, FOOT_M)
    assert not asks_for_unit(unit_state(alternatives=1), SEARCH, FOOT_M)
    assert asks_for_unit(unit_state(FOOT_M, 1), SEARCH, 1.0)
    assert log_odds_of_unit(1.0) == 0.0
    assert log_odds_of_unit(FOOT_M) == log_odds_of_unit(3.0) == -4.0
    leads = (-9.0, FOOT_M, True), (-10.0, FOOT_M, False), (-11.0, FOOT_M, False), (-1.0, 1.0, False)
    for nats, unit_m, is_open in leads:
        hold = Hold(step_unit_m=unit_m)
        other = SimpleNamespace(hold=hold, log_bayes_factor=lambda _, nats=nats: nats)
        state = unit_state(alternative=other)
        assert is_unit_open(state, SEARCH, FOOT_M) == is_open
        # A row has been faster than any walker's, in feet or not.
        assert not is_unit_open(state, SEARCH, 1.0)
        assert hold_after_takeover(state) is hold


def in_feet(log):
    """A walk of a walker's speed, whose steps are in feet."""
    log = slowed(log)
    motion = log.motion.assign(step_m=log.motion["step_m"] / FOOT_M)
    return make_log(log.crs, motion=motion, radio=log.radio, truth=log.truth)


def test_a_walk_in_feet_is_located_and_says_so():
    """Rows of 5 m every 4 s are a walker's; in feet they look like a cyclist's."""
    right, reasons, wrong = 0, set(), 0
    for seed in (1, 2, 3):
        log = in_feet(walk_log(TOWN, seed, error_db=3.0))
        rng = np.random.default_rng(seed)
        state, ends = AREA.begin(), []
        for epoch in epochs(log):
            state, output = AREA.step(state, epoch, rng)
            fix = output.fix
            off_m = error_m(log, fix)
            claimed = fix.status in (Status.CONVERGED, Status.TRACKING)
            ends.append((off_m < 50, claimed and not off_m < 50))
            reasons |= {one.reason for one in output.unused}
        right += np.mean(ends[-20:], axis=0)[0] > 0.9
        wrong += np.mean(ends, axis=0)[1]
        assert state.hold.step_unit_m == FOOT_M
    assert right >= 2
    assert wrong / 3 < 0.05
    assert Reason.OTHER_UNIT in reasons
