"""What reports say of the null hypothesis, step by step on a made town."""

import numpy as np
import pytest
from made_town import Town

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Epoch, ReportRow

CELLS = tuple("ABCDEFG")
AREA = BayesFilter().over_area(Town.of(1).area())
STEP = (MotionStep(30.0, 0.0),)


def report(*levels_dbm):
    rows = zip(CELLS, levels_dbm, strict=False)
    return tuple(
        ReportRow("serving" if cell == "A" else "neighbour", cell, None, None, level, 0)
        for cell, level in rows
    )


def test_levels_of_an_earlier_report_do_not_count_again_with_a_serving_cell_alone():
    rng = np.random.default_rng(1)
    state = AREA.begin_at(500_450.0, 4_500_450.0, 5.0, rng)
    levels = report(-75.0, -82.0, -88.0, -90.0, -93.0, -95.0, -97.0)
    state, _ = AREA.step(state, Epoch(1.0, STEP, levels), rng)
    of_levels = state.belief.shared.other_log_likelihood
    assert of_levels < -4.0
    alone = (ReportRow("serving", "A", None, None, np.nan, 0),)
    after, output = AREA.step(state, Epoch(30.0, STEP, alone), rng)
    assert output.fix.reason is Reason.USED
    assert after.null.log_odds == pytest.approx(state.null.log_odds, abs=2.0)
