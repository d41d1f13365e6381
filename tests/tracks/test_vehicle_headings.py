"""Headings of vehicles beside their speeds, by hand."""

from math import nan, pi

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.pdr.vehicle_headings import has_headings, reckon_headings


def rows(heading, speed=8.0, yaw=nan, time_s=None):
    """A row a second."""
    time_s = np.arange(float(len(heading))) if time_s is None else time_s
    return pd.DataFrame(
        {"time_s": time_s, "speed_mps": speed, "yaw_rate_radps": yaw, "speed_sd_mps": 0.3,
         "heading_rad": heading}
    )  # fmt: skip


def wrapped(rad):
    return (np.asarray(rad) + pi) % (2 * pi) - pi


def test_a_heading_is_the_mean_of_an_intervals_ends_and_read_between_rows():
    """Past the west, with none at 4 and 5 s."""
    given = wrapped(2.8 + 0.1 * np.arange(10))
    given[[4, 5]] = nan
    motion, imu, notes = reckon_headings(rows(given))
    expected = wrapped([2.8, *(2.85 + 0.1 * np.arange(9))])
    np.testing.assert_allclose(wrapped(motion["heading_rad"] - expected), 0.0, atol=1e-9)
    assert motion["heading_rad"].abs().max() <= pi
    assert motion["step_m"].tolist() == [0.0, *[8.0] * 9]
    assert motion["turn_rad"].isna().all()
    assert notes == ()
    # Steady ones still err by a degree, and by 10 for long.
    assert (imu.sigma_orient_deg, imu.bias_sd_deg) == (1.0, 10.0)
    assert imu.sigma_trans_m == pytest.approx(0.3)


@pytest.mark.parametrize(("speed", "unknown_s"), [(8.0, 3.0), (-8.0, 3.0), (0.1, 3.0), (0.0, None)])
def test_motion_without_a_heading_for_over_a_second_is_not_known(speed, unknown_s):
    given = np.full(13, 0.5)
    given[4:9] = nan
    time_s = np.arange(13.0)
    # 5.5 s after 4 s, and 1.5 s before 7 s.
    time_s[5] = 5.5
    motion, _, notes = reckon_headings(rows(given, speed, time_s=time_s))
    missing = motion["heading_rad"].isna().to_numpy()
    assert np.flatnonzero(missing).tolist() == [6, 7]
    blind = motion["step_m"].isna().to_numpy()
    assert np.flatnonzero(blind).tolist() == ([6, 7] if unknown_s else [])
    told = "odometry: no heading over 1.5 s of driving: motion is not known"
    assert notes == ((told,) if unknown_s else ())
    np.testing.assert_allclose(motion["heading_rad"][~missing], 0.5)


@pytest.mark.parametrize(
    ("swing_rad", "sd_deg"), [(0.01, 1.0), (0.1, 6.936), (1.0, 69.36), (2.0, 90.0)]
)
def test_the_scatter_of_headings_is_their_error(swing_rad, sd_deg):
    """Of second differences of twice the swing; a normal one's are √6 as wide as it."""
    given = swing_rad * (np.arange(40) % 2)
    _, imu, _ = reckon_headings(rows(given))
    assert imu.sigma_orient_deg == pytest.approx(sd_deg, rel=1e-3)


def test_headings_at_the_ends_are_those_of_the_nearest_row():
    given = [nan, 0.2, 0.2, 0.4, nan]
    motion, _, notes = reckon_headings(rows(given))
    assert motion["heading_rad"].tolist() == pytest.approx([0.2, 0.2, 0.2, 0.3, 0.4])
    assert notes == ()
    late, _, notes = reckon_headings(rows(given, time_s=[0.0, 1.5, 2.5, 3.5, 5.0]))
    assert late["heading_rad"].tolist() == pytest.approx([nan, 0.2, 0.2, 0.3, 0.4], nan_ok=True)
    assert notes == ()


@pytest.mark.parametrize(
    ("time_s", "given"),
    [([0.0, 0.5, 2.0, 2.5], [0.2, 0.2, nan, 0.4]), ([0.0, 0.5, 9.0], [0.2, nan, 0.4]),
     ([0.0, 0.5, 1.0], [nan, 0.2, nan])],
)  # fmt: skip
def test_a_second_from_one_row_is_enough(time_s, given):
    """From the last one, from the first, or from the only one."""
    motion, _, notes = reckon_headings(rows(given, time_s=time_s))
    assert motion["heading_rad"].notna().all()
    assert not any("no heading" in note for note in notes)


def test_a_second_row_of_a_time_is_left_out():
    motion, _, _ = reckon_headings(rows([0.0, 0.2, 2.0, 0.4], time_s=[0.0, 1.0, 1.0, 2.0]))
    assert motion["time_s"].tolist() == [0.0, 1.0, 2.0]
    assert motion["heading_rad"].tolist() == pytest.approx([0.0, 0.1, 0.3])


def test_gaps_are_noted_and_yaw_rates_are_not_used():
    speed = np.full(30, 8.0)
    speed[10:20] = nan
    given = rows(np.full(30, 0.5), speed, yaw=0.1)
    motion, _, notes = reckon_headings(given)
    assert motion["time_s"].tolist() == [*range(10), *range(20, 30)]
    assert motion["turn_rad"].isna().all()
    assert notes == (
        "odometry: 1 gap (longest 11.0 s), over which motion is not known",
    )  # fmt: skip


def test_whether_there_are_headings():
    assert has_headings(rows([nan, 0.5]))
    assert not has_headings(rows([nan, nan]))
    assert not has_headings(rows([0.5]).drop(columns="heading_rad"))
