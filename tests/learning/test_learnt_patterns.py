"""Levels of sectors with another azimuth, on masts of one band and of several."""

import numpy as np
import pytest
from learning_world import CRS, EAST, NORTH

from mapfilter.learning.patterns import Patterns
from mapfilter.radio.cells import Cell, CellPlan

LOSS_DB = {900.0: 100.0, 940.0: 100.0, 1800.0: 112.0}
AROUND = np.array([(0.0, 300.0), (300.0, 0.0), (0.0, -300.0), (-300.0, 0.0)])


def patterns_of(*sectors):
    cells = tuple(
        Cell(f"{mhz:g}-{azimuth:g}", "S", EAST, NORTH, 30.0, azimuth, 60.0, mhz)
        for mhz, azimuth in sectors
    )
    plan = CellPlan(CRS, cells)
    east_m, north_m = EAST + AROUND[:, 0], NORTH + AROUND[:, 1]
    free = Patterns(plan, east_m, north_m, np.zeros((4, len(cells))), -110.0)
    level_dbm = [
        cell.eirp_dbm - LOSS_DB[cell.frequency_mhz] + free.gain_db(cell, cell.azimuth_deg)
        for cell in cells
    ]
    return Patterns(plan, east_m, north_m, np.column_stack(level_dbm), -110.0)


@pytest.mark.parametrize("turn_deg", [0.0, 90.0, 180.0])
@pytest.mark.parametrize(
    "sectors",
    [
        [(900.0, 0.0), (900.0, 180.0)],
        # Sectors with carriers of their own have the loss of one band.
        [(900.0, 0.0), (940.0, 180.0)],
        # Those of another band, which point the same way, come first.
        [(900.0, 0.0), (900.0, 180.0), (1800.0, 0.0), (1800.0, 180.0)],
        [(1800.0, 0.0), (900.0, 0.0), (1800.0, 180.0), (900.0, 180.0)],
    ],
)
def test_a_turned_sector_has_the_loss_of_its_band(sectors, turn_deg):
    patterns = patterns_of(*sectors)
    for number, cell in enumerate(patterns.plan.cells):
        azimuth_deg = cell.azimuth_deg + turn_deg
        gain_db = patterns.gain_db(cell, azimuth_deg)
        expected = cell.eirp_dbm - LOSS_DB[cell.frequency_mhz] + gain_db
        np.testing.assert_allclose(patterns.turned(number, azimuth_deg), expected)


def test_where_no_sector_of_a_band_is_received_the_level_stays_unknown():
    patterns = patterns_of((900.0, 0.0), (1800.0, 0.0), (1800.0, 180.0))
    patterns.level_dbm[1, 1:] = np.nan
    turned = patterns.turned(1, 90.0)
    assert np.isnan(turned).tolist() == [False, True, False, False]
    assert np.isfinite(patterns.turned(0, 90.0)).all()
