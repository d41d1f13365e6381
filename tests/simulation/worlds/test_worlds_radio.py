"""Levels of the foreign world: slopes, diffraction, antennas, guiding, shadowing.

Intervals of what is drawn are four standard errors.
"""

from dataclasses import replace

import numpy as np
import pytest
from blocks_town import LATTICE, SOUTH_M, WEST_M, heights_m, plan, streets

from mapfilter.simulation.worlds.path_loss import (
    Mast,
    fresnel_parameter,
    knife_edge_db,
    pattern_db,
    roof_loss_db,
    sight_loss_db,
)
from mapfilter.simulation.worlds.radio import Radio, RadioModel, planners_offsets_db

SEEDS = 600
CLEAN = RadioModel(guiding_db=0.0, eirp_sd_db=0.0, azimuth_sd_deg=0.0, slope_sd=0.0)


@pytest.fixture(scope="module")
def lines():
    return streets()


def made(lines, model, seed=0, cells=None, heights=None, offsets_db=(0.0, 0.0)):
    return Radio(cells or plan(), LATTICE, heights, lines, model, seed, offsets_db)


def at(*places):
    east, north = np.array(places, dtype=float).T
    return WEST_M + east, SOUTH_M + north


def drawn(lines, model, *places):
    """Return the shadowing of many seeds at places, shape (seeds, places, cells)."""
    found = [made(lines, model, seed).shadowing_db(*at(*places)) for seed in range(SEEDS)]
    return np.array(found)


@pytest.mark.parametrize(
    ("near_m", "far_m", "slope"), [(20, 140, 30), (160, 480, 38), (600, 5e3, 44)]
)
def test_slopes_over_the_roofs(near_m, far_m, slope):
    near, far = roof_loss_db(np.array([near_m, far_m], dtype=float), 1800.0)
    assert (far - near) / np.log10(far_m / near_m) == pytest.approx(slope)


@pytest.mark.parametrize(
    "loss", [lambda d: roof_loss_db(d, 900.0), lambda d: sight_loss_db(d, 900.0, 20.0)]
)
def test_losses_rise_without_a_jump(loss):
    distance = np.geomspace(10.0, 2e4, 4000)
    rises = np.diff(loss(distance))
    assert (rises >= 0).all()
    assert rises.max() < 0.15


def test_line_of_sight_is_free_space_before_the_breakpoint_and_steep_beyond():
    near = np.diff(sight_loss_db(np.array([60.0, 120.0]), 900.0, 10.0))
    far = np.diff(sight_loss_db(np.array([2000.0, 4000.0]), 900.0, 10.0))
    assert near[0] == pytest.approx(20 * np.log10(2), abs=0.1)
    assert far[0] == pytest.approx(40 * np.log10(2), abs=0.02)


def test_a_house_in_the_path_costs_its_knife_edge():
    """A roof of 15 m half-way between a mast of 30 m and a phone of 1.5 m."""
    heights = np.zeros((LATTICE.rows, LATTICE.cols), dtype=np.float32)
    mast = Mast(WEST_M + 102.5, SOUTH_M + 500.0, 30.0)
    phone = np.array([mast.east_m + 200.0]), np.array([mast.north_m])
    clear = fresnel_parameter(heights, LATTICE, mast, *phone, 1800.0)
    heights[:, 40] = 15.0
    found = fresnel_parameter(heights, LATTICE, mast, *phone, 1800.0)
    wave_m = 299_792_458.0 / 1.8e9
    height_m = 15.0 - 15.75
    expected = height_m * np.sqrt(2 / wave_m * (1 / 100 + 1 / 100))
    assert clear[0] == -2.0
    assert found[0] == pytest.approx(expected, abs=0.4)
    assert knife_edge_db(found)[0] > 0


def test_houses_next_to_the_phone_or_the_mast_do_not_count():
    heights = np.zeros((LATTICE.rows, LATTICE.cols), dtype=np.float32)
    mast = Mast(WEST_M + 102.5, SOUTH_M + 500.0, 10.0)
    phone = np.array([mast.east_m + 200.0]), np.array([mast.north_m])
    heights[:, 20] = heights[:, 60] = 50.0
    assert fresnel_parameter(heights, LATTICE, mast, *phone, 1800.0)[0] == -2.0


def test_the_antennas_own_building_does_not_count():
    """A wide house about the mast; a second one behind a yard does."""
    heights = np.zeros((LATTICE.rows, LATTICE.cols), dtype=np.float32)
    mast = Mast(WEST_M + 102.5, SOUTH_M + 500.0, 4.0)
    phone = np.array([mast.east_m + 200.0]), np.array([mast.north_m])
    heights[:, 15:30] = 12.0
    assert fresnel_parameter(heights, LATTICE, mast, *phone, 1800.0)[0] == -2.0
    heights[:, 33] = 12.0
    assert fresnel_parameter(heights, LATTICE, mast, *phone, 1800.0)[0] > 2.0


def test_a_pattern_is_half_power_at_its_width_and_limited_behind():
    phases = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    mean = np.mean(
        [pattern_db(np.radians([0.0, 32.5, -32.5, 180.0]), 65.0, 25.0, p) for p in phases], 0
    )
    assert mean == pytest.approx([0.0, -3.0, -3.0, -25.0], abs=1e-9)


