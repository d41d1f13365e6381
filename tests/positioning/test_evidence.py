"""Reports made ready for the map filter."""

import numpy as np
from cross_world import make_database

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.evidence import EvidenceOptions, RadioHistory, reading_of
from mapfilter.positioning.bayes.options import open_area
from mapfilter.positioning.epochs import Epoch, ReportRow


def report(level_dbm):
    return Epoch(0.0, heard=(ReportRow("serving", "W", None, None, level_dbm, 0),))


def test_the_level_of_a_first_report_counts_as_it_is_and_of_a_second_its_news(tmp_path):
    area, options = open_area(make_database(tmp_path)), EvidenceOptions()
    memory, first, reason, unplaced = reading_of(
        area, options, RadioHistory.empty(len(area.cell_ids)), report(-70.0)
    )
    assert (reason, unplaced) == (Reason.USED, [])
    assert first.levels.offset_db.tolist() == [-70.0]
    assert first.levels.rho.tolist() == [0.0]
    memory = memory.moved(MotionStep(10.0, 0.0))
    _, second, _, _ = reading_of(area, options, memory, report(-75.0))
    rho = np.exp(-10.0 / options.levels.correlation_m)
    np.testing.assert_allclose(second.levels.rho, rho, rtol=1e-6)
    np.testing.assert_allclose(second.levels.offset_db, -75.0 + 70.0 * rho, rtol=1e-6)
    assert second.levels.scale[0] > first.levels.scale[0]
