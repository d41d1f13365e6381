"""Reports over those transmitters only that were received, and those with a position."""

import numpy as np
from made_fingerprints import CRS

from mapfilter.positioning.fingerprints.reports import Reports


def reports(cell, first, east_m):
    count, cell = len(first) - 1, np.array(cell, dtype=np.int32)
    serving = np.array([2] + [-1] * (count - 1), np.int32)
    return Reports(
        CRS, ("A", "B", "C", "D"), np.array(first), cell, -60.0 - np.arange(len(cell)),
        np.zeros(len(cell)), np.zeros(len(cell), np.int8), serving,
        np.full(count, np.nan), np.arange(float(count)), np.array(east_m), np.zeros(count),
        np.full(count, -1, np.int32),
    )  # fmt: skip


def test_a_transmitter_that_was_received_once_stays():
    given = reports([2, 0, 2], [0, 2, 3], [1.0, 2.0])
    found = given.compact()
    assert found.cell_ids == ("A", "C")
    assert found.cell.tolist() == [1, 0, 1]
    assert found.serving.tolist() == [1, -1]
    np.testing.assert_array_equal(found.level_dbm, given.level_dbm)
    whole = reports([3, 0, 2, 1], [0, 4], [1.0])
    assert whole.compact() is whole


def test_reports_without_a_position_or_a_reading_are_left_out():
    given = reports([2, 0, 2, 3], [0, 2, 2, 3, 4], [1.0, 2.0, 3.0, np.nan])
    found = given.placed()
    assert len(found) == 2
    assert found.east_m.tolist() == [1.0, 3.0]
    assert found.cell_ids == ("A", "C")
    assert found.notes == ("2 reports left out: no position, or nothing received",)
    assert reports([0, 1, 2, 3], [0, 2, 4], [1.0, 2.0]).placed().notes == ()
