"""Clocks of reports and motion that differ: told, radii that hold, positions not claimed."""

from dataclasses import replace
from functools import lru_cache
from math import isnan, nan

import numpy as np
import pytest
from made_town import SOUTH_M, WEST_M, Town, slowed, walk_log

from mapfilter.filters.contract import Reason, Status
from mapfilter.models.level_errors import LevelReport
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning
from mapfilter.positioning.bayes.clock_check import (
    Place,
    _compared,
    _in_doubt,
    _traced,
    with_clocks_checked,
)
from mapfilter.positioning.bayes.clocks import APART_S, SAME, Clocks
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.loop import locate
from mapfilter.positioning.merging import epochs

FOLLOWED = (Status.CONVERGED, Status.TRACKING)
TOWN = 11


class Textured(Town):
    """A town whose predicted levels change from street to street, as houses make them."""

    def levels_dbm(self, place_m):
        place_m = np.asarray(place_m)
        angle = np.arange(6)[:, None] + [0.0, 2.0]
        length_m = 90.0 + 25.0 * np.arange(6)[:, None] * [1.0, 0.6]
        ahead_m = place_m[..., :1, None] * np.cos(angle) + place_m[..., 1:, None] * np.sin(angle)
        return super().levels_dbm(place_m) + 4 * np.sin(ahead_m * 2 * np.pi / length_m).sum(axis=-1)


@lru_cache
def positioner(town):
    return BayesFilter().over_area(Textured.of(town).area())


def shifted(log, table, by_s):
    rows = getattr(log, table)
    return replace(log, **{table: rows.assign(time_s=rows["time_s"] + by_s)})


def walk(seed):
    """A walk of 1.25 m a second."""
    return slowed(walk_log(Textured.of(TOWN), seed, 1500.0))


def along_the_truth(log, late_s):
    """Clocks after reports of a walk, by its true positions of some seconds later."""
    found, clocks = positioner(TOWN), None
    truth = log.truth[["time_s", "east_m", "north_m"]].to_numpy() - [0.0, WEST_M, SOUTH_M]
    for epoch in epochs(log):
        if epoch.radio and epoch.time_s - late_s >= 0:
            gone_m = 1.25 * epoch.time_s
            reading = found._radio.read(None, DeadReckoning(), epoch, 5.0).radio
            where = [np.interp(epoch.time_s - late_s, truth[:, 0], truth[:, k]) for k in (1, 2)]
            place = Place(epoch.time_s, *where)
            clocks = _compared(_traced(clocks, place, gone_m), found.model, place, gone_m, reading)
    return clocks


@pytest.mark.parametrize("late_s", [-20.0, 20.0])
def test_reports_show_by_how_much_positions_are_late(late_s):
    clocks = [along_the_truth(walk(seed), late_s) for seed in range(1, 6)]
    likely = [one.probability[np.abs(APART_S - late_s) <= 10].sum() for one in clocks]
    assert np.median(likely) > 0.95
    told = [one.apart_s for one in clocks if not isnan(one.apart_s)]
    assert len(told) >= 3
    assert np.abs(np.array(told) - late_s).max() <= 10


def test_positions_in_time_show_no_difference():
    for seed in range(1, 6):
        clocks = along_the_truth(walk(seed), 0.0)
        assert isnan(clocks.apart_s)
        assert clocks.probability[np.abs(APART_S) < 7].sum() > 0.9


def located(log):
    """Estimate of a walk, and its errors."""
    found = locate(log, positioner(TOWN), np.random.default_rng(1)).estimate
    truth = [np.interp(found.time_s, log.truth["time_s"], log.truth[axis])
             for axis in ("east_m", "north_m")]  # fmt: skip
    return found, np.hypot(found.east_m - truth[0], found.north_m - truth[1])


def of_clocks(estimate):
    return [one for one in estimate.unused if one.reason is Reason.CLOCKS_APART]


