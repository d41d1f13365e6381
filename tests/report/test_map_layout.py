"""Maps keep their labels within the picture, however wide map and legend are."""

import numpy as np
import pytest
from matplotlib.image import imread

from mapfilter.geodesy import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.report.basemap import BaseMap
from mapfilter.report.canvas import save
from mapfilter.report.network import plot_best_server
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
