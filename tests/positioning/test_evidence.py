"""Reports made ready for the map filter."""

import numpy as np
from cross_world import make_database

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.options import open_area
from mapfilter.positioning.bayes.radio import EvidenceOptions, RadioSource
from mapfilter.positioning.bayes.state import DeadReckoning
from mapfilter.positioning.epochs import Epoch, ReportRow


def report(level_dbm):
    return Epoch(0.0, radio=(ReportRow("serving", "W", None, None, level_dbm, 0),))


def test_the_level_of_a_first_report_counts_as_it_is_and_of_a_second_its_news(tmp_path):
    options = EvidenceOptions()
    source = RadioSource(open_area(make_database(tmp_path)), options)
    update = source.first(report(-70.0))
    first = update.radio
    assert (update.reason, update.unused) == (Reason.USED, [])
    assert first.levels.offset_db.tolist() == [-70.0]
    assert first.levels.rho.tolist() == [0.0]
    moved = DeadReckoning().moved(MotionStep(10.0, 0.0))
    second = source.read(update.state, moved, report(-75.0), 5.0).radio
    rho = np.exp(-10.0 / options.levels.correlation_m)
    np.testing.assert_allclose(second.levels.rho, rho, rtol=1e-6)
    np.testing.assert_allclose(second.levels.offset_db, -75.0 + 70.0 * rho, rtol=1e-6)
    assert second.levels.scale[0] > first.levels.scale[0]
