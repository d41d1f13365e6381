"""Levels on a page: those of each cell, and of each layer the two strongest."""

from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.database.field import RadioField
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.viewing.arrays import unpacked
from mapfilter.viewing.ground import ViewFrame, level_fields

CRS, FLOOR_DBM, QUIET_DBM = "EPSG:32635", -110.0, -116.0
LATTICE = Lattice(CRS, 385_400.0, 6_671_700.0, 5.0, 4, 5)
ARFCN = {"A": 100, "B": 100, "C": 3050, "D": 100}


def database(names):
    rng = np.random.default_rng(1)
    level_dbm = np.round(rng.uniform(-108.0, -60.0, (4, 5, len(names))) * 2) / 2
    level_dbm[1, 2, 0] = np.nan
    near = np.zeros((4, 5), dtype=np.float32)
    way = near.astype(np.int64)
    field = RadioField(LATTICE, names, level_dbm.astype("f4"), near, near, way, way == 0)
    cells = tuple(
        Cell(n, n, 0.0, 0.0, 30.0, None, 30.0, 1800.0, "omni", technology="LTE", arfcn=ARFCN[n])
        for n in names
    )
    return SimpleNamespace(
        field=lambda _: field, floor_dbm=FLOOR_DBM, plan=CellPlan(CRS, cells)
    ), level_dbm


@pytest.mark.parametrize(
    ("names", "layers"), [("ABCD", [0, 0, 1, 0]), ("ABD", [0, 0, 0]), ("C", [0])]
)
def test_of_each_layer_the_two_strongest_levels_are_in_a_page(names, layers):
    made, level_dbm = database(tuple(names))
    found, bands = level_fields(made, ViewFrame(CRS, 385_400.0, 6_671_680.0), None)
    assert (found["layer"], list(bands)) == (layers, list(names))
    heard = np.where(np.isnan(level_dbm), QUIET_DBM, level_dbm)
    for name, place in (("best", 0), ("second", 1)):
        shown = unpacked(found[name]).reshape(-1, 4, 5)
        assert shown.shape[0] == max(layers) + 1
        for layer, row, col in np.ndindex(shown.shape):
            own = [heard[row, col, k] for k in range(len(names)) if layers[k] == layer]
            expected = sorted([*own, QUIET_DBM, QUIET_DBM], reverse=True)[place]
            value = shown[layer, row, col]
            assert (QUIET_DBM if np.isnan(value) else value) == pytest.approx(expected, abs=0.25)
