"""Neighbours reported by carrier and code, which far cells share: they weigh as named ones do."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from made_town import CRS, FLOOR_DBM, NAMES, WEST_M, Town, slowed, walk_log

from mapfilter.database.field import RadioField
from mapfilter.filters.contract import Status
from mapfilter.models.fingerprint import BoundReading, bound_table, weigh_by_bound
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.sources.evidence import RadioReading, bound_under_null
from mapfilter.positioning.merging import epochs
from mapfilter.radio.cells import Cell, CellPlan

SD_DB, WEIGHT = 8.0, 0.4


def ambiguous(level_dbm, count, censored=0):
    return BoundReading(np.arange(count, dtype=np.int32), level_dbm, censored, SD_DB, WEIGHT)


def on_the_map(bound, expected_dbm):
    """Log-likelihood where the first cell is expected at a level, and the others not at all."""
    expected = np.full(bound.cells.size, -200.0, dtype=np.float32)
    expected[0] = expected_dbm
    found = np.zeros(1)
    pixel = np.zeros(1, dtype=np.int32)
    weigh_by_bound(pixel, expected, bound.cells.size, bound, bound_table(), found)
    return float(found[0])


@pytest.mark.parametrize("count", [2, 5, 12])
@pytest.mark.parametrize("error_db", [0.0, 8.0, -14.0])
def test_cells_elsewhere_speak_neither_for_nor_against_the_map(count, error_db):
    level_dbm = -84.0
    one, several = ambiguous(level_dbm, 1), ambiguous(level_dbm, count)
    alone = on_the_map(one, level_dbm - error_db) - bound_under_null(one)
    among = on_the_map(several, level_dbm - error_db) - bound_under_null(several)
    # Each of the others is given the likelihood of four standard deviations.
    rest = WEIGHT * np.log1p((count - 1) * np.exp(-8.0 + 0.5 * (error_db / SD_DB) ** 2))
    assert among == pytest.approx(alone + rest, abs=2e-4)


def test_a_level_that_fits_favours_the_map_and_one_that_does_not_the_opposite():
    bound = ambiguous(-80.0, 8)
    assert on_the_map(bound, -80.0) - bound_under_null(bound) > 0.6 * WEIGHT
    assert on_the_map(bound, -110.0) - bound_under_null(bound) < -4 * WEIGHT


def test_under_the_null_hypothesis_levels_are_those_that_phones_report():
    # Up to the peak of the map's own density, which is 1: a normal density of 17 dB, for 8 cells.
    level_dbm = np.linspace(-200.0, 20.0, 4001)
    density = [np.exp(bound_under_null(ambiguous(x, 8)) / WEIGHT) for x in level_dbm]
    total = np.trapezoid(density, level_dbm) * 8 / (SD_DB * np.sqrt(2 * np.pi))
    assert total == pytest.approx(1.0, abs=1e-6)
    assert level_dbm[np.argmax(density)] == pytest.approx(-90.0)


def test_an_end_of_the_scale_is_as_probable_as_on_the_map():
    assert bound_under_null(ambiguous(-110.5, 1, censored=-1)) == 0.0
    several = (ambiguous(-80.0, 3), ambiguous(-47.5, 1, censored=1), ambiguous(-95.0, 2))
    expected = bound_under_null(several[0]) + bound_under_null(several[2])
    reading = RadioReading(bounds=several)
    assert reading.radio_under_null(-1.5) == pytest.approx(-1.5 + expected)


def with_namesakes(town, each):
    """Return a town's area in a network that gives each of its codes to so many more cells."""
    area, plan, lattice = town.area(), town.plan(), town.area().lattice
    cells = [replace(cell, arfcn=600, bsic=k) for k, cell in enumerate(plan.cells)]
    far = [
        Cell(f"{name}{n}", name, WEST_M + 9e3 * n, 4.5e6, 30.0, None, 50.0, 900.0, "omni",
             arfcn=600, bsic=k)
        for k, name in enumerate(NAMES) for n in range(1, each + 1)
    ]  # fmt: skip
    level = area.level_dbm[..., : len(NAMES)]
    level = np.where(level >= FLOOR_DBM, level, np.nan)
    unheard = np.full((*level.shape[:2], len(far)), np.nan, dtype=np.float32)
    names = (*NAMES, *(cell.id for cell in far))
    ways = area.distance_m + np.float32(3.0), np.full_like(area.distance_m, 3.0)
    way = np.ones(level.shape[:2], dtype=np.int64)
    levels = np.concatenate([level, unheard], axis=-1).astype(np.float32)
    field = RadioField(lattice, names, levels, *ways, way, area.on_way)
    return AreaMap.of_field(field, CellPlan(CRS, (*cells, *far)), FLOOR_DBM)


def by_code(log):
    """Return a log whose neighbours have a carrier and a code instead of a name."""
    radio = log.radio.copy()
    beside = (radio["role"] == "neighbour").to_numpy()
    code = radio["cell"].map({name: k for k, name in enumerate(NAMES)})
    radio["arfcn"] = pd.array(np.where(beside, 600, -1), dtype="Int64")
    radio["bsic"] = pd.array(code.to_numpy(), dtype="Int64")
    radio.loc[beside, "cell"] = None
    radio.loc[~beside, ["arfcn", "bsic"]] = pd.NA
    return replace(log, radio=radio)


@pytest.mark.parametrize("each", [0, 7])
def test_walks_are_tracked_where_codes_are_used_again_far_away(each):
    """Most of eight walks, and none wrongly; without a counterpart of the namesakes it was none."""
    town, found = Town.of(3), []
    few = BayesFilter(
        max_particles=5000, min_search_particles=3000, min_particles=800, claim_mass=0.95
    )
    positioner = few.over_area(with_namesakes(town, each))
    for seed in range(21, 29):
        log = by_code(slowed(walk_log(town, seed, error_db=3.0)))
        rng, state = np.random.default_rng(5), positioner.begin()
        for epoch in epochs(log):
            state, output = positioner.step(state, epoch, rng)
        end = log.truth.iloc[-1]
        away_m = np.hypot(output.fix.east_m - end["east_m"], output.fix.north_m - end["north_m"])
        if output.fix.status is Status.TRACKING:
            found.append(away_m)
    assert len(found) >= 5
    assert max(found) < 30.0
