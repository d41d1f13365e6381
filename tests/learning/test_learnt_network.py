"""Each fault of a network is found from visits, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest
from learning_world import CRS, plan_of, study

from mapfilter.learning.fit import fit_network
from mapfilter.learning.learn import changes_of
from mapfilter.radio.cells import CellPlan


def with_cells(plan, **changed):
    return CellPlan(CRS, tuple(replace(c, **changed.get(c.id, {})) for c in plan.cells))


def learned(given, true, seed, **options):
    return fit_network(*study(given, true, np.random.default_rng(seed), **options))


def names(found):
    return {(one.kind, one.cells) for one in found.network.findings}


@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_found_where_nothing_is_wrong(seed):
    plan = plan_of()
    found = learned(plan, plan, seed)
    assert names(found) == set()
    assert (found.trust > 0.9).all()
    assert 4.0 < found.sd_db < 8.0
    assert all(abs(state.offset_db) < 4.0 for state in found.network.cells)


@pytest.mark.parametrize(("offset_db", "cell"), [(10.0, "S2B"), (-10.0, "S3A")])
def test_an_offset_is_found_with_its_sign_and_size(offset_db, cell):
    given = plan_of()
    true = with_cells(given, **{cell: {"eirp_dbm": given[cell].eirp_dbm + offset_db}})
    found = learned(given, true, 1)
    (one,) = found.network.findings
    assert (one.kind, one.cells) == ("offset", (cell,))
    assert one.value == pytest.approx(offset_db, abs=2.5)
    assert one.log_bayes_factor > 3.0
    assert one.probability > 0.95
    assert 1 <= one.agreeing <= one.journeys == 8


def test_a_dead_cell_is_found():
    plan = plan_of()
    assert names(learned(plan, plan, 2, silent=("S2C",))) == {("dead", ("S2C",))}


@pytest.mark.parametrize("turn_deg", [120.0, 240.0, 90.0])
def test_a_rotated_mast_is_found_with_its_angle(turn_deg):
    given = plan_of()
    turned = {
        c.id: {"azimuth_deg": (c.azimuth_deg + turn_deg) % 360.0}
        for c in given.cells
        if c.site == "S2"
    }
    found = learned(given, with_cells(given, **turned), 3)
    (one,) = found.network.findings
    assert (one.kind, one.cells, one.value) == ("rotated", ("S2A", "S2B", "S2C"), turn_deg)


def test_two_swapped_sectors_are_found():
    given = plan_of()
    swap = {
        "S1A": {"azimuth_deg": given["S1C"].azimuth_deg},
        "S1C": {"azimuth_deg": given["S1A"].azimuth_deg},
    }
    assert names(learned(given, with_cells(given, **swap), 4)) == {("swapped", ("S1A", "S1C"))}


def test_cells_of_two_masts_that_are_swapped_are_found():
    given = plan_of()
    a, b = given["S1B"], given["S2C"]
    place = ("site", "east_m", "north_m", "azimuth_deg")
    swap = {
        "S1B": {name: getattr(b, name) for name in place},
        "S2C": {name: getattr(a, name) for name in place},
    }
    assert names(learned(given, with_cells(given, **swap), 5)) == {("swapped", ("S1B", "S2C"))}


def test_a_moved_cell_is_found_near_where_it_stands():
    true = plan_of(indoor=((900, 300), (600, 600)))
    given = with_cells(true, I1={"east_m": true["I1"].east_m - 300.0})
    (one,) = learned(given, true, 6, journeys=12).network.findings
    assert (one.kind, one.cells) == ("moved", ("I1",))
    away = np.hypot(one.place_m[0] - true["I1"].east_m, one.place_m[1] - true["I1"].north_m)
    assert away < 110.0


def test_a_single_turned_sector_is_found():
    given = plan_of()
    true = with_cells(given, S3B={"azimuth_deg": 210.0})
    (one,) = learned(given, true, 7).network.findings
    assert (one.kind, one.cells, one.value) == ("turned", ("S3B",), 90.0)


def test_all_faults_together():
    given = plan_of(sites=((300, 300), (900, 900), (300, 900), (900, 400)))
    turned = {
        f"S2{n}": {"azimuth_deg": (given[f"S2{n}"].azimuth_deg + 120.0) % 360.0} for n in "ABC"
    }
    swap = {"S1A": {"azimuth_deg": 120.0}, "S1B": {"azimuth_deg": 0.0}}
    strong = {"S4C": {"eirp_dbm": 60.0}}
    true = with_cells(given, **turned, **swap, **strong)
    found = learned(given, true, 8, journeys=12, silent=("S3A",))
    assert names(found) == {
        ("rotated", ("S2A", "S2B", "S2C")),
        ("swapped", ("S1A", "S1B")),
        ("dead", ("S3A",)),
        ("offset", ("S4C",)),
    }
    kinds = [change.kind for change in changes_of(found.network.findings, {})]
    assert kinds == ["rotated", "swapped", "offset", "dead"]


def test_journeys_that_were_located_elsewhere_do_not_count():
    given = plan_of()
    found = learned(given, given, 9, journeys=10, lost=(0, 4, 7))
    assert (found.trust < 0.5).nonzero()[0].tolist() == [0, 4, 7]
    assert names(found) == set()


def test_few_visits_prove_nothing():
    given = plan_of()
    true = with_cells(given, S2B={"eirp_dbm": 60.0})
    visits, patterns, place, _ = study(given, true, np.random.default_rng(1), journeys=1)
    few = visits.where(np.arange(len(visits)) < 60)
    assert fit_network(few, patterns, place[:60], 1).network.findings == ()


def test_without_visits_nothing_is_found():
    plan = plan_of()
    visits, patterns, place, _ = study(plan, plan, np.random.default_rng(0), journeys=1)
    none = visits.where(np.zeros(0, dtype=np.int64))
    found = fit_network(none, patterns, place[:0], 3)
    assert found.network.findings == ()
    assert found.trust.tolist() == [0.0, 0.0, 0.0]
