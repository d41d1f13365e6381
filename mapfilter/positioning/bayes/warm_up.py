"""The compiled kernels of the map filter, loaded by a step of each kind before the first log."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mapfilter.filters.contract import MotionStep
from mapfilter.models.fingerprint import BoundReading
from mapfilter.models.level_errors import LevelReport
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.epochs import Epoch

if TYPE_CHECKING:
    from mapfilter.positioning.bayes.filter import BayesPositioner


def run_kernels(small: BayesPositioner) -> None:
    """Move and weigh the hypotheses of a filter, which had better be few."""
    area, rng = small.area, np.random.default_rng(0)
    west, south = area.origin_m
    state = small.begin_at(west, south, 1.0, rng)
    step = MotionStep(1.0, 0.0)
    # The step waits, and the position goes on by dead reckoning: only `predict` moves something.
    state, _ = small.step(state, Epoch(0.0, (step,)), rng)
    if state.belief is not None:
        small.beliefs.by_compass[True].predict(state.belief, step, rng)
    if state.belief is not None and area.cell_ids:
        update, reading = small.beliefs.by_compass[True].update, _every_kind()
        belief, _ = update(state.belief, reading, rng)
        update(belief, replace(reading, length_m=5.0, tracked=True), rng)


def _every_kind() -> RadioReading:
    one, none = np.full(1, -60, dtype=np.float32), np.zeros(1, dtype=np.int32)
    levels = LevelReport(none, one, none, one - 40, 1.0)
    return RadioReading(0, 1.0, levels, (BoundReading(none, -60.0, 1, 8.0, 1.0),))
