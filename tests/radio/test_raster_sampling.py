"""Levels at points of several windows at once are those of each window alone."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters import sampling
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.resampling import read_on
from mapfilter.rasters.sampling import Places, levels_at

WHOLE = Lattice("EPSG:32632", 400_000.0, 5_600_000.0, 5.0, 64, 64)
CUTS = {"A": (0, 0, 40, 40), "B": (20, 10, 40, 50), "C": (5, 30, 30, 30), "D": (0, 0, 64, 64)}
PLAN = CellPlan(
    WHOLE.crs,
    tuple(
        Cell(name, "S", WHOLE.west_m, WHOLE.north_m, 30.0, None, 50.0 + n, 900.0, antenna="omni")
        for n, name in enumerate(CUTS)
    ),
)
WINDOWS = [(row, col, 16, 16) for row in (0, 16, 32) for col in (0, 16, 48)]


def rasters_of(folder, quantity="level", values=None, *, single=False, **options):
    """Return a file for each cell, cut about it; or one file of all bands."""
    folder.mkdir()
    rng, bands = np.random.default_rng(7), []
    for name, window in CUTS.items():
        part = WHOLE if single else WHOLE.window(*window)
        level = rng.uniform(-110, -60, (part.rows, part.cols)).round(2)
        level[:3] = np.nan
        level = -level if quantity == "loss" else level
        if values is not None and name in values:
            level = values[name](level)
        bands.append((name, part, level))
    if single:
        items = [(name, level) for name, _, level in bands]
        write_rasters(folder / "all.tif", WHOLE, items, list(CUTS), quantity=quantity)
        return open_rasters(folder / "all.tif", **options)
    for name, part, level in bands:
        write_rasters(folder / f"{name}.tif", part, [(name, level)], [name], quantity=quantity)
    return open_rasters(folder, **options)


def places_in(rasters, windows=WINDOWS):
    rng, found = np.random.default_rng(1), []
    for window in windows:
        part = rasters.reaching(window)
        row, col = rng.integers(0, window[2], 30), rng.integers(0, window[3], 30)
        found.append(Places(part, PLAN, tuple(sorted(part.cell_ids)), window, row, col))
    return found


def alone(one):
    """Return the levels of a window as the set itself reads them."""
    return one.rasters.read_levels_dbm(PLAN, one.window, one.cells)[:, one.row, one.col]


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("quantity", ["level", "loss"])
@pytest.mark.parametrize("options", [{}, {"factor": 0.9}, {"resolution_m": 7.0},
                                     {"resolution_m": 7.0, "resampling": "bilinear"}])  # fmt: skip
def test_windows_together_give_the_same_bytes(tmp_path, single, quantity, options):
    rasters = rasters_of(tmp_path / "rasters", quantity, single=single, **options)
    side = min(rasters.lattice.rows, rasters.lattice.cols)
    windows = [w for w in WINDOWS if max(w[0], w[1]) + 16 <= side]
    places = places_in(rasters, windows)
    found = levels_at(places)
    assert np.isnan(found[0]).any()
    assert not all(np.isnan(one).all() for one in found)
    for one, levels in zip(places, found, strict=True):
        assert levels.dtype == np.float32
        assert levels.tobytes() == alone(one).tobytes()


def boxes_read(monkeypatch, places):
    boxes = []

    def noted(file, bands, lattice, window, resampling):
        boxes.append((file.path.stem, len(bands), window))
        return read_on(file, bands, lattice, window, resampling)

    monkeypatch.setattr(sampling, "read_on", noted)
    return levels_at(places), boxes


def test_each_file_is_read_once(tmp_path, monkeypatch):
    places = places_in(rasters_of(tmp_path / "rasters"))
    _, boxes = boxes_read(monkeypatch, places)
    assert sorted(boxes) == [
        ("A", 1, (0, 0, 48, 32)), ("B", 1, (16, 0, 32, 64)),
        ("C", 1, (0, 16, 48, 48)), ("D", 1, (0, 0, 48, 64)),
    ]  # fmt: skip


def test_no_more_is_read_at_a_time_than_the_bands_of_one_window(tmp_path, monkeypatch):
    places = places_in(rasters_of(tmp_path / "rasters", single=True))
    monkeypatch.setattr(sampling, "_BANDS_AT_A_TIME", 3)
    found, boxes = boxes_read(monkeypatch, places)
    assert [box for _, _, box in boxes] == WINDOWS * 2
    assert [bands for _, bands, _ in boxes] == [3] * 9 + [1] * 9
    monkeypatch.undo()
    for one, levels in zip(places, found, strict=True):
        assert levels.tobytes() == alone(one).tobytes()


def test_windows_far_apart_are_read_one_by_one(tmp_path, monkeypatch):
    corners = [(0, 0, 16, 16), (48, 48, 16, 16)]
    places = places_in(rasters_of(tmp_path / "rasters"), corners)
    _, boxes = boxes_read(monkeypatch, places)
    assert [box for name, _, box in boxes if name == "D"] == corners


def test_a_window_without_points_or_cells_reads_nothing(tmp_path, monkeypatch):
    rasters, none = rasters_of(tmp_path / "rasters"), np.empty(0, np.int64)
    places = [
        Places(rasters, PLAN, tuple(CUTS), WINDOWS[0], none, none),
        Places(rasters, PLAN, (), WINDOWS[1], np.array([1]), np.array([2])),
    ]
    found, boxes = boxes_read(monkeypatch, places)
    assert [levels.shape for levels in found] == [(4, 0), (0, 1)]
    assert boxes == []


def test_what_is_not_plausible_in_one_window_is_an_error(tmp_path):
    """Levels of 0 dBm all over one window, as alone; most of the file is sound."""

    def spoilt(level):
        level[:16, :16] = 0.0
        return level

    rasters = rasters_of(tmp_path / "rasters", values={"D": spoilt})
    places = places_in(rasters)
    with pytest.raises(InputError, match=r"D\.tif.*0 means no data, and the file does not"):
        levels_at(places)
    levels_at(places[1:])


@pytest.mark.parametrize(
    ("quantity", "number", "refused"),
    [("level", -1, True), ("level", -200, False), ("loss", 0, True), ("loss", 255, False)],
)
def test_a_number_for_no_data_is_an_error_where_it_is_strong(quantity, number, refused, tmp_path):
    def spoilt(values):
        values[:16, 8:16] = number
        return values

    places = places_in(rasters_of(tmp_path / "rasters", quantity, {"D": spoilt}))
    if not refused:
        levels_at(places)
        return
    with pytest.raises(InputError, match=rf"D\.tif pixels, cell D: .*{number} means no data"):
        levels_at(places)


@pytest.mark.parametrize("number", [-9999, -1, 0])
@pytest.mark.parametrize("factor", [1 / 16, 0.1, 1.0])
def test_the_number_for_no_data_in_a_message_is_the_one_to_set(number, factor, tmp_path):
    def spoilt(values):
        stored = np.round(values / np.float32(factor))
        stored[:16, 8:16] = number
        return stored

    whole = {cell: lambda values: np.round(values / np.float32(factor)) for cell in CUTS}
    made = rasters_of(tmp_path / "rasters", values=whole | {"D": spoilt}, factor=factor)
    said = rf"likely: ({number}) means no data, and the file does not state it; set nodata"
    with pytest.raises(InputError, match=said):
        levels_at(places_in(made))
    if number == -9999:
        with pytest.raises(InputError, match=said):
            made.read()
    levels_at(places_in(open_rasters(made.path, factor=factor, nodata=float(number))))


@pytest.mark.parametrize(
    ("quantity", "number", "pixels"),
    [("level", 0, "1 pixel"), ("level", -1, "3 pixels"), ("loss", 0, "2 pixels")],
)
def test_a_hole_of_a_few_pixels_is_found_beside_strong_levels(quantity, number, pixels, tmp_path):
    """Levels near the mast are as strong as the number, so that all of a tile tell nothing."""

    def spoilt(values):
        values[4:12, 3:6] = -12.0 if quantity == "level" else 12.0
        values[5, 10 : 10 + int(pixels[0])] = number
        return values

    places = places_in(rasters_of(tmp_path / "rasters", quantity, {"D": spoilt}))
    with pytest.raises(InputError, match=f"cell D: .*found {number} in {pixels} of a tile"):
        levels_at(places)


def test_a_strong_pixel_among_strong_ones_is_a_level(tmp_path):
    def strong(values):
        values[4:9, 4:9] = -18.0
        values[6, 6] = 0.0
        return values

    levels_at(places_in(rasters_of(tmp_path / "rasters", values={"D": strong})))


def test_a_number_for_no_data_is_found_before_it_is_weighed_with_its_neighbours(tmp_path):
    def spoilt(values):
        values[20:23, 20:23] = 0
        return values

    finer = {"resolution_m": 2.5, "resampling": "bilinear"}
    rasters = rasters_of(tmp_path / "rasters", values={"D": spoilt}, **finer)
    with pytest.raises(InputError, match=r"cell D: .*0 means no data"):
        levels_at(places_in(rasters, [(32, 32, 40, 40)]))


def test_deviations_are_no_levels(tmp_path):
    rasters = rasters_of(tmp_path / "rasters", "deviation", dict.fromkeys(CUTS, np.abs))
    with pytest.raises(InputError, match="levels or losses"):
        levels_at(places_in(rasters))
