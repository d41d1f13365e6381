"""Ways that journeys took off the map, and the noise of phones."""

import math

import numpy as np
import pandas as pd
import pytest
import shapely
from learning_world import CRS, EAST, NORTH

from mapfilter.database.field import RadioField
from mapfilter.lattice import Lattice
from mapfilter.learning.missing_ways import LEAST_JOURNEYS, missing_ways
from mapfilter.learning.phone import phone_noise
from mapfilter.learning.tracks import JourneyTrack
from mapfilter.tracks.log import make_log

LATTICE = Lattice(CRS, EAST, NORTH + 600.0, 5.0, 120, 120)
# From a street in the south along it, then by an unmapped way to a street in the north, and on.
PATH = np.array([[20.0, 102.5], [250.0, 102.5], [350.0, 302.5], [580.0, 302.5]])


def street_field():
    """Streets from west to east every 200 m, 15 m wide."""
    row, _ = np.mgrid[0:120, 0:120]
    on = np.abs((119 - row) * 5.0 + 2.5 - 102.5) % 200.0 <= 5.0
    nothing = np.zeros((120, 120))
    return RadioField(
        LATTICE,
        (),
        np.zeros((120, 120, 0), np.float32),
        nothing.astype(np.float32),
        np.full((120, 120), 7.5, np.float32),
        nothing.astype(np.int64),
        on,
    )


def journey(rng, path=PATH, *, blind=True, heading_sd=0.05, scale=1.0, bias=0.0):
    """A walk along a path; where it is off the streets the track is not known."""
    line = shapely.LineString(path)
    at = np.arange(0.0, line.length, 1.3)
    place = shapely.get_coordinates(shapely.line_interpolate_point(line, at))
    moved = np.diff(place, axis=0)
    heading = np.arctan2(moved[:, 1], moved[:, 0]) + bias
    heading = heading + heading_sd * rng.standard_normal(heading.size)
    time_s = np.arange(at.size, dtype=float)
    motion = pd.DataFrame(
        {
            "time_s": time_s[1:],
            "step_m": np.hypot(*moved.T) / scale,
            "heading_rad": (heading + math.pi) % (2 * math.pi) - math.pi,
        }
    )
    east, north = (EAST + place[:, 0]), NORTH + place[:, 1]
    off = np.abs((place[:, 1] - 102.5 + 100.0) % 200.0 - 100.0) > 8.0
    radius = np.where(off & blind, 80.0, 8.0)
    shown = np.where(off & blind, 102.5 + NORTH, north)
    return make_log(CRS, motion=motion), JourneyTrack(time_s, east, shown, radius)


def found(journeys):
    logs, tracks = zip(*journeys, strict=True)
    return missing_ways(street_field(), tracks, logs)


def test_a_way_that_several_journeys_took_is_proposed_along_their_path():
    rng = np.random.default_rng(0)
    proposed = found([journey(rng) for _ in range(4)])
    assert len(proposed) == 1
    (one,) = proposed
    line = shapely.LineString(np.array(one.line_m) - [EAST, NORTH])
    true = shapely.LineString(PATH[1:3])
    assert line.hausdorff_distance(true) < 25.0
    assert true.buffer(10.0).contains(shapely.intersection(line, true.buffer(9.9)))
    assert shapely.intersection(line, true.buffer(10.0)).length > 0.8 * line.length
    assert (one.kind, one.journeys) == ("way", 4)
    assert one.log_bayes_factor > 3.0
    assert one.probability > 0.9


def test_too_few_journeys_propose_nothing():
    rng = np.random.default_rng(1)
    assert found([journey(rng) for _ in range(LEAST_JOURNEYS - 1)]) == ()
    assert missing_ways(street_field(), (), ()) == ()


def test_journeys_on_the_map_propose_nothing():
    rng = np.random.default_rng(2)
    along = np.array([[20.0, 102.5], [580.0, 102.5]])
    assert found([journey(rng, along) for _ in range(5)]) == ()


