"""What a GeoTIFF's header may say, by headers made up: each limit on both of its sides."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from raster_files import WINDOWS
from rasterio import Affine

from mapfilter._gdal import check_blocks
from mapfilter.errors import Faults, InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters import geotiff
from mapfilter.rasters.geotiff import QUANTITY_TAG, _check_extent_of_file, _lattice, _quantity
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 6, 8)


def complaints(check, *arguments):
    try:
        check(*arguments)
    except InputError as error:
        return [f"{fault.expected}; {fault.hint}" for fault in error.faults]
    return []


def placed(transform, known):
    """Return where the pixels of a file lie, whose transform is known or is GDAL's default."""
    faults = Faults()
    header = SimpleNamespace(transform=transform, crs=None, height=6, width=8)
    lattice = _lattice("a.tif", header, CRS, known, faults)
    faults.raise_if_any(InputError)
    return lattice


@pytest.mark.parametrize(
    ("transform", "said"),
    [
        (Affine(5, 0, 385000, 0, -5, 6673000), []),
        (Affine(5, 0, 385000, 0, -5.000004, 6673000), []),
        (Affine(5, 0, 385000, 0, -5.000006, 6673000), ["square pixels; "]),
        (Affine(5, 0, 385000, 0, -4.999994, 6673000), ["square pixels; "]),
        (Affine(1e-3, 0, 385000, 0, -1e-3, 6673000), []),
        (Affine(5, 0, 385000, 0, 5, 6673000), ["row 0 in the north, column 0 in the west; "]),
        (Affine(-5, 0, 385000, 0, -5, 6673000), ["row 0 in the north, column 0 in the west; "]),
        (Affine(5, 0, 385000, 0, 0, 6673000), ["row 0 in the north, column 0 in the west; "]),
        (Affine(0, 0, 385000, 0, -5, 6673000), ["row 0 in the north, column 0 in the west; "]),
        (Affine(5, 0.1, 385000, 0, -5, 6673000), ["rows that run east; "]),
        (Affine(5, 0, 385000, 0.1, -5, 6673000), ["rows that run east; "]),
        (Affine(5, 0, np.nan, 0, -5, 6673000), ["finite numbers; "]),
        (Affine(5, 0, 385000, 0, -5, np.inf), ["finite numbers; "]),
        (Affine.identity(), ["where the pixels lie; exported without it"]),
    ],
)
def test_where_the_pixels_lie(transform, said):
    found = complaints(placed, transform, True)
    assert len(found) == len(said)
    assert all(one.startswith(other) for one, other in zip(found, said, strict=True))
    if not said:
        expected = Lattice(CRS, transform.c, transform.f, transform.a, 6, 8)
        assert placed(transform, True) == expected
    (unplaced,) = complaints(placed, transform, False)
    assert unplaced.startswith("where the pixels lie")


def source(height, width, block, count=1, interleaving="band", kinds=("float32",), blocks=None):
    """Return a header: ``blocks`` gives offset and length by band, column and row of blocks."""

    def tag(name, domain, bidx):
        assert domain == "TIFF"
        kind, col, row = name.removeprefix("BLOCK_").split("_")
        found = (blocks or {}).get((bidx, int(col), int(row)))
        return None if found is None else str(found[kind == "SIZE"])

    return SimpleNamespace(
        height=height,
        width=width,
        count=count,
        interleaving=interleaving,
        dtypes=kinds,
        block_shapes=[block] * count,
        get_tag_item=tag,
    )


def of_size(folder, size):
    path = folder / "a.tif"
    with path.open("wb") as stream:
        stream.truncate(size)
    return path


WHOLE = {(1, 0, 0): (100, 50), (1, 1, 0): (150, 50), (1, 0, 1): (200, 50), (1, 1, 1): (250, 50)}


def _check_size(path, header):
    check_blocks(path, header)
    _check_extent_of_file(path, header)


