"""The seam from options to a function that locates logs."""

import numpy as np
from cross_world import make_database, walk_log

from mapfilter.evaluation.accuracy import Truth, accuracy
from mapfilter.filters.candidate import CandidateOptions
from mapfilter.positioning.candidate import cell_points, position_by_candidates
from mapfilter.positioning.locators import FilterChoice, open_locator

OPTIONS = CandidateOptions(update_length_m=20.0)


def test_a_locator_locates_as_its_filter(tmp_path):
    database, log = make_database(tmp_path), walk_log()
    rng = np.random.default_rng(0)
    directly = position_by_candidates(database, cell_points(database, 0.0), log, OPTIONS, rng)
    choice = FilterChoice(OPTIONS, margin_db=0.0)
    for ways in (True, False):
        found = open_locator(database, choice, ways=ways)(log, rng).estimate
        assert found.filter == choice.name == "candidate"
        assert found.status == directly.estimate.status
        np.testing.assert_array_equal(found.east_m, directly.estimate.east_m)
        assert bool(found.way_id.any()) is ways
        truth = Truth(*(log.truth[name].to_numpy() for name in ("time_s", "east_m", "north_m")))
        assert accuracy(found, truth).switched
