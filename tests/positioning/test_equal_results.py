"""What a filter returns is compared by its contents, also where these are arrays."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from cross_world import make_database, walk_tables

import mapfilter as mf
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Estimate
from mapfilter.positioning.filter import Hypotheses

SMALL = mf.BayesFilter(max_particles=600, min_search_particles=300, min_particles=200)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    database = make_database(tmp_path_factory.mktemp("cross"))
    made = {name: table.iloc[:30] for name, table in walk_tables().items()}
    log = mf.make_log(database.lattice.crs, **made)
    track = mf.locate(log, database, SMALL, snapshots=True)
    positioner = SMALL.over(database)
    _, output = positioner.step(positioner.begin(), mf.epochs(log)[0], np.random.default_rng(0))
    return {
        "track": track.estimate,
        "positioned": track.positioned,
        "snapshot": track.positioned.snapshots[0],
        "output": output,
        "fix": output.fix,
        "nowhere": mf.Fix.nowhere(0.0, mf.Status.SEARCHING, output.fix.reason),
        "truth": Truth.of_table(log.truth),
        "hypotheses": Hypotheses(*np.ones((3, 2))),
        "estimate": Estimate(1.0, float("nan"), np.eye(2), np.ones(3)),
    }


CHANGED = {
    "track": {"filter": "other"},
    "positioned": {"snapshots": ()},
    "snapshot": {"weight": np.zeros(3)},
    "output": {"unused": ("other",)},
    "fix": {"radii_m": np.zeros(3)},
    "nowhere": {"radii_m": np.zeros(3)},
    "truth": {"east_m": np.zeros(30)},
    "hypotheses": {"weight": np.array([1.0, 0.0])},
    "estimate": {"radii_m": np.array([1.0, 1.0, 2.0])},
}


@pytest.mark.parametrize("name", CHANGED)
def test_equal_contents_are_equal(results, name):
    given = results[name]
    again = copy.deepcopy(given)
    assert again is not given
    assert again == given


@pytest.mark.parametrize("name", CHANGED)
def test_other_contents_are_not(results, name):
    given = results[name]
    assert given != replace(given, **CHANGED[name])
    assert given != 3
    assert given is not None
    assert given != (given,)


def test_two_runs_of_a_seed_are_equal_and_of_another_not(results, tmp_path):
    database = make_database(tmp_path)
    made = {name: table.iloc[:30] for name, table in walk_tables().items()}
    log = mf.make_log(database.lattice.crs, **made)
    assert mf.locate(log, database, SMALL).estimate == results["track"]
    assert mf.locate(log, database, SMALL, seed=1).estimate != results["track"]


def test_a_track_is_the_same_however_long_it_took(results):
    found = results["positioned"]
    assert replace(found, filter_s=found.filter_s + 1.0) == found
