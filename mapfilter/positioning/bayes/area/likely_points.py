"""How likely a report makes each point of an area, kept for beliefs that start from an equal one.

All runs of a sweep on one journey start from the same report; to weigh all points by it took a
tenth of a run.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from mapfilter._types import Floats32
from mapfilter.filters.belief_models import Cloud
from mapfilter.models.street_motion import EAST, NORTH, STATES
from mapfilter.positioning.bayes.sources.evidence import RadioReading

if TYPE_CHECKING:
    from mapfilter.positioning.bayes.beliefs.model import BayesModel

KEPT_REPORTS = 4
_MOST_POINTS = 1_000_000
"""Of an area with more, four bytes each, nothing is kept."""
_AT_ONCE = 50_000


@dataclass(frozen=True)
class KnownReading:
    """A report by its numbers: equal ones make points equally likely."""

    key: Hashable
    reading: RadioReading = field(compare=False)


def known_reading(reading: RadioReading) -> KnownReading | None:
    """Return a report with its numbers; None with terms of other sources, which have no equals."""
    if reading.terms:
        return None
    levels: tuple[Hashable, ...] = ()
    if reading.levels is not None:
        cell, level_dbm, absent, limit_dbm, offset_db = reading.levels
        arrays = (cell, level_dbm, absent, limit_dbm)
        levels = (*(one.tobytes() for one in arrays), float(offset_db))
    bounds = tuple((one.cells.tobytes(), *map(float, one[1:])) for one in reading.bounds)
    # As a text NaN is equal to itself.
    rest = repr((reading.serving, reading.serving_weight, reading.length_m, reading.tracked))
    under_null = repr((reading.timing_advance, reading.serving_under_null, reading.under_null))
    return KnownReading((levels, bounds, rest, under_null), reading)


def likelihoods(
    model: BayesModel, points: Floats32, reading: RadioReading | None
) -> tuple[Floats32, float]:
    """Return shares (P,) of points, shape (2, P), by their likelihood, and the log of its mean."""
    log_weight = np.zeros(points.shape[1])
    if reading is not None:
        for first in range(0, points.shape[1], _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            state = np.zeros((STATES, points[:, part].shape[1]), dtype=np.float32)
            state[EAST : NORTH + 1] = points[:, part]
            nothing = np.empty((0, state.shape[1]), dtype=np.float32)
            model.weigh(Cloud(state, nothing), log_weight[part], reading)
    most = log_weight.max()
    weight = np.exp(log_weight - most)
    shares = (weight / weight.sum()).astype(np.float32)
    return shares, float(most + np.log(weight.mean()))


def likelihoods_on_ways(model: BayesModel, reading: RadioReading | None) -> tuple[Floats32, float]:
    """Return :func:`likelihoods` of all points on the ways of an area that is held as a whole."""
    points = model.whole.points
    known = None if reading is None else known_reading(reading)
    if known is None or points.shape[1] > _MOST_POINTS:
        return likelihoods(model, points, reading)
    return model.kept_likelihoods(known)
