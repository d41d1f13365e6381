"""What a filter without a map and without sites makes of a log with cells."""

import pandas as pd
import pytest

from mapfilter.positioning.kalman.siteless import needs_sites, without_cells
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"
TABLES = {
    "motion": {"time_s": [0.0, 1.0], "step_m": [1.4, 1.4], "heading_rad": [0.0, 0.0]},
    "gnss": {"time_s": [0.0], "east_m": [385_000.0], "north_m": [6_672_000.0]},
    "radio": {"time_s": [0.0, 0.0, 1.0], "role": ["serving", "neighbour", "serving"]},
    "tdoa": {
        "time_s": [0.0], "cell": ["a"], "reference": ["b"], "difference_m": [40.0], "sd_m": [10.0],
    },
}  # fmt: skip


def log_of(*tables):
    return make_log(CRS, **{name: pd.DataFrame(TABLES[name]) for name in tables})


@pytest.mark.parametrize(
    ("tables", "needed"),
    [
        (["radio"], True),
        (["tdoa"], True),
        (["radio", "tdoa", "motion"], True),
        (["radio", "gnss"], False),
        (["tdoa", "gnss", "motion"], False),
        (["gnss"], False),
        (["motion"], False),
    ],
)
def test_sites_are_needed_where_nothing_but_cells_could_tell_the_position(tables, needed):
    assert needs_sites(log_of(*tables)) is needed


def test_cells_are_left_out_with_a_note_on_each_table():
    log = log_of("motion", "gnss", "radio", "tdoa")
    bare = without_cells(log, "a plan")
    assert (len(bare.radio), len(bare.tdoa)) == (0, 0)
    assert list(bare.radio) == list(log.radio)
    assert (len(bare.motion), len(bare.gnss)) == (2, 1)
    assert bare.notes == (
        *log.notes,
        "3 rows of cells (radio) and 1 time difference (tdoa) left out: their sites are unknown "
        "without a plan",
    )
    one = without_cells(log_of("gnss", "tdoa"), "a database")
    *_, note = one.notes
    assert note.startswith("1 time difference (tdoa) left out: ")
    assert note.endswith(" without a database")


def test_a_log_without_cells_stays_as_it_is():
    log = log_of("motion", "gnss")
    assert without_cells(log, "a plan") is log
