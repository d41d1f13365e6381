"""A search for the nearest points of a database that has none, and points of other cells."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from small_world import make_database, make_world

from mapfilter.database.cell_levels import PointReader
from mapfilter.database.points import read_points
from mapfilter.errors import StoreError
from mapfilter.radio.cells import CellPlan


@pytest.mark.parametrize("window", [(0, 0, 2, 2), (20, 3, 4, 5)])
def test_a_search_ends_with_the_whole_lattice(tmp_path, window):
    database = make_database(make_world(tmp_path), tmp_path)
    reader, asked = PointReader(database), []

    def read(outer):
        asked.append(outer)
        assert len(asked) < 20, "the search does not end"
        return {}

    reader._reader = SimpleNamespace(read=read)
    with pytest.raises(StoreError, match="expected points of the database, found none"):
        reader.nearest(window)
    lattice = database.lattice
    assert asked[-1] == (0, 0, lattice.rows, lattice.cols)
    assert asked[-1] not in asked[:-1]


def test_points_of_cells_that_a_database_lacks_are_refused(tmp_path):
    """Such are parts of another database; one of roads alone asks for no cell."""
    database = make_database(make_world(tmp_path), tmp_path)
    part, lattice, plan = database.points_part, database.lattice, database.plan
    points = read_points(part, lattice, plan)
    turned = CellPlan(plan.crs, plan.cells[::-1])
    last = len(plan) - 1
    assert read_points(part, lattice, turned).best_server.tolist() == [
        last - cell for cell in points.best_server.tolist()
    ]
    best = plan.cells[int(points.best_server[0])]
    lacking = CellPlan(plan.crs, tuple(cell for cell in plan.cells if cell is not best))
    with pytest.raises(StoreError) as caught:
        read_points(part, lattice, lacking)
    (fault,) = caught.value.faults
    assert (fault.where, fault.hint) == (str(part), "parts mixed up")
    assert fault.expected == "best servers among the cells"
    assert best.id in fault.got
    roads = read_points(part, lattice, CellPlan(plan.crs, ()))
    assert set(roads.best_server.tolist()) == {-1}


def reads(database):
    """All ways to read points or levels of a database."""
    cell = database.cell_ids[0]
    return {
        "points": database.points,
        "levels": lambda: database.cell_points(cell),
        "field": database.field,
    }


@pytest.mark.parametrize("name", ["points", "levels", "field"])
@pytest.mark.parametrize(("rows", "cols"), [(0, 1), (0, -1), (-30, 0)])
def test_points_of_another_lattice_are_refused(database, name, rows, cols):
    """They would lie in other places: numbers count by the columns."""
    lattice = database.lattice
    other = replace(lattice, rows=lattice.rows + rows, cols=lattice.cols + cols)
    with pytest.raises(StoreError) as caught:
        reads(replace(database, lattice=other))[name]()
    (fault,) = caught.value.faults
    assert (fault.expected, fault.hint) == ("points on the database's lattice", "parts mixed up")


def test_points_of_the_lattice_are_read(database):
    for read in reads(database).values():
        read()
