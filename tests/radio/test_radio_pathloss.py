"""COST 231 path loss against numbers worked by hand from the published equations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.propagation.empirical import (
    cost231_hata_db,
    cost231_walfisch_ikegami_db,
    free_space_db,
    multi_screen_db,
    roof_to_street_db,
)
from mapfilter.propagation.published_ranges import outside_published_range


def test_hata_term_by_term() -> None:
    # f = 1800 MHz, h_b = 30 m, h_m = 1.5 m, d = 2 km; lg f = 3.2552725, lg h_b = 1.4771213.
    #   46.3 + 33.9 · 3.2552725           = 156.65374
    #   - 13.82 · 1.4771213               = -20.41382
    #   a = 2.8807998 · 1.5 - 4.2782251   =   0.04297
    #   35.2248557 · lg 2 = 0.30103       =  10.60374
    expected = 156.65374 - 20.41382 - 0.04297 + 10.60374
    assert cost231_hata_db(2000.0, 1800.0, 30.0, 1.5, False) == pytest.approx(expected, abs=2e-4)
    assert cost231_hata_db(2000.0, 1800.0, 30.0, 1.5, True) == pytest.approx(
        expected + 3.0, abs=2e-4
    )


def test_hata_slope_per_decade() -> None:
    loss = cost231_hata_db([1000.0, 10000.0], 1800.0, 50.0, 1.5, False)
    assert loss[1] - loss[0] == pytest.approx(44.9 - 6.55 * math.log10(50.0))


def test_line_of_sight_canyon() -> None:
    # 42.6 + 26 lg 0.02 + 20 lg 900 = 42.6 - 44.17322 + 59.08485
    loss = cost231_walfisch_ikegami_db(20.0, 900.0, 10, 1.5, 15, 20, 40, 90, False, True)
    assert loss == pytest.approx(57.51163, abs=1e-5)


def test_canyon_meets_free_space_at_20_m() -> None:
    canyon = cost231_walfisch_ikegami_db(20.0, 900.0, 10, 1.5, 15, 20, 40, 90, False, True)
    assert canyon == pytest.approx(free_space_db(20.0, 900.0), abs=0.02)


def test_roof_to_street_has_three_orientations() -> None:
    # -16.9 - 10 lg 20 + 10 lg 900 + 20 lg 13.5 = -16.9 - 13.0103 + 29.542425 + 22.606675
    base = 22.2388
    angles = [0.0, 20.0, 34.999999, 35.0, 45.0, 55.0, 90.0]
    orientation = [-10.0, -2.92, 2.39, 2.5, 3.25, 4.0, 0.01]
    got = roof_to_street_db(900.0, 13.5, 20.0, angles)
    np.testing.assert_allclose(got, base + np.array(orientation), atol=1e-4)


def test_multi_screen_with_base_above_roofs() -> None:
    # -18 lg(1 + 15) + 54 + 18 lg 2 + k_f lg 1800 - 9 lg 40, k_f = -4 + 0.7 (1800/925 - 1)
    #   = -21.67416 + 54 + 5.41854 - 3.3378378 · 3.2552725 - 14.41854
    medium = 12.46028
    assert multi_screen_db(2000.0, 1800.0, 30.0, 15.0, 40.0, False) == pytest.approx(
        medium, abs=1e-4
    )
    # k_f is larger by 0.8 · 0.9459459 in metropolitan centres.
    assert multi_screen_db(2000.0, 1800.0, 30.0, 15.0, 40.0, True) == pytest.approx(
        medium + 0.8 * 0.9459459 * 3.2552725, abs=1e-4
    )


def test_multi_screen_with_base_below_roofs() -> None:
    # Δh_b = 10 - 15 = -5: L_bsh = 0, k_a = 54 + 4 (d ≥ 0.5 km), k_d = 18 + 15 · 5 / 15 = 23,
    # k_f = -4 + 0.7 (900/925 - 1) = -4.0189189; lg 900 = 2.9542425, 9 lg 40 = 14.41854.
    far = 58.0 + 23.0 * math.log10(0.8) - 4.0189189 * 2.9542425 - 14.41854
    assert multi_screen_db(800.0, 900.0, 10.0, 15.0, 40.0, False) == pytest.approx(far, abs=1e-5)
    # Nearer than 0.5 km k_a falls with distance: 54 + 0.8 · 5 · 0.2 / 0.5 = 55.6.
    near = 55.6 + 23.0 * math.log10(0.2) - 4.0189189 * 2.9542425 - 14.41854
    assert multi_screen_db(200.0, 900.0, 10.0, 15.0, 40.0, False) == pytest.approx(near, abs=1e-5)


def test_without_line_of_sight_is_the_sum_of_the_terms() -> None:
    loss = cost231_walfisch_ikegami_db(1000.0, 1800.0, 30, 1.5, 15, 20, 40, 90, False, False)
    # Free space 97.50545, roof to street 25.24910 + 0.01, multi-screen 7.04174.
    assert loss == pytest.approx(129.80629, abs=1e-4)


def test_negative_diffraction_leaves_free_space() -> None:
    loss = cost231_walfisch_ikegami_db(100.0, 1800.0, 300, 1.5, 3.0, 100, 40, 0, False, False)
    assert loss == pytest.approx(free_space_db(100.0, 1800.0))


def test_distances_below_20_m_count_as_20_m() -> None:
    for seen in (True, False):
        loss = cost231_walfisch_ikegami_db(
            [0.0, 5.0, 20.0], 1800.0, 30, 1.5, 15, 20, 40, 90, False, seen
        )
        assert loss[0] == loss[1] == loss[2]
    hata = cost231_hata_db([0.0, 20.0], 1800.0, 30, 1.5, False)
    assert hata[0] == hata[1]


def test_low_roofs_count_as_one_metre_above_the_mobile() -> None:
    args = (300.0, 1800.0, 30.0, 1.5)
    flat = cost231_walfisch_ikegami_db(*args, [0.0, 2.0, 2.5], 20, 40, 90, False, False)
    assert flat[0] == flat[1] == flat[2]
    assert np.isfinite(flat).all()


@given(
    st.floats(20, 5000),
    st.floats(800, 2000),
    st.floats(4, 50),
    st.floats(3, 45),
    st.floats(0, 90),
    st.booleans(),
)
def test_never_below_free_space_and_rising_with_distance(
    distance_m: float, mhz: float, base_m: float, roof_m: float, angle_deg: float, metro: bool
) -> None:
    distances_m = [distance_m, 1.1 * distance_m]
    loss = cost231_walfisch_ikegami_db(
        distances_m, mhz, base_m, 1.5, roof_m, 20, 40, angle_deg, metro, False
    )
    assert (loss >= free_space_db(distances_m, mhz) - 1e-9).all()
    # Below the roofs k_a falls with distance up to 0.5 km, so that only the far part must rise.
    if base_m > roof_m or distance_m > 500:
        assert loss[1] > loss[0]


TOO_LOW = {"frequency_mhz": 100.0, "base_height_m": 30.0, "distance_m": 1000.0}


def test_what_is_extrapolated_is_told() -> None:
    used = {"base_height_m": 20.0, "mobile_height_m": 1.5, "distance_m": 500.0}
    notes = outside_published_range("cost231_hata", used | {"frequency_mhz": 900.0})
    assert notes == (
        "frequency_mhz 900 is outside 1500..2000, set prediction.model = "
        '"okumura_hata" or "cost231_walfisch_ikegami" or "tr38901_uma" or "tr38901_umi"',
        "base_height_m 20 is outside 30..200",
        "distance_m 500 is outside 1000..20000",
    )
    notes = outside_published_range("cost231_walfisch_ikegami", used | {"frequency_mhz": 2630.0})
    assert notes == (
        "frequency_mhz 2630 is outside 800..2000, set prediction.model = "
        '"tr38901_uma" or "tr38901_umi"',
    )
    (note,) = outside_published_range("okumura_hata", {"mobile_height_m": 1.5, **TOO_LOW})
    assert note == "frequency_mhz 100 is outside 150..1500"
