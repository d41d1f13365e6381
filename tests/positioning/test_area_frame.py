"""Extent, edges, cells and sites of an area in its local frame, however its levels are held."""

from dataclasses import replace

import numpy as np
import pytest
from small_area import FLOOR_DBM, LEVEL_DBM, make_area

from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.area.area_frame import (
    AreaFrame,
    carriers_of,
    interfering_of,
    sites_of,
)
from mapfilter.radio.cells import Cell, CellPlan

CRS = "EPSG:32629"


class Frame(AreaFrame):
    """An area without levels or ways."""

    def __init__(self, rows, cols, resolution_m=10.0, cell_ids=(), sites=None):
        self.lattice = Lattice(CRS, 500_000.0, 4_000_000.0, resolution_m, rows, cols)
        self.cell_ids, self.sites = cell_ids, sites or {}

    def levels_at(self, pixel, band):
        raise NotImplementedError

    def matched_way(self, east_m, north_m, weight):
        raise NotImplementedError


WIDE = Frame(200, 300)
"""3000 m by 2000 m: the edge is 60 m wide."""
SMALL = Frame(60, 80)
"""800 m by 600 m: the edge is 30 m wide, a twentieth of the shorter side."""


def cloud(*places):
    return np.array(places, dtype=np.float32).T


def test_the_local_frame_begins_in_the_south_west():
    assert WIDE.origin_m == (500_000.0, 3_998_000.0)
    assert WIDE.size_m == (3000.0, 2000.0)
    assert WIDE.frame == (0.0, 2000.0, 0.1, 200, 300)
    assert Frame(20, 30, 4.0).frame == (0.0, 80.0, 0.25, 20, 30)


@pytest.mark.parametrize(("area", "edge_m"), [(WIDE, 60.0), (SMALL, 30.0)])
def test_the_edge_is_as_wide_on_each_side(area, edge_m):
    width_m, height_m = area.size_m
    middle = np.array([width_m / 2, height_m / 2])
    assert not area.at_edge(middle)
    for axis, far_m in ((0, width_m), (1, height_m)):
        for place_m, near in (
            (edge_m - 0.1, True), (edge_m, False), (far_m - edge_m, False),
            (far_m - edge_m + 0.1, True), (-5.0, True), (far_m + 5.0, True),
        ):  # fmt: skip
            place = middle.copy()
            place[axis] = place_m
            assert area.at_edge(place) == near, (axis, place_m)


@pytest.mark.parametrize(("area", "clear_m"), [(WIDE, 61.0), (SMALL, 31.0)])
def test_a_belief_is_clear_of_the_edge_if_all_of_it_is(area, clear_m):
    """A metre more than the edge, as its mean is rounded."""
    width_m, height_m = area.size_m
    middle = (width_m / 2, height_m / 2)
    assert area.clear_of_edge(cloud(middle, (clear_m + 0.1, clear_m + 0.1)))
    assert area.clear_of_edge(cloud((width_m - clear_m - 0.1, height_m - clear_m - 0.1), middle))
    for other in (
        (clear_m - 0.1, middle[1]), (middle[0], clear_m - 0.1),
        (width_m - clear_m + 0.1, middle[1]), (middle[0], height_m - clear_m + 0.1),
    ):  # fmt: skip
        assert not area.clear_of_edge(cloud(middle, other, middle))


def test_what_lies_beyond_an_area():
    state = cloud((0.0, 0.0), (800.0, 600.0), (-0.1, 5.0), (5.0, -0.1), (800.1, 5.0), (5.0, 600.1))
    assert SMALL.beyond(state).tolist() == [False, False, True, True, True, True]
    assert SMALL.holds_all(*state[:, :2])
    assert not SMALL.holds_all(*state[:, 1:3])


