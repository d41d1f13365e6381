"""Every filter of the package keeps the contract over epochs; breaches are noticed."""
# ruff: noqa: ARG002

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pytest
from cross_world import CROSSING, walk_log, walk_tables

from mapfilter.errors import ConfigError
from mapfilter.filters.contract import Estimate, Reason, Status, UpdateInfo
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.locators import BUILT_IN
from mapfilter.positioning.step_output import Fix, StepOutput
from mapfilter.testing import ContractError, check_filter


def steps_of_5_m():
    """Every fourth second of the walk, on which the same filters converge and track."""
    tables = {name: rows.iloc[::4] for name, rows in walk_tables().items()}
    step_m = 4 * tables["motion"]["step_m"]
    # A row tells the motion up to its time.
    times = {"time_s": tables["motion"]["time_s"] + 3.0, "step_m": step_m}
    return walk_log(**{**tables, "motion": tables["motion"].assign(**times)})


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_built_in_filter_keeps_the_contract(name, database):
    check_filter(name, database, steps_of_5_m())


@pytest.mark.parametrize("options", [BayesFilter(levels=False), BayesFilter(smooth=True)], ids=str)
def test_so_does_the_bayes_filter_with_other_options(options, database):
    check_filter(options, database, steps_of_5_m())


def test_candidates_may_all_vanish(database):
    check_filter(CandidateFilter(update_length_m=2.0), database, walk_log())


@dataclass(frozen=True)
class Beliefs:
    """A filter of beliefs that stays at the crossing."""

    database: object

    def init(self, first, rng):
        return 0

    def predict(self, belief, motion, rng):
        return belief + 1, Reason.USED

    def update(self, belief, epoch, rng):
        return belief, UpdateInfo(Reason.USED, Status.SEARCHING, 1)

    def locate(self, belief):
        return Estimate(*CROSSING, np.eye(2), np.arange(3.0))


def fix_at(epoch, status, *, radii_m=(1.0, 2.0, 3.0), time_s=None):
    return StepOutput(
        Fix(
            epoch.time_s if time_s is None else time_s, *CROSSING, np.eye(2), np.array(radii_m),
            status, 1, 1.0, 0, 0.0, Reason.USED,
        )
    )  # fmt: skip


class Steady:
    """A filter over epochs that stays at the crossing."""

    def __init__(self, database):
        pass

    def begin(self, kinds):
        return {"steps": 0}

    def step(self, state, epoch, rng):
        return {"steps": state["steps"] + 1}, fix_at(epoch, Status.SEARCHING)


class Held:
    """A state without an equality of its own, which leads back to itself."""

    def __init__(self, steps):
        self.steps = pd.DataFrame({"steps": [steps, np.nan]})
        self.places = np.array([(np.nan, steps)], dtype=[("east_m", float), ("step", int)])
        self.dice = np.random.default_rng(1)
        self.own = self


class Objects(Steady):
    """A filter whose states are ordinary objects."""

    def begin(self, kinds):
        return Held(0)

    def step(self, state, epoch, rng):
        return Held(int(state.steps["steps"][0]) + 1), fix_at(epoch, Status.SEARCHING)


@pytest.mark.parametrize("made", [Beliefs, Steady, Objects])
def test_custom_filters_of_either_contract_keep_it(made, database):
    check_filter(made, database, walk_log())


class InPlace(Steady):
    def step(self, state, epoch, rng):
        state["steps"] += 1
        return state, fix_at(epoch, Status.SEARCHING)


class ObjectInPlace(Objects):
    def step(self, state, epoch, rng):
        state.steps.loc[0, "steps"] += 1
        return state, fix_at(epoch, Status.SEARCHING)


class DiceInPlace(Objects):
    def step(self, state, epoch, rng):
        state.dice.random()
        return state, fix_at(epoch, Status.SEARCHING)


class Jumping(Steady):
    def step(self, state, epoch, rng):
        return state, fix_at(epoch, Status.TRACKING)


class OwnDice(Steady):
    dice = np.random.default_rng(1)

    def step(self, state, epoch, rng):
        output = fix_at(epoch, Status.SEARCHING)
        return state, replace(output, fix=replace(output.fix, east_m=self.dice.random()))


class Shrinking(Steady):
    def step(self, state, epoch, rng):
        return state, fix_at(epoch, Status.SEARCHING, radii_m=(3.0, 2.0, 1.0))


class Narrow(Steady):
    def step(self, state, epoch, rng):
        output = fix_at(epoch, Status.SEARCHING)
        return state, replace(output, fix=replace(output.fix, radius_99_m=2.0))