def test_a_walk_with_two_clocks_is_told_once_and_radii_hold(monkeypatch):
    log, held = shifted(walk(1), "motion", 20.0), []
    found, error_m = located(log)
    (one,) = of_clocks(found)
    assert (one.kind, one.what) == ("radio", "+20 s")
    after = found.time_s > one.time_s
    monkeypatch.setattr(
        "mapfilter.positioning.bayes.filter.with_clocks_checked",
        lambda _beliefs, state, _updates, _time_s: (state, []),
    )
    before, same_m = located(log)
    for estimate, off_m in ((before, same_m), (found, error_m)):
        claimed = after & np.isin(estimate.status, FOLLOWED)
        held.append(np.mean(off_m[claimed] <= estimate.radii_m[claimed, 2]))
    assert held[0] < 0.6
    assert held[1] > 0.95


def test_nothing_is_told_of_one_clock():
    found, error_m = located(walk(1))
    assert not of_clocks(found)
    claimed = np.isin(found.status, FOLLOWED)
    assert np.median(found.radii_m[claimed, 2]) < 25
    assert np.mean(error_m[claimed] <= found.radii_m[claimed, 2]) > 0.95


# Arithmetic by hand.


def straight(odds, *, speed=1.4, until_s=100.0):
    """Clocks of a straight walk to the east; log-likelihoods of some differences, -12 of others."""
    time_s = np.arange(0.0, until_s + 1, 10.0)
    trace = np.column_stack([time_s, speed * time_s, np.zeros(time_s.size)])
    log_weight = np.array([odds.get(float(apart), -12.0) for apart in APART_S])
    return Clocks(trace, speed * until_s, log_weight=log_weight)


def test_one_clock_in_twenty_differs_beforehand():
    found = Clocks(np.zeros((1, 3))).probability
    assert found[SAME] == pytest.approx(0.95)
    assert np.delete(found, SAME) == pytest.approx(np.full(12, 0.05 / 12))


@pytest.mark.parametrize(
    ("odds", "apart_s"),
    [
        ({0.0: 0.0}, nan),
        # Beforehand one of them is 228 times less probable than one clock: 5.4 nats.
        ({0.0: -7.0, 20.0: 0.0}, nan),
        ({0.0: -8.0, 20.0: 0.0}, 20.0),
        ({0.0: -12.0, -13.0: -0.1, -7.0: 0.0}, -7.0),
        # Few seconds are not told.
        ({0.0: -12.0, 3.0: 0.0}, nan),
    ],
)
def test_a_difference_is_told_from_nine_tenths_on(odds, apart_s):
    found = straight(odds).apart_s
    assert isnan(found) if isnan(apart_s) else found == apart_s


def test_the_position_is_off_by_the_way_in_between_with_half_of_the_probability():
    apart = {0.0: -12.0, 20.0: 0.0}
    found = _in_doubt(straight(apart), 100.0, 15.0, positioned=False)
    # 28 m, and those at -12 nats, of which there are twelve, make up a ten thousandth.
    assert found.wider_m == pytest.approx((0.0, 28.0, 28.0, 28.0))
    assert found.away == pytest.approx(0.0, abs=1e-4)
    farther = _in_doubt(straight(apart), 100.0, 23.0, positioned=False)
    assert farther.away == pytest.approx(0.5, abs=1e-3)


def test_less_probable_differences_widen_the_larger_radii_alone():
    prior = np.log(0.95 / (0.05 / 12))
    for share, wider_m in ((0.03, (0.0, 0.0, 0.0, 28.0)), (0.15, (0.0, 0.0, 28.0, 28.0)),
                           (0.008, (0.0, 0.0, 0.0, 0.0))):  # fmt: skip
        odds = prior + np.log(share / (1 - share))
        clocks = straight({0.0: -odds if odds > 0 else 0.0, 20.0: min(odds, 0.0) * (odds < 0)})
        clocks = replace(clocks, log_weight=np.where(clocks.log_weight < -11, -40.0,
                                                     clocks.log_weight))  # fmt: skip
        assert clocks.probability[APART_S == 20.0] == pytest.approx(share, rel=1e-6)
        found = _in_doubt(clocks, 100.0, 15.0, positioned=False)
        assert found.wider_m == pytest.approx(wider_m)


def test_reports_of_a_moment_ago_are_usual_and_fixes_are_by_their_own_clock():
    late = straight({0.0: -12.0, -3.0: 0.0}, speed=12.0)
    assert _in_doubt(late, 100.0, 15.0, positioned=False).wider_m[2] == 0.0
    early = straight({0.0: -12.0, 3.0: 0.0}, speed=12.0)
    assert _in_doubt(early, 100.0, 15.0, positioned=False).wider_m[2] == pytest.approx(36.0)
    fixed = _in_doubt(early, 100.0, 15.0, positioned=True)
    assert (fixed.wider_m, fixed.away) == ((0.0, 0.0, 0.0, 0.0), 0.0)


