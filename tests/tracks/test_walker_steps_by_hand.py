"""Steps of a walker by hand: the band of a filter, and each limit of a peak and of a rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mapfilter.geodesy import project
from mapfilter.tracks.joining.position_shift import best_place_shift, median_apart_m, places_of
from mapfilter.tracks.pdr.signals import RATE_HZ
from mapfilter.tracks.pdr.steps import find_steps, step_lengths, still, vertical_swing
from mapfilter.tracks.readers.recorded.recording import Clock, Recording


def gain(hz):
    """Of a Butterworth band-pass of second order, 0.5 to 2.6 Hz, forwards and backwards.

    Its analogue is 1 / (1 + ((w² - w0²) / (b w))⁴) of the power, at warped frequencies.
    """
    warped, low, high = (np.tan(np.pi * one / RATE_HZ) for one in (hz, 0.5, 2.6))
    return 1 / (1 + ((warped**2 - low * high) / ((high - low) * warped)) ** 4)


def wave(hz, amplitude_mps2=1.0, lasts_s=40.0):
    time_s = np.arange(int(lasts_s * RATE_HZ)) / RATE_HZ
    return 9.81 + amplitude_mps2 * np.sin(2 * np.pi * hz * time_s)


def middle(values):
    return values[int(10 * RATE_HZ) : int(-10 * RATE_HZ)]


@pytest.mark.parametrize("hz", [0.2, 0.5, 0.8, 1.4, 2.0, 2.6, 3.5, 6.0])
def test_the_swing_is_what_a_walk_has_of_a_vertical_acceleration(hz):
    given = wave(hz)
    found = middle(vertical_swing(given))
    np.testing.assert_allclose(found, gain(hz) * middle(given - 9.81), atol=2e-3)
    if hz in (0.5, 2.6):
        assert np.abs(found).max() == pytest.approx(0.5, abs=5e-3)


def test_the_band_is_flat_in_its_middle_and_gravity_is_none():
    assert gain(1.14) == pytest.approx(1.0, abs=1e-3)
    assert np.abs(middle(vertical_swing(np.full(int(40 * RATE_HZ), 9.81)))).max() < 1e-6


@pytest.mark.parametrize(("hz", "range_mps2"), [(1.2, 1.52), (1.8, 1.52), (2.4, 1.52), (1.8, 8.0)])
def test_a_step_is_a_swing_of_a_metre_and_a_half_per_square_second(hz, range_mps2):
    found = find_steps(wave(hz, range_mps2 / 2 / gain(hz)))
    inside = (found.index > 10 * RATE_HZ) & (found.index < 30 * RATE_HZ)
    assert np.diff(found.index[inside]) == pytest.approx(RATE_HZ / hz, abs=1.01)
    assert inside.sum() == pytest.approx(20 * hz, abs=1)
    np.testing.assert_allclose(found.swing_mps2[inside], range_mps2, rtol=0.02)
    if range_mps2 < 2:
        weaker = find_steps(wave(hz, 1.48 / 2 / gain(hz)))
        assert not ((weaker.index > 10 * RATE_HZ) & (weaker.index < 30 * RATE_HZ)).any()


def steps_at(*at_s, weak=(), weak_mps2=3.5, lasts_s=30.0):
    """Return which of some steps are found: a bump of 0.4 s each; ``weak`` ones are lower."""
    time_s = np.arange(int(lasts_s * RATE_HZ)) / RATE_HZ
    force = np.full(time_s.size, 9.81)
    for n, one in enumerate(at_s):
        size = weak_mps2 if n in weak else 16.0
        force += size * np.exp(-0.5 * ((time_s - one) / 0.12) ** 2)
    index = find_steps(force).index / RATE_HZ
    return [n for n, one in enumerate(at_s) if (np.abs(index - one) < 0.1).any()]


def test_three_steps_in_a_row_are_a_walk():
    assert steps_at(10.0, 10.8, 11.6) == [0, 1, 2]
    assert steps_at(10.0, 10.8) == []
    # Up to 1.5 s between them, and each run by itself.
    assert steps_at(10.0, 11.46, 12.92) == [0, 1, 2]
    assert steps_at(10.0, 11.56, 13.12) == []
    assert steps_at(5.0, 5.8, 6.6, 12.0, 12.8, 18.0, 18.8, 19.6) == [0, 1, 2, 5, 6, 7]


def test_a_step_has_a_third_of_what_those_beside_it_have():
    at_s = 5.0 + 0.9 * np.arange(15)
    assert steps_at(*at_s) == list(range(15))
    assert 7 not in steps_at(*at_s, weak=(7,))
    assert 7 in steps_at(*at_s, weak=(7,), weak_mps2=4.0)
    # Among weak ones they are steps.
    assert steps_at(*at_s, weak=tuple(range(15))) == list(range(15))


def test_without_a_walk_there_are_no_steps():
    for force in (np.full(500, 9.81), np.zeros(200)):
        found = find_steps(force)
        assert (found.index.size, found.swing_mps2.size) == (0, 0)
        assert found.index.dtype == np.int64


def test_lengths_are_those_of_weinberg():
    swing = np.array([0.0, 1.0, 16.0, 81.0, -3.0])
    np.testing.assert_allclose(step_lengths(swing, 0.5), [0, 0.5, 1.0, 1.5, 0])


@pytest.mark.parametrize(("off_mps2", "rests"), [(0.29, True), (0.31, False)])
def test_a_device_is_still_if_a_second_scatters_by_less_than_three_tenths(off_mps2, rests):
    """From sample to sample to either side, on one axis or shared by two."""
    count = int(6 * RATE_HZ)
    sign = (-1.0) ** np.arange(count)
    for share in ((1.0, 0.0, 0.0), (0.0, 0.6, 0.8), (0.0, 0.0, 1.0)):
        force = np.array([0.0, 3.0, 9.0]) + off_mps2 * sign[:, None] * np.array(share)
        assert middle_of(still(force), count).tolist() == [rests] * (count // 2)


def middle_of(values, count):
    return values[count // 4 : count // 4 + count // 2]


def test_a_shake_is_seen_for_a_second_about_it():
    count = int(8 * RATE_HZ)
    force = np.tile([0.0, 0.0, 9.81], (count, 1))
    force[count // 2] += 5.0
    moved = np.flatnonzero(~middle_of(still(force), count)) + count // 4 - count // 2
    # Half a second about each mean, each over half a second.
    assert -1.0 * RATE_HZ <= moved.min() <= -0.45 * RATE_HZ
    assert 0.45 * RATE_HZ <= moved.max() <= 1.0 * RATE_HZ


METRE_DEG = 360 / 40_030_228.88
"""Of a great circle, on a sphere of 6371.0088 km."""


def track(begin_s=0.0, lasts_s=100.0, lat=50.0, lon=8.0, off_m=0.0, every_s=1.0):
    """Places on a way that bends, and ``off_m`` north of it."""
    time_s = begin_s + np.arange(0.0, lasts_s + every_s / 2, every_s)
    north_m = off_m + 10 * time_s + 30 * np.sin(time_s / 9)
    east_m = 40 * np.cos(time_s / 7)
    lon_deg = lon + METRE_DEG * east_m / np.cos(np.radians(lat))
    return time_s, lon_deg, lat + METRE_DEG * north_m


def later(places, by_s):
    return places[0] - by_s, places[1], places[2]


@pytest.mark.parametrize("shift_s", [0.0, 3.0, -7.4, 12.3])
def test_the_shift_of_a_track_is_that_at_which_it_lies_on_the_other(shift_s):
    one, other = track(), later(track(20.0, 60.0), shift_s)
    shifts = np.arange(-15.0, 15.5, 1.0)
    found_s, apart_m = best_place_shift(one, other, shifts)
    assert found_s == pytest.approx(shift_s, abs=0.051)
    assert apart_m < 0.7
    assert median_apart_m(one, other, shift_s, 0.5) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("lon", [8.0, 179.9995])
def test_how_far_tracks_are_apart_in_metres_to_the_north_and_east(lon):
    one = track(lon=lon)
    assert median_apart_m(one, track(lon=lon, off_m=25.0), 0.0, 0.5) == pytest.approx(25, rel=2e-3)
    time_s, lon_deg, lat_deg = track(lon=lon)
    east_deg = lon_deg + METRE_DEG * 25.0 / np.cos(np.radians(50.0))
    for turned_deg in (0.0, 360.0, -360.0):
        other = time_s, east_deg + turned_deg, lat_deg
        assert median_apart_m(one, other, 0.0, 0.5) == pytest.approx(25.0, rel=2e-3)


def test_enough_of_a_track_is_in_common():
    one, other = track(), track(every_s=1.0)
    # 51 of 101 rows at a shift of 50 s, of which a half is asked for; a row more is too much.
    assert np.isfinite(median_apart_m(one, other, 50.0, 0.5))
    assert np.isnan(median_apart_m(one, other, 51.0, 0.5))
    assert np.isfinite(median_apart_m(one, other, -50.0, 0.5))
    assert np.isnan(median_apart_m(one, other, -51.0, 0.5))
    assert np.isfinite(median_apart_m(one, other, 98.0, 0.0))
    assert np.isnan(median_apart_m(one, other, 99.0, 0.0))
    # Exactly the share that is asked for is enough: 50 of 100 rows.
    even = tuple(values[:100] for values in other)
    assert np.isfinite(median_apart_m(one, even, 51.0, 0.5))
    assert np.isnan(median_apart_m(one, even, 52.0, 0.5))
    far = later(other, 5000.0)
    assert best_place_shift(one, far, np.arange(-5.0, 6.0)) == (0.0, float("inf"))
    # Of a short recording beside a long one the share is that of what there can be.
    short = later(track(20.0, 30.0), 2.0)
    found_s, _ = best_place_shift(short, later(track(), 0.0), np.arange(-5.0, 6.0))
    assert found_s == pytest.approx(-2.0, abs=0.051)


def recording(crs="", **tables):
    return Recording(Path("a.csv"), "csv", "", Clock("utc"), tables, 3, (), (), crs)


def test_which_places_of_a_recording_are_compared():
    degrees = pd.DataFrame(
        {"time_s": [2.0, 0.0, 0.0, 1.0], "lon_deg": [-179.9, 179.8, 5.0, 179.9], "lat_deg": 1.0}
    )
    metres = pd.DataFrame({"time_s": [0.0, 1.0, 2.0]})
    east_m, north_m = project("EPSG:32632", [8.0, 8.1, 8.2], [50.0, 50.0, 50.1])
    metres = metres.assign(east_m=east_m, north_m=north_m)
    for name in ("positions", "truth"):
        time_s, lon_deg, lat_deg = places_of(recording(**{name: degrees}))
        assert time_s.tolist() == [0.0, 1.0, 2.0]
        assert lon_deg == pytest.approx([179.8, 179.9, 180.1])
        assert lat_deg.tolist() == [1.0] * 3
        assert places_of(recording(**{name: degrees.iloc[:2]})) is None
    for name in ("places", "true_places"):
        _, lon_deg, lat_deg = places_of(recording("EPSG:32632", **{name: metres}))
        assert lon_deg == pytest.approx([8.0, 8.1, 8.2])
        assert lat_deg == pytest.approx([50.0, 50.0, 50.1])
        # Metres of no known place are none.
        assert places_of(recording(**{name: metres})) is None
        assert places_of(recording("EPSG:32632", **{name: metres.iloc[:2]})) is None
    both = recording("EPSG:32632", positions=degrees, truth=degrees.assign(lat_deg=2.0))
    assert places_of(both)[2][0] == 1.0
