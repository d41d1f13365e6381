"""One cell of which the prediction is wrong must not lead a belief astray."""

from dataclasses import replace
from math import log

import numpy as np
import pytest
from small_area import BANDS, LEVEL_DBM, OPTIONS, PIXEL_M, ROWS, make_area

from mapfilter.filters.belief_models import Cloud
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.street_motion import EAST, NORTH, STATES
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.sources.evidence import RadioReading

ROTATED = BANDS["B"]
SOUND = tuple(band for name, band in BANDS.items() if name != "B")
REPORTS, SPACING_M = 25, 10.0


def log_weights(fault_probability, *, levels):
    """Of every pixel, after reports from one where B is heard 40 dB too strong, and serves."""
    errors = replace(
        OPTIONS.levels, fault_probability=fault_probability, fault_m=300.0, slow_db=4.0, weight=1.0
    )
    model = BayesModel(make_area(), evidence=replace(OPTIONS, levels=errors))
    here = truth()
    row, col = np.divmod(np.arange(LEVEL_DBM[..., 0].size), LEVEL_DBM.shape[1])
    state = np.zeros((STATES, row.size), dtype=np.float32)
    state[EAST], state[NORTH] = (col + 0.5) * PIXEL_M, (ROWS - row - 0.5) * PIXEL_M
    cloud, found = Cloud(state, np.empty((0, row.size), np.float32)), np.zeros(row.size)
    level_dbm = LEVEL_DBM[here].astype(np.float32)
    level_dbm[ROTATED] = level_dbm.max() + 15.0
    report = LevelReport(
        np.array([ROTATED, *SOUND], dtype=np.int32),
        level_dbm[[ROTATED, *SOUND]],
        np.zeros(0, dtype=np.int32),
        np.zeros(0, dtype=np.float32),
        0.0,
    )
    for k in range(REPORTS):
        length_m = SPACING_M if k else 0.0
        reading = RadioReading(ROTATED, 0.4, report if levels else None, length_m=length_m)
        cloud, _ = model.weigh(cloud, found, reading)
    at = here[0] * LEVEL_DBM.shape[1] + here[1]
    return found - found[at], cloud


def truth():
    """The pixel where B is far weaker than another cell, and all four are heard."""
    gap = LEVEL_DBM[..., SOUND].max(axis=-1) - LEVEL_DBM[..., ROTATED]
    heard = (LEVEL_DBM > -108).all(axis=-1)
    return tuple(int(i) for i in np.unravel_index(np.argmax(np.where(heard, gap, 0)), gap.shape))


@pytest.mark.parametrize("levels", [True, False])
def test_with_faults_in_mind_the_truth_is_not_given_up(levels):
    """A reading then costs what one without meaning does, instead of what contradicts the map."""
    without, _ = log_weights(1e-300, levels=levels)
    within, cloud = log_weights(0.06, levels=levels)
    # A fault costs log(0.06) once, and then each reading of the serving cell 0.7 at full weight.
    serving = -log(0.06) + REPORTS * 0.4 * OPTIONS.serving.fault_nats
    assert within.max() < serving + (2.0 if levels else 0.0)
    assert without.max() > 3 * within.max()
    memory = cloud.shared
    row, col = truth()
    odds = memory.fault_odds(ROTATED, cloud.kept)[row * LEVEL_DBM.shape[1] + col]
    assert odds == pytest.approx(8.0)


def test_a_cell_that_is_right_keeps_its_odds_low():
    _, cloud = log_weights(0.06, levels=True)
    row, col = truth()
    for band in SOUND:
        odds = cloud.shared.fault_odds(band, cloud.kept)[row * LEVEL_DBM.shape[1] + col]
        assert odds < -2.7
