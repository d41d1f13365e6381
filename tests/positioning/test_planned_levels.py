"""Single reports over levels that were predicted with a plan that lacks powers and heights."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.experiments.recorded.ground import open_ground, predicted
from mapfilter.lattice import Lattice
from mapfilter.positioning.fingerprints.locating import fit_locator, locate_by
from mapfilter.positioning.fingerprints.planned import (
    OWN_DB,
    Planned,
    level_deviations_db,
)
from mapfilter.positioning.fingerprints.reports import Reports, make_reports
from mapfilter.positioning.fingerprints.sources import reports_of_database
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.identities import TIMING_STEP_M

LTE_STEP_M = TIMING_STEP_M["LTE"]
CRS = "EPSG:32635"
EAST_M, NORTH_M = 385_000.0, 6_672_000.0
AT_M = np.array([EAST_M, NORTH_M])
SIDE_M, SPACING_M = 1500.0, 100.0


def _cell(name: str, east_m: float, north_m: float, mhz: float, **more: object) -> Cell:
    place = (EAST_M + east_m, NORTH_M + north_m)
    return Cell(name, name, *place, 30.0, None, 30.0, mhz, "omni", technology="LTE", **more)


def _level_dbm(cell: Cell, places: np.ndarray) -> np.ndarray:
    away_m = np.hypot(*(places - [cell.east_m, cell.north_m]).T)
    return cell.eirp_dbm - 40 - 35 * np.log10(np.maximum(away_m, 20.0) / 10)


def _map(plan: CellPlan, error_db: float = 6.0) -> Reports:
    """Return the predicted levels of a plan on a square."""
    steps = np.arange(-SIDE_M, SIDE_M + 1, SPACING_M)
    places = np.stack(np.meshgrid(steps, steps), -1).reshape(-1, 2) + AT_M
    count, cells = len(places), plan.cells
    found = make_reports(
        CRS,
        np.tile(np.arange(count), len(cells)),
        np.repeat([cell.id for cell in cells], count),
        np.concatenate([_level_dbm(cell, places) for cell in cells]),
        count=count,
        places=places,
        sd_db=np.concatenate([level_deviations_db(c, CRS, places, error_db) for c in cells]),
    )
    return replace(found, predicted=True, planned=Planned.of(plan, found.cell_ids))


def _plan(**more: object) -> CellPlan:
    places = [(-600, -500), (650, -450), (0, 700), (100, 0)]
    return CellPlan(CRS, tuple(_cell(f"c{i}", *at, 1800.0, **more) for i, at in enumerate(places)))


def _received(plan: CellPlan, count: int, rng: np.random.Generator) -> Reports:
    """Draw reports of a network whose powers and heights are not the usual ones."""
    places = rng.uniform(-SIDE_M, SIDE_M, (count, 2)) + AT_M
    # Powers and heights differ from network to network, here from report to report.
    common_db = 6.5 * rng.standard_normal(count)
    levels = [
        _level_dbm(cell, places) + common_db + np.hypot(5.7, 6) * rng.standard_normal(count)
        for cell in plan.cells
    ]
    return make_reports(
        CRS,
        np.tile(np.arange(count), len(plan.cells)),
        np.repeat([cell.id for cell in plan.cells], count),
        np.concatenate(levels),
        count=count,
        places=places,
        serving=["c0"] * count,
    )


def _share_within_95(plan: CellPlan, reports: Reports) -> float:
    fitted = fit_locator(
        _map(plan), "probabilistic", np.random.default_rng(1), strongest=4, validated=800
    )
    located = locate_by(fitted, reports)
    return float(np.mean(located.error_m <= located.radii_m[:, 2]))


def test_regions_hold_where_usual_values_stand_for_powers_and_heights():
    reports = _received(_plan(), 800, np.random.default_rng(7))
    assumed = _share_within_95(_plan(assumed="eirp_dbm height_m"), reports)
    # The same levels, with a plan that claims them for its cells' own.
    stated = _share_within_95(_plan(), reports)
    assert 0.93 <= assumed <= 0.98
    assert stated < 0.91


def test_errors_are_those_stated_where_the_plan_lacks_nothing():
    places = np.array([[EAST_M, NORTH_M], [EAST_M + 900, NORTH_M]])
    assert level_deviations_db(_plan()["c0"], CRS, places, 6.0).tolist() == [6.0, 6.0]
    unknown = _plan(assumed="eirp_dbm")["c0"]
    found = level_deviations_db(unknown, CRS, places, 6.0)
    assert found == pytest.approx(np.hypot(6.0, OWN_DB["eirp_dbm"]))


def test_behind_an_assumed_sector_levels_err_by_more():
    sector = replace(_cell("c", 0, 0, 800.0, assumed="height_m"), azimuth_deg=90.0, antenna="3gpp")
    front, behind = level_deviations_db(
        sector, CRS, np.array([[EAST_M + 500, NORTH_M], [EAST_M - 500, NORTH_M]]), 6.0
    )
    assert behind > front + 4


def test_behind_an_assumed_sector_two_fifths_of_what_the_pattern_loses_are_added():
    sector = replace(_cell("c", 0, 0, 800.0, assumed="height_m"), azimuth_deg=90.0, antenna="3gpp")
    sector = replace(sector, beamwidth_deg=65.0, max_attenuation_db=25.0)
    behind = np.array([[EAST_M - 500, NORTH_M]])
    found = level_deviations_db(sector, CRS, behind, 6.0)
    assert found == pytest.approx(np.sqrt(6.0**2 + 4.0**2 + (0.4 * 25.0) ** 2))
    turned = replace(sector, assumed="azimuth_deg eirp_dbm")
    own_db2 = 6.0**2 + 9.0**2 + 4.0**2
    assert level_deviations_db(turned, CRS, behind, 6.0) == pytest.approx(np.sqrt(own_db2 + 100.0))
    stated = replace(sector, assumed="")
    assert level_deviations_db(stated, CRS, behind, 6.0).tolist() == [6.0]


def test_the_common_error_is_the_mean_of_what_each_cell_lacks():
    fields = ("", "eirp_dbm", "height_m", "azimuth_deg", "eirp_dbm height_m")
    for k, field in enumerate(fields):
        plan = CellPlan(CRS, (_cell("a", 0, 0, 1800.0, assumed=field),))
        expected = [0.0, 5.0, 3.0, 0.0, np.sqrt(34.0)][k]
        assert Planned.of(plan, ("a",)).common_db == pytest.approx(expected)
    cells = (_cell("a", 0, 0, 1800.0, assumed="eirp_dbm"), _cell("b", 0, 0, 800.0))
    made = Planned.of(CellPlan(CRS, cells), ("a", "b"))
    assert made.common_db == pytest.approx(2.5)
    assert made.step_m == pytest.approx([78.07, 78.07], abs=0.01)
    assert Planned.of(CellPlan(CRS, cells), ()).common_db == 0.0


def _one(plan: CellPlan, names: list[str], level_dbm: list[float], **more: object) -> np.ndarray:
    fitted = fit_locator(_map(plan), "probabilistic", np.random.default_rng(1))
    reports = make_reports(CRS, np.zeros(len(names), int), names, level_dbm, count=1, **more)
    located = locate_by(fitted, reports)
    return np.array([located.east_m[0] - EAST_M, located.north_m[0] - NORTH_M])


def test_a_cell_of_a_carrier_that_was_not_measured_is_not_absent():
    near, other = _cell("a", 0, 0, 1800.0), _cell("b", 700, 0, 800.0)
    same = replace(other, frequency_mhz=1800.0)
    level = [float(_level_dbm(near, np.array([[EAST_M + 500, NORTH_M]]))[0])]
    apart = _one(CellPlan(CRS, (near, other)), ["a"], level, serving=["a"])
    together = _one(CellPlan(CRS, (near, same)), ["a"], level, serving=["a"])
    # On the carrier of the serving cell a strong cell would have been reported.
    assert abs(apart[0]) < 30
    assert together[0] < apart[0] - 50


def test_a_timing_advance_counts_by_the_distance_to_the_site():
    plan = CellPlan(CRS, (_cell("a", 0, 0, 1800.0), _cell("b", 1200, 0, 1800.0)))
    middle = np.array([[EAST_M + 600, NORTH_M]])
    levels = [float(_level_dbm(cell, middle)[0]) for cell in plan.cells]
    east_m = [
        _one(plan, ["a", "b"], levels, serving=["a"], timing_advance=[steps])[0]
        for steps in (200 // LTE_STEP_M, 1000 // LTE_STEP_M)
    ]
    assert east_m[1] > east_m[0] + 150


@pytest.mark.parametrize("technology", ["LTE", "GSM"])
def test_a_timing_advance_is_normal_about_the_middle_of_its_step_and_clipped(technology):
    """Its deviation is 200 m and that of a step's width; beyond three of them all is alike."""
    bit_m = 299_792_458 * 48e-6 / 13
    step_m = {"LTE": LTE_STEP_M, "GSM": bit_m / 2}[technology]
    cell = replace(_cell("a", 0, 0, 1800.0), technology=technology)
    planned = Planned.of(CellPlan(CRS, (cell,)), ("a",))
    sd_m = np.sqrt(200.0**2 + step_m**2 / 12)
    middle_m = 7.5 * step_m
    off_sd = np.array([0.0, 1.0, -2.0, 2.9, 3.1, 5.0, 9.0])
    places = AT_M + np.outer(middle_m + off_sd * sd_m, [0.6, 0.8])
    found = planned.log_timing(places, 0, 7.0)
    expected = [0.0, -0.5, -2.0, -0.5 * 2.9**2, -4.5, -4.5, -4.5]
    np.testing.assert_allclose(found, expected, atol=1e-6)
    for serving, steps in ((-1, 7.0), (0, np.nan)):
        assert planned.log_timing(places, serving, steps).tolist() == [0.0] * 7


