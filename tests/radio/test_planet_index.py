"""Raw rasters with an index of Planet, which has no header."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.rasters.opening import open_rasters
from mapfilter.workflows.info import run_info

CRS = "EPSG:32635"
WEST_M, NORTH_M, SIDE_M, ROWS, COLS = 385_000.0, 6_673_000.0, 20.0, 5, 8
EDGES = f"{WEST_M} {WEST_M + COLS * SIDE_M} {NORTH_M - ROWS * SIDE_M} {NORTH_M} {SIDE_M}"
VALUES = -60 - np.arange(ROWS * COLS).reshape(ROWS, COLS)


@pytest.fixture
def folder(tmp_path):
    def write(index, names=("A1.bin", "B 2.bin")):
        for n, name in enumerate(names):
            (tmp_path / name).write_bytes((VALUES - n).astype(">i2").tobytes())
        (tmp_path / "index.txt").write_text(index)
        return tmp_path

    return write


def opened(path):
    return open_rasters(path, "level", crs=CRS)


@pytest.mark.parametrize("named", [False, True])
def test_rasters_are_read_by_their_index(folder, named):
    """They were refused, with the advice to rename them and to write headers."""
    path = folder(f"A1.bin {EDGES}\nB 2.bin\t{EDGES}\n\n")
    found = opened(path / "index.txt" if named else path)
    assert found.cell_ids == ("A1", "B 2")
    assert found.lattice.bounds_m == (WEST_M, NORTH_M - 100, WEST_M + 160, NORTH_M)
    assert found.lattice.resolution_m == SIDE_M
    np.testing.assert_array_equal(found.read()[0], VALUES)
    np.testing.assert_array_equal(found.read()[1], VALUES - 1)


def test_info_knows_their_folder(folder):
    found = run_info(folder(f"A1.bin {EDGES}\n"))
    assert (found["kind"], found["cells"], found["resolution_m"]) == ("rasters", 1, SIDE_M)


def test_a_number_for_no_data(folder):
    path = folder(f"A1.bin {EDGES}\n")
    values = VALUES.copy()
    values[0, 0] = -9999
    (path / "A1.bin").write_bytes(values.astype(">i2").tobytes())
    read = opened(path).read()[0]
    assert np.isnan(read[0, 0])
    assert np.isnan(read).sum() == 1


@pytest.mark.parametrize(
    ("index", "told"),
    [
        (f"A1.bin {EDGES}\nC3.bin {EDGES}\n", "index.txt row 2, name: expected the name of a file"),
        (f"../A1.bin {EDGES}\n", "index.txt row 1, name: expected the name of a file"),
        (f"A1.bin {EDGES}\nA1.bin {EDGES}\n", "row 2, name: expected each cell once"),
        (f"A1.bin {EDGES}\nB 2.bin 3850o0 5 5 5 5\n",
         "row 2: expected a file's name, west, east.*3850o0"),
        (f"A1.bin {WEST_M} {NORTH_M - 100} {WEST_M + 160} {NORTH_M} 20\nB 2.bin 5 1 1 5 20\n",
         "row 2, area: .*another order of columns"),
        (f"A1.bin {EDGES[:-4]}10.0\n", "bytes"),
    ],
)  # fmt: skip
def test_faults_of_an_index(folder, index, told):
    with pytest.raises(InputError, match=told):
        opened(folder(index))


def test_paths_and_links_are_told_as_such(folder, tmp_path_factory):
    """They were called rasters that were moved elsewhere, unlike in an index of Atoll."""
    with pytest.raises(InputError, match=r"A1.bin is beside the index: leave its name alone"):
        opened(folder(f"C:\\maps\\A1.bin {EDGES}\n"))
    path = folder(f"L.bin {EDGES}\n")
    other = tmp_path_factory.mktemp("other") / "X.bin"
    other.write_bytes(b"")
    (path / "L.bin").symlink_to(other)
    with pytest.raises(InputError, match="a link out of the folder"):
        opened(path)


def test_another_text_is_no_index(folder):
    """A list of words and numbers beside rasters that are named by themselves."""
    path = folder("made on 2026 5 1 by hand\n", names=())
    (path / "A1.asc").write_text(
        f"ncols 2\nnrows 2\nxllcorner {WEST_M}\nyllcorner {NORTH_M}\ncellsize 20\n-6 -7\n-8 -9\n"
    )
    assert opened(path).cell_ids == ("A1",)
