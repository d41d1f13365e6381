"""Levels of an area in a view: the strongest of each layer, also where only some cells are held."""

from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.database.field import RadioField
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.viewing import ground
from mapfilter.viewing.arrays import unpacked
from mapfilter.viewing.ground import ViewFrame, level_fields

CRS, ROWS, COLS, FLOOR_DBM = "EPSG:32635", 20, 30, -110.0
NAMES = ("U1", "L1", "U2", "L2", "G1", "U3")
LAYERS = ("UMTS", "LTE", "UMTS", "LTE", "GSM", "UMTS")
FRAME = ViewFrame(CRS, 0.0, 0.0)


@pytest.fixture(scope="module")
def level_dbm():
    level = np.random.default_rng(4).uniform(-108, -50, (ROWS, COLS, len(NAMES)))
    level[level < -95] = np.nan
    return level.astype(np.float32)


def database(level_dbm, technologies=LAYERS):
    shape = level_dbm.shape[:2]
    zero = np.zeros(shape, dtype=np.float32)
    field = RadioField(
        Lattice(CRS, 0.0, 500.0, 25.0, *shape),
        NAMES,
        level_dbm,
        zero,
        zero,
        np.ones(shape, dtype=np.int64),
        np.ones(shape, dtype=np.bool_),
    )
    cells = (
        Cell(name, name, 0.0, 0.0, 30.0, None, 50.0, 900.0, "omni", technology=technology)
        for name, technology in zip(NAMES, technologies, strict=True)
    )
    plan = CellPlan(CRS, tuple(cells))
    return SimpleNamespace(floor_dbm=FLOOR_DBM, plan=plan, field=lambda _: field)


def by_hand(level_dbm, bands):
    """Strongest and second strongest level of some cells at each pixel."""
    found = np.full((2, ROWS, COLS), FLOOR_DBM - 6.0)
    for row, col in np.ndindex(ROWS, COLS):
        heard = sorted((x for x in level_dbm[row, col, bands] if np.isfinite(x)), reverse=True)
        found[: len(heard[:2]), row, col] = heard[:2]
    return found


def compare(levels, layer, expected):
    assert levels["layer"] == layer
    for name, values in zip(("best", "second"), zip(*expected, strict=True), strict=True):
        assert unpacked(levels[name]) == pytest.approx(np.array(values), abs=0.151)


def test_each_layer_has_its_strongest_levels(level_dbm):
    levels, bands = level_fields(database(level_dbm), FRAME, None)
    assert (list(bands), levels["complete"]) == (list(NAMES), True)
    expected = [by_hand(level_dbm, some) for some in ([0, 2, 5], [1, 3], [4])]
    compare(levels, [0, 1, 0, 1, 2, 0], expected)


def test_cells_that_are_left_out_still_compare_with_those_of_their_layer(level_dbm, monkeypatch):
    monkeypatch.setattr(ground, "_MOST_LEVELS", 2 * ROWS * COLS)
    levels, bands = level_fields(database(level_dbm), FRAME, None, {"L2", "G1"})
    assert (list(bands), levels["complete"]) == (["L2", "G1"], False)
    compare(levels, [0, 1], [by_hand(level_dbm, some) for some in ([1, 3], [4])])


def test_levels_beside_an_antenna_are_held_as_they_are(level_dbm):
    near = level_dbm + np.float32(45.0)
    levels, _ = level_fields(database(near), FRAME, None)
    found = np.moveaxis(unpacked(levels["level"]), 0, 2)
    assert np.array_equal(np.isnan(found), np.isnan(near))
    assert found == pytest.approx(near, abs=0.25, nan_ok=True)
    strongest = [by_hand(near, some)[0] for some in ([0, 2, 5], [1, 3], [4])]
    assert unpacked(levels["best"]) == pytest.approx(np.array(strongest), abs=0.25)


def test_one_layer_is_held_once(level_dbm):
    levels, _ = level_fields(database(level_dbm, [None] * len(NAMES)), FRAME, None)
    assert unpacked(levels["best"]).shape == (1, ROWS, COLS)
    compare(levels, [0] * len(NAMES), [by_hand(level_dbm, list(range(len(NAMES))))])