def test_cells_of_one_layer_are_measured_with_each_other():
    """In GSM, and where the technology is unknown, carriers make no difference."""
    kinds = [("LTE", 1800.0), ("LTE", 1800.0), ("NR", 800.0), ("GSM", 800.0), (None, 1800.0),
             ("UMTS", 2100.0), ("GSM", 1800.0), (None, 900.0)]  # fmt: skip
    cells = tuple(
        replace(_cell(f"c{k}", 0, 0, mhz), technology=technology)
        for k, (technology, mhz) in enumerate(kinds)
    )
    made = Planned.of(CellPlan(CRS, cells), tuple(cell.id for cell in cells))
    for reported, alike in (
        ([0], [0, 1]), ([2], [2]), ([5], [5]), ([1, 2], [0, 1, 2]), ([3], [3, 6]), ([7], [4, 7]),
        ([], []),
    ):  # fmt: skip
        found = np.flatnonzero(made.measured_with(np.array(reported, dtype=np.int32)))
        assert found.tolist() == alike
    known = [False, False, True, False, True, True, False, True]
    np.testing.assert_array_equal(np.isnan(made.step_m), known)
    kept = made.some(np.array([3, 0]))
    assert kept.layer.tolist() == [made.layer[3], made.layer[0]]
    assert kept.common_db == made.common_db


