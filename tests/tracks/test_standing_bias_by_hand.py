"""Yaw rates of a standing vehicle by hand: which rows count, and what the smoother is given."""

from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.tracks.pdr import standing_bias as module
from mapfilter.tracks.pdr.gyroscope import WALK_RAD_PER_SQRT_S
from mapfilter.tracks.pdr.standing_bias import _settled, standing_bias

NAN = np.nan


@pytest.mark.parametrize(
    ("standing", "settled"),
    [
        # A quarter of a second each: after 0.4 s, and not the last one before it moves.
        ("..ssssss.", "...ssss.."),
        ("sss..", "ss..."),
        ("..sss", "...ss"),
        ("s.s.s", "....."),
        ("ss", "ss"),
        ("....", "...."),
    ],
)
def test_where_a_vehicle_has_come_to_rest(standing, settled):
    is_standing = np.array([mark == "s" for mark in standing])
    found = _settled(0.25 * np.arange(len(standing)), is_standing)
    assert "".join("s" if one else "." for one in found) == settled


@pytest.fixture
def given(monkeypatch):
    """Return what the smoother is given by rows that all stand."""
    taken = {}

    def smoother(compass, rates, sds, **more):
        taken.update(more, compass=compass, rates=rates, sds=sds)
        return SimpleNamespace()

    monkeypatch.setattr(module, "yaw_offset", smoother)

    def of(time_s, rate, course=None, averaged_s=0.25):
        slow = np.ones(len(time_s), dtype=bool)
        found = standing_bias(np.asarray(time_s), np.asarray(rate), slow, averaged_s, course)
        return SimpleNamespace(**taken), found

    return of


def test_each_second_has_its_median_rate(given):
    """Deviations of 0.01 rad/s are a scatter of 0.0148, that of 20 rows of a second 0.0033."""
    time_s = 100 + 0.05 * np.arange(50)
    rate = 0.03 + 0.01 * np.where(np.arange(50) % 2, 1.0, -1.0)
    # More than four deviations, or 0.05 rad/s, from the usual one are movements.
    rate[5], rate[6] = 0.03 - 0.06, 0.03 + 0.06
    taken, found = given(time_s, rate)
    assert found.is_shown
    assert found.stood.all()
    assert taken.rates.tolist() == pytest.approx([0.03, 0.03, 0.03], abs=1e-12)
    spread = 1.4826 * 0.01
    each = [spread / np.sqrt(count) for count in (18, 20, 10)]
    assert taken.sds.tolist() == pytest.approx(each, rel=1e-9)
    assert found.walk_rad_per_sqrt_s == pytest.approx(np.hypot(WALK_RAD_PER_SQRT_S, spread * 0.5))
    assert taken.usual_radps == pytest.approx(0.03)
    assert taken.compass.time_s.tolist() == [100.5, 101.5, 102.5]
    assert not taken.use_compass


def test_equal_rates_are_not_more_certain_than_counts(given):
    taken, _ = given(0.1 * np.arange(20), np.full(20, 0.02))
    assert taken.sds.tolist() == [5e-4, 5e-4]
    assert taken.usual_radps == 0.02


@pytest.mark.parametrize("rate", [0.11, -0.11])
def test_turns_are_no_bias(given, rate):
    """Faster than 6 deg/s."""
    taken, _ = given(0.1 * np.arange(20), np.full(20, rate))
    assert np.isnan(taken.rates).all()
    assert taken.usual_radps == 0


@pytest.mark.parametrize(
    ("count", "every_s", "is_shown"), [(4, 1.0, False), (5, 1.0, True), (9, 0.1, False)]
)
def test_five_rows_and_a_second_show_a_bias(given, count, every_s, is_shown):
    taken, found = given(every_s * np.arange(count), np.full(count, 0.02))
    assert found.is_shown == is_shown
    assert np.isfinite(taken.rates).any() == is_shown
    if not is_shown:
        some = f"{count} rows at standstill, too few to learn the bias (of 5 rows and 1 s)"
        assert found.notes == (f"yaw rate: {some}",)


def test_the_course_is_north_of_a_compass(given):
    """What is added to the yaw for the course is counter-clockwise from east."""
    course = np.full(20, NAN)
    course[3], course[17] = 0.5, -1.0
    taken, _ = given(0.2 * np.arange(20), np.full(20, 0.02), course)
    assert taken.use_compass
    expected = [np.pi / 2 - 0.5, NAN, NAN, np.pi / 2 + 1.0]
    north = np.where(taken.compass.disturbed, NAN, taken.compass.north_rad)
    assert north.tolist() == pytest.approx(expected, nan_ok=True)


def test_missing_rates_do_not_count(given):
    rate = np.where(np.arange(20) < 15, NAN, 0.02)
    _, found = given(0.5 * np.arange(20), rate)
    assert int(found.stood.sum()) == 5
