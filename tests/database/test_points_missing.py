"""A search for the nearest points of a database that has none."""

from types import SimpleNamespace

import pytest
from small_world import make_database, make_world

from mapfilter.database.cell_levels import PointReader
from mapfilter.errors import StoreError


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