def test_drawn_timing_advances_are_whole_steps_of_distances_with_their_error():
    cells = (_cell("a", 0, 0, 1800.0), _cell("b", 3000, 0, 1800.0))
    made = Planned.of(CellPlan(CRS, cells), ("a", "b"))
    places = AT_M + np.array([[600.0, 800.0], [600.0, 800.0], [60.0, 80.0], [3000.0, 500.0]])
    given = SimpleNamespace(standard_normal=lambda count: np.array([1.0, -2.0, -1.0, 0.5])[:count])
    found = made.drawn_timing(places, np.array([0, 0, 0, 1]), given)
    # Of 1200, 600, no and 600 m; none is negative.
    assert found.tolist() == [1200 // LTE_STEP_M, 600 // LTE_STEP_M, 0.0, 600 // LTE_STEP_M]


def test_a_database_keeps_what_its_plan_assumes(tmp_path):
    """Levels of a database err by what its plan lacks; powers of whole carriers are named."""
    lattice = Lattice.covering(CRS, (EAST_M, NORTH_M, EAST_M + 400, NORTH_M + 400), 50.0)
    cells = (
        _cell("a", 100, 100, 1800.0, assumed="eirp_dbm"),
        replace(_cell("b", 300, 100, 1800.0), eirp_dbm=58.0),
    )
    database = predicted(
        CellPlan(CRS, cells), lattice, open_ground(lattice), tmp_path / "db", floor_dbm=-130.0
    )
    assert [cell.assumed for cell in database.plan.cells] == ["eirp_dbm", ""]
    found = reports_of_database(database)
    of_a = found.cell == found.cell_ids.index("a")
    assert found.sd_db[of_a] == pytest.approx(np.hypot(6.0, OWN_DB["eirp_dbm"]))
    assert found.sd_db[~of_a].tolist() == [6.0] * int((~of_a).sum())
    assert "usual values for what the plan lacks" in found.notes[0]
    assert "eirp_dbm of 1 cell is that of a carrier" in found.notes[1]