def test_a_phone_at_rest_is_where_it_was():
    rests = straight({0.0: -12.0, 20.0: 0.0})
    rests = replace(rests, trace=np.column_stack([rests.trace[:, 0], np.full((11, 2), 7.0)]))
    assert _in_doubt(rests, 100.0, 49.0, positioned=False).wider_m == (0.0, 0.0, 0.0, 0.0)


class Model:
    """A model that remembers what it is to weigh, and prefers the fifth place."""

    def __init__(self):
        self.asked = []
        self.evidence = positioner(TOWN).model.evidence

    def weigh(self, cloud, log_weight, reading):
        self.asked.append((cloud.state[:2].copy(), reading))
        log_weight[5] += 30.0
        return cloud._replace(kept=np.full((2, APART_S.size), len(self.asked), np.float32),
                              shared=len(self.asked)), Reason.USED  # fmt: skip


def read(seconds, speed=2.0):
    """Clocks after reports each two seconds on a straight way, and what the model was asked."""
    model, clocks = Model(), None
    for time_s in np.arange(0.0, seconds, 2.0).tolist():
        levels = LevelReport(*(np.array([time_s], np.float32),) * 4, 0.0)
        gone_m = speed * time_s
        place = Place(time_s, 100.0 + gone_m, 50.0)
        clocks = _traced(clocks, place, gone_m)
        clocks = _compared(clocks, model, place, gone_m, RadioReading(1, levels=levels))
    return clocks, model.asked


def test_reports_wait_for_the_positions_after_them():
    clocks, asked = read(130.0)
    # Each 15 m, that is 8 s, from 40 s after the first position on, and 40 s before the last.
    whens = [float(reading.levels.level_dbm[0]) for _, reading in asked]
    assert whens == [40.0, 48.0, 56.0, 64.0, 72.0, 80.0, 88.0]
    places, reading = asked[0]
    np.testing.assert_allclose(places[0], 180.0 + 2 * APART_S)
    np.testing.assert_allclose(places[1], 50.0)
    assert (reading.length_m, reading.serving_weight) == (0.0, 0.0)
    _, later = asked[1]
    assert later.length_m == 16.0
    assert later.serving_weight == pytest.approx(16 / 22)
    assert clocks.compared_m == 176.0
    assert (clocks.memory, clocks.kept.max()) == (7, 7.0)
    # Evidence is bounded, as clocks may be set.
    assert clocks.log_weight == pytest.approx(np.where(np.arange(13) == 5, 0.0, -12.0))


def test_a_fast_vehicle_is_compared_each_five_seconds():
    _, asked = read(110.0, speed=20.0)
    whens = np.array([float(reading.levels.level_dbm[0]) for _, reading in asked])
    assert np.all(np.diff(whens) == 6.0)


def test_a_position_that_jumps_begins_anew():
    clocks, _ = read(130.0)
    on = _traced(clocks, Place(130.0, 359.0 + 49.0, 50.0), 260.0)
    assert on.compared_m == clocks.compared_m
    jumped = _traced(clocks, Place(130.0, 359.0 + 60.0, 50.0), 260.0)
    assert (len(jumped.trace), jumped.held, jumped.log_weight) == (1, (), None)


def test_two_minutes_of_positions_are_kept():
    clocks, _ = read(400.0)
    assert clocks.trace[0, 0] == 398.0 - 120.0
    assert clocks.trace[-1].tolist() == [398.0, 100.0 + 796.0, 50.0]


@pytest.mark.parametrize("status", [Status.SEARCHING, Status.LOST, Status.OUTSIDE])
def test_nothing_is_known_without_a_position_that_is_followed(status):
    begun = positioner(TOWN).begin_at(WEST_M + 300, SOUTH_M + 300, 5.0, np.random.default_rng(1))
    state = replace(begun, status=status, clocks=straight({20.0: 0.0}))
    found, unused = with_clocks_checked(positioner(TOWN).beliefs, state, [], 5.0)
    assert (found.clocks, unused) == (None, [])
