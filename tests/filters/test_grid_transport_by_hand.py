"""Mass that is moved, spread and exchanged on a lattice, beside loops over its pixels."""

from math import cos, nan, sin, sqrt

import numpy as np
import pytest

from mapfilter.filters.contract import MotionStep
from mapfilter.filters.grid_transport import (
    Spread,
    Transport,
    Waiting,
    carried,
    shifted,
    spread_along,
    taps,
    turned,
)

BEFORE = Waiting(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)


def test_a_step_waits_by_its_heading():
    after = BEFORE.after(MotionStep(-2.0, 0.5, sampling_sd_m=0.3))
    expected = (1 - 2 * cos(0.5), 2 - 2 * sin(0.5), 5.0, 4.09, 5.0, 6.0, 7.0)
    assert after == pytest.approx(expected)


def test_a_step_without_a_heading_goes_to_all_sides():
    after = BEFORE.after(MotionStep(-2.0, nan, turned_sd_rad=0.2, spread_m=6.0))
    assert after == pytest.approx((1.0, 2.0, 3.0, 4.0, 5.04, 8.0, 7.0 + 18.0))
    # One of which but the length is known goes as far as that.
    assert BEFORE.after(MotionStep(-2.0, nan)).aside_m2 == pytest.approx(7.0 + 2.0)
    assert Waiting() == (0.0,) * 7


@pytest.mark.parametrize(
    ("shift_px", "sd_px", "first", "share"),
    [
        (0.2, 0.5, -1, [0.045, 0.71, 0.245]),
        (-3.2, 0.0, -4, [0.2, 0.8, 0.0]),
        # As wide as three taps can be.
        (0.0, 1.0, -1, [0.5, 0.0, 0.5]),
        (2.25, sqrt(15 / 16), 1, [0.375, 0.0, 0.625]),
        # Between pixels less is not possible.
        (0.6, 0.1, 0, [0.4, 0.6, 0.0]),
    ],
)
def test_three_taps(shift_px, sd_px, first, share):
    begin, found = taps(shift_px, sd_px)
    assert begin == first
    np.testing.assert_allclose(found, share, atol=1e-6)


@pytest.mark.parametrize(
    ("shift_px", "sd_px", "first", "count"), [(0.3, 2.0, -9, 20), (-5.0, 1.1, -11, 13)]
)
def test_wide_taps_are_a_gaussian_over_pixels_read_into_pixels(shift_px, sd_px, first, count):
    """A sixth of a square pixel is what both do; four deviations and a pixel are kept."""
    begin, found = taps(shift_px, sd_px)
    assert (begin, found.size, found.dtype) == (first, count, np.float32)
    x = np.linspace(-12, 12, 240_001) * sd_px
    narrower = sqrt(sd_px**2 - 1 / 6)
    density = np.exp(-0.5 * (x / narrower) ** 2)
    density /= density.sum()
    for k, share in zip(range(first, first + count), found, strict=True):
        triangle = np.maximum(1 - np.abs(x + shift_px - k), 0)
        assert share == pytest.approx(triangle @ density, abs=1e-6)


MASS = np.arange(1.0, 61.0, dtype=np.float32).reshape(3, 4, 5)
SHARES = np.array([0.5, 0.2, 0.3], dtype=np.float32)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("first", [*range(-7, 6), -40, 40])
def test_mass_is_spread_along_an_axis_and_lost_beyond_the_lattice(first, axis):
    found = shifted(MASS, first, SHARES, axis=axis)
    expected = np.zeros(MASS.shape)
    for source in np.ndindex(MASS.shape):
        for k, share in enumerate(SHARES):
            target = list(source)
            target[axis] += first + k
            if 0 <= target[axis] < MASS.shape[axis]:
                expected[tuple(target)] += share * MASS[source]
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert found.dtype == np.float32


def test_shares_far_below_the_rounding_of_numbers_are_left_out():
    few = np.array([0.9e-7, 1.1e-7], dtype=np.float32)
    np.testing.assert_allclose(
        shifted(np.ones((1, 3), dtype=np.float32), 0, few, axis=1), [[0, 1.1e-7, 1.1e-7]]
    )


@pytest.mark.parametrize("first", [-8, -1, 0, 2, 5])
def test_an_angle_goes_around(first):
    found = turned(MASS, first, SHARES, circular=True)
    expected = np.zeros(MASS.shape)
    for b in range(3):
        for k, share in enumerate(SHARES):
            expected[(b + first + k) % 3] += share * MASS[b]
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    wide = np.full(7, 1 / 7, dtype=np.float32)
    twice = turned(MASS, first, wide, circular=True)
    counts = np.bincount((first + np.arange(7)) % 3, minlength=3) / 7
    by_hand = sum(counts[k] * np.roll(MASS, k, axis=0) for k in range(3))
    np.testing.assert_allclose(twice, by_hand, rtol=1e-6)
    # Where it does not, it is lost as on a lattice.
    np.testing.assert_array_equal(
        turned(MASS, first, SHARES, circular=False), shifted(MASS, first, SHARES, axis=0)
    )


