"""Fixes beside a way: lines by least squares, and how far errors that last lead them astray."""

from math import radians

import numpy as np
import pytest

from mapfilter.positioning.kalman.stretches import Stretches, led_by

EAST, NORTH, LASTS_S = 500_000.0, 4_600_000.0, 30.0


def rows_of(way, fixes, variance_m2, usual_m=0.0, beyond_m=0.0, every_s=4.0):
    """Rows of fixes beside a way, as complex numbers, that are some seconds apart."""
    many = len(way)
    columns = [every_s * np.arange(many), way.real, way.imag, fixes.real + EAST, fixes.imag + NORTH]
    same = [np.full(many, one) for one in (variance_m2, usual_m, beyond_m, 0.0, 0.0, 50.0)]
    return np.column_stack([*columns, *same])


def line(way, fixes):
    """Four unknowns of east and north of fixes, what they leave, and the matrix that gives them."""
    one, zero = np.ones(len(way)), np.zeros(len(way))
    x, y = way.real, way.imag
    matrix = np.vstack([np.stack([one, zero, x, -y], 1), np.stack([zero, one, y, x], 1)])
    given = np.concatenate([fixes.real, fixes.imag])
    inverse = np.linalg.pinv(matrix)
    found = inverse @ given
    return found, given - matrix @ found, matrix, inverse


def both_axes(variance_m2, lasting_m, many, every_s=4.0):
    """Covariance of the errors of all eastings and northings."""
    apart_s = every_s * np.abs(np.subtract.outer(np.arange(many), np.arange(many)))
    own = variance_m2 * np.eye(many) + lasting_m**2 * np.exp(-apart_s / LASTS_S)
    return np.kron(np.eye(2), own)


@pytest.mark.parametrize(("usual_m", "beyond_m"), [(0.0, 0.0), (6.0, 0.0), (0.0, 9.0), (4.0, 7.0)])
def test_stretches_are_least_squares(usual_m, beyond_m):
    rng = np.random.default_rng(7)
    way = np.cumsum(rng.normal(5, 3, (12, 2)), axis=0) @ [1, 1j]
    fixes = 1.1 * np.exp(0.8j) * way + rng.normal(0, 2, (12, 2)) @ [1, 1j]
    rows = rows_of(way, fixes, 60.0, usual_m, beyond_m)
    found = Stretches.of(rows, LASTS_S)
    for first in range(7):
        (east, north, a, b), left, matrix, inverse = line(way[first:], fixes[first:])
        factor = complex(a, b)
        assert found.factor[first] == pytest.approx(factor, rel=1e-9)
        assert found.residual_m2[first] == pytest.approx(left @ left, rel=1e-6)
        size, across = abs(factor), np.array([0.0, 0.0, -b, a]) / abs(factor) ** 2
        errors = both_axes(60.0, beyond_m, 12 - first)
        covariance = inverse @ errors @ inverse.T
        sd_rad = np.sqrt(across @ covariance @ across)
        assert found.sd_rad[first] == pytest.approx(sd_rad, rel=1e-9)
        # What a line leaves of such errors on average.
        beside = np.eye(len(left)) - matrix @ inverse
        usual = np.trace(beside @ errors)
        assert found.fits[first] == (left @ left <= 2.0 * usual)
        led = led_by(rows[first:], complex(way[-1]), LASTS_S)
        place = complex(east, north) + factor * way[-1]
        assert (led.east_m - EAST, led.north_m - NORTH) == pytest.approx(
            (place.real, place.imag), rel=1e-6
        )
        errors = both_axes(60.0, np.hypot(usual_m, beyond_m), 12 - first)
        covariance = inverse @ errors @ inverse.T
        at = np.array([[1.0, 0.0, way[-1].real, -way[-1].imag], [0, 1, way[-1].imag, way[-1].real]])
        assert led.sd_m == pytest.approx(np.sqrt(at[0] @ covariance @ at[0]), rel=1e-6)
        assert led.sd_rad == pytest.approx(np.sqrt(across @ covariance @ across), rel=1e-6)
        assert led.shared_m_rad == pytest.approx(at @ covariance @ across, rel=1e-6, abs=1e-6)
        assert size == pytest.approx(1.1, abs=0.3)
    assert not found.fits[7:].any()


def test_a_line_fits_up_to_twice_what_errors_leave():
    """One coordinate is off by as much as leaves a little less, and a little more than that."""
    way = 5.0 * np.arange(10.0) + 3j * np.arange(10.0) ** 1.5
    bent = 1j * np.where(np.arange(10) % 2, 1.0, -1.0)
    _, left, matrix, inverse = line(way, bent)
    errors = both_axes(50.0, 8.0, 10)
    usual = np.trace((np.eye(20) - matrix @ inverse) @ errors)
    most = np.sqrt(2.0 * usual / (left @ left))
    for times, fits in ((0.99, True), (1.01, False)):
        rows = rows_of(way, way + times * most * bent, 50.0, 0.0, 8.0)
        assert Stretches.of(rows, LASTS_S).fits[0] == fits


