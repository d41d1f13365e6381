"""A first fix that is known to kilometres only, such as a network's circle."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.radio.cells import Cell, CellPlan

CRS, EAST, NORTH = "EPSG:32629", 500_000.0, 4_600_000.0
SITES_M = np.array([[0.0, 0.0], [3000.0, 0.0], [1500.0, 2600.0]])
STEP_M = 78.07
PLAN = CellPlan(CRS, tuple(
    Cell(f"S{k}", f"S{k}", EAST + x, NORTH + y, 30.0, None, 50.0, 1800.0, "omni")
    for k, (x, y) in enumerate(SITES_M)
))  # fmt: skip
WALK_M = np.stack([np.linspace(1000.0, 1700.0, 501), np.linspace(600.0, 700.0, 501)], axis=1)


def fix(east_m, north_m, sd_m):
    return pd.DataFrame({
        "time_s": [0.0], "east_m": [EAST + east_m], "north_m": [NORTH + north_m],
        "var_east_m2": [sd_m**2], "var_north_m2": [sd_m**2],
    })  # fmt: skip


def walk(gnss=None):
    """Return a log of the walk: a timing advance of each site in turn, and a compass."""
    time_s = np.arange(0.0, 501.0, 10.0)
    site = (time_s / 10).astype(int) % 3
    away_m = np.hypot(*(WALK_M[time_s.astype(int)] - SITES_M[site]).T)
    radio = pd.DataFrame({
        "time_s": time_s, "role": "serving", "cell": [f"S{k}" for k in site],
        "timing_advance": (away_m / STEP_M).astype(int), "technology": "LTE",
    })  # fmt: skip
    moved = np.diff(WALK_M, axis=0)
    motion = pd.DataFrame({
        "time_s": np.arange(1.0, 501.0), "step_m": np.hypot(*moved.T),
        "heading_rad": np.arctan2(moved[:, 1], moved[:, 0]),
    })  # fmt: skip
    return mf.make_log(CRS, motion=motion, radio=radio, gnss=gnss)


@pytest.mark.parametrize("motion", [("motion",), ()])
@pytest.mark.parametrize("plan", [CellPlan(CRS, ()), PLAN], ids=["siteless", "sites"])
@pytest.mark.parametrize("sd_m", [3.0, 140.0, 700.0, 2000.0, 8000.0])
def test_the_radius_of_a_first_fix_is_what_it_states(sd_m, plan, motion):
    tracker = KalmanFilter().over_sites(plan)
    given = GnssFix(EAST, NORTH, sd_m**2, sd_m**2, 0.0)
    state = tracker.begin(("gnss", "serving", *motion))
    _, output = tracker.step(state, Epoch(0.0, gnss=given), np.random.default_rng(0))
    off_m = np.hypot(output.fix.east_m - EAST, output.fix.north_m - NORTH)
    assert off_m < 1e-3 * sd_m
    # Half of a normal belief lies within 1.1774 deviations, 95 % within 2.4477.
    expected_m = np.array([1.1774, 2.4477]) * sd_m
    np.testing.assert_allclose(output.fix.radii_m[[0, 2]], expected_m, rtol=0.03)


@pytest.mark.parametrize("off_m", [(2500.0, 1500.0), (-1500.0, 2500.0), (500.0, -3000.0)])
def test_a_vague_first_fix_does_not_lead_timing_advances_astray(off_m):
    filter_ = KalmanFilter().over_sites(PLAN)
    east_m, north_m = WALK_M[0] + off_m
    found = mf.locate(walk(fix(east_m, north_m, 2000.0)), filter=filter_).estimate
    place_m = np.array([found.east_m[-1] - EAST, found.north_m[-1] - NORTH])
    error_m = np.hypot(*(place_m - WALK_M[-1]))
    # Without the fix it is 3 m, with one Gaussian for the start 40 to 720 m.
    assert error_m < 100.0
    assert error_m < found.radii_m[-1, 2]
