"""Antenna patterns."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import InputError
from mapfilter.radio.antenna import sector_gain_db, vertical_gain_db

BEAM_RAD = float(np.radians(65.0))


def test_worked_numbers() -> None:
    offset_rad = np.radians([0.0, 10.0, 32.5, 65.0, 120.0])
    # 12 (10/65)² = 0.284, 12 (1/2)² = 3, 12 capped by nothing, 12 (120/65)² = 40.9 capped by 25.
    expected = [0.0, -12 * (10 / 65) ** 2, -3.0, -12.0, -25.0]
    np.testing.assert_allclose(sector_gain_db(offset_rad, BEAM_RAD, 25.0), expected, atol=1e-12)


def test_attenuation_is_capped_beyond_93_8_degrees() -> None:
    edge_rad = BEAM_RAD * np.sqrt(25.0 / 12.0)
    assert sector_gain_db(0.999 * edge_rad, BEAM_RAD, 25.0) > -25.0
    assert sector_gain_db(1.001 * edge_rad, BEAM_RAD, 25.0) == -25.0


@given(st.floats(-50, 50), st.integers(-3, 3))
def test_pattern_is_even_bounded_and_periodic(offset_rad: float, turns: int) -> None:
    gain = sector_gain_db(offset_rad, BEAM_RAD, 25.0)
    assert -25.0 <= gain <= 0.0
    np.testing.assert_allclose(sector_gain_db(-offset_rad, BEAM_RAD, 25.0), gain, atol=1e-9)
    turned = sector_gain_db(offset_rad + 2 * np.pi * turns, BEAM_RAD, 25.0)
    np.testing.assert_allclose(turned, gain, atol=1e-9)


def test_west_is_reached_across_the_wrap() -> None:
    gain = sector_gain_db(np.radians([359.0, -359.0]), BEAM_RAD, 25.0)
    np.testing.assert_allclose(gain, -12 * (1 / 65) ** 2)


def test_vertical_pattern_peaks_at_the_downtilt_and_ends_in_side_lobes() -> None:
    depression_rad = np.radians([6.0, 2.5, 9.5, 60.0, -60.0])
    gain = vertical_gain_db(depression_rad, np.radians(6.0), np.radians(7.0))
    np.testing.assert_allclose(gain, [0, -3, -3, -20, -20], atol=1e-12)


def test_beamwidth_in_degrees_is_told() -> None:
    with pytest.raises(InputError, match="degrees given for radians"):
        sector_gain_db(0.0, 65.0, 25.0)
    with pytest.raises(InputError, match="max_attenuation_db"):
        sector_gain_db(0.0, BEAM_RAD, -1.0)
