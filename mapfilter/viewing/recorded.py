"""What a trace holds of a run as the page reads it: beliefs and explanations."""

from __future__ import annotations

from math import nan
from typing import Any

import numpy as np

from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.radio.cells import CellPlan
from mapfilter.viewing.arrays import cell_numbers, packed, starts
from mapfilter.viewing.explain import TERMS
from mapfilter.viewing.ground import ViewFrame
from mapfilter.viewing.readings import dbm
from mapfilter.viewing.trace import TraceRecorder


def belief_of(trace: TraceRecorder | None, every: int, frame: ViewFrame) -> dict[str, Any] | None:
    """Return the recorded beliefs as the page reads them; None where there are none."""
    frames = list(trace.frames.kept.values()) if trace is not None else []
    if not frames:
        return None
    step = np.array([one.step_m for one in frames])
    # The corner of a view lies on the lines between squares of any size.
    west, south = (np.rint(at_m / step) for at_m in (frame.west_m, frame.south_m))
    col = [one.col - int(first) for one, first in zip(frames, west, strict=True)]
    row = [one.row - int(first) for one, first in zip(frames, south, strict=True)]
    return {
        "epoch": packed(np.array([one.epoch // every for one in frames], np.int64), "u4"),
        "first": starts([one.col.size for one in frames]),
        "step": packed(step, "f4"),
        "col": packed(np.concatenate(col), "i4"),
        "row": packed(np.concatenate(row), "i4"),
        "mass": packed(np.concatenate([one.shade for one in frames]), "u1"),
        "peak": packed([one.peak for one in frames], "f4"),
        "which": "density",
    }


def explained_of(
    trace: TraceRecorder | None,
    every: int,
    frame: ViewFrame,
    plan: CellPlan,
    estimate: TrackEstimate,
) -> dict[str, Any] | None:
    """Return the recorded explanations as the page reads them; None where there are none."""
    if trace is None or not isinstance(trace.filter, BayesPositioner) or not trace.explained.kept:
        return None
    area = trace.filter.area
    number = np.array([plan.index(cell) for cell in area.cell_ids] + [-1], dtype=np.int64)
    kept = sorted(trace.explained.kept.items())
    at = np.array([epoch for epoch, _ in kept], dtype=np.int64)
    rows = [row for _, one in kept for row in one.rows]
    found = np.array([row[2:] for row in rows], dtype=np.float64).reshape(-1, 6)
    sums = np.array([np.sum([row[5:] for row in one.rows], axis=0) for _, one in kept])
    evidence = estimate.evidence
    nowhere = np.full(len(estimate), nan)
    return {
        "epoch": packed(at // every, "u4"),
        "first": starts([len(one.rows) for _, one in kept]),
        "terms": list(TERMS),
        "what": packed(np.array([TERMS.index(row.what) for row in rows], np.int64), "u1"),
        "cell": cell_numbers(number[[row.cell for row in rows]]),
        "measured": dbm(found[:, 0]),
        "lead_predicted": dbm(found[:, 1]),
        "runner_predicted": dbm(found[:, 2]),
        "lead": packed(found[:, 3], "f8"),
        "runner": packed(found[:, 4], "f8"),
        "alt": packed(found[:, 5], "f8"),
        "lead_sum": packed(sums[:, 0], "f8"),
        "runner_sum": packed(sums[:, 1], "f8"),
        "alt_sum": packed(sums[:, 2], "f8"),
        "runner_east": frame.east((evidence.runner_up_east_m if evidence else nowhere)[at]),
        "runner_north": frame.north((evidence.runner_up_north_m if evidence else nowhere)[at]),
        "runner_prior": packed([one.prior for _, one in kept], "f4"),
    }
