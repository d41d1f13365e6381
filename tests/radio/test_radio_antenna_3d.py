"""Antennas in three dimensions: cuts combined, electrical and mechanical downtilt."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msi_files import panel_losses

from mapfilter.radio.antenna import (
    MeasuredAntenna,
    combined_gain_db,
    leaning,
    sector_gain_db,
    vertical_gain_db,
)

ANGLES = st.floats(-np.pi, np.pi)
STEEP = st.floats(-np.pi / 2, np.pi / 2)


def panel(downtilt_deg: float = 0.0) -> MeasuredAntenna:
    horizontal, vertical = panel_losses(downtilt_deg)
    every = np.arange(360.0)
    return MeasuredAntenna("panel", every, horizontal, every, vertical, downtilt_deg)


def test_element_of_tr_38901() -> None:
    # Table 7.3-1: 65° both ways, SLA_V = A_max = 30 dB; θ″ = 90° + depression.
    def gain(offset_deg: float, depression_deg: float) -> float:
        beam_rad = np.radians(65.0)
        return float(
            combined_gain_db(
                sector_gain_db(np.radians(offset_deg), beam_rad, 30.0),
                vertical_gain_db(np.radians(depression_deg), 0.0, beam_rad, 30.0),
                30.0,
            )
        )

    assert gain(0, 0) == 0
    assert gain(32.5, 0) == pytest.approx(-3)
    assert gain(32.5, 32.5) == pytest.approx(-6)
    # 12 (60/65)² + 12 (30/65)² = 10.22485 + 2.55621
    assert gain(60, -30) == pytest.approx(-12.78107, abs=1e-5)
    assert gain(180, 90) == -30


def test_side_lobes_have_their_own_bound() -> None:
    steep_rad = np.radians(80.0)
    assert vertical_gain_db(steep_rad, 0.0, np.radians(10.0)) == -20
    assert vertical_gain_db(steep_rad, 0.0, np.radians(10.0), 30.0) == -30


def test_leaning_forward_lowers_the_beam_in_front_raises_it_behind_and_not_beside() -> None:
    around_rad = np.radians([0.0, 90.0, 180.0, 270.0])
    _, own = leaning(around_rad, np.zeros(4), np.radians(8.0))
    np.testing.assert_allclose(np.degrees(own), [-8.0, 0.0, 8.0, 0.0], atol=1e-9)
    # At 45° the beam is arcsin(sin 8° cos 45°) = 5.6476° above this horizon.
    _, own = leaning(np.radians(45.0), 0.0, np.radians(8.0))
    assert np.degrees(own) == pytest.approx(-5.6476, abs=1e-4)


def test_leaning_by_the_equations_of_tr_38901() -> None:
    # cos θ′ = cos φ sin θ sin β + cos θ cos β,
    # φ′ = arg(cos φ sin θ cos β - cos θ sin β + j sin φ sin θ)
    theta, phi, tilt = np.radians([100.0, 40.0, 6.0])
    cos_own = np.cos(phi) * np.sin(theta) * np.sin(tilt) + np.cos(theta) * np.cos(tilt)
    own_phi = np.arctan2(
        np.sin(phi) * np.sin(theta),
        np.cos(phi) * np.sin(theta) * np.cos(tilt) - np.cos(theta) * np.sin(tilt),
    )
    offset, depression = leaning(phi, theta - np.pi / 2, tilt)
    assert offset == pytest.approx(own_phi)
    assert depression == pytest.approx(np.arccos(cos_own) - np.pi / 2)


@given(ANGLES, STEEP, st.floats(-0.5, 0.5))
def test_leaning_forth_and_back_is_nothing(offset: float, depression: float, tilt: float) -> None:
    there = leaning(*leaning(offset, depression, tilt), -tilt)
    before = [np.cos(depression) * np.cos(offset), np.cos(depression) * np.sin(offset)]
    after = [np.cos(there[1]) * np.cos(there[0]), np.cos(there[1]) * np.sin(there[0])]
    np.testing.assert_allclose(after, before, atol=1e-12)
    assert np.sin(there[1]) == pytest.approx(np.sin(depression), abs=1e-12)


def test_cuts_are_reproduced() -> None:
    antenna = panel(6.0)
    horizontal, vertical = panel_losses(6.0)
    ahead = np.radians(np.arange(-90.0, 91.0))
    expected = -vertical[np.arange(-90, 91) % 360]
    np.testing.assert_allclose(antenna.gain_db(0.0, ahead), expected, atol=1e-9)
    np.testing.assert_allclose(
        antenna.gain_db(np.pi, ahead),
        -np.maximum(vertical[(180 - np.arange(-90, 91)) % 360], 0),
        atol=1e-9,
    )
    untilted = panel()
    around = np.radians(np.arange(360.0))
    # Clockwise angles in the file, counter-clockwise ones here.
    np.testing.assert_allclose(
        untilted.gain_db(around, 0.0), -horizontal[-np.arange(360) % 360], atol=1e-9
    )


def test_interpolation_crosses_the_wrap() -> None:
    horizontal = np.full(360, 10.0)
    horizontal[0], horizontal[1], horizontal[359] = 0.0, 2.0, 4.0
    antenna = MeasuredAntenna("a", np.arange(360.0), horizontal, np.arange(360.0), np.zeros(360))
    # A quarter of a degree clockwise lies between 0 and 1, counter-clockwise between 359 and 360.
    behind = 0.25 / 180 * (horizontal[180] - 0.0)
    got = antenna.gain_db(np.radians([-0.25, 0.25]), 0.0)
    np.testing.assert_allclose(got, [-(0.5 - behind), -(1.0 - behind)], atol=1e-9)


def test_gain_at_an_angle_is_the_formula_worked() -> None:
    # φ = 60°, θ = 7°: H = 12 (60/65)² = 10.22485, V = 12, V(173°) = 25 + 12, H(180°) = 25:
    # 10.22485 - 2/3 (0 - 12) - 1/3 (25 - 37) = 22.22485
    gain = panel().gain_db(np.radians(60.0), np.radians(7.0))
    assert gain == pytest.approx(-22.22485, abs=1e-5)


@given(ANGLES, STEEP, st.floats(-10, 20))
def test_no_direction_is_stronger_than_boresight(
    offset: float, depression: float, tilt: float
) -> None:
    assert panel(4.0).gain_db(offset, depression, tilt) <= 0


def test_electrical_downtilt_shifts_from_the_files_own() -> None:
    antenna = panel(6.0)
    at = np.radians([0.0, 2.0, 6.0, 10.0])
    np.testing.assert_allclose(antenna.gain_db(0.0, at, 6.0), antenna.gain_db(0.0, at))
    np.testing.assert_allclose(antenna.gain_db(0.0, at, 2.0), panel(2.0).gain_db(0.0, at))
    # Electrically tilted, the beam sinks behind as well.
    assert np.argmax(antenna.gain_db(np.pi, np.radians(np.arange(-20.0, 21.0)), 2.0)) == 22