@pytest.mark.parametrize(
    ("header", "size", "said"),
    [
        (source(20, 20, (16, 16), blocks=WHOLE), 300, []),
        (source(20, 20, (16, 16), blocks=WHOLE), 299, ["at least 300 bytes"]),
        (source(32, 32, (16, 16), blocks=WHOLE), 299, ["at least 300 bytes"]),
        # Sparse blocks are nowhere; a file without any is none.
        (source(20, 20, (16, 16), blocks={(1, 0, 0): (100, 50)}), 150, []),
        (source(20, 20, (16, 16), blocks={(1, 1, 0): (100, 50)}), 149, ["at least 150 bytes"]),
        (source(20, 20, (16, 16)), 300, ["pixels"]),
        # The second band has its own blocks, unless both share theirs.
        (
            source(9, 9, (16, 16), 2, blocks={(1, 0, 0): (8, 8), (2, 0, 0): (16, 8)}),
            23,
            ["at least 24 bytes"],
        ),
        (
            source(9, 9, (16, 16), 2, "PIXEL", blocks={(1, 0, 0): (8, 8), (2, 0, 0): (16, 8)}),
            23,
            [],
        ),
        # Four bytes at least for each block's place.
        (source(160, 160, (16, 16), blocks={(1, 0, 0): (8, 8)}), 400, []),
        (
            source(160, 160, (16, 16), blocks={(1, 0, 0): (8, 8)}),
            399,
            ["as many bytes as its header needs"],
        ),
        (
            source(160, 160, (16, 16), 2, blocks={(1, 0, 0): (8, 8)}),
            799,
            ["as many bytes as its header needs"],
        ),
        (source(160, 160, (16, 16), 2, "PIXEL", blocks={(1, 0, 0): (8, 8)}), 400, []),
        # A block of 64 MiB at most, or of the size of the file.
        (source(4096, 4096, (4096, 4096), blocks={(1, 0, 0): (8, 8)}), 100, []),
        (
            source(4096, 4096, (4096, 4097), blocks={(1, 0, 0): (8, 8)}),
            100,
            ["blocks under 64 MiB"],
        ),
        (
            source(4096, 4096, (4096, 4096), kinds=("uint8", "float64"), blocks=WHOLE),
            300,
            ["blocks under 64 MiB"],
        ),
        (source(4096, 4096, (4096, 4096), 2, "PIXEL", blocks=WHOLE), 300, ["blocks under 64 MiB"]),
        (source(4096, 4096, (4096, 4096), 2, blocks=WHOLE), 300, []),
        (source(4096, 4096, (4096, 4097), blocks={(1, 0, 0): (8, 8)}), 4 * 4096 * 4097, []),
    ],
)
def test_bytes_that_a_header_promises(tmp_path, header, size, said):
    found = complaints(_check_size, of_size(tmp_path, size), header)
    assert len(found) == len(said)
    assert all(one.startswith(other) for one, other in zip(found, said, strict=True))


def test_of_many_blocks_some_are_looked_at_and_the_last_always(tmp_path, monkeypatch):
    monkeypatch.setattr(geotiff, "_MOST_BLOCKS_LOOKED_AT", 3)
    looked = []
    last = {(1, 4, 1): (100, 60)}
    header = source(32, 80, (16, 16), blocks=last)
    ask = header.get_tag_item
    header.get_tag_item = lambda name, *more, **kind: (
        looked.append(name) or ask(name, *more, **kind)
    )
    # Ten blocks, three of them looked at: every fourth from the last.
    assert complaints(_check_extent_of_file, of_size(tmp_path, 159), header) == [
        "at least 160 bytes; the file is cut off, or its header is damaged"
    ]
    assert [name for name in looked if "OFFSET" in name] == [
        "BLOCK_OFFSET_4_1",
        "BLOCK_OFFSET_0_1",
        "BLOCK_OFFSET_1_0",
    ]


@pytest.mark.parametrize(
    ("tag", "units", "quantity"),
    [
        ("loss", ("dBm",), "loss"),
        ("deviation", (None,), "deviation"),
        ("other", ("dBm",), None),
        (None, ("dBm", " DBM "), "level"),
        (None, ("dB",), "loss"),
        (None, ("dB", "dBm"), None),
        (None, ("m",), None),
        (None, ("dB", None), None),
        (None, (None, ""), None),
    ],
)
def test_what_a_file_says_that_it_holds(tag, units, quantity):
    tags = {} if tag is None else {QUANTITY_TAG: tag}
    assert _quantity(SimpleNamespace(tags=lambda: tags, units=units)) == quantity


@pytest.fixture(scope="module")
def rasters(tmp_path_factory):
    path = tmp_path_factory.mktemp("rasters") / "r.tif"
    level = np.linspace(-90, -60, 48).reshape(6, 8)
    write_rasters(path, LATTICE, [("A", level), ("B", level - 5)], ["A", "B"])
    return open_rasters(path)


@pytest.mark.parametrize(("window", "fits"), WINDOWS)
def test_windows_on_the_lattice(rasters, window, fits):
    if fits:
        assert rasters.read(window).shape == (2, *window[2:])
        return
    with pytest.raises(InputError, match="a window on 6 x 8 pixels"):
        rasters.read(window)


def test_reads_of_four_gibibytes_are_the_largest(rasters, monkeypatch):
    monkeypatch.setattr("mapfilter.rasters.raster_set._LARGEST_READ_BYTES", 4 * 48)
    assert rasters.read(cells=["B"]).shape == (1, 6, 8)
    with pytest.raises(InputError, match="at most 4 GiB at a time"):
        rasters.read()
    np.testing.assert_allclose(
        rasters.read((0, 0, 3, 8), ["B", "A"])[0], rasters.read((0, 0, 3, 8), ["A"])[0] - 5
    )


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"factor": 0.0}, "factor"),
        ({"factor": np.nan}, "factor"),
        ({"factor": np.inf}, "factor"),
        ({"resolution_m": 0.0}, "resolution_m"),
        ({"resolution_m": -5.0}, "resolution_m"),
        ({"nodata": np.nan}, "nodata"),
    ],
)
def test_options_that_are_none(rasters, options, said):
    with pytest.raises(InputError, match=said):
        open_rasters(Path(rasters.path), **options)


def test_a_factor_is_multiplied(rasters):
    negative = open_rasters(rasters.path, factor=0.5)
    np.testing.assert_allclose(negative.read(), rasters.read() / 2, rtol=1e-6)
