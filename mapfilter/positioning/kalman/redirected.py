"""Motions of a belief that turns out to be another one.

Headings have jumped, are in doubt, or are found, or a belief without fixes takes over.
"""

from __future__ import annotations

from math import radians

import numpy as np

from mapfilter.models.state import StateLayout
from mapfilter.positioning.kalman.alignment import Direction
from mapfilter.positioning.kalman.coasting import Coasting
from mapfilter.positioning.kalman.lasting import Motion
from mapfilter.positioning.kalman.reckoning import RATE, RECKONED, TURNED, at_rest
from mapfilter.positioning.kalman.turned import Turn

_ASTRAY_RAD, _ASTRAY_RADPS = radians(30.0), radians(1.0)
"""What is added to the errors of turns and of their rate where they have led astray."""


def jump_to(turn: Turn, layout: StateLayout, lasting_m: float | None) -> Motion:
    """Return the motion of a jump of headings: to their error, and to where it has led.

    What the belief had of both is forgotten. Both are as the fixes tell them, and their errors are
    of one cause.

    Parameters
    ----------
    layout : StateLayout
        Of the belief.
    lasting_m : float or None
        Deviation of the error of fixes that lasts; None where it is no part of the state.
    """
    transition, _, shift = at_rest(layout)
    own = [layout.east, layout.north]
    of = [RECKONED.size, RECKONED.size + 1]
    # East and north, once or twice, and the heading error by the two of the place and the angle.
    cause = np.zeros((layout.size, 3))
    for place in [own] if lasting_m is None else [own, of]:
        transition[place, place] = 0.0
        shift[place] = turn.east_m, turn.north_m
        cause[place, [0, 1]] = 1.0
    transition[TURNED, TURNED], shift[TURNED], cause[TURNED, 2] = 0.0, turn.turned_rad, 1.0
    known = np.diag([turn.sd_m**2, turn.sd_m**2, turn.sd_rad**2])
    known[:2, 2] = known[2, :2] = turn.shared_m_rad
    noise = cause @ known @ cause.T
    if lasting_m is not None:
        noise[of, of] += lasting_m**2
    return transition, noise, shift


def turns_in_doubt(layout: StateLayout) -> Motion:
    """Return the motion of headings that turns have led astray: their errors are open again.

    Turns that were noisier than assumed, or had a larger bias, lead a belief away from its fixes
    until it begins anew; with what it had of their errors it would be led away again.
    """
    transition, noise, shift = at_rest(layout)
    noise[TURNED, TURNED], noise[RATE, RATE] = _ASTRAY_RAD**2, _ASTRAY_RADPS**2
    return transition, noise, shift


def turned_to(direction: Direction, layout: StateLayout) -> Motion:
    """Return the motion to the heading error that turns have, on the ground.

    What the belief had of it is forgotten, and says nothing of the way before.
    """
    transition, noise, shift = at_rest(layout)
    transition[TURNED, TURNED], shift[TURNED] = 0.0, direction.turned_rad
    noise[TURNED, TURNED] = direction.sd_rad**2
    return transition, noise, shift


def regained_by(coasting: Coasting, layout: StateLayout, lasting_m: float | None) -> Motion:
    """Return the motion to a belief without the last fixes, whose errors are unknown again.

    Parameters
    ----------
    coasting : Coasting
        With such a belief.
    layout : StateLayout
        Of the belief that has used them.
    lasting_m : float or None
        Deviation of the error of fixes that lasts; None where it is no part of the state.
    """
    coast, size = coasting.apart.coast, RECKONED.size
    if coast is None:
        raise AssertionError("regained by a belief")
    transition, noise, shift = at_rest(layout)
    of = [] if lasting_m is None else [size, size + 1]
    both = [*range(size), *of]
    # The place that fixes are of is the position and what lasts.
    parts = np.eye(size)[[*range(size), *([layout.east, layout.north] if of else [])]]
    transition[both] = 0.0
    shift[both] = parts @ coast.mean[:size]
    noise[np.ix_(both, both)] = parts @ coast.covariance[:size, :size] @ parts.T
    if lasting_m is not None:
        noise[of, of] += lasting_m**2
    return transition, noise, shift
