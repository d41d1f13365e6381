"""Turns of tables and angles of options in degrees where radians are meant are refused."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mapfilter as mf
from mapfilter.errors import ConfigError, InputError
from mapfilter.models.street_motion import MotionErrors

CRS = "EPSG:32635"
LIKELY = "likely: degrees given for radians"


def motion_of(step_m, turn_deg, apart_s=1.0):
    time_s = apart_s * np.arange(len(turn_deg))
    return pd.DataFrame({"time_s": time_s, "step_m": step_m, "turn_rad": np.radians(turn_deg)})


def driven(seed=1):
    """Return turns of a drive, degrees in each second, a third of them in bends."""
    rng = np.random.default_rng(seed)
    bends = np.repeat(rng.choice([-1, 1], 30), 20) * 4.0
    return np.where(np.arange(600) // 20 % 3 == 1, bends, rng.normal(0, 0.6, 600))


@pytest.mark.parametrize(
    ("step_m", "apart_s", "turn_deg"),
    [(9.0, 1.0, driven()), (0.14, 0.1, np.tile(np.clip(driven(), -3, 3), 5))],
    ids=["drive", "walk"],
)
def test_small_turns_in_degrees_are_too_fast(step_m, apart_s, turn_deg):
    motion = motion_of(step_m, turn_deg, apart_s)
    assert mf.make_log(CRS, motion=motion).notes == ()
    motion["turn_rad"] = turn_deg
    with pytest.raises(InputError, match=LIKELY) as refused:
        mf.make_log(CRS, motion=motion)
    assert str(refused.value).startswith("motion, turn_rad: expected radians turned in each")


def test_noise_of_a_compass_at_50_hz_is_no_turn():
    heading_deg = np.cumsum(np.repeat(driven() / 50, 50))
    heading_deg += np.random.default_rng(2).normal(0, 1.5, heading_deg.size)
    turn_deg = np.diff(heading_deg, prepend=heading_deg[0])
    motion = motion_of(0.3, turn_deg, 0.02)
    assert np.quantile(np.abs(15 * motion["turn_rad"] / 0.02), 0.8) > 20
    assert mf.make_log(CRS, motion=motion).notes == ()


@given(
    corners=st.lists(st.sampled_from([-90, 90, 180]), min_size=30, max_size=60),
    apart=st.integers(6, 30),
    step_m=st.floats(0.5, 30.0),
)
def test_right_angles_within_a_row_are_no_degrees(corners, apart, step_m):
    turn_deg = np.zeros(len(corners) * apart)
    turn_deg[::apart] = corners
    assert len(mf.make_log(CRS, motion=motion_of(step_m, turn_deg)).motion) == turn_deg.size


def test_rows_of_one_time_have_no_rate():
    motion = motion_of(9.0, driven())
    motion["time_s"] = np.floor(motion["time_s"] / 4)
    motion["turn_rad"] += 1e-6 * np.arange(600)
    assert len(mf.make_log(CRS, motion=motion).motion) == 600


def test_angles_of_options_are_at_most_a_whole_turn():
    expected = r"heading_sd_rad: expected a number in 0\.\.6\.28319, found 20"
    with pytest.raises(ConfigError, match=rf"{expected} \({LIKELY}\)"):
        MotionErrors(heading_sd_rad=20)
    with pytest.raises(ConfigError, match="bias_sd_rad") as refused:
        MotionErrors(bias_sd_rad=400)
    assert LIKELY not in str(refused.value)
    assert MotionErrors(disturbed_rad=3).disturbed_rad == 3
