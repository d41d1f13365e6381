"""Fixes that wander beside dead reckoning: how much larger their errors are than stated."""

from dataclasses import replace

import numpy as np
import pytest

from mapfilter.positioning.gnss.state import GnssState
from mapfilter.positioning.gnss.wander import FixWander, FoundErrors, Way, _times_stated

COUNT = 200


def streets(rng, count, mps=1.4, every_s=1.0):
    """A way of steps of a second with corners, as complex numbers."""
    turns = np.where(rng.random(count) < 0.02, rng.choice([-1, 1], count), 0) * np.pi / 2
    return np.cumsum(mps * every_s * np.exp(1j * np.cumsum(turns)))


def lasting(rng, count, sd_m, memory_s=60.0):
    """A Gauss-Markov process at each second, as complex numbers."""
    kept, found = np.exp(-1 / memory_s), np.empty(count, dtype=complex)
    found[0] = complex(*rng.normal(0, sd_m, 2))
    for k in range(1, count):
        new = complex(*rng.normal(0, sd_m, 2))
        found[k] = kept * found[k - 1] + np.sqrt(1 - kept**2) * new
    return found


def white(rng, count, sd_m):
    return rng.normal(0, sd_m, count) + 1j * rng.normal(0, sd_m, count)


def after(
    way, fixes, sd_m=5.0, *, wander=None, every_s=1, first_s=0.0, gaps=None, rate=0.0, drift=0.0
):
    """The record after fixes of places in a far country, beside a way from elsewhere."""
    wander = wander or FixWander()
    for k in range(0, len(way), every_s):
        gap = 0 if gaps is None else int(gaps[k])
        east, north = 500_000 + fixes[k].real, 5_400_000 + fixes[k].imag
        place = Way(way[k].real, way[k].imag, gap)
        wander = wander.at_fix(first_s + k, place, (east, north), sd_m**2, rate, drift)
    return wander


def times(rng, white_m, lasting_m, sd_m, **options):
    way = streets(rng, 2 * COUNT)
    errors = white(rng, 2 * COUNT, white_m) + lasting(rng, 2 * COUNT, lasting_m)
    # Headings that are off by any angle, and steps that are too short.
    seen = 0.97 * way * np.exp(1j * rng.uniform(0, 6))
    return sum(after(seen, way + errors, sd_m, **options).now)


@pytest.mark.parametrize(
    ("white_m", "lasting_m", "sd_m", "least", "most"),
    [
        # Means over forty walks of times of the stated variance: 1, 1, 3.2, 4 and 0.36.
        (2.5, 4.3, 5.0, 0.8, 1.2),
        (5.0, 0.0, 5.0, 0.9, 1.45),
        (3.0, 14.0, 8.0, 2.2, 3.4),
        (3.0, 9.5, 5.0, 2.8, 4.2),
        (1.5, 2.6, 5.0, 0.3, 0.8),
    ],
)
def test_errors_are_found_as_large_as_they_are(white_m, lasting_m, sd_m, least, most):
    """Whatever angle headings are off by; one minute of what is stated counts before."""
    found = [times(np.random.default_rng(seed), white_m, lasting_m, sd_m) for seed in range(40)]
    assert least < np.mean(found) < most


def test_white_and_lasting_errors_are_told_apart():
    found = {}
    for name, (white_m, lasting_m) in {"white": (10.0, 0.0), "lasting": (0.5, 10.0)}.items():
        parts = []
        for seed in range(20):
            rng = np.random.default_rng(seed)
            way = streets(rng, COUNT)
            errors = white(rng, COUNT, white_m) + lasting(rng, COUNT, lasting_m)
            parts.append(after(way, way + errors, 5.0, every_s=5).now)
        found[name] = np.mean(parts, axis=0)
    assert found["white"][0] > 1.4 * found["white"][1]
    assert found["lasting"][1] > 3 * found["lasting"][0]


@pytest.mark.parametrize("rate_deg", [0.0, 0.5, 2.0])
def test_a_bias_of_a_gyroscope_is_no_error_of_fixes(rate_deg):
    """As far as it is known; what is left of it bends the way."""
    rng = np.random.default_rng(3)
    way = streets(rng, COUNT, mps=8.0)
    steps = np.diff(way, prepend=0)
    seen = np.cumsum(steps * np.exp(-1j * np.radians(rate_deg) * np.arange(COUNT)))
    fixes = way + white(rng, COUNT, 2.5) + lasting(rng, COUNT, 4.3)
    known = np.radians(0.95 * rate_deg)
    assert after(seen, fixes, rate=known).now.understated == 1.0
    if rate_deg == 2.0:
        assert after(seen, fixes).now.understated > 3.0


def test_what_steps_do_not_tell_breaks_it_off():
    rng = np.random.default_rng(5)
    way = streets(rng, COUNT)
    fixes = way + white(rng, COUNT, 3.0)
    # A ride of 200 m in the middle, of which no step was counted.
    ridden = fixes + np.where(np.arange(COUNT) >= 100, 200.0, 0.0)
    assert after(way, ridden).now.understated > 3.0
    assert after(way, ridden, gaps=np.arange(COUNT) >= 100).now.understated == 1.0
    begun = after(way[:100], ridden[:100])
    assert begun.broken_off().rows == ()
    assert begun.broken_off().now == begun.now
    assert FixWander().broken_off() == FixWander()
    left = after(way[100:], ridden[100:], wander=begun.broken_off(), first_s=100.0)
    assert left.now.understated == 1.0