def test_paths_of_single_journeys_are_no_way():
    rng = np.random.default_rng(3)
    apart = [
        np.array([[20.0, 102.5], [x, 102.5], [x + 60.0, 302.5], [580.0, 302.5]])
        for x in (80.0, 180.0, 280.0, 380.0, 480.0)
    ]
    assert found([journey(rng, path) for path in apart]) == ()


def test_logs_without_motion_are_passed_over():
    _, track = journey(np.random.default_rng(4))
    empty = make_log(CRS)
    assert found([(empty, track)] * 4) == ()


def test_the_noise_of_phones_is_estimated():
    rng = np.random.default_rng(5)
    biases = np.radians([6.0, -4.0, 5.0, -7.0, 2.0])
    journeys = [
        journey(rng, blind=False, scale=1.05, bias=bias, heading_sd=0.02) for bias in biases
    ]
    noise = phone_noise(journeys, np.array([2.0, -2.0, 2.0, -2.0, 0.0]), 7.0)
    assert noise.journeys == 5
    assert noise.heading_bias_sd_deg == pytest.approx(
        math.sqrt(np.mean(np.degrees(biases) ** 2)), rel=0.1
    )
    assert noise.heading_sd_deg < 8.0
    assert noise.step_scale == pytest.approx(1.05, abs=0.01)
    assert noise.phone_offset_sd_db == pytest.approx(np.std([2, -2, 2, -2, 0]))
    assert phone_noise([], np.zeros(0), 7.0) is None


def test_a_track_keeps_its_arrays_as_bytes():
    _, track = journey(np.random.default_rng(6))
    again = JourneyTrack.from_bytes(track.to_bytes())
    for name in ("time_s", "east_m", "north_m", "radius_m"):
        assert np.array_equal(getattr(again, name), getattr(track, name))
    nowhere = JourneyTrack(*(np.empty(0),) * 4)
    assert np.isnan(nowhere.at(np.zeros(3))).all()


def test_time_outside_a_track_has_no_position():
    track = JourneyTrack(*(np.array([1.0, 2.0]),) * 4)
    east, _, _ = track.at(np.array([0.0, 1.5, 3.0]))
    assert np.isnan(east).tolist() == [True, False, True]
    assert east[1] == 1.5


def test_of_a_line_that_returns_to_the_map_only_the_stretch_beside_it_is_proposed():
    rng = np.random.default_rng(7)
    # Along a street, 60 m aside by an unmapped bay, and back to the street.
    bay = np.array([[20, 102.5], [200, 102.5], [230, 140], [330, 140], [360, 102.5], [580, 102.5]])
    (one,) = found([journey(rng, bay.astype(float)) for _ in range(4)])
    line = np.array(one.line_m) - [EAST, NORTH]
    assert 180.0 < line[:, 0].min() < line[:, 0].max() < 380.0
    assert line[:, 1].max() == pytest.approx(140.0, abs=8.0)


def test_a_path_that_only_cuts_corners_of_pixels_proposes_nothing():
    """Two steps lie in pixels off the map, between which there is none of every five metres."""
    begins = np.arange(100.0, 108.0, 0.5)
    corners = []
    for east in begins:
        across = [(0, 0), (13, 13), (26, 0), (66, 0), (79, 13), (92, 0)]
        path = np.array([(20.0, 102.5), *(np.add((east, 102.5), across)), (400.0, 102.5)])
        log, track = journey(np.random.default_rng(0), path, blind=False, heading_sd=0.0)
        hidden = (track.east_m - EAST > east - 5) & (track.east_m - EAST < east + 97)
        track = JourneyTrack(track.time_s, track.east_m, track.north_m, np.where(hidden, 80.0, 8.0))
        corners.append((log, track))
    rng = np.random.default_rng(0)
    walks = [journey(rng) for _ in range(4)]
    (one,) = found([*walks, *corners])
    assert one.journeys == 4
