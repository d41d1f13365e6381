"""Maps keep their labels within the picture, however wide map and legend are."""

import numpy as np
import pytest
from matplotlib.image import imread

from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.report import network
from mapfilter.report.basemap import BaseMap, local_frame
from mapfilter.report.network import plot_best_server
from mapfilter.report.saving import save
from mapfilter.report.survey import plot_left_out

CRS = "EPSG:25832"


@pytest.mark.parametrize(
    ("rows", "cols", "name"), [(60, 60, "A{}"), (50, 60, "HH00{}_1"), (90, 40, "302-720-291-8{}")]
)
def test_the_label_at_the_left_is_whole(rows, cols, name, tmp_path):
    lattice = Lattice(CRS, 565_000.0, 5_934_000.0, 25.0, rows, cols)
    west, _, _, north = lattice.bounds_m
    cells = tuple(
        Cell(name.format(n), "S", west + 300.0, north - 300.0, 30.0, 60.0 * n, 50.0, 1800.0)
        for n in range(6)
    )
    server = np.add.outer(np.arange(rows), np.arange(cols)) % 6
    plan, ids, path = CellPlan(CRS, cells), [cell.id for cell in cells], tmp_path / "map.png"
    save(plot_best_server(server, ids, lattice, plan, BaseMap(lattice.bounds_m)), path)
    assert (imread(path)[:, :3, :3] == 1.0).all()


def test_no_bias_has_no_sign(tmp_path, monkeypatch):
    told = []
    monkeypatch.setattr("matplotlib.axes.Axes.text", lambda *args, **_: told.append(args[3]))
    measured = np.array([-80.0, -70.0, -60.0, -50.0])
    predicted = measured + 0.005
    save(plot_left_out(measured, predicted), tmp_path / "left-out.png")
    assert "bias 0.0 dB" in told[0]
    save(plot_left_out(measured, predicted + 1.0), tmp_path / "left-out.png")
    assert "bias \N{MINUS SIGN}1.0 dB" in told[1]


@pytest.mark.parametrize("rows", [40, 1000])
def test_a_cell_is_named_deep_in_its_own_area(rows):
    """Cell 0 lies about cell 1, whose middle is its median, and has a thin arm besides."""
    lattice = Lattice(CRS, 565_000.0, 5_934_000.0, 5.0, rows, rows)
    server = np.zeros((rows, rows), dtype=int)
    server[rows // 8 : -rows // 8, rows // 4 :] = 1
    server[rows // 2, rows // 2 :] = 0
    plan = CellPlan(CRS, ())
    axes = plot_best_server(server, ["A", "B"], lattice, plan, BaseMap(lattice.bounds_m))
    places = {text.get_text(): text.get_position() for text in axes.texts}
    unit_m = 5.0 * rows / 1000 if 5.0 * rows >= 1000 else 5.0 * rows
    x, y = np.array(places["A"]) / unit_m
    # The widest part of cell 0 is the quarter at the left; the middle of its height is at 1/2.
    assert x == pytest.approx(1 / 8, abs=1 / 16)
    assert y == pytest.approx(1 / 2, abs=1 / 8)
    x, y = np.array(places["B"]) / unit_m
    assert (x > 1 / 4) & (abs(y - 1 / 2) > 1 / 16)


def test_only_named_cells_are_looked_at_each_in_its_own_window(monkeypatch):
    """A thousand cells, many of them of one pixel, cost no pass over the raster each."""
    lattice = Lattice(CRS, 565_000.0, 5_934_000.0, 5.0, 1200, 1200)
    server = np.add.outer(40 * (np.arange(1200) // 40), np.arange(1200) // 40).astype(np.int16)
    server = np.minimum(server, 799)
    ids = [f"S{number}" for number in range(1000)]
    row, col = np.divmod(np.arange(200), 20)
    server[60 * row + 31, 60 * col + 31] = 800 + np.arange(200)
    west, _, _, north = lattice.bounds_m
    indoor = Cell(
        "S799", "S", west + 300.0, north - 300.0, 3.0, None, 20.0, 1800.0, "omni", indoor=True
    )
    looked, whole = [], network._deepest
    monkeypatch.setattr(network, "_deepest", lambda own: looked.append(own.shape) or whole(own))
    plot_best_server(server, ids, lattice, CellPlan(CRS, (indoor,)), BaseMap(lattice.bounds_m))
    # Sixty are named, but the largest, an indoor cell, at its mark.
    assert len(looked) == 59
    assert max(max(shape) for shape in looked) <= 40


@pytest.mark.parametrize("at", [(0, 0), (601, 803), (1199, 1199)])
def test_a_cell_of_one_pixel_is_named_there(at):
    lattice = Lattice(CRS, 565_000.0, 5_934_000.0, 5.0, 1200, 1200)
    server = np.zeros((1200, 1200), dtype=np.int8)
    server[at] = 1
    base = BaseMap(lattice.bounds_m)
    axes = plot_best_server(server, ["A", "B"], lattice, CellPlan(CRS, ()), base)
    (place,) = [text.get_position() for text in axes.texts if text.get_text() == "B"]
    frame = local_frame(base)
    np.testing.assert_allclose(place, np.array(frame(*lattice.east_north(*at))))
