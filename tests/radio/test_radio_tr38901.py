"""TR 38.901 against numbers worked by hand from tables 7.4.1-1 and 7.4.2-1."""

from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.propagation.tr38901 import (
    breakpoint_distance_m,
    hidden_loss_db,
    seen_loss_db,
    sight_probability,
)

Scenario = Literal["uma", "umi"]
SCENARIOS = st.sampled_from(["uma", "umi"])


def test_breakpoints() -> None:
    # 4 · 24 · 0.5 · 2e9 / 3e8 and 4 · 9 · 0.5 · 3.5e9 / 3e8
    assert breakpoint_distance_m(2000.0, 25.0, 1.5) == pytest.approx(320.0)
    assert breakpoint_distance_m(3500.0, 10.0, 1.5) == pytest.approx(210.0)
    # A mobile at 20 m over an environment of 12 m: 4 · 13 · 8 · 2e9 / 3e8
    assert breakpoint_distance_m(2000.0, 25.0, 20.0, 12.0) == pytest.approx(2773.3333, abs=1e-4)
    assert breakpoint_distance_m(2000.0, 25.0, 0.5) > 0


def test_uma_before_and_beyond_the_breakpoint() -> None:
    # d_3D = √(100² + 23.5²) = 102.72415: 28 + 22 · 2.0116724 + 6.0206 = 78.27739
    # d_3D = 1000.27609: 28 + 40 · 3.0001199 + 6.0206 - 9 lg(320² + 23.5²) = 154.02540 - 45.11372
    got = seen_loss_db("uma", [100.0, 1000.0], 2000.0, 25.0, 1.5)
    np.testing.assert_allclose(got, [78.27739, 108.91168], atol=2e-5)


def test_uma_hidden() -> None:
    # 13.54 + 39.08 · 3.0001199 + 6.0206 = 136.80529; 3 m higher 1.8 dB less.
    assert hidden_loss_db("uma", 1000.0, 2000.0, 25.0, 1.5) == pytest.approx(136.80529, abs=2e-5)
    base_m = np.sqrt(1000.27609**2 - 1000.0**2) + 4.5
    assert hidden_loss_db("uma", 1000.0, 2000.0, base_m, 4.5) == pytest.approx(135.00529, abs=2e-5)


def test_umi_before_and_beyond_the_breakpoint() -> None:
    # d_3D = √(50² + 8.5²) = 50.71735: 32.4 + 21 · 1.7051566 + 10.8813609 = 79.08965
    # d_3D = 500.07224: 32.4 + 40 · 2.6990328 + 10.8813609 - 9.5 lg(210² + 8.5²)
    #   = 151.24267 - 9.5 · 4.6451495
    got = seen_loss_db("umi", [50.0, 500.0], 3500.0, 10.0, 1.5)
    np.testing.assert_allclose(got, [79.08965, 107.11375], atol=2e-5)


def test_umi_hidden() -> None:
    # 22.4 + 35.3 · 1.7051566 + 21.3 · 0.5440680 = 94.18068
    assert hidden_loss_db("umi", 50.0, 3500.0, 10.0, 1.5) == pytest.approx(94.18068, abs=2e-5)


def test_probability_of_line_of_sight() -> None:
    # UMa, 100 m: 0.18 + e^(-100/63) · 0.82; UMi: 0.18 + e^(-100/36) · 0.82
    assert sight_probability("uma", 100.0) == pytest.approx(0.3476708, abs=1e-6)
    assert sight_probability("umi", 100.0) == pytest.approx(0.2309845, abs=1e-6)
    # At 23 m C' = 1: 1 + 1.25 e^(-100/150) = 1.6417714 times as much; at 13 m none.
    assert sight_probability("uma", 100.0, 23.0) == pytest.approx(0.5707960, abs=1e-6)
    assert sight_probability("uma", 100.0, 13.0) == sight_probability("uma", 100.0)
    assert sight_probability("umi", 100.0, 23.0) == sight_probability("umi", 100.0)
    np.testing.assert_array_equal(sight_probability("uma", [0.0, 18.0], 22.0), [1.0, 1.0])


@given(SCENARIOS, st.floats(0, 5e4), st.floats(0.1, 100))
def test_probability_is_one(scenario: Scenario, distance_m: float, mobile_m: float) -> None:
    assert 0 < sight_probability(scenario, distance_m, mobile_m) <= 1


@given(SCENARIOS, st.floats(500, 7000), st.floats(5, 50), st.floats(1.1, 4.9))
def test_loss_is_continuous_at_the_breakpoint(
    scenario: Scenario, mhz: float, base_m: float, mobile_m: float
) -> None:
    at_m = float(breakpoint_distance_m(mhz, base_m, mobile_m))
    near, far = seen_loss_db(
        scenario, [at_m * (1 - 1e-9), at_m * (1 + 1e-9)], mhz, base_m, mobile_m
    )
    if at_m > 10:
        assert near == pytest.approx(far, abs=1e-6)


@given(SCENARIOS, st.floats(10, 5000), st.floats(500, 7000), st.floats(3, 60), st.floats(1, 22))
def test_hidden_is_never_less_than_seen_and_both_rise(
    scenario: Scenario, distance_m: float, mhz: float, base_m: float, mobile_m: float
) -> None:
    distances_m = [distance_m, 1.05 * distance_m]
    seen = seen_loss_db(scenario, distances_m, mhz, base_m, mobile_m)
    hidden = hidden_loss_db(scenario, distances_m, mhz, base_m, mobile_m)
    assert (hidden >= seen).all()
    assert seen[1] > seen[0]
    assert hidden[1] > hidden[0]


def test_nearer_than_10_m_counts_as_10_m() -> None:
    for scenario in ("uma", "umi"):
        loss = hidden_loss_db(scenario, [0.0, 9.0, 10.0], 2000.0, 25.0, 1.5)  # type: ignore[arg-type]
        assert np.unique(loss).size == 1
