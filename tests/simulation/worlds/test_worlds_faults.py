"""Each fault of the inputs changes what it says, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from blocks_town import LATTICE, plan

from mapfilter.errors import ConfigError
from mapfilter.lattice import Lattice
from mapfilter.propagation.models import PredictionModel
from mapfilter.propagation.predict import predict
from mapfilter.simulation.worlds.faults import FAULTS, District, GivenInputs, given_inputs

SEEDS = range(40)
COARSE = Lattice(LATTICE.crs, LATTICE.west_m, LATTICE.north_m, 25.0, 44, 44)


def given(name, seed=0, variant=0):
    return given_inputs(name, plan(), LATTICE, seed, variant)


def changed(name, seed=0):
    """Return the fields of each cell in which the given plan differs from the true one."""
    found = {}
    for cell in given(name, seed).plan.cells:
        own = plan()[cell.id]
        fields = {f for f in cell.__slots__ if getattr(cell, f) != getattr(own, f)}
        if fields:
            found[cell.id] = fields
    return found


def test_without_a_fault_the_truth_is_given():
    assert given(None) == GivenInputs(plan())


@pytest.mark.parametrize("name", FAULTS)
def test_faults_depend_on_seed_variant_and_name_only(name):
    assert given(name, 3, 1) == given(name, 3, 1)
    if name != "ways-missing":
        drawn = [repr(given(name, seed)) for seed in SEEDS]
        assert len(set(drawn)) > 1
        assert len({repr(given(name, 3, variant)) for variant in range(8)}) > 1


@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_says_what_it_does_and_does_something(name):
    assert FAULTS[name].__doc__
    assert given(name) != GivenInputs(plan())


def test_cells_off():
    found = given("cells-off")
    assert found.plan == plan()
    assert found.silent == found.affected
    assert len(found.silent) == round(0.2 * 7)
    assert set(found.silent) <= set(plan().ids)
    assert {name for seed in SEEDS for name in given("cells-off", seed).silent} == set(plan().ids)


def test_cells_moved_by_three_hundred_metres():
    for seed in SEEDS:
        assert all(
            f == {"site", "east_m", "north_m"} for f in changed("cells-moved", seed).values()
        )
        found = given("cells-moved", seed)
        assert tuple(changed("cells-moved", seed)) == found.affected
        assert len(found.affected) == 1
        cell = found.plan[found.affected[0]]
        own = plan()[cell.id]
        away = np.hypot(cell.east_m - own.east_m, cell.north_m - own.north_m)
        assert away == pytest.approx(300.0)


def test_all_cells_biased_by_eight_decibels():
    found = given("cells-biased-8")
    assert found.plan == plan()
    assert set(found.offset_db) == set(plan().ids)
    assert {abs(db) for db in found.offset_db.values()} == {8.0}
    signs = np.sign(
        [db for seed in SEEDS for db in given("cells-biased-8", seed).offset_db.values()]
    )
    assert abs(signs.mean()) < 4 / np.sqrt(signs.size)


def test_some_cells_biased_by_ten_decibels():
    found = given("cells-biased-10")
    assert set(found.offset_db) == set(found.affected)
    assert len(found.affected) == 1
    assert {abs(db) for db in found.offset_db.values()} == {10.0}
    level = np.full((4, 4), -80.0, dtype=np.float32)
    shifted = found.predicted(found.affected[0], level, COARSE)
    assert shifted == pytest.approx(-80.0 + found.offset_db[found.affected[0]])
    other = next(name for name in plan().ids if name not in found.affected)
    assert (found.predicted(other, level, COARSE) == level).all()


def test_two_sectors_of_a_site_are_swapped():
    for seed in SEEDS:
        cells = changed("sectors-swapped", seed)
        assert len(cells) == 2
        assert all(fields == {"azimuth_deg"} for fields in cells.values())
        first, second = cells
        assert plan()[first].site == plan()[second].site
        found = given("sectors-swapped", seed)
        assert found.plan[first].azimuth_deg == plan()[second].azimuth_deg
        assert found.plan[second].azimuth_deg == plan()[first].azimuth_deg


def test_a_site_is_rotated_by_120_degrees():
    for seed in SEEDS:
        cells = changed("site-rotated", seed)
        assert all(fields == {"azimuth_deg"} for fields in cells.values())
        assert len({plan()[name].site for name in cells}) == 1
        assert len(cells) == 3
        for name in cells:
            turned = given("site-rotated", seed).plan[name].azimuth_deg - plan()[name].azimuth_deg
            assert turned % 360 == pytest.approx(120.0)


def test_a_rotated_site_predicts_each_sector_as_the_next_one():
    found = given("site-rotated")
    true = dict(predict(plan(), COARSE, None, PredictionModel()))
    wrong = dict(predict(found.plan, COARSE, None, PredictionModel()))
    turned = found.affected
    for name, following in zip(turned, (*turned[1:], turned[0]), strict=True):
        assert wrong[name] == pytest.approx(true[following], abs=1e-3)
    for name in set(plan().ids) - set(turned):
        assert np.array_equal(wrong[name], true[name])


def test_faults_together_have_cells_of_their_own():
    for seed in SEEDS:
        found = given("faults-together", seed)
        cells = [cell for names in found.by_fault.values() for cell in names]
        assert len(cells) == len(set(cells)) == len(found.affected)
        assert {name: len(names) for name, names in found.by_fault.items()} == {
            "sectors-swapped": 2,
            "site-rotated": 3,
            "cells-off": 1,
            "cells-biased-10": 1,
        }
        differing = {*found.by_fault["sectors-swapped"], *found.by_fault["site-rotated"]}
        assert set(changed("faults-together", seed)) == differing
        assert found.silent == found.by_fault["cells-off"]
        assert tuple(found.offset_db) == found.by_fault["cells-biased-10"]
        assert found.missing_ways == 0.1


def test_a_new_cell_is_not_in_the_plan():
    found = given("new-cell")
    assert set(plan().ids) - set(found.plan.ids) == set(found.affected)
    assert len(found.plan) == len(plan()) - 1
    assert all(found.plan[name] == plan()[name] for name in found.plan.ids)


def test_ways_missing():
    assert given("ways-missing") == GivenInputs(plan(), missing_ways=0.1)


def test_a_district_is_six_decibels_off():
    found = given("district-6db")
    district = found.district
    assert found.plan == plan()
    assert abs(district.offset_db) == 6.0
    west, south, east, north = LATTICE.bounds_m
    area = (east - west) * (north - south)
    assert np.pi * district.radius_m**2 == pytest.approx(0.25 * area)
    assert west <= district.east_m <= east
    assert south <= district.north_m <= north
    for name, level in predict(plan(), COARSE, None, PredictionModel()):
        shift = found.predicted(name, level, COARSE) - level
        row, col = np.indices(level.shape)
        x, y = COARSE.east_north(row, col)
        inside = np.hypot(x - district.east_m, y - district.north_m) <= district.radius_m
        assert shift[inside] == pytest.approx(district.offset_db, abs=1e-4)
        assert (shift[~inside] == 0).all()


def test_a_district_of_a_known_size():
    level = np.zeros((COARSE.rows, COARSE.cols), dtype=np.float32)
    east, north = COARSE.east_north(20, 20)
    shifted = District(float(east), float(north), 30.0, -6.0).added_to(level, COARSE)
    assert np.count_nonzero(shifted) == 5


def test_unknown_faults_and_plans_without_sectors_are_refused():
    with pytest.raises(ConfigError, match="cells-off"):
        given("nothing")
    omni = replace(
        plan(), cells=tuple(replace(c, azimuth_deg=None, antenna="omni") for c in plan().cells)
    )
    for name in ("sectors-swapped", "site-rotated", "faults-together"):
        with pytest.raises(ConfigError, match="two sectors or more"):
            given_inputs(name, omni, LATTICE, 0)
    with pytest.raises(ConfigError, match="two cells"):
        given_inputs("new-cell", replace(plan(), cells=plan().cells[:1]), LATTICE, 0)
