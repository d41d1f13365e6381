"""Walks in a made town in which the phone is turned."""

from dataclasses import replace

import numpy as np
from made_town import Town

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Epoch

TOWN = Town.of(1)
AREA = BayesFilter(heading_sd_deg=6.0, claim_mass=0.95).over_area(TOWN.area())
# Rows of the made town are 5 m long.
WATCHED = replace(AREA, holds=replace(AREA.holds, longest_row_m=6.0))
START_M = 500_450.0, 4_500_450.0


def begun(positioner=WATCHED):
    """A tracked state and its generator."""
    rng = np.random.default_rng(5)
    return positioner.begin_at(*START_M, 5.0, rng), rng


def walked(state, rng, *rows, positioner=WATCHED):
    """The state after rows of time, length and heading."""
    for time_s, step_m, heading_rad in rows:
        motion = (MotionStep(step_m, heading_rad),)
        state, output = positioner.step(state, Epoch(time_s, motion), rng)
    return state, output
