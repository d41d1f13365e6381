"""Damaged raster files of every kind: one message or pixels, never a crash, a hang or gigabytes."""

import contextlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fuzz import fuzz
from raster_files import INDEX_HEADER, index_row, write_ascii, write_bil

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 12, 9)
LEVEL = np.linspace(-120, -60, 108).reshape(12, 9).round()
WINDOW_PX = 256

# rasterio's own logger stumbles over GDAL messages that quote bytes which are no text.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


def _read(folder: Path) -> None:
    rasters = open_rasters(folder, "level", crs=CRS)
    rows, cols = (min(n, WINDOW_PX) for n in (rasters.lattice.rows, rasters.lattice.cols))
    rasters.read((0, 0, rows, cols), rasters.cell_ids[:4])
    bottom, right = rasters.lattice.rows - rows, rasters.lattice.cols - cols
    rasters.read((bottom, right, rows, cols), rasters.cell_ids[-4:])


def _geotiff(folder: Path) -> Path:
    items = [("A", LEVEL), ("B", LEVEL - 3)]
    write_rasters(folder / "x.tif", LATTICE, items, ["A", "B"])
    return folder / "x.tif"


def _ascii(folder: Path) -> Path:
    return write_ascii(folder / "x.asc", LATTICE, LEVEL, nodata="-9999")


def _bil(folder: Path) -> Path:
    return write_bil(folder / "x.bil", LATTICE, LEVEL.astype("i2"))


def _header(folder: Path) -> Path:
    return _bil(folder).with_suffix(".hdr")


def _index(folder: Path) -> Path:
    rows = [index_row(name, folder / "x.bil", LATTICE) for name in "AB"]
    (folder / "index.txt").write_text(INDEX_HEADER + "".join(rows))
    _bil(folder)
    return folder / "index.txt"


def _index_alone(folder: Path) -> Path:
    path = _index(folder)
    (folder / "x.hdr").unlink()
    return path


@pytest.mark.parametrize(
    "make", [_geotiff, _ascii, _bil, _header, _index, _index_alone], ids=lambda f: f.__name__[1:]
)
def test_damaged_rasters(tmp_path: Path, make: Callable[[Path], Path], mutation_count: int) -> None:
    path = make(tmp_path)
    _read(tmp_path)

    def read(data: bytes) -> None:
        path.write_bytes(data)
        _read(tmp_path)

    tally = fuzz(path.read_bytes(), read, mutation_count)
    print(f"{make.__name__[1:]}: {tally}")  # noqa: T201
    assert tally.refused > 0.2 * mutation_count


@pytest.mark.parametrize("make", [_ascii, _bil, _header, _index], ids=lambda f: f.__name__[1:])
def test_cut_off_at_any_byte(tmp_path: Path, make: Callable[[Path], Path]) -> None:
    path = make(tmp_path)
    whole = path.read_bytes()
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        with contextlib.suppress(InputError):
            _read(tmp_path)
