"""Turns that drift beside the course of positions."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.checks.turn_drift import turn_drift_radps


def journey(rng, drift_degps=0.0, white_degps=0.1, fix_sd_m=4.0, speed_mps=10.0):
    """Ten minutes with a corner every half minute, a row and a fix each second."""
    time_s = np.arange(600.0)
    turn = np.where(time_s % 30 == 15, np.pi / 2, 0.0) * rng.choice([-1, 1], 600)
    heading = np.cumsum(turn)
    way = np.cumsum(speed_mps * np.exp(1j * (heading - turn / 2)))
    seen = turn + np.radians(drift_degps) + rng.normal(0, np.radians(white_degps), 600)
    motion = pd.DataFrame({"time_s": time_s, "step_m": speed_mps, "turn_rad": seen})
    east, north = (part + rng.normal(0, fix_sd_m, 600) for part in (way.real, way.imag))
    return motion, pd.DataFrame({"time_s": time_s, "east_m": east, "north_m": north})


@pytest.mark.parametrize("drift_degps", [-3.0, -1.0, 0.6, 2.0])
@pytest.mark.parametrize("speed_mps", [5.0, 10.0])
def test_a_bias_is_found(drift_degps, speed_mps):
    for seed in range(4):
        rng = np.random.default_rng(seed)
        found = turn_drift_radps(*journey(rng, drift_degps, 0.5, speed_mps=speed_mps))
        assert np.degrees(found) == pytest.approx(drift_degps, rel=0.3)


@pytest.mark.parametrize("white_degps", [0.1, 2.0])
@pytest.mark.parametrize("fix_sd_m", [1.0, 15.0])
def test_noise_is_no_drift(white_degps, fix_sd_m):
    for seed in range(10, 20):
        rng = np.random.default_rng(seed)
        assert turn_drift_radps(*journey(rng, 0.0, white_degps, fix_sd_m)) == 0.0


def test_turns_that_are_not_known_show_nothing():
    motion, places = journey(np.random.default_rng(1), 2.0)
    assert turn_drift_radps(motion.assign(turn_rad=np.nan), places) == 0.0
    assert turn_drift_radps(motion, places.iloc[:4]) == 0.0
    assert turn_drift_radps(motion.iloc[:0], places) == 0.0
    assert turn_drift_radps(motion.assign(step_m=0.0), places) == 0.0
