"""The one loop over a log: every epoch through a filter, and the outputs put together."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import isfinite, nan
from typing import Any

import numpy as np

from mapfilter.errors import InputError, fail
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import same_crs, shown_crs
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.estimate_columns import EstimateColumns
from mapfilter.positioning.filter import Filter, Recorder
from mapfilter.positioning.integrity import DEFAULT_RISK, check_risk
from mapfilter.positioning.merging import epochs
from mapfilter.positioning.positioned_track import PositionedTrack, Snapshot
from mapfilter.positioning.step_output import StepOutput, UnusedReading
from mapfilter.tracks.kinds import rows_by_kind
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import TABLES, Kind

_KEPT = ("motion", "radio")
"""Tables whose rows stay, as they make the epochs."""
_SNAPSHOT_EVERY_M = 20.0

OnSnapshots = Callable[[tuple[Snapshot, ...], bool], None]
"""Takes snapshots, and whether the last of their epochs has evidence."""


def locate(
    log: TrackLog,
    filter_: Filter[Any],
    rng: np.random.Generator,
    *,
    snapshots: bool = False,
    risk: float = DEFAULT_RISK,
    recorder: Recorder | None = None,
    on_snapshots: OnSnapshots | None = None,
) -> PositionedTrack:
    """Locate a log: the one loop over epochs.

    Nothing aborts a track: readings that cannot be used are labelled with a reason.

    Parameters
    ----------
    log : TrackLog
        In the filter's CRS.
    snapshots : bool
        Whether to keep the hypotheses at some epochs until the filter first tracks, for figures.
    risk : float
        Probability, at each epoch, that the error exceeds the protection level. Positions that are
        smoothed have a level only where the smoother gives one.
    recorder : Recorder, optional
        Sees every step; the result is the same with and without one.
    on_snapshots : callable, optional
        With ``snapshots``, called once with all of them, and whether there is evidence: as soon as
        there will be no more, when the filter first tracks or is lost, or at the end. The time of
        the call itself is not the filter's.

    Raises
    ------
    ConfigError
        The risk does not lie between 0 and 1.
    InputError
        The log is in another CRS than the filter.
    """
    check_risk(risk)
    if not same_crs(log.crs, filter_.crs):
        hint = "log of another area or zone"
        raise fail(InputError, "log, crs", shown_crs(filter_.crs), shown_crs(log.crs), hint)
    log, unused = usable_part(log, filter_)
    merged = epochs(log)
    filter_.warm_up(merged)
    smoother = filter_.smoother()
    album = _Album(filter_)
    columns = EstimateColumns()
    began_s = time.process_time()
    state = filter_.begin(kinds_of(log))
    for epoch in merged:
        before = state
        drawn = copy.deepcopy(rng) if recorder is not None else rng
        state, output = filter_.step(before, epoch, rng)
        if risk != DEFAULT_RISK:
            output = output.protected(output.tail, risk)
        columns.add(output)
        if recorder is not None:
            paused_s = time.process_time()
            recorder.record(before, epoch, drawn, state, output)
            began_s += time.process_time() - paused_s
        if smoother is not None:
            smoother.add(before, state)
        if snapshots:
            album.add(state, epoch, output)
            if on_snapshots is not None and not album.open:
                paused_s = time.process_time()
                on_snapshots(tuple(album.taken), output.evidence is not None)
                began_s += time.process_time() - paused_s
                on_snapshots = None
    estimate = columns.estimate(filter_.crs, filter_.name, log.start_utc_s, tuple(unused))
    if smoother is not None:
        unknown = np.full(len(estimate), nan)
        estimate = replace(estimate, radius_99_m=unknown, protection_m=unknown)
        estimate = smoother.smoothed(estimate, rng)
    took_s = time.process_time() - began_s
    if snapshots and on_snapshots is not None:
        on_snapshots(tuple(album.taken), estimate.evidence is not None)
    return PositionedTrack(estimate, tuple(album.taken), took_s)


def kinds_of(log: TrackLog) -> frozenset[Kind]:
    """Return which kinds of measurements a log holds."""
    return frozenset(kind for kind, rows in rows_by_kind(log).items() if len(rows))


def usable_part(log: TrackLog, filter_: Filter[Any]) -> tuple[TrackLog, list[UnusedReading]]:
    """Name each kind of measurement that a filter does not use, and take its rows out of the log.

    Motion and radio reports stay, as they make the epochs.
    """
    rows, uses = rows_by_kind(log), set(filter_.uses)
    unused = [
        UnusedReading(
            float(found["time_s"].iloc[0]), kind, "", Reason.NOT_USED_BY_FILTER, len(found)
        )
        for kind, found in rows.items()
        if kind not in uses and len(found)
    ]
    idle = [
        name
        for name, table in TABLES.items()
        if table.kinds and name not in _KEPT and uses.isdisjoint(table.kinds)
    ]
    return replace(log, **{table: getattr(log, table).iloc[:0] for table in idle}), unused


def estimate_of(
    filter_: Filter[Any],
    outputs: Sequence[StepOutput],
    unused: Sequence[UnusedReading] = (),
    start_utc_s: float = nan,
) -> TrackEstimate:
    """Put the outputs of a filter's steps together.

    Parameters
    ----------
    filter_ : Filter
        Gives name and CRS.
    outputs : sequence of StepOutput
        One for each epoch.
    unused : sequence of UnusedReading
        Besides those of the outputs.
    start_utc_s : float
        UTC seconds of time 0.
    """
    columns = EstimateColumns()
    for output in outputs:
        columns.add(output)
    return columns.estimate(filter_.crs, filter_.name, start_utc_s, tuple(unused))


class _Album:
    """Hypotheses until the filter first tracks or is lost: at a new status, and every 20 m."""

    def __init__(self, filter_: Filter[Any]) -> None:
        self.filter, self.travelled_m, self.open = filter_, 0.0, True
        self.taken: list[Snapshot] = []

    def add(self, state: Any, epoch: Epoch, output: StepOutput) -> None:
        fix, found = output.fix, self.filter.hypotheses(state) if self.open else None
        if found is None:
            return
        if self.taken:
            moved = (step.step_m for step in epoch.motion if isfinite(step.step_m))
            self.travelled_m += sum(map(abs, moved))
            last = self.taken[-1]
            near = self.travelled_m - last.travelled_m < _SNAPSHOT_EVERY_M
            if fix.status is last.status and near:
                return
        self.open = fix.status in (Status.SEARCHING, Status.CONVERGED)
        if fix.status not in (Status.TRACKING, Status.UNCERTAIN):
            hypotheses = found.east_m, found.north_m, found.weight
            at = fix.east_m, fix.north_m, fix.status
            self.taken.append(Snapshot(fix.time_s, self.travelled_m, *hypotheses, *at))
