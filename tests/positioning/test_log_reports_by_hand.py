"""True positions of a log's reports, and what its rows state besides levels."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.positioning.fingerprints.log_reports import reports_of_log
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"


def log(times_s, known_s, **columns):
    count = len(times_s)
    radio = {"time_s": times_s, "role": ["serving"] * count, "cell": list("abcdefgh")[:count],
             "level_dbm": [-70.0] * count} | columns  # fmt: skip
    known_s = np.array(known_s, dtype=float)
    truth = {"time_s": known_s, "east_m": 10.0 * known_s, "north_m": 5.0 - known_s}
    return make_log(CRS, radio=pd.DataFrame(radio), truth=pd.DataFrame(truth))


@pytest.mark.parametrize(
    ("time_s", "known"),
    [
        # At 0, 30, 60.5 and 70 s the position is known.
        (-0.5, False), (0.0, True), (12.0, True), (30.0, True), (30.5, False), (60.0, False),
        (60.5, True), (65.0, True), (70.0, True), (70.5, False),
    ],
)  # fmt: skip
def test_a_report_is_between_two_true_positions_of_half_a_minute_at_most(time_s, known):
    found = reports_of_log(log([time_s], [0.0, 30.0, 60.5, 70.0]))
    expected = [10.0 * time_s, 5.0 - time_s] if known else [np.nan, np.nan]
    np.testing.assert_allclose(found.places, [expected])


def test_at_a_true_position_none_other_is_needed():
    for time_s in (0.0, 100.0, 200.0):
        found = reports_of_log(log([time_s], [0.0, 100.0, 200.0]))
        assert found.places.tolist() == [[10.0 * time_s, 5.0 - time_s]]


def test_without_a_true_position_places_are_unknown():
    assert np.isnan(reports_of_log(log([3.0], [])).places).all()


def test_a_log_is_of_no_block_unless_stated():
    given = log([0.0, 5.0], [])
    assert reports_of_log(given).block.tolist() == [-1, -1]
    assert reports_of_log(given, 7).block.tolist() == [7, 7]


def test_a_log_without_rows_has_no_reports():
    found = reports_of_log(log([], []))
    assert (len(found), found.first.tolist(), found.cell_ids) == (0, [0], ())


def test_rows_that_state_no_bound_are_none():
    censored = pd.array([-1, None, 1], dtype="Int64")
    found = reports_of_log(log([0.0, 5.0, 9.0], [], censored=censored))
    assert found.censored.tolist() == [-1, 0, 1]
    assert reports_of_log(log([0.0, 5.0], [])).censored.tolist() == [0, 0]


def test_beacons_among_others_count_by_their_mean_level():
    """Advertised three times in a scan, beside an access point that is there once."""
    given = log(
        [0.0, 0.1, 0.2, 0.3], [], role=["neighbour"] * 4, cell=["t", "t", "w", "t"],
        level_dbm=[-60.0, -64.0, -50.0, -71.0], technology=["BLE", "BLE", "WLAN", "BLE"],
    )  # fmt: skip
    found = reports_of_log(given)
    assert [found.cell_ids[k] for k in found.cell] == ["t", "w"]
    assert found.level_dbm.tolist() == [-65.0, -50.0]


def test_levels_that_fill_in_for_cells_that_were_not_received_are_none():
    """Tables of some programs have each cell at each time."""
    times_s = np.repeat(5.0 * np.arange(12), 2)
    level = np.where(np.arange(24) % 2, -140.0, -60.0 - np.arange(24))
    columns = {"role": ["serving", "neighbour"] * 12, "cell": ["a", "b"] * 12}
    found = reports_of_log(log(times_s, [], level_dbm=level, **columns))
    np.testing.assert_array_equal(found.level_dbm, level[::2])
    assert found.cell_ids == ("a",)
    assert found.notes == (
        "12 readings left out: -140 dBm, far below all others (likely: what stands for a cell "
        "that was not received)",
    )
    # Weak ones that go on below others, and a few far below, are levels.
    near = np.where(level == -140, -86.0, level)
    few = np.where(np.arange(24) < 18, near, level)
    for kept in (near, few):
        found = reports_of_log(log(times_s, [], level_dbm=kept, **columns))
        np.testing.assert_array_equal(np.sort(found.level_dbm), np.sort(kept))


def test_of_several_serving_cells_of_a_report_the_first_counts():
    """A phone with cells of two technologies has the timing advance of the first."""
    found = reports_of_log(
        log(
            [0.0, 0.0, 0.0, 5.0, 5.0], [],
            cell=["lte", "nr", "far", None, "nr"],
            role=["serving", "serving", "neighbour", "serving", "serving"],
            technology=["LTE", "NR", "LTE", "LTE", "NR"],
            timing_advance=pd.array([5, None, None, 7, 3], dtype="Int64"),
        )
    )  # fmt: skip
    assert [found.cell_ids[number] for number in found.serving] == ["lte", "nr"]
    assert found.timing_advance.tolist() == [5.0, 3.0]
