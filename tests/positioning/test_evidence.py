"""Reports made ready for the map filter, in a database on disk."""

import numpy as np
import pytest
from cross_world import make_database
from small_area import make_area

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.options import open_area
from mapfilter.positioning.bayes.radio import EvidenceOptions, RadioSource
from mapfilter.positioning.bayes.state import DeadReckoning
from mapfilter.positioning.epochs import Epoch, ReportRow


def report(level_dbm):
    return Epoch(0.0, radio=(ReportRow("serving", "W", None, None, level_dbm, 0),))


def test_levels_are_as_reported_and_the_state_is_where_the_last_report_was_used(tmp_path):
    area = open_area(make_database(tmp_path))
    source = RadioSource(area, EvidenceOptions())
    update = source.first(report(-70.0))
    first = update.radio
    assert (update.reason, update.unused, update.state) == (Reason.USED, [], DeadReckoning())
    assert first.levels.level_dbm.tolist() == [-70.0]
    assert first.levels.cell.tolist() == [area.band_of["W"]]
    moved = DeadReckoning().moved(MotionStep(10.0, 0.0))
    again = source.read(update.state, moved, report(-75.0), 5.0)
    assert again.state is moved
    assert again.radio.levels.level_dbm.tolist() == [-75.0]
    assert (first.length_m, again.radio.length_m) == (0.0, 10.0)
    near = source.read(update.state, moved, report(-75.0), 1.5).radio
    assert near.levels.offset_db < again.radio.levels.offset_db
    # The street of the made cross is a residential one: 7 m to each side are on it.
    assert np.all(area.distance_m[area.on_way] == 0)
    assert area.distance_m[30 + 4, 60] == 4 * 5.0 - 7.0


@pytest.mark.parametrize(
    ("role", "cell"), [("serving", "unknown"), ("serving", "E"), ("neighbour", "A")]
)
def test_a_report_without_a_usable_serving_cell_has_band_minus_one(role, cell):
    """Unknown, nowhere received, or none at all."""
    rows = (
        ReportRow(role, cell, None, None, -70.0, 0),
        ReportRow("neighbour", "B", None, None, -75.0, 0),
    )
    reading = RadioSource(make_area(), EvidenceOptions()).first(Epoch(0.0, radio=rows)).radio
    assert reading.serving == -1
    assert np.isnan(reading.timing_advance)
