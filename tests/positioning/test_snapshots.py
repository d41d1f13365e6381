"""Snapshots of hypotheses: until the filter first tracks or is lost."""

import numpy as np
import pytest
from cross_world import walk_log

from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.filter import Filter, Hypotheses, StepOutput
from mapfilter.positioning.loop import locate
from mapfilter.positioning.step_output import Fix

S, C, T, L = Status.SEARCHING, Status.CONVERGED, Status.TRACKING, Status.LOST


class Scripted(Filter):
    """Takes a status and a number of hypotheses for each epoch from a list; the last repeats."""

    name, crs = "scripted", "EPSG:32629"

    def __init__(self, *script):
        self.script = script

    def begin(self, kinds=()):  # noqa: ARG002
        return -1

    def step(self, state, epoch, rng):  # noqa: ARG002
        state = min(state + 1, len(self.script) - 1)
        fix = Fix.nowhere(epoch.time_s, self.script[state][0], Reason.NO_READING)
        return state, StepOutput(fix)

    def hypotheses(self, state):
        at_m = np.zeros(self.script[state][1])
        return Hypotheses(at_m, at_m, at_m)


def statuses(*script):
    rng = np.random.default_rng(0)
    found = locate(walk_log(), Scripted(*script), rng, snapshots=True).snapshots
    assert [s.travelled_m for s in found] == sorted(s.travelled_m for s in found)
    return [s.status for s in found]


@pytest.mark.parametrize(
    ("script", "seen"),
    [
        ([(S, 9), (C, 1), (T, 1), (L, 1), (S, 9), (C, 1), (T, 1)], [S, C]),
        ([(S, 9), (L, 0), (S, 9)], [S, L]),
    ],
    ids=["tracking", "lost"],
)
def test_nothing_after_the_first_tracking_or_loss_is_kept(script, seen):
    assert statuses(*script) == seen


def test_hypotheses_are_shown_every_20_m_while_searching():
    assert len(statuses((S, 9))) > 5
