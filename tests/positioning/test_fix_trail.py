"""Rejected fixes that agree with each other and with the motion between them, by hand."""

from dataclasses import replace
from math import cos, inf, pi, radians, sin

import numpy as np
import pytest

from mapfilter.positioning.bayes.beliefs.path import DeadReckoning
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.trail import Contradiction, FixTrail
from mapfilter.serving.state_file import decode, encode

EVERY_M, EVERY_S, LEAST_S = 10.0, 6.0, 10.0


def followed(rejected, *, turned_rad=0.0, away=None, sd_m=5.0, every_m=EVERY_M, every_s=EVERY_S):
    """Return the trail of fixes along a way to the east that dead reckoning turns by an angle.

    ``rejected`` has a letter for each: r is rejected, o an outlier that is, u used; ``away`` moves
    all that are rejected, east and north.
    """
    trail = FixTrail()
    for index, kind in enumerate(rejected):
        gone_m = index * every_m
        east_m, north_m = gone_m + 0.5e6, 4.5e6
        if kind != "u" and away is not None:
            east_m, north_m = east_m + away[0], north_m + away[1]
        if kind == "o":
            north_m += 100.0 * (-1) ** index
        # A position that is measured anew differs.
        north_m += 1e-6 * index
        # Positions lie to the left of where headings point.
        way = DeadReckoning(gone_m, gone_m * cos(turned_rad), -gone_m * sin(turned_rad))
        fix = GnssFix(east_m, north_m, sd_m**2, sd_m**2, 0.0)
        rejects = kind != "u"
        trail = trail.after(index * every_s, fix, way, LEAST_S, rejected=rejects)
    return trail


@pytest.mark.parametrize(
    ("kinds", "fixes"),
    [
        ("uuuurrr", 3),
        ("uuuurrrrr", 5),
        # Two are too few, and outliers do not agree.
        ("uuuurr", None),
        ("uuuuror", None),
        ("uuuuooo", None),
        ("uuuurrorr", 4),
        # Of an outlier that the belief used, it is as it was; two in a row end it.
        ("uuuurrru", 3),
        ("uuuurrruu", None),
        ("uuuurrrurr", 5),
        ("uuuuuuu", None),
        # Of two kinds in turn, of which one agrees with the belief.
        ("uuuu" + "ru" * 6, None),
    ],
)
def test_rejected_fixes_that_agree_contradict_a_belief(kinds, fixes):
    found = followed(kinds).contradiction
    assert (found.fixes if found else None) == fixes
    if found is not None:
        assert found.turned_rad == pytest.approx(0.0, abs=1e-6)
        assert not found.is_turned
        assert found.goes_on


def test_they_have_to_last():
    assert followed("uuuurrr", every_s=5.0).contradiction is not None
    assert followed("uuuurrr", every_s=4.9).contradiction is None


@pytest.mark.parametrize(("away_m", "goes_on"), [(8.0, True), (300.0, False)])
def test_a_way_that_dead_reckoning_does_not_have_does_not_go_on(away_m, goes_on):
    """A spoofer moves all of them at once; they agree with each other all the same."""
    found = followed("uuuurrrr", away=(0.0, away_m)).contradiction
    assert (found.fixes, found.goes_on) == (4, goes_on)


@pytest.mark.parametrize("turned_deg", [-170.0, -90.0, 50.0, 120.0])
def test_a_way_that_is_turned_is_found_by_two(turned_deg):
    found = followed("uuuurr", turned_rad=radians(turned_deg)).contradiction
    assert np.degrees(found.turned_rad) == pytest.approx(turned_deg)
    assert (found.fixes, found.goes_on, found.is_turned) == (2, True, True)
    # One over the root of the sum of squares of the way about its mean, by the deviation.
    spread = ((np.arange(6) - 2.5) ** 2).sum() * EVERY_M**2 / 5.0**2
    assert found.sd_rad == pytest.approx(1 / np.sqrt(spread))