def test_a_rest_breaks_it_off_and_rows_some_seconds_apart_are_none():
    """A phone may write its steps each four seconds: no step since then is no rest yet."""
    rng = np.random.default_rng(10)
    way = streets(rng, 40)
    begun = after(way, way)
    assert begun.rested(43.9, 39.9) is begun
    assert begun.rested(50.0, 39.9).rows == ()
    assert begun.rested(50.0, 39.9).now == begun.now


def test_who_stays_in_one_place_learns_nothing():
    rng = np.random.default_rng(6)
    fixes = white(rng, COUNT, 30.0)
    assert after(0.05 * streets(rng, COUNT), fixes).now == FoundErrors()
    assert after(streets(rng, COUNT), fixes).now != FoundErrors()


def test_few_fixes_or_a_short_time_say_nothing():
    rng = np.random.default_rng(7)
    way = streets(rng, COUNT)
    fixes = way + white(rng, COUNT, 30.0)
    assert after(way[:60], fixes[:60]).now == FoundErrors()
    assert after(way[:62], fixes[:62]).now != FoundErrors()
    # Seven in three minutes.
    assert after(way, fixes, every_s=30).now == FoundErrors()


def test_what_was_known_before_is_two_minutes_old():
    rng = np.random.default_rng(8)
    way = streets(rng, 400)
    fixes = way + white(rng, 400, 3.0)
    # From 200 s on positions lead away, by 3 m/s to the side.
    led = fixes + 3j * np.maximum(np.arange(400) - 200, 0)
    early = after(way[:300], led[:300])
    assert early.now.understated > 2.0
    assert early.before.understated == 1.0
    assert after(way, led).before.understated > 1.0


def test_a_break_brings_nothing_of_the_last_two_minutes():
    """What was known before a rest, or a row without a direction, counts as it did."""
    rng = np.random.default_rng(8)
    way = streets(rng, 400)
    led = way + white(rng, 400, 3.0) + 3j * np.maximum(np.arange(400) - 200, 0)
    early = after(way[:300], led[:300])
    rested = after(way[300:340], led[300:340], wander=early.broken_off(), first_s=300.0)
    assert early.now.understated > 2.0
    assert early.before.understated == rested.before.understated == 1.0
    jumped = early.before_a_jump()
    assert (jumped.rows, jumped.now, jumped.before) == ((), early.before, early.before)
    later = after(way[300:340], led[300:340], wander=jumped, first_s=300.0)
    assert later.before == early.before


def test_a_random_walk_of_headings_is_no_error_of_fixes():
    """As far as it is assumed: a vehicle's turns of 0.6° per root metre."""
    found = {}
    for assumed_deg in (0.0, 0.6):
        excess = []
        for seed in range(10):
            rng = np.random.default_rng(seed)
            way = streets(rng, COUNT, mps=10.0)
            walk = np.cumsum(np.radians(0.6) * 10**0.5 * rng.standard_normal(COUNT))
            seen = np.cumsum(np.diff(way, prepend=0) * np.exp(1j * walk))
            fixes = way + white(rng, COUNT, 2.5) + lasting(rng, COUNT, 4.3)
            drift = np.radians(assumed_deg)
            excess.append(sum(after(seen, fixes, drift=drift).now))
        found[assumed_deg] = np.mean(excess)
    assert found[0.0] > 2.5
    assert found[0.6] < 0.7 * found[0.0]


def test_errors_that_are_exact_divide_by_nothing():
    way = streets(np.random.default_rng(9), COUNT)
    found = after(way, way)
    assert sum(found.now) < 0.7
    assert found.now.understated == 1.0


def test_stated_by_hand():
    assert FoundErrors() == (1.0, 0.0)
    assert FoundErrors(0.5, 0.9).understated == 1.0
    assert FoundErrors(0.5, 1.0).understated == 1.5
    assert FoundErrors(0.5, 0.9).lasting_m(25.0) == 0.0
    assert FoundErrors(0.5, 4.0).lasting_m(25.0) == 10.0
    assert FoundErrors(0.5, 2.0).beyond_m(25.0) == 5.0
    assert FoundErrors(3.0, 0.9).beyond_m(25.0) == 0.0
    assert FoundErrors(1.0, 0.0).towards(3.0, 1.0, 0.5) == (2.0, 0.5)
    # Nine times at most.
    assert FoundErrors(1.0, 0.0).towards(6.0, 12.0, 1.0) == (3.0, 6.0)


def test_what_either_shows_counts():
    """What a fix after the other is off by, or how far they wander."""
    state = GnssState()
    assert state.understated == 1.0
    known = replace(state, wander=FixWander(before=FoundErrors(1.0, 3.0)))
    assert known.understated == 4.0
    assert replace(known, excess=5.0).understated == 5.0
    assert replace(state, wander=FixWander(now=FoundErrors(1.0, 3.0))).understated == 1.0


def test_coordinates_of_a_country_lose_no_digits():
    """Places in 1024ths of a metre, which 7000 km from the origin still are exact."""
    rng = np.random.default_rng(5)
    rows = np.zeros((40, 7))
    rows[:, 0], rows[:, 6] = 2.0 * np.arange(40), 4.0
    rows[:, 1:3] = np.cumsum(np.round(1024 * rng.normal(1.0, 1.0, (40, 2))) / 1024, axis=0)
    rows[:, 4:6] = rows[:, 1:3] + np.round(1024 * rng.normal(0.0, 3.0, (40, 2))) / 1024
    far = rows.copy()
    far[:, 4:6] += 500_000.0, 7_000_000.0
    near = _times_stated(rows, 0.0, 0.0)
    assert near[0] > 0
    assert _times_stated(far, 0.0, 0.0) == near
