"""Errors of fixes in a Kalman-type filter as they have shown, with numbers by hand."""

from dataclasses import replace
from math import isnan, nan, sqrt

import numpy as np
import pytest

from mapfilter.filters.gaussian import Gaussian
from mapfilter.positioning.gnss.wander import FixWander, FoundErrors, WanderFix, Way
from mapfilter.positioning.kalman.coast import Coast
from mapfilter.positioning.kalman.coasting import Coasting, Separation
from mapfilter.positioning.kalman.disputed import FixRecord
from mapfilter.positioning.kalman.fix_errors import FixErrors
from mapfilter.positioning.kalman.lasting import Motion
from mapfilter.positioning.kalman.models import KalmanOptions
from mapfilter.positioning.kalman.proof import Doubt

MOTION: Motion = np.eye(5), np.zeros((5, 5)), np.array([1.0, 2.0, 0, 0, 0])
COAST = Coast.of(0.0, Gaussian(np.zeros(5), np.eye(5)), 1.0, np.zeros(2))
HELD = Coasting(kept=(COAST,), apart=Separation(0.5, COAST), is_held=True)
LED = tuple(WanderFix(5.0 * k, 7.0 * k, 0.0, 0, 7.0 * k, 0.0, 3.0) for k in range(20))
"""Fixes that lie where steps have led."""


@pytest.mark.parametrize(
    ("excess", "white", "lasting", "times", "understated"),
    [(1.0, 1.0, 0.0, 1.0, 1.0), (4.0, 1.0, 2.0, 2.0, 4.0), (2.0, 1.0, 2.0, 2.5, 3.0),
     (2.0, 1.0, 2.0, 5.0, 5.0), (1.4, 0.9, 0.5, 1.0, 1.0)],
)  # fmt: skip
def test_fixes_are_as_bad_as_the_worst_that_has_shown(excess, white, lasting, times, understated):
    errors = FixErrors(
        record=FixRecord(excess=excess),
        wander=FixWander(now=FoundErrors(white, lasting)),
        coasting=Coasting(times=times),
    )
    assert errors.understated == understated


@pytest.mark.parametrize(
    ("times", "usual_s", "lasting_s"),
    [(1.0, 30.0, 30.0), (2.0, 30.0, 60.0), (2.0, 90.0, 90.0), (1.0, 90.0, 90.0)],
)
def test_errors_between_houses_last_for_a_minute(times, usual_s, lasting_s):
    assert FixErrors(coasting=Coasting(times=times)).lasting_s(usual_s) == lasting_s


def test_the_way_since_the_last_fix():
    errors = FixErrors(way=Way(10.0, 20.0, 1), fixed_way=Way(7.0, 16.0))
    assert errors.gone_m == 5.0
    moved = errors.moved(3.0, 4.0, 2)
    assert (moved.way, moved.fixed_way) == (Way(13.0, 24.0, 3), Way(7.0, 16.0))
    record = FixRecord(agreed=3)
    after = moved.after_fix(2.5, record, 9.0)
    assert (after.gone_m, after.lasting_m, after.fixed_s) == (0.0, 2.5, 9.0)
    assert after.record is record
    assert after.way == moved.way


def test_beliefs_without_fixes_move_unless_steps_have_gaps():
    errors = FixErrors(coasting=Coasting(kept=(COAST,)))
    moved = errors.coasted(MOTION, np.zeros(5), 0)
    assert moved.coasting.kept[0].mean.tolist() == [1, 2, 0, 0, 0, 0, 0]
    assert errors.coasted(MOTION, np.zeros(5), 1).coasting.kept == ()
    # One that is held stays where it was.
    held = FixErrors(coasting=HELD)
    assert held.coasted(MOTION, np.zeros(5), 1) is held
    empty = FixErrors()
    assert empty.coasted(MOTION, np.zeros(5), 0) is empty


@pytest.mark.parametrize(
    ("options", "times", "before", "usual_m", "beyond_m"),
    [
        # A share of a quarter lasts usually: 2 m of 4.
        ({"fix_lasting_share": 0.25, "fix_lasting_m": 0.0}, 1.0, 0.0, 2.0, 0.0),
        ({"fix_lasting_share": 0.25, "fix_lasting_m": 0.0}, 1.0, 3.0, 2.0, sqrt(2.0) * 4),
        ({"fix_lasting_share": 0.25, "fix_lasting_m": 0.0}, 5.0, 3.0, 2.0, 8.0),
        # Where a length is stated, that lasts.
        ({"fix_lasting_m": 5.0}, 1.0, 0.0, 0.0, 5.0),
        ({"fix_lasting_m": 7.0}, 5.0, 3.0, 0.0, 8.0),
        ({"fix_lasting_m": 9.0}, 5.0, 3.0, 0.0, 9.0),
    ],
)
def test_what_lasts_of_a_fix_of_four_metres(options, times, before, usual_m, beyond_m):
    errors = FixErrors(
        wander=FixWander(before=FoundErrors(1.0, before)), coasting=Coasting(times=times)
    )
    found = errors.lasting(16.0, KalmanOptions(fix_lasting_s=40.0, **options))
    assert found == (pytest.approx(usual_m), pytest.approx(beyond_m), 40.0)


