"""Global positioning over a radio-route database: search, converge, track, or lose the way."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import nan

import numpy as np

from mapfilter.database.nearest import CellPointIndex
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import InputError, fail
from mapfilter.filters.candidate import CandidateBelief, CandidateFilter, CandidateOptions
from mapfilter.filters.contract import Estimate, Event, Reason, Status, run
from mapfilter.geodesy import same_crs
from mapfilter.positioning.epochs import serving_events
from mapfilter.positioning.estimate import Fix, Snapshot, TrackEstimate, UnusedReading
from mapfilter.positioning.estimate import PositionedTrack as PositionedTrack
from mapfilter.positioning.matched_way import nearest_ways
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SERVING

PointsOf = Callable[[str], CellPointIndex | None]

_NOWHERE = Estimate(nan, nan, np.full((2, 2), nan), np.full(3, nan))


def cell_points(database: RadioRouteDatabase, margin_db: float | None = None) -> PointsOf:
    """Return a function that gives the points of a cell, read at its first use and kept.

    Parameters
    ----------
    database : RadioRouteDatabase
        Where the points are.
    margin_db : float or None
        A point belongs to every cell within this margin of its best server; None takes the
        margin that the database was built with.
    """
    known = frozenset(database.cell_ids)

    @cache
    def points_of(cell: str) -> CellPointIndex | None:
        if cell not in known:
            return None
        row, col, _ = database.cell_points(cell, margin_db)
        return CellPointIndex.of_points(database.lattice, row, col)

    return points_of


def position_by_candidates(
    database: RadioRouteDatabase,
    points_of: PointsOf,
    log: TrackLog,
    options: CandidateOptions,
    rng: np.random.Generator,
    *,
    ways: bool = True,
) -> PositionedTrack:
    """Locate a log with the candidate filter (Khalaf-Allah 2007, Tables 2 and 3).

    The filter starts at the first report whose serving cell the database knows. Nothing aborts a
    track: what cannot be used is labelled and passed over.

    Parameters
    ----------
    database : RadioRouteDatabase
        The map.
    points_of : callable
        From :func:`cell_points`, so that many logs share what was read.
    log : TrackLog
        Motion and radio reports in the database's CRS.
    options : CandidateOptions
        The reading of the paper.
    rng : numpy.random.Generator
        Part of the filter contract; this filter draws nothing.
    ways : bool
        Whether positions are matched to ways.

    Raises
    ------
    InputError
        The log is in another CRS than the database.
    """
    if not same_crs(log.crs, database.lattice.crs):
        raise fail(
            InputError, "log, crs", database.lattice.crs, log.crs, "log of another area or zone"
        )
    merged = serving_events(log)
    for cell in {event.reading for event in merged.events if event.reading is not None}:
        points = points_of(cell)
        if points is not None:
            # The compiled search is loaded, like the points, before the clock starts.
            points.nearest(0.0, 0.0, 0.0)
    began_s = time.process_time()
    first = _first_known(merged.events, points_of)
    epochs = [_before_start(event, points_of) for event in merged.events[:first]]
    snapshots: list[Snapshot] = []
    if first < len(merged.events):
        filter_ = CandidateFilter(points_of, options)
        followed, snapshots = _follow(filter_, merged.events[first:], rng)
        epochs += followed
    filter_s = time.process_time() - began_s
    fixes = [_fix(epoch) for epoch in epochs]
    unused = [*merged.unused, *(u for epoch in epochs for u in _unused(epoch))]
    estimate = TrackEstimate.of_fixes(
        database.lattice.crs,
        "candidate",
        nearest_ways(database, fixes) if ways else fixes,
        start_utc_s=log.start_utc_s,
        unused=sorted(unused, key=lambda reading: reading.time_s),
    )
    return PositionedTrack(estimate, tuple(snapshots), filter_s)


@dataclass(frozen=True, slots=True)
class _Epoch:
    """What the loop tells of one event."""

    event: Event[str]
    motion_reason: Reason
    reading_reason: Reason
    status: Status
    hypotheses: int
    located: Estimate


def _before_start(event: Event[str], points_of: PointsOf) -> _Epoch:
    if event.reading is None:
        reason = Reason.NO_READING
    else:
        known = points_of(event.reading) is not None
        reason = Reason.NO_POINTS_IN_CELL if known else Reason.UNKNOWN_CELL
    moved = Reason.USED if event.motion is None else Reason.NOT_STARTED
    return _Epoch(event, moved, reason, Status.SEARCHING, 0, _NOWHERE)


def _follow(
    filter_: CandidateFilter, events: Sequence[Event[str]], rng: np.random.Generator
) -> tuple[list[_Epoch], list[Snapshot]]:
    """Run the filter over the events, of which the first holds the report to start from."""
    first = events[0]
    belief = filter_.init(str(first.reading), rng)
    # What was travelled until the first report is not motion of the candidates: they start here.
    events = (Event(first.time_s, reading=first.reading), *events[1:])
    status, travelled_m, searching = Status.SEARCHING, 0.0, True
    hypotheses = int(belief.east_m.size)
    epochs: list[_Epoch] = []
    snapshots = [_snapshot(filter_, first.time_s, 0.0, belief, status)]
    for step in run(filter_, belief, events, rng):
        event, info = step.event, step.info
        if event.motion is not None and step.motion_reason is Reason.USED:
            travelled_m += abs(event.motion.step_m)
        reading_reason = Reason.NO_READING
        if info is not None:
            if searching and (info.hypotheses, info.status) != (hypotheses, status):
                snapshots.append(
                    _snapshot(filter_, event.time_s, travelled_m, step.belief, info.status)
                )
            status, hypotheses, reading_reason = info.status, info.hypotheses, info.reason
            searching = status is Status.SEARCHING
        elif status is Status.CONVERGED:
            status = Status.TRACKING
        located = filter_.locate(step.belief)
        epochs.append(
            _Epoch(event, step.motion_reason, reading_reason, status, hypotheses, located)
        )
    if first.motion is not None:
        epochs[0] = replace(epochs[0], motion_reason=Reason.NOT_STARTED)
    return epochs, snapshots


def _snapshot(
    filter_: CandidateFilter,
    time_s: float,
    travelled_m: float,
    belief: CandidateBelief,
    status: Status,
) -> Snapshot:
    located, count = filter_.locate(belief), belief.east_m.size
    return Snapshot(
        time_s,
        travelled_m,
        belief.east_m,
        belief.north_m,
        np.full(count, 1 / count if count else nan),
        located.east_m,
        located.north_m,
        status,
    )


def _fix(epoch: _Epoch) -> Fix:
    """Return the epoch's fix, its way still open."""
    located = epoch.located
    return Fix(
        epoch.event.time_s,
        located.east_m,
        located.north_m,
        located.covariance_m2,
        located.radii_m,
        epoch.status,
        epoch.hypotheses,
        nan,
        0,
        nan,
        epoch.reading_reason,
    )


def _unused(epoch: _Epoch) -> list[UnusedReading]:
    unused, event = [], epoch.event
    if epoch.motion_reason is not Reason.USED:
        unused.append(UnusedReading(event.time_s, "motion", "", epoch.motion_reason))
    waiting = (Reason.USED, Reason.NOT_MOVED_ENOUGH)
    if event.reading is not None and epoch.reading_reason not in waiting:
        unused.append(UnusedReading(event.time_s, SERVING, event.reading, epoch.reading_reason))
    return unused


def _first_known(events: Sequence[Event[str]], points_of: PointsOf) -> int:
    """Return the index of the first report whose cell has points, or the number of events."""
    for index, event in enumerate(events):
        if event.reading is not None:
            points = points_of(event.reading)
            if points is not None and len(points):
                return index
    return len(events)
