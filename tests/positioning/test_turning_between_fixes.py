"""Fixes seconds apart without dead reckoning: a vehicle turns and brakes between two of them."""

import numpy as np
import pytest

from mapfilter.filters.contract import Status
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.radio.cells import CellPlan

EAST, NORTH, SD_M = 500_000.0, 4_600_000.0, 5.0


def followed(way, seen, apart_s):
    """Return errors, 95 % radii and statuses at fixes of places ``seen`` along a way."""
    tracker = KalmanFilter().over_sites(CellPlan("EPSG:32629", ()))
    state, found, rng = tracker.begin({"gnss"}), [], np.random.default_rng(0)
    for k, place in enumerate(seen):
        fix = GnssFix(EAST + place.real, NORTH + place.imag, SD_M**2, SD_M**2, 0.0)
        state, out = tracker.step(state, Epoch(apart_s * k, gnss=fix), rng)
        error = complex(out.fix.east_m - EAST, out.fix.north_m - NORTH) - way[k]
        found.append((abs(error), out.fix.radii_m[2], out.fix.status))
    errors_m, radii_m, statuses = zip(*found, strict=True)
    return np.array(errors_m), np.array(radii_m), statuses


def noisy(way, seed=3):
    rng = np.random.default_rng(seed)
    return way + rng.normal(0, SD_M, way.size) + 1j * rng.normal(0, SD_M, way.size)


def blocks(time_s):
    """Return headings of a town: turns of 90 degrees to the left and to the right in turn."""
    return np.where(np.floor(time_s / 35.0) % 2 == 0, 0.0, np.pi / 2)


def curves(time_s):
    """Return headings of a motorway, with up to 1.7 m/s² at 30 m/s."""
    return 0.8 * np.sin(2 * np.pi * time_s / 90.0)


@pytest.mark.parametrize(
    ("heading", "speed_mps", "apart_s"),
    [(blocks, 10.0, 5.0), (blocks, 10.0, 10.0), (blocks, 12.0, 20.0), (curves, 30.0, 10.0),
     (curves, 30.0, 20.0)],
)  # fmt: skip
def test_a_vehicle_that_turns_is_followed(heading, speed_mps, apart_s):
    time_s = np.arange(0.0, 40 * apart_s, 0.5)
    way = np.cumsum(0.5 * speed_mps * np.exp(1j * heading(time_s)))[:: round(apart_s / 0.5)]
    errors_m, radii_m, statuses = followed(way, noisy(way), apart_s)
    # Fixes alone are off by 12 m in one of twenty.
    assert errors_m.max() < 25.0
    assert radii_m[1:].max() < 40.0
    assert Status.LOST not in statuses


def test_a_walker_does_not_follow_a_reflection():
    way = 1.4 * 7.0 * np.arange(40.0) + 0j
    seen = noisy(way)
    seen[[12, 20, 30]] += [150.0, 90.0j, -250.0]
    errors_m, _, statuses = followed(way, seen, 7.0)
    assert errors_m.max() < 60.0
    assert np.median(errors_m) < 8.0
    assert Status.LOST not in statuses


def test_a_vehicle_does_not_follow_a_reflection_from_one_second_to_the_next():
    way = 10.0 * np.arange(120.0) + 0j
    seen = noisy(way)
    seen[60:63] += 80.0j
    errors_m, _, _ = followed(way, seen, 1.0)
    assert errors_m.max() < 30.0