def transport(**changes):
    likelihood = np.linspace(0.5, 1.5, 20, dtype=np.float32).reshape(4, 5)
    given = {
        "right_px": np.array([1.0, 0.0, -2.0]), "down_px": np.array([0.0, -1.0, 2.0]),
        "sd_right_px": np.array([0.0, 0.5, 0.0]), "sd_down_px": np.array([0.0, 0.0, 0.6]),
        "turned_bins": 0.0, "on": likelihood, "off": 0.25, "leave": 0.1, "come_back": 0.4,
    }  # fmt: skip
    return Transport(**(given | changes))


def moved_by_hand(mass):
    """Each bin by its own way: 1 to the right; 1 up and wide; 2 to the left and 2 down, tall."""
    found = np.zeros(mass.shape)
    found[0, :, 1:] = mass[0, :, :-1]
    up = np.zeros((4, 5))
    up[:-1] = mass[1, 1:]
    found[1] = 0.75 * up
    found[1, :, 1:] += 0.125 * up[:, :-1]
    found[1, :, :-1] += 0.125 * up[:, 1:]
    left = np.zeros((4, 5))
    left[:, :-2] = mass[2, :, 2:]
    for by, share in ((1, 0.18), (2, 0.64), (3, 0.18)):
        found[2, by:] += share * left[:-by]
    return found


def test_each_bin_goes_its_own_way_and_some_mass_changes_sides():
    on, off = MASS, MASS[::-1].copy()
    step = transport()
    stayed, away = carried(on, off, step, circular=True)
    here, there = moved_by_hand(on), moved_by_hand(off)
    np.testing.assert_allclose(stayed, (0.9 * here + 0.4 * there) * step.on, rtol=1e-5)
    np.testing.assert_allclose(away, (0.1 * here + 0.6 * there) * 0.25, rtol=1e-5)
    assert stayed.dtype == away.dtype == np.float32


@pytest.mark.parametrize("circular", [True, False])
def test_the_heading_error_changes_by_its_deviation(circular):
    on, off = MASS, MASS[::-1].copy()
    found = carried(on, off, transport(turned_bins=0.5), circular=circular)
    still = carried(on, off, transport(), circular=circular)
    for masses, before in zip(found, still, strict=True):
        expected = 0.75 * before
        for by in (-1, 1):
            other = np.roll(before, by, axis=0)
            if not circular:
                other[0 if by == 1 else -1] = 0
            expected += 0.125 * other
        np.testing.assert_allclose(masses, expected, rtol=1e-5)


def test_one_bin_alone_has_no_other_heading():
    step = transport(right_px=np.zeros(1), down_px=np.zeros(1), sd_right_px=np.zeros(1),
                     sd_down_px=np.zeros(1), turned_bins=0.5)  # fmt: skip
    stayed, _ = carried(MASS[:1], MASS[:1], step, circular=False)
    np.testing.assert_allclose(stayed, 1.3 * MASS[:1] * step.on, rtol=1e-5)


def test_a_way_to_all_sides_follows_the_ways_and_loses_nothing():
    ways = np.linspace(0.2, 2.0, 20, dtype=np.float32).reshape(4, 5)
    on, off = MASS[:2].copy(), MASS[1:].copy()
    stayed, away = spread_along(on, off, Spread(0.5, ways, 0.3, 0.1, 0.4))
    pull = np.zeros((4, 5, 4, 5))
    for row, col, a, b in np.ndindex(pull.shape):
        share = {0: 0.75, 1: 0.125}
        pull[row, col, a, b] = share.get(abs(row - a), 0) * share.get(abs(col - b), 0)
    mixed = {"on": 0.9 * on + 0.4 * off, "off": 0.1 * on + 0.6 * off}
    by_ways = pull * ways
    by_ways /= by_ways.sum(axis=(2, 3), keepdims=True)
    anywhere = pull / pull.sum(axis=(2, 3), keepdims=True)
    for found, mass, to in ((stayed, mixed["on"], by_ways), (away, mixed["off"], anywhere)):
        np.testing.assert_allclose(found, 0.3 * np.einsum("nrc,rcab->nab", mass, to), rtol=1e-5)
    assert (stayed + away).sum() == pytest.approx(0.3 * (on + off).sum(), rel=1e-5)
