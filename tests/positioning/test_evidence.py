"""Reports made ready for the map filter, in a database on disk."""

import numpy as np
import pytest
from cross_world import make_database
from small_area import make_area

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.sources.evidence_options import EvidenceOptions
from mapfilter.positioning.bayes.sources.radio import RadioSource
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


def first_of(*rows):
    """Read a first report of (role, cell)."""
    report = Epoch(0.0, radio=tuple(ReportRow(*row, None, None, -70.0, 0) for row in rows))
    return RadioSource(make_area(), EvidenceOptions()).first(report)


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        (("serving", "unknown"), Reason.UNKNOWN_CELL),
        (("serving", "E"), Reason.NO_POINTS_IN_CELL),
        (("serving", None), Reason.NO_SERVING_CELL),
        (("neighbour", "A"), Reason.NO_SERVING_CELL),
    ],
)
def test_a_report_without_a_usable_serving_cell_has_band_minus_one_and_a_reason(row, reason):
    update = first_of(row, ("neighbour", "B"))
    assert update.reason is reason
    assert update.radio.serving == -1
    assert np.isnan(update.radio.timing_advance)


def test_the_first_of_several_serving_cells_counts():
    update = first_of(("serving", "B"), ("neighbour", "A"), ("serving", "C"), ("serving", "D"))
    assert (update.reason, update.radio.serving) == (Reason.USED, 1)
    assert [(one.what, one.reason) for one in update.unused] == [
        ("C", Reason.SECOND_SERVING_CELL), ("D", Reason.SECOND_SERVING_CELL),
    ]  # fmt: skip
    assert first_of().reason is Reason.NO_READING