@pytest.mark.parametrize("beyond_m", [0.0, 9.0])
def test_how_far_directions_and_places_are_off_is_what_is_stated(beyond_m):
    """Of 4 000 stretches with drawn errors (95 % of a mean square: 0.956 to 1.044)."""
    rng = np.random.default_rng(11)
    way = np.cumsum(7.0 * np.exp(1j * np.repeat([0.2, 1.8, 0.3], 6)))
    root = np.linalg.cholesky(both_axes(49.0, beyond_m, 18))
    drawn = rng.normal(size=(4000, 36)) @ root.T
    off_rad, off_m, led = [], [], None
    for one in drawn:
        fixes = way + one[:18] + 1j * one[18:]
        led = led_by(rows_of(way, fixes, 49.0, 0.0, beyond_m), complex(way[-1]), LASTS_S)
        off_rad.append(np.angle(Stretches.of(rows_of(way, fixes, 49.0), LASTS_S).factor[0]))
        off_m.append([led.east_m - EAST - way[-1].real, led.north_m - NORTH - way[-1].imag])
    exact = led_by(rows_of(way, way, 49.0, 0.0, beyond_m), complex(way[-1]), LASTS_S)
    assert np.mean(np.square(off_rad)) / exact.sd_rad**2 == pytest.approx(1, abs=0.06)
    assert np.mean(np.square(off_m)) / exact.sd_m**2 == pytest.approx(1, abs=0.05)
    shared = np.array(off_m).T @ off_rad / 4000 / (exact.sd_m * exact.sd_rad)
    stated = np.array(exact.shared_m_rad) / (exact.sd_m * exact.sd_rad)
    assert shared == pytest.approx(stated, abs=0.06)


@pytest.mark.parametrize("off_deg", [10.0, 60.0, 180.0])
def test_the_ratio_is_that_of_sums_of_squares(off_deg):
    """Of exact fixes, with the angle of the belief known: what another angle leaves of them."""
    rng = np.random.default_rng(3)
    way = np.cumsum(rng.normal(5, 3, (10, 2)), axis=0) @ [1, 1j]
    fixes = np.exp(0.3j) * way
    found = Stretches.of(rows_of(way, fixes, 49.0), LASTS_S)
    nats = found.nats(np.full(10, radians(off_deg)), np.zeros(10))
    for first in range(5):
        other = np.exp(1j * (0.3 + radians(off_deg))) * way[first:]
        off = fixes[first:] - other
        left = np.abs(off - off.mean()) ** 2
        assert nats[first] == pytest.approx(left.sum() / (2 * 49.0), rel=1e-6)


def test_a_way_that_is_drawn_out_is_told_once_it_is_long():
    way = 5.0 * np.cumsum(np.exp(1j * np.repeat([0.2, 1.8], 15)))
    for times, expected in ((1.05, False), (1.35, True), (0.7, True)):
        found = Stretches.of(rows_of(way, times * np.exp(0.7j) * way, 49.0), LASTS_S)
        assert found.drawn_out[0] == expected
        # Six fixes over 25 m may be off by as much.
        assert not found.drawn_out[-6]
        assert found.fits[[0, -6]].all()


def test_fixes_that_jump_do_not_fit():
    """They state 5 m; 25 m aside is no jump, 35 m is, up to the last fix before it."""
    way = 5.0 * np.arange(30.0) * np.exp(0.4j)
    for aside_m, jumps in ((25.0, False), (35.0, True)):
        rows = rows_of(way, way + 1j * np.exp(0.4j) * aside_m * (np.arange(30) >= 20), 400.0)
        rows[:, 10] = 5.0
        fits = Stretches.of(rows, LASTS_S).fits
        assert fits[20:25].all()
        assert fits[10:20].any() != jumps


@pytest.mark.parametrize(("aside_m", "jumps"), [(51.9, False), (52.1, True)])
def test_a_jump_is_by_the_errors_of_the_two_fixes_beside_it(aside_m, jumps):
    """Four times 13 m, of one of 5 m and one of 12 m. What others state is nothing to it."""
    way = np.zeros(20) + 5.0j * np.arange(20)
    rows = rows_of(way, way + aside_m * (np.arange(20) >= 12), 4000.0)
    # Steps lead 5 m north meanwhile, and fixes as far to the side and north.
    rows[:, 3] = EAST + np.where(np.arange(20) >= 12, np.sqrt((aside_m + 5.0) ** 2 - 25.0), 0.0)
    for others_m in (1.0, 90.0):
        rows[:, 10] = others_m
        rows[11, 10], rows[12, 10] = 5.0, 12.0
        if others_m == 90.0:
            assert Stretches.of(rows, LASTS_S).fits[11] != jumps
        # With 1 m no other pair jumps, either.
        assert Stretches.of(rows, LASTS_S).fits[:12].any() != jumps
        assert Stretches.of(rows, LASTS_S).fits[12]


@pytest.mark.parametrize(("residual_m2", "fits"), [(200.0, True), (204.0, False)])
def test_what_lasts_of_the_last_fix_may_be_left_of_a_line(residual_m2, fits):
    """101 m² of the last fix, 125 m² of the second: a line takes most of what lasts away."""
    way = 5.0 * np.arange(8.0) + 0j
    bent = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0])
    rows = rows_of(way, way + 1j * bent * np.sqrt(residual_m2 / 8), 1.0, 0.0, 10.0, every_s=0.001)
    rows[1, 5] = 25.0
    found = Stretches.of(rows, LASTS_S)
    assert found.residual_m2[0] == pytest.approx(residual_m2, rel=1e-3)
    assert found.fits[0] == fits