def test_time_changes_the_record_alone():
    errors = FixErrors()
    assert errors.at_time(1e6) is errors


def test_who_is_led_another_way_is_not_claimed():
    errors = FixErrors(wander=FixWander(rows=LED), doubt=Doubt.IF_CONTRADICTED)
    after = errors.led()
    assert (after.doubt, after.wander.rows) == (Doubt.UNTIL_PROVEN, ())
    assert after.record is errors.record


@pytest.mark.parametrize(
    ("coasting", "doubt", "after"),
    [
        (Coasting(kept=(COAST,)), Doubt.NONE, Doubt.IF_CONTRADICTED),
        (Coasting(kept=(COAST,)), Doubt.UNTIL_PROVEN, Doubt.UNTIL_PROVEN),
        (HELD, Doubt.NONE, Doubt.UNTIL_PROVEN),
    ],
)
def test_what_is_left_after_a_jump(coasting, doubt, after):
    rows = ("some",)
    errors = FixErrors(
        record=FixRecord(agreed=7, rows=rows), wander=FixWander(rows=LED), doubt=doubt,
        coasting=coasting,
    )  # fmt: skip
    found = errors.after_a_jump()
    assert found.doubt is after
    assert (found.record.rows, found.record.agreed, found.wander.rows) == ((), 7, ())
    assert found.coasting == (coasting if coasting.is_held else Coasting())


def test_without_a_doubt_each_fix_that_agrees_is_of_none():
    errors = FixErrors(wander=FixWander(rows=LED))
    assert isnan(errors.doubted_s)
    after = errors.proven(50.0, 30.0)
    assert (after.doubted_s, after.doubt) == (50.0, Doubt.NONE)


@pytest.mark.parametrize("doubt", [Doubt.IF_CONTRADICTED, Doubt.UNTIL_PROVEN])
def test_a_way_that_agrees_ends_a_doubt_and_one_aside_does_not(doubt):
    errors = FixErrors(wander=FixWander(rows=LED), doubt=doubt, doubted_s=3.0)
    after = errors.proven(100.0, 30.0)
    assert (after.doubt, after.doubted_s) == (Doubt.NONE, 3.0)
    drawn = tuple(one._replace(east_m=1.6 * one.east_m) for one in LED)
    aside = errors._replace(wander=FixWander(rows=drawn)).proven(100.0, 30.0)
    assert aside.doubt is Doubt.UNTIL_PROVEN
    # Too few of them say nothing.
    few = errors._replace(wander=FixWander(rows=drawn[:3])).proven(100.0, 30.0)
    assert few.doubt is doubt


@pytest.mark.parametrize(
    ("time_s", "doubted_s", "from_s", "agreed", "is_proven"),
    [
        (220.0, 100.0, 90.0, 10, True), (219.0, 100.0, 90.0, 10, False),
        (220.0, 100.0, 90.0, 9, False), (220.0, 90.0, 100.0, 10, True),
        (219.0, 90.0, 100.0, 10, False), (220.0, 90.0, 101.0, 10, False),
    ],
)  # fmt: skip
def test_two_minutes_and_ten_fixes_show_it_whatever_the_way(
    time_s, doubted_s, from_s, agreed, is_proven
):
    errors = FixErrors(
        record=FixRecord(agreed=agreed, agreed_from_s=from_s), doubt=Doubt.UNTIL_PROVEN,
        doubted_s=doubted_s,
    )  # fmt: skip
    after = errors.proven(time_s, 30.0)
    assert after.doubt is (Doubt.NONE if is_proven else Doubt.UNTIL_PROVEN)


def test_fixes_that_lead_away_are_followed_once_they_agree_with_steps_for_long():
    errors = FixErrors(wander=FixWander(rows=LED), coasting=HELD)
    after = errors.proven(200.0, 30.0)
    assert (after.coasting.agrees_s, after.doubted_s) == (200.0, 200.0)
    assert after.proven(229.0, 30.0).coasting.is_held
    assert not after.proven(230.0, 30.0).coasting.is_held
    # A vehicle's way takes five minutes.
    fast = tuple(one._replace(way_east_m=4 * one.way_east_m, east_m=4 * one.east_m) for one in LED)
    driven = errors._replace(wander=FixWander(rows=fast)).proven(200.0, 30.0)
    assert driven.coasting.agrees_s == 200.0
    assert driven.proven(499.0, 30.0).coasting.is_held
    assert not driven.proven(500.0, 30.0).coasting.is_held
    # Without any fix beside the steps nothing is known of the speed.
    bare = errors._replace(wander=FixWander(), doubt=Doubt.UNTIL_PROVEN)
    assert bare.proven(200.0, 30.0).coasting is HELD
    doubted = replace(HELD, agrees_s=nan)
    both = FixErrors(wander=FixWander(rows=LED), coasting=doubted, doubt=Doubt.UNTIL_PROVEN)
    found = both.proven(200.0, 30.0)
    assert (found.doubt, found.coasting.agrees_s) == (Doubt.NONE, 200.0)
    assert isnan(found.doubted_s)
