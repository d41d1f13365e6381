"""What a plan adds to predicted levels, by hand: deviations, steps of timing advance, layers."""

from dataclasses import replace
from math import atan, cos, hypot, nan, pi, radians, sin, sqrt, tan

import numpy as np
import pytest

from mapfilter.geodesy import unproject
from mapfilter.positioning.fingerprints.planned import Planned, level_deviations_db
from mapfilter.radio.cells import Cell, CellPlan

CRS, EAST_M, NORTH_M = "EPSG:32635", 700_000.0, 6_672_000.0
CELL = Cell("A", "A", EAST_M, NORTH_M, 30.0, 40.0, 50.0, 1800.0, beamwidth_deg=60.0)
GSM_M, LTE_M = 299_792_458.0 * 48 / 13e6 / 2, 299_792_458.0 / 30.72e6 * 16 / 2
"""A bit, and 16 samples, there and back."""


def planned(*cells):
    plan = CellPlan(CRS, tuple(cells))
    return Planned.of(plan, tuple(cell.id for cell in cells))


def at(azimuth_deg):
    """A place in a true direction from the cell: the zone's meridian is at 27 degrees."""
    lon, lat = (radians(float(one)) for one in unproject(CRS, EAST_M, NORTH_M))
    convergence = atan(tan(lon - radians(27.0)) * sin(lat))
    heading = pi / 2 - radians(azimuth_deg) + convergence
    return [EAST_M + 700.0 * cos(heading), NORTH_M + 700.0 * sin(heading)]


@pytest.mark.parametrize(
    ("assumed", "own_db", "common_db"),
    [("", 0.0, 0.0), ("eirp_dbm", 4.0, 5.0), ("height_m", 4.0, 3.0), ("azimuth_deg", 9.0, 0.0),
     ("eirp_dbm height_m", sqrt(32.0), sqrt(34.0)),
     ("eirp_dbm height_m azimuth_deg", sqrt(113.0), sqrt(34.0))],
)  # fmt: skip
def test_deviations_of_what_is_assumed_add_up_by_their_squares(assumed, own_db, common_db):
    cell = replace(CELL, assumed=assumed)
    found = level_deviations_db(cell, CRS, np.array([at(40.0), at(70.0), at(180.0)]), 6.0)
    # To the side 12 (φ / width)² dB are lost, at most 25: of these four tenths are in doubt.
    lost_db = [0.0, 3.0, 25.0] if assumed else [0.0] * 3
    whole_db = hypot(6.0, own_db)
    assert found == pytest.approx([hypot(whole_db, 0.4 * one) for one in lost_db], abs=2e-3)
    around = replace(cell, antenna="omni", azimuth_deg=None)
    places = np.array([at(40.0), at(180.0)])
    assert level_deviations_db(around, CRS, places, 6.0) == pytest.approx([whole_db] * 2)
    assert level_deviations_db(cell, CRS, np.empty((0, 2)), 6.0).shape == (0,)
    assert planned(cell).common_db == pytest.approx(common_db)
    # What all levels share is the mean over the cells.
    assert planned(cell, replace(CELL, id="B")).common_db == pytest.approx(common_db / 2)


def test_steps_and_layers_of_cells():
    """Layers are numbered in the order of their first cells."""
    given = [("GSM", 900.0), ("LTE", 2600.0), (None, 800.0), ("UMTS", 2100.0), ("LTE", 800.0),
             ("NR", 2600.0)]  # fmt: skip
    cells = [
        replace(CELL, id=f"c{k}", east_m=EAST_M + k, technology=technology, frequency_mhz=mhz)
        for k, (technology, mhz) in enumerate(given)
    ]
    found = planned(*cells)
    assert found.site_m.tolist() == [[EAST_M + k, NORTH_M] for k in range(6)]
    np.testing.assert_allclose(found.step_m, [GSM_M, LTE_M, nan, nan, LTE_M, nan], rtol=1e-5)
    assert found.layer.tolist() == [0, 1, 2, 3, 4, 5]
    assert found.measured_with(np.array([1, 4], dtype=np.int32)).tolist() == [
        False, True, False, False, True, False,
    ]  # fmt: skip
    few = found.some(np.array([4, 0]))
    assert (few.layer.tolist(), few.site_m[0].tolist()) == ([4, 0], [EAST_M + 4, NORTH_M])
    none = Planned.of(CellPlan(CRS, ()), ())
    assert (none.site_m.shape, none.step_m.shape, none.common_db) == ((0, 2), (0,), 0.0)


@pytest.mark.parametrize(("serving", "step_m"), [(0, GSM_M), (1, LTE_M)])
def test_a_timing_advance_is_normal_about_the_middle_of_its_step_and_clipped(serving, step_m):
    """200 m and the step's own error; three deviations are the most that it is off."""
    cells = [replace(CELL, technology="GSM"), replace(CELL, id="B", technology="LTE")]
    places = np.array([EAST_M, NORTH_M]) + np.outer([0.0, 400.0, 1000.0, 9000.0], [0.6, -0.8])
    found = planned(*cells).log_timing(places, serving, 2.0)
    off = (np.array([0.0, 400.0, 1000.0, 9000.0]) - 2.5 * step_m) / hypot(200.0, step_m / sqrt(12))
    np.testing.assert_allclose(found, -0.5 * np.clip(off, -3.0, 3.0) ** 2, rtol=1e-4)
    assert found[-1] == -4.5


@pytest.mark.parametrize(("serving", "steps"), [(-1, 2.0), (0, nan), (1, 2.0), (1, nan)])
def test_without_a_serving_cell_or_a_known_step_a_timing_advance_tells_nothing(serving, steps):
    given = planned(replace(CELL, technology="LTE"), replace(CELL, id="B"))
    found = given.log_timing(np.full((3, 2), EAST_M), serving, steps)
    np.testing.assert_array_equal(found, np.zeros(3))


def test_drawn_timing_advances_are_whole_steps():
    """200 m about the distance, 0 at least: of a step of 78 m at 1000 m 12.8 on average."""
    given = planned(replace(CELL, technology="LTE"), replace(CELL, id="B"))
    places = np.tile([EAST_M + 600.0, NORTH_M + 800.0], (4000, 1))
    found = given.drawn_timing(places, np.zeros(4000, dtype=np.int32), np.random.default_rng(0))
    np.testing.assert_array_equal(found, np.floor(found))
    assert found.min() >= 0
    assert found.mean() == pytest.approx(1000.0 / LTE_M - 0.5, abs=0.15)
    assert found.std() == pytest.approx(200.0 / LTE_M, rel=0.05)
    unknown = given.drawn_timing(places[:2], np.ones(2, dtype=np.int32), np.random.default_rng(0))
    assert np.isnan(unknown).all()
