"""Names in an index of rasters that no file can have."""

import pytest
from raster_files import INDEX_HEADER, index_row

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.atoll import read_index

LATTICE = Lattice("EPSG:32635", 385000.0, 6673000.0, 5.0, 12, 9)


@pytest.mark.parametrize("name", ["a" * 300 + ".bil", "a/" * 3000 + "b.bil"])
def test_names_longer_than_the_file_system_allows_are_refused(tmp_path, name):
    row = index_row("A", tmp_path / "x.bil", LATTICE).replace("x.bil", name)
    (tmp_path / "index.txt").write_text(INDEX_HEADER + row)
    with pytest.raises(InputError, match="FILE_NAME: expected the name of a file"):
        read_index(tmp_path / "index.txt")
