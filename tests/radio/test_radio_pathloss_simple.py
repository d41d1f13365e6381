"""Free space, log-distance and Okumura-Hata against numbers worked by hand and published ones."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.propagation.empirical import (
    cost231_hata_db,
    free_space_db,
    friis_db,
    large_city_mobile_db,
    log_distance_db,
    mobile_height_db,
    okumura_hata_db,
)


def test_friis_at_one_wavelength_per_metre() -> None:
    # λ = 1 m at 299.792458 MHz: 20 lg(4 π · 100) = 61.98419.
    assert friis_db(100.0, 299.792458) == pytest.approx(61.98419, abs=1e-5)


def test_friis_levels_of_an_independent_implementation() -> None:
    # Received levels at 100, 1000 and 5000 m; transmitter and frequency drop out of differences.
    levels_dbm = np.array([-9.11391848288, -29.1139184829, -43.0933185696])
    loss_db = friis_db([100.0, 1000.0, 5000.0], 900.0)
    np.testing.assert_allclose(np.diff(loss_db), -np.diff(levels_dbm), atol=1e-9)


def test_friis_agrees_with_the_rounded_constant_of_cost_231() -> None:
    distances_m = np.geomspace(10.0, 1e4, 7)
    difference_db = friis_db(distances_m, 1800.0) - free_space_db(distances_m, 1800.0)
    # 20 lg(4 π 1e9 / c) = 32.44778 against 32.4.
    np.testing.assert_allclose(difference_db, 0.04778, atol=1e-5)


def test_friis_has_no_near_field() -> None:
    assert np.unique(friis_db([0.0, 0.5, 1.0], 900.0)).size == 1


def test_log_distance_worked() -> None:
    # Rappaport: n = 3.5 from 80 dB at 100 m; 35 dB a decade, 10.53605 an octave.
    loss_db = log_distance_db([50.0, 100.0, 200.0, 1000.0], 1800.0, 3.5, 100.0, 80.0)
    np.testing.assert_allclose(loss_db, [80.0, 80.0, 90.53605, 115.0], atol=1e-5)


@given(st.floats(1, 1e5), st.floats(100, 7000))
def test_log_distance_with_exponent_2_is_free_space(distance_m: float, mhz: float) -> None:
    assert log_distance_db(distance_m, mhz, 2.0) == pytest.approx(friis_db(distance_m, mhz))


def test_hata_in_four_environments() -> None:
    # f = 900 MHz, h_b = 30 m, h_m = 1.5 m, d = 5 km; lg f = 2.9542425, lg h_b = 1.4771213.
    #   69.55 + 26.16 · 2.9542425           = 146.83298
    #   - 13.82 · 1.4771213                 = -20.41382
    #   (44.9 - 6.55 · 1.4771213) lg 5      =  24.62112
    #   a = 2.5496668 · 1.5 - 3.8086183     =   0.01588
    town = 146.83298 - 20.41382 + 24.62112
    #   large city: 3.2 lg²(17.625) - 4.97  =  -0.00092
    #   suburb: 2 lg²(900 / 28) + 5.4       =   9.94261
    #   open: 4.78 · 8.7275487 - 18.33 · 2.9542425 + 40.94 = 28.50642
    expected = {
        "large_city": town + 0.00092,
        "city": town - 0.01588,
        "suburban": town - 0.01588 - 9.94261,
        "open": town - 0.01588 - 28.50642,
    }
    for environment, loss_db in expected.items():
        got = okumura_hata_db(5000.0, 900.0, 30.0, 1.5, environment)  # type: ignore[arg-type]
        assert got == pytest.approx(loss_db, abs=3e-5)


def test_hata_example_of_a_textbook() -> None:
    # Stallings, Wireless Communications and Networks: 900 MHz, 40 m, 5 m, 10 km: 150.14 dB from
    # terms rounded to two decimals.
    assert okumura_hata_db(10e3, 900.0, 40.0, 5.0, "city") == pytest.approx(150.14, abs=0.03)


def test_hata_mobile_heights() -> None:
    # 8.29 lg²(2.31) - 1.1 = 8.29 · 0.1322137 - 1.1
    assert large_city_mobile_db(150.0, 1.5) == pytest.approx(-0.00395, abs=1e-5)
    assert large_city_mobile_db(900.0, 1.5) == pytest.approx(-0.00092, abs=1e-5)
    assert mobile_height_db(900.0, 5.0) == pytest.approx(8.93972, abs=1e-5)


def test_hata_slope_is_that_of_the_base_height() -> None:
    loss = okumura_hata_db([1000.0, 10000.0], 900.0, 100.0, 1.5, "open")
    assert loss[1] - loss[0] == pytest.approx(44.9 - 6.55 * 2)


def test_the_two_hata_models_meet_near_1500_mhz() -> None:
    old = okumura_hata_db(3000.0, 1500.0, 50.0, 1.5, "city")
    new = cost231_hata_db(3000.0, 1500.0, 50.0, 1.5, False)
    # 69.55 - 46.3 + (26.16 - 33.9) lg 1500 = -1.3327
    assert old - new == pytest.approx(23.25 - 7.74 * math.log10(1500.0))
    assert abs(old - new) < 1.4


@given(st.floats(150, 1500), st.floats(30, 200), st.floats(1, 10), st.floats(1000, 20000))
def test_hata_orders_its_environments(
    mhz: float, base_m: float, mobile_m: float, distance_m: float
) -> None:
    at = (distance_m, mhz, base_m, mobile_m)
    city, suburb, open_land = (
        float(okumura_hata_db(*at, kind)) for kind in ("city", "suburban", "open")
    )
    assert open_land < suburb < city
    assert okumura_hata_db(1.1 * distance_m, mhz, base_m, mobile_m, "city") > city