def test_a_turn_of_two_that_is_not_told_well_is_not_used():
    assert followed("uurr", turned_rad=pi / 2, every_m=6.0).contradiction is None
    assert followed("uuuurr", turned_rad=radians(44.0)).contradiction is None


def test_what_is_turned_and_what_has_direction():
    ahead = Contradiction(radians(50.0), radians(9.0), 3, goes_on=True)
    assert ahead.is_turned
    assert ahead.has_direction
    wide = ahead._replace(sd_rad=radians(17.0))
    assert not wide.is_turned
    assert not wide.has_direction
    assert not ahead._replace(turned_rad=radians(-44.0)).is_turned
    assert ahead._replace(turned_rad=radians(-46.0)).is_turned


def test_fixes_close_to_each_other_are_left_out():
    """Five metres, or three seconds, are between two; twenty are kept."""
    assert len(followed("u" * 7, every_m=2.5, every_s=1.0).rows) == 4
    assert len(followed("u" * 7, every_m=5.0, every_s=1.0).rows) == 7
    assert len(followed("u" * 30).rows) == 20


def test_at_a_standstill_fixes_agree_by_their_place_alone():
    found = followed("uuuurrr", every_m=0.0, away=(60.0, 0.0)).contradiction
    assert (found.fixes, found.goes_on, found.is_turned, found.sd_rad) == (3, False, False, inf)


def test_without_a_stated_deviation_a_fix_has_ten_metres_and_at_least_five():
    fix, way = GnssFix(1.0, 2.0), DeadReckoning()
    (row,) = FixTrail().after(0.0, fix, way, LEAST_S, rejected=False).rows
    assert row.sd_m == 10.0
    fix = replace(fix, var_east_m2=1.0, var_north_m2=1.0, cov_east_north_m2=0.0)
    (row,) = FixTrail().after(0.0, fix, way, LEAST_S, rejected=False).rows
    assert row.sd_m == 5.0


def test_a_saved_trail_is_the_same_again():
    given = followed("uuuurrr")
    found = decode(encode({"trail": given}), "a session")["trail"]
    assert found == given
    assert isinstance(found.contradiction, Contradiction)


def test_fixes_before_are_those_that_were_used():
    """Two genuine ones within a spoofed minute do not make the others go on."""
    found = followed("uuuurruurrr", away=(0.0, 300.0)).contradiction
    assert (found.fixes, found.goes_on) == (3, False)
    # One that was used before is enough.
    assert followed("urrr", away=(0.0, 8.0)).contradiction.goes_on


def test_a_way_that_goes_on_does_so_until_fixes_are_used_again():
    """Those before fall out of the rows that are kept."""
    assert followed("uuuu" + 24 * "r").contradiction.goes_on
    assert not followed("uuuu" + 4 * "r" + "uu" + 4 * "r", away=(0.0, 300.0)).contradiction.goes_on


def test_a_position_that_a_receiver_holds_counts_once():
    trail = FixTrail()
    held = GnssFix(5e5, 4.5e6, 25.0, 25.0, 0.0)
    for k in range(12):
        way = DeadReckoning(6.0 * k, 6.0 * k, 0.0)
        trail = trail.after(4.0 * k, held, way, LEAST_S, rejected=True)
    assert (len(trail.rows), trail.contradicts) == (1, False)


def test_a_trail_begins_anew_after_minutes_without_fixes():
    trail = followed("uuuurrr")
    assert trail.contradicts
    way = DeadReckoning(500.0, 500.0, 0.0)
    fix = GnssFix(500_500.0, 4.5e6, 25.0, 25.0, 0.0)
    for later_s, rows in ((300.0, 8), (300.1, 1)):
        after = trail.after(36.0 + later_s, fix, way, LEAST_S, rejected=False)
        assert (len(after.rows), after.contradicts) == (rows, False)
