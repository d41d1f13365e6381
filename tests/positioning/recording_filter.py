"""A filter that notes what it does and fails where it is told to, for the front door."""
# ruff: noqa: ARG002

import mapfilter as mf
from mapfilter.filters.contract import Reason


class Recording(mf.Filter):
    """Takes GNSS only; fails where it is told to."""

    name, crs = "recording", "EPSG:32629"
    uses = ("gnss",)

    def __init__(self, database):
        pass

    def begin(self, kinds=()):
        return 0

    def step(self, state, epoch, rng):
        if state == 3:
            raise ValueError("no idea")
        fix = mf.Fix.nowhere(epoch.time_s, mf.Status.SEARCHING, Reason.NO_READING)
        return state + 1, mf.StepOutput(fix)
