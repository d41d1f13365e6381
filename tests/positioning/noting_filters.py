"""Filters that note what an epoch's motion asks them for, and states that it moves."""
# ruff: noqa: ARG002

from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.street_motion import EAST, NORTH, STATES
from mapfilter.positioning.bayes.beliefs.moving import moved
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules, PullRules
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.watch import SensorWatch

CHANGES = {
    "moving": ("carried_on",),
    "belief_set": ("turned_at_jump", "remounted"),
}
"""Changes of beliefs that are noted alone, by the modules that ask for them."""
SEARCHING, TRACKING = Status.SEARCHING, Status.TRACKING
FIX = GnssFix(0.0, 0.0)
STEP = MotionStep(2.0, 0.5, 0.1, sampling_sd_m=0.25)


def belief(status=TRACKING, *, name=0, log_evidence=0.0):
    """Hypotheses at one place; north notes whose they are."""
    state = np.zeros((STATES, 20), dtype=np.float32)
    state[NORTH] = name
    return ParticleBelief(
        state, np.full(20, -np.log(20.0)), Bins.over((0.0, 0.0, 100.0, 100.0)),
        np.empty((0, 20), dtype=np.float32), status=status, log_evidence=log_evidence,
    )  # fmt: skip


def whose(given):
    return int(given.state[NORTH, 0])


@dataclass
class Beliefs:
    """Filters that note what they are asked for, and move hypotheses to the east by a step."""

    holds: HoldRules = field(default_factory=HoldRules)
    pulls: PullRules = field(default_factory=PullRules)
    lead: bool = False
    map_may_start: bool = False
    left: bool = False
    anywhere: bool = False
    why: Reason = Reason.USED
    asked: list = field(default_factory=list)

    @property
    def model(self):
        return SimpleNamespace(motion=SimpleNamespace(white_rad=0.0))

    def moving_filter(self, state, *, compass):
        def predict(given, step, rng):
            rng.random()
            self.asked.append(("predict", whose(given), step, compass))
            after = given.state.copy()
            after[EAST] += step.step_m
            return replace(given, state=after), self.why

        return SimpleNamespace(predict=predict)

    def may_have_left(self, state):
        return self.left

    def left_share(self, state, watch):
        return 0.0

    def followed_ways(self, state):
        return False

    def may_be_anywhere(self, state, watch, time_s):
        return self.anywhere and watch.rest is None

    def positions_lead(self, state):
        return self.lead

    def carried_on(self, given, rest, gone_s, rng):
        self.asked.append(("carried on", gone_s))
        return replace(given, log_evidence=-77.0)

    def without_compass(self, given, rng):
        self.asked.append(("without compass",))
        return given

    def turned_at_jump(self, given, rules, changed_rad, rng, *, back_probability):
        # At the first jump nothing is known of others.
        assert rules is self.holds
        assert back_probability is None
        self.asked.append(("turned", changed_rad))
        return given

    def remounted(self, given, motion, length_m, rng):
        self.asked.append(("remounted", length_m))
        return given


def walking(main=None, *, status=TRACKING, stepped_s=9.0, **more):
    """A state in the middle of a walk."""
    watch = SensorWatch(pace=Pace(stepped_s=stepped_s), moving_s=4.0)
    given = {"belief": main or belief(), "watch": watch, "walking_rad": 0.4} | more
    return BayesState(status=status, **given)


def moved_by(beliefs, *given):
    with ExitStack() as patches:
        for module, names in CHANGES.items():
            changes = {name: getattr(beliefs, name) for name in names}
            where = f"mapfilter.positioning.bayes.beliefs.{module}"
            patches.enter_context(patch.multiple(where, **changes))
        return moved(beliefs, *given)


def move(state, *motion, beliefs=None, time_s=10.0, watch=None, **readings):
    beliefs = beliefs or Beliefs()
    watch = watch or SensorWatch()
    epoch = Epoch(time_s, motion, **readings)
    found, unused = moved_by(beliefs, state, watch, epoch, np.random.default_rng(1))
    return found, unused, beliefs.asked


def steps_of(asked, name=0):
    return [one[2] for one in asked if one[0] == "predict" and one[1] == name]