class Negative(Steady):
    def step(self, state, epoch, rng):
        output = fix_at(epoch, Status.SEARCHING)
        return state, replace(output, fix=replace(output.fix, protection_m=-1.0))


class Late(Steady):
    def step(self, state, epoch, rng):
        return state, fix_at(epoch, Status.SEARCHING, time_s=epoch.time_s + 1e-3)


class Drifting(Steady):
    def step(self, state, epoch, rng):
        steps = state["steps"] + 1
        output = fix_at(epoch, Status.SEARCHING)
        fix = replace(output.fix, east_m=output.fix.east_m + steps)
        return {"steps": steps}, replace(output, fix=fix)


def with_fields(**changes):
    """Make a filter whose fixes have other values."""

    class Changed(Steady):
        def step(self, state, epoch, rng):
            output = fix_at(epoch, Status.SEARCHING)
            return state, replace(output, fix=replace(output.fix, **changes))

    return Changed


@pytest.mark.parametrize(
    ("changes", "clause"),
    [
        ({"covariance_m2": -np.eye(2)}, "no negative eigenvalue"),
        ({"covariance_m2": np.array([[1.0, 2.0], [2.0, 1.0]])}, "no negative eigenvalue"),
        ({"covariance_m2": np.array([[4.0, 1.0], [0.0, 4.0]])}, "covariance_m2 is symmetric"),
        ({"covariance_m2": np.eye(3)}, r"covariance_m2 of shape \(2, 2\)"),
        ({"radii_m": np.array([-1.0, 2.0, 3.0])}, "radii are not negative"),
        ({"radii_m": np.ones(2)}, r"radii_m of shape \(3,\)"),
        ({"mass_50m": 1.5}, "mass_50m lies between 0 and 1"),
        ({"way_probability": -0.5}, "way_probability lies between 0 and 1"),
        ({"hypotheses": -1}, "counted from 0"),
        ({"north_m": np.nan}, "both known, or neither"),
    ],
)
def test_values_that_no_fix_can_have_are_named(changes, clause, database):
    with pytest.raises(ContractError, match=clause):
        check_filter(with_fields(**changes), database, walk_log())


class Inverted(Beliefs):
    def locate(self, belief):
        return Estimate(*CROSSING, -np.eye(2), np.arange(3.0))


@pytest.mark.parametrize(
    ("made", "clause"),
    [
        (InPlace, "states are never changed in place"),
        (ObjectInPlace, "states are never changed in place"),
        (DiceInPlace, "states are never changed in place"),
        (Inverted, "covariance_m2 has no negative eigenvalue"),
        (Jumping, "SEARCHING is not followed by TRACKING"),
        (Narrow, "99 % is not below that for 95 %"),
        (Negative, "a protection level is not negative"),
        (OwnDice, "the generator alone decides the result"),
        (Shrinking, "do not shrink"),
        (Late, "time of its epoch"),
        (Drifting, "moves nothing"),
    ],
)
def test_a_breach_is_named(made, clause, database):
    with pytest.raises(ContractError, match=clause):
        check_filter(made, database, walk_log())


class Silent(Beliefs):
    def update(self, belief, epoch, rng):
        return belief, None


class Alone(Beliefs):
    def update(self, belief, epoch, rng):
        return belief


class Unreasoned(Beliefs):
    def predict(self, belief, motion, rng):
        return belief, "used"


class Nowhere(Beliefs):
    def locate(self, belief):
        return None


class Stateless(Steady):
    def step(self, state, epoch, rng):
        return fix_at(epoch, Status.SEARCHING)


@pytest.mark.parametrize(
    ("made", "clause"),
    [
        (Silent, "update returns (belief, UpdateInfo), not (belief, None)"),
        (Alone, "update returns (belief, UpdateInfo), not int"),
        (Unreasoned, "predict returns (belief, Reason), not (belief, str)"),
        (Nowhere, "locate returns Estimate, not None"),
        (Stateless, "step returns (state, StepOutput), not StepOutput"),
    ],
)
def test_a_function_that_returns_something_else_is_named(made, clause, database):
    with pytest.raises(ContractError) as caught:
        check_filter(made, database, walk_log())
    assert str(caught.value) == clause


class Dividing(Beliefs):
    def update(self, belief, epoch, rng):
        return belief / 0


def test_an_error_in_a_filter_does_not_advise_the_check_that_met_it(database):
    with pytest.raises(ConfigError, match=r"in update: .*ZeroDivisionError") as caught:
        check_filter(Dividing, database, walk_log())
    assert "check_filter" not in str(caught.value)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_a_short_log_is_not_enough(database):
    with pytest.raises(ValueError, match="ten epochs"):
        check_filter("bayes", database, walk_log(((0.0, 5.0),)))