def test_levels_are_eirp_minus_loss_and_pattern(lines):
    """South of S1, behind its first sector, without buildings."""
    level = made(lines, CLEAN).median_dbm(*at((300.0, 10.0)))[0]
    free = 52.0 - sight_loss_db(np.array([300.0]), 1800.0, 30.0)[0]
    assert level[0] == pytest.approx(free - 25.0, abs=1.1)
    assert level[1] == pytest.approx(level[2], abs=3.0)


def test_indoor_cells_lose_their_walls(lines):
    cells = plan()
    outdoors = replace(cells["I1"], indoor=False, penetration_loss_db=0.0)
    other = replace(cells, cells=(*cells.cells[:-1], outdoors))
    place = at((700.0, 260.0))
    inside = made(lines, CLEAN).median_dbm(*place)[0, -1]
    outside = made(lines, CLEAN, cells=other).median_dbm(*place)[0, -1]
    assert outside - inside == pytest.approx(10.0)


def test_streets_that_point_to_the_site_are_louder(lines):
    """S2 is at (800, 790): along the street of north 750 it is ahead, behind a house."""
    heights = np.full((LATTICE.rows, LATTICE.cols), 25.0, dtype=np.float32)
    # A yard about each mast: its own building does not count.
    heights[58:67, 156:165] = heights[154:163, 56:65] = 0.0
    model = replace(CLEAN, guiding_db=6.0)
    place = at((200.0, 750.0), (750.0, 200.0))
    plainly = made(lines, CLEAN, heights=heights).median_dbm(*place)
    guided = made(lines, model, heights=heights).median_dbm(*place) - plainly
    assert guided[:, 3:6] == pytest.approx(3.0, abs=0.35)
    across = made(lines, model, heights=heights).median_dbm(*at((400.0, 310.0 + 40.0)))
    across -= made(lines, CLEAN, heights=heights).median_dbm(*at((400.0, 350.0)))
    assert np.abs(across).max() <= 3.0


def test_the_deviation_of_the_shadowing(lines):
    values = drawn(lines, RadioModel(), (250.0, 250.0))[:, 0]
    expected = np.sqrt(4.0**2 + 3.5**2 + 2.0**2)
    assert np.abs(values.std(axis=0) / expected - 1).max() < 4 / np.sqrt(2 * SEEDS)
    assert np.abs(values.mean(axis=0)).max() < 4 * expected / np.sqrt(SEEDS)


def test_blocks_are_shared_by_sectors_and_in_part_by_sites(lines):
    model = RadioModel(street_sd_db=0.0, own_sd_db=0.0)
    values = drawn(lines, model, (250.0, 250.0))[:, 0]
    correlation = np.corrcoef(values.T)
    assert correlation[0, 1] == pytest.approx(1.0)
    assert abs(correlation[0, 3] - 0.5) < 4 * 0.75 / np.sqrt(SEEDS)


def test_the_street_canyon_changes_along_a_street_not_across(lines):
    """Between two crossings of the street of north 250; that of north 350 is another one."""
    model = RadioModel(area_sd_db=0.0, own_sd_db=0.0)
    places = (280.0, 250.0), (280.0, 255.0), (320.0, 250.0), (300.0, 350.0)
    values = drawn(lines, model, *places)[..., 0]
    correlation = np.corrcoef(values.T)[0]
    assert correlation[1] > 0.97
    assert abs(correlation[2] - np.exp(-1)) < 4 * 0.87 / np.sqrt(SEEDS)
    assert abs(correlation[3]) < 4 / np.sqrt(SEEDS)


def test_the_street_canyon_is_continuous_through_a_crossing(lines):
    east = np.arange(230.0, 270.0, 0.5)
    model = RadioModel(area_sd_db=0.0, own_sd_db=0.0)
    levels = made(lines, model, 3).shadowing_db(*at(*((e, 250.0) for e in east)))
    assert np.abs(np.diff(levels, axis=0)).max() < 3.0


def test_draws_depend_on_names_only(lines):
    """A cell more changes no other; another seed changes all."""
    place = at((250.0, 250.0), (700.0, 650.0))
    less = replace(plan(), cells=plan().cells[1:])
    whole = made(lines, RadioModel(), 5).levels_dbm(*place)
    assert np.array_equal(whole[:, 1:], made(lines, RadioModel(), 5, less).levels_dbm(*place))
    assert (whole != made(lines, RadioModel(), 6).levels_dbm(*place)).all()


def test_levels_do_not_depend_on_the_other_positions(lines):
    place = at((250.0, 250.0), (701.0, 650.0), (333.0, 452.0))
    whole = made(lines, RadioModel(), 5, heights=heights_m()).levels_dbm(*place)
    alone = made(lines, RadioModel(), 5, heights=heights_m()).levels_dbm(*(p[1:2] for p in place))
    assert np.array_equal(whole[1], alone[0])


def test_planners_take_out_the_mean_of_each_kind_of_cell(lines):
    east, north = at(*np.random.default_rng(8).uniform(50, 1050, (300, 2)))
    radio = made(lines, CLEAN, heights=heights_m())
    predicted = radio.median_dbm(east, north) + np.array([3.0] * 6 + [-5.0])
    parts = plan(), LATTICE, heights_m(), lines
    found = planners_offsets_db(*parts, predicted, east, north)
    assert found == pytest.approx((3.0, -5.0))
    moved = Radio(*parts, CLEAN, 0, found).median_dbm(east, north)
    assert moved == pytest.approx(predicted)