@pytest.mark.parametrize("outside", [(-1.0, 300.0), (801.0, 300.0), (400.0, -1.0), (400.0, 601.0)])
def test_an_area_holds_a_belief_if_more_than_half_of_it_lies_there(outside):
    east, north = cloud((400.0, 300.0), outside)
    for inside, held in ((0.51, True), (0.5, False), (0.1, False)):
        weight = np.array([inside, 1 - inside], dtype=np.float32)
        assert SMALL.holds(east, north, weight) is held
    assert SMALL.holds(east[:1], north[:1], np.ones(1, np.float32)) is True
    none = np.empty(0, np.float32)
    assert SMALL.holds(none, none, none) is False


def test_the_border_belongs_to_the_area():
    half = np.array([0.6, 0.4], dtype=np.float32)
    for corner in ((0.0, 0.0), (800.0, 600.0)):
        assert SMALL.holds(*cloud(corner, (900.0, 900.0)), half)


def test_cells_at_one_place_are_of_one_site():
    sites = {"a": (1.0, 2.0, 30.0), "b": (1.0, 2.0, 10.0), "c": (1.0, 3.0, 30.0)}
    sites |= {"unused": (9.0, 9.0, 9.0)}
    area = Frame(20, 20, cell_ids=("c", "nowhere", "a", "b", "elsewhere"), sites=sites)
    assert area.site_of.tolist() == [0, 1, 2, 2, 3]
    assert area.site_of.dtype == np.int64
    assert area.band_of == {"c": 0, "nowhere": 1, "a": 2, "b": 3, "elsewhere": 4}


def cell(name, arfcn=None, bsic=None, east_m=1.0):
    return Cell(name, "S", east_m, 2.0, 30.0, 90.0, 50.0, 1800.0, arfcn=arfcn, bsic=bsic)


def test_carriers_have_the_bands_of_their_cells():
    plan = CellPlan(
        CRS, (cell("a", 70, 3), cell("b", 70, 4), cell("c", 70), cell("d", 71, 3), cell("e"),
              cell("f", 70, 3), cell("away", 70, 3)),
    )  # fmt: skip
    bands = ("f", "a", "b", "c", "d", "e")
    assert carriers_of(plan, bands) == {
        (70, -1): (1, 2, 3, 0), (70, 3): (1, 0), (70, 4): (2,), (71, -1): (4,), (71, 3): (4,),
    }  # fmt: skip
    assert sites_of(CellPlan(CRS, (cell("a", east_m=7.0),))) == {"a": (7.0, 2.0, 30.0)}


def test_not_all_neighbours_of_a_known_technology_are_found():
    technologies = {"a": "LTE", "b": "GSM", "c": None, "d": "NR", "e": "UMTS", "away": "LTE"}
    cells = [replace(cell(name), technology=one) for name, one in technologies.items()]
    assert interfering_of(CellPlan(CRS, tuple(cells)), ("e", "c", "b", "a", "d")) == {0, 2, 3, 4}
    assert interfering_of(CellPlan(CRS, ()), ("a",)) == frozenset()


def test_levels_that_are_not_in_the_database_are_six_decibels_below_its_floor():
    held = make_area().level_dbm[..., :4]
    assert (held.min(), FLOOR_DBM) == (-116.0, -110.0)
    np.testing.assert_array_equal(held, LEVEL_DBM)


@pytest.mark.parametrize(
    ("layers", "layer_of", "bands", "strongest"),
    [((), [0, 0, 0], 5, [3, 3, 3]), ((0, 1, 0), [0, 1, 0], 7, [3, 5, 3])],
)
def test_without_layers_all_cells_are_of_one(layers, layer_of, bands, strongest):
    """Behind the cells' bands are the strongest and the second strongest of each layer."""
    frame = Frame(2, 3, cell_ids=("a", "b", "c"))
    frame.layers = layers
    assert frame.layer_of.tolist() == layer_of
    assert frame.bands == bands
    assert [frame.strongest(band) for band in range(3)] == strongest
