"""Names of cells on maps: whole, apart from each other, and as their plan has them."""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.report.basemap import BaseMap, short_names
from mapfilter.report.network import plot_best_server, plot_points_per_cell

LATTICE = Lattice("EPSG:32635", 385_000.0, 6_672_000.0, 10.0, 200, 200)
BASE = BaseMap(LATTICE.bounds_m)
IDS = tuple(f"Groß-Gerau Süd_L08_{number}" for number in range(1, 7))


def plan() -> CellPlan:
    west, south, _, _ = LATTICE.bounds_m
    places = ((west + 300.0 * i, south + 500.0) for i in range(len(IDS)))
    return CellPlan(
        LATTICE.crs,
        tuple(
            Cell(name, name[:14], *place, 30.0, 60.0 * i, 55.0, 1800.0)
            for i, (name, place) in enumerate(zip(IDS, places, strict=True))
        ),
    )


def boxes_of_names(axes):
    """Return the names on a map, and the box of each, in pixels, as it is drawn."""
    FigureCanvasAgg(axes.figure).draw()
    named = [text for text in axes.texts if "L08" in text.get_text()]
    return {text.get_text(): text.get_window_extent() for text in named}


def assert_whole_and_apart(axes):
    boxes = boxes_of_names(axes)
    assert boxes
    edge = axes.get_window_extent()
    for box in boxes.values():
        assert edge.x0 <= box.x0 < box.x1 <= edge.x1
        assert edge.y0 <= box.y0 < box.y1 <= edge.y1
    found = list(boxes.values())
    for at, box in enumerate(found):
        assert not any(box.overlaps(other) for other in found[at + 1 :])
    return set(boxes)


def test_names_at_an_edge_are_whole():
    best_server = np.full((200, 200), 1)
    best_server[:, :20] = 0
    axes = plot_best_server(best_server, IDS[:2], LATTICE, plan(), BASE)
    assert assert_whole_and_apart(axes) == set(IDS[:2])


def test_of_names_in_one_place_the_largest_cells_is_shown():
    west, south, _, _ = LATTICE.bounds_m
    east_m, north_m = west + np.linspace(5, 1995, 50), np.full(50, south + 1000.0)
    points = {name: (east_m[i:], north_m[i:]) for i, name in enumerate(IDS)}
    axes = plot_points_per_cell(points, plan(), BASE)
    assert assert_whole_and_apart(axes) == {IDS[0]}


def test_names_are_shortened_by_what_numbers_them_alone():
    assert short_names(["302-720-29100-95", "302-720-29100-9"]) == ["95", "9"]
    assert short_names(list(IDS)) == list(IDS)
