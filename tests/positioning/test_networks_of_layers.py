"""Walks in a network of several carriers or technologies, over the database of all of them.

The cells that serve are those of a made town; of another layer stronger ones stand at the same
masts, of which the phone says nothing. So positions are those of the town alone.
"""

from dataclasses import replace

import numpy as np
import pytest
from made_town import CRS, FLOOR_DBM, NAMES, Town, slowed, walk_log

from mapfilter.database.field import RadioField
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.estimate import Status
from mapfilter.positioning.loop import locate
from mapfilter.radio.cells import CellPlan

OPTIONS = BayesFilter(max_particles=3000, min_search_particles=3000, min_particles=1500)
TOWN = Town.of(3)
OTHERS = {"another technology": ("GSM", None), "another carrier": ("LTE", 6300)}


def area_of(town, other=None):
    """Return the town's area; with an other layer of cells that are 25 dB stronger everywhere."""
    own = town.area()
    cells = tuple(replace(cell, technology="LTE", arfcn=1300) for cell in town.plan().cells)
    level = own.level_dbm[..., : len(NAMES)].copy()
    level[level < FLOOR_DBM] = np.nan
    if other is not None:
        technology, arfcn = other
        cells += tuple(
            replace(cell, id=f"{cell.id}2", technology=technology, arfcn=arfcn) for cell in cells
        )
        level = np.concatenate([level, level + 25], axis=-1)
    field = RadioField(
        own.lattice,
        tuple(cell.id for cell in cells),
        level,
        own.distance_m + np.float32(3.0),
        np.full_like(own.distance_m, 3.0),
        own.way_id,
        own.on_way,
    )
    return AreaMap.of_field(field, CellPlan(CRS, cells), FLOOR_DBM)


def located(log, area):
    return locate(log, OPTIONS.over_area(area), np.random.default_rng(5)).estimate


@pytest.mark.parametrize("levels", [True, False], ids=["levels", "serving cells only"])
@pytest.mark.parametrize("other", OTHERS.values(), ids=OTHERS)
def test_cells_of_a_layer_that_is_not_reported_change_nothing(other, levels):
    log = slowed(walk_log(TOWN, 4, 1200.0 if levels else 1800.0, levels=levels, error_db=2.0))
    alone, beside = located(log, area_of(TOWN)), located(log, area_of(TOWN, other))
    np.testing.assert_array_equal(beside.east_m, alone.east_m)
    np.testing.assert_array_equal(beside.north_m, alone.north_m)
    np.testing.assert_array_equal(beside.radii_m, alone.radii_m)
    assert beside.status == alone.status
    assert Status.TRACKING in alone.status


def test_a_phone_that_changes_its_carrier_is_followed():
    """Half of the way it is on the weaker carrier, half on the stronger one."""
    log = slowed(walk_log(TOWN, 4, error_db=2.0))
    radio = log.radio.copy()
    other = radio["time_s"].to_numpy() % 160 < 80
    radio.loc[other, "cell"] += "2"
    radio.loc[other, "level_dbm"] += 25.0
    found = located(replace(log, radio=radio), area_of(TOWN, OTHERS["another carrier"]))
    truth = log.truth
    off_m = np.hypot(
        found.east_m - np.interp(found.time_s, truth["time_s"], truth["east_m"]),
        found.north_m - np.interp(found.time_s, truth["time_s"], truth["north_m"]),
    )
    last = found.status[-30:]
    assert all(status.is_followed for status in last)
    # A corner may be one of a phone that was mirrored, until levels tell.
    assert last.count(Status.TRACKING) >= 20
    assert off_m[-30:].max() < 30.0
