"""What custom filters return and are called: shapes, names, and filters of no map."""
# ruff: noqa: ARG002

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np
import pytest
from cross_world import CROSSING, LATTICE, walk_log

import mapfilter as mf
from mapfilter.errors import ConfigError
from mapfilter.filters.contract import Estimate, Reason, Status, UpdateInfo
from mapfilter.testing import ContractError, check_filter


class Steady:
    """Says that the phone is at the crossing."""

    changes: ClassVar[dict] = {}

    def __init__(self, database=None):
        self.database = database

    def begin(self, kinds=()):
        return 0

    def step(self, state, epoch, rng):
        status = Status.TRACKING if state else Status.CONVERGED
        fix = mf.Fix(
            *(epoch.time_s, *CROSSING, np.eye(2), np.arange(3.0), status),
            *(1, np.nan, 0, np.nan, Reason.USED),
        )
        return state + 1, mf.StepOutput(replace(fix, **self.changes))


class Beliefs:
    """The same, as a filter of beliefs."""

    changes: ClassVar[dict] = {}

    def __init__(self, database):
        self.database = database

    def init(self, first, rng):
        return 0

    def predict(self, belief, motion, rng):
        return belief, Reason.USED

    def update(self, belief, epoch, rng):
        status = Status.TRACKING if belief else Status.CONVERGED
        return belief + 1, UpdateInfo(Reason.USED, status, 1)

    def locate(self, belief):
        return replace(Estimate(*CROSSING, np.eye(2), np.arange(3.0)), **self.changes)


WRONG = [
    ({"covariance_m2": np.eye(4)}, "covariance_m2 of shape (2, 2)", "shape (4, 4)"),
    ({"radii_m": [1.0, 2.0]}, "radii_m of shape (3,)", "shape (2,)"),
    ({"east_m": np.ones(1)}, "east_m as a number", "shape (1,)"),
    ({"north_m": None}, "north_m as a number", "None"),
    ({"north_m": "3.0"}, "north_m as a number", "str"),
    ({"radii_m": ["1", "2", "3"]}, "radii_m of shape (3,)", "list"),
]


@pytest.mark.parametrize(("changes", "expected", "got"), WRONG)
@pytest.mark.parametrize(("kind", "function"), [(Steady, "step"), (Beliefs, "locate")])
def test_values_of_another_shape_are_named(kind, function, changes, expected, got, database):
    made = type("Own", (kind,), {"changes": changes})
    message = f"filter Own, {function}: expected it to return {expected}, found {got}"
    with pytest.raises(ConfigError) as caught:
        mf.locate(walk_log(), database, made)
    assert str(caught.value) == message
    with pytest.raises(ContractError) as caught:
        check_filter(made, database, walk_log())
    assert str(caught.value) == f"{function} returns {expected}, not {got}"


@pytest.mark.parametrize("name", ["hypotheses", "way_id"])
def test_counts_are_whole_numbers(name, database):
    made = type("Own", (Steady,), {"changes": {name: 1.5}})
    with pytest.raises(ConfigError, match=f"{name} as a whole number, found float"):
        mf.locate(walk_log(), database, made)


def test_lists_and_numbers_of_numpy_will_do(database):
    changes = {"covariance_m2": [[1, 0], [0, 1]], "radii_m": (1, 2, 3), "east_m": np.float32(3)}
    for kind in (Steady, Beliefs):
        made = type("Own", (kind,), {"changes": changes})
        estimate = mf.locate(walk_log(), database, made).estimate
        assert (estimate.east_m[-1], estimate.radii_m[-1].tolist()) == (3.0, [1.0, 2.0, 3.0])


class Named(Steady):
    name = "mine, of today"


class Called(Steady):
    @property
    def name(self):
        return f"mine over {self.database.lattice.rows} rows"


@pytest.mark.parametrize(
    ("made", "name"),
    [
        (Named, "mine, of today"),
        (Called, f"mine over {LATTICE.rows} rows"),
        (partial(Named), "mine, of today"),
        (partial(Steady), "Steady"),
        (Steady, "Steady"),
        (Beliefs, "Beliefs"),
    ],
)
def test_a_filter_has_the_name_that_it_gives_itself(made, name, database):
    assert mf.locate(walk_log(), database, made).estimate.filter == name
    assert mf.locate(walk_log(), database, made(database)).estimate.filter == name


@pytest.mark.parametrize("given", [None, 3, ["ekf"]])
def test_what_is_no_filter_is_told_what_one_is(given, database):
    with pytest.raises(ConfigError) as caught:
        mf.locate(walk_log(), database, given)
    (fault,) = caught.value.faults
    assert fault.where == "filter"
    assert fault.expected == "the name of a filter, options such as BayesFilter(), or a class"


@dataclass(frozen=True)
class Mapless(mf.Filter[int]):
    """A filter over no map at all, such as one of another package."""

    own: Steady
    crs: str = LATTICE.crs
    name: str = "mapless"

    def begin(self, kinds=()):
        return 0

    def step(self, state, epoch, rng):
        return self.own.step(state, epoch, rng)


def test_a_filter_without_a_map_needs_no_database():
    log = walk_log()
    track = mf.locate(log, filter=Mapless(Steady()))
    assert (track.database, track.estimate.filter, len(track.log.radio)) == (
        *(None, "mapless"),
        len(log.radio),
    )
    assert mf.score(track, log.truth).switched
    assert track.plot().get_title()


def test_shapes_of_such_a_filter_are_named_too(database):
    made = type("Own", (Steady,), {"changes": {"covariance_m2": np.eye(4)}})
    with pytest.raises(mf.MapfilterError) as caught:
        mf.locate(walk_log(), database, Mapless(made()))
    assert str(caught.value) == (
        "step, fix: expected covariance_m2 of shape (2, 2) and radii_m of shape (3,), "
        "found (4, 4) and (3,)"
    )


def test_one_over_a_database_still_needs_it(database):
    """Cells by identity are named by its plan."""
    for options in (mf.BayesFilter(), mf.CandidateFilter()):
        with pytest.raises(ConfigError, match="expected a database of open_database or build"):
            mf.locate(walk_log(), filter=options.over(database))
