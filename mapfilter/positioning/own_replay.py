"""Replaying a log through a filter that a user wrote."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from math import nan
from typing import Any

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import InputError, fail
from mapfilter.filters.contract import Estimate, Reason, Status, UpdateInfo
from mapfilter.filters.run import Event, Step, run
from mapfilter.geodesy import same_crs
from mapfilter.positioning.epochs import Epoch, epochs
from mapfilter.positioning.estimate import Fix, TrackEstimate, UnusedReading
from mapfilter.positioning.matched_way import nearest_ways
from mapfilter.positioning.own_filter import MapFilter, told_by_name
from mapfilter.positioning.track import PositionedTrack
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SERVING

_NOWHERE = Estimate(nan, nan, np.full((2, 2), nan), np.full(3, nan))


def position_by_own(
    database: RadioRouteDatabase,
    filter_: MapFilter,
    log: TrackLog,
    rng: np.random.Generator,
    *,
    name: str,
    ways: bool = True,
) -> PositionedTrack:
    """Locate a log with a filter of one's own.

    It starts at the first epoch with a fix or with a serving cell of which the database has points:
    ``init`` is given that epoch, and ``update`` the same one and all later ones in which something
    was heard: reports, fixes, pseudoranges or time differences. What is before is labelled and
    passed over.

    Parameters
    ----------
    database : RadioRouteDatabase
    filter_ : Filter
        Its prior and its readings are epochs.
    log : TrackLog
        In the database's CRS.
    rng : numpy.random.Generator
        Handed to the filter.
    name : str
        What estimates call the filter.
    ways : bool
        Whether positions are matched to ways.

    Raises
    ------
    InputError
        The log is in another CRS than the database.
    ConfigError
        The filter's code fails, or returns something else than the contract says.
    """
    if not same_crs(log.crs, database.lattice.crs):
        raise fail(
            InputError, "log, crs", database.lattice.crs, log.crs, "log of another area or zone"
        )
    known = _cells_with_points(database)
    fixes: list[Fix] = []
    unused: list[UnusedReading] = []
    began_s = time.process_time()
    with told_by_name(name):
        for fix, told in _follow(filter_, epochs(log), known, rng):
            fixes.append(fix)
            unused += told
    filter_s = time.process_time() - began_s
    estimate = TrackEstimate.of_fixes(
        database.lattice.crs,
        name,
        nearest_ways(database, fixes) if ways else fixes,
        start_utc_s=log.start_utc_s,
        unused=unused,
    )
    return PositionedTrack(estimate, (), filter_s)


def _follow(
    filter_: MapFilter,
    merged: Sequence[Epoch],
    known: Callable[[str], Reason],
    rng: np.random.Generator,
) -> Iterator[tuple[Fix, list[UnusedReading]]]:
    """Yield what the filter says after each epoch, and what it did not use."""
    belief: Any = None
    status, hypotheses = Status.SEARCHING, 0
    for epoch in merged:
        cell, reason = _serving(epoch, known)
        unused: list[UnusedReading] = []
        if belief is None:
            if epoch.motion:
                unused.append(UnusedReading(epoch.time_s, "motion", "", Reason.NOT_STARTED))
            if epoch.fix is None and reason is not Reason.USED:
                if epoch.heard:
                    unused.append(UnusedReading(epoch.time_s, SERVING, cell, reason))
                yield _fix(epoch, _NOWHERE, status, 0, reason), unused
                continue
            belief = filter_.init(epoch, rng)
            events: tuple[Event[Epoch], ...] = (Event(epoch.time_s, reading=epoch),)
        else:
            events = _events(epoch)
        info = None
        for taken in run(filter_, belief, events, rng):
            _check_types(taken)
            belief = taken.belief
            if taken.motion_reason is not Reason.USED:
                unused.append(UnusedReading(epoch.time_s, "motion", "", taken.motion_reason))
            info = taken.info or info
        if info is not None:
            status, hypotheses, reason = info.status, info.hypotheses, info.reason
            if reason not in (Reason.USED, Reason.NOT_MOVED_ENOUGH):
                unused.append(UnusedReading(epoch.time_s, SERVING, cell, reason))
        elif status is Status.CONVERGED:
            status = Status.TRACKING
        located = filter_.locate(belief)
        if not isinstance(located, Estimate):
            raise TypeError(f"locate returns an Estimate, not {type(located).__name__}")
        yield _fix(epoch, located, status, hypotheses, reason), unused


def _events(epoch: Epoch) -> tuple[Event[Epoch], ...]:
    *earlier, last = epoch.motion or (None,)
    told = epoch.heard or epoch.ranges or epoch.differences or epoch.fix is not None
    heard = epoch if told else None
    return (
        *(Event[Epoch](epoch.time_s, motion) for motion in earlier),
        Event(epoch.time_s, last, heard),
    )


def _fix(epoch: Epoch, located: Estimate, status: Status, hypotheses: int, reason: Reason) -> Fix:
    return Fix(
        epoch.time_s,
        float(located.east_m),
        float(located.north_m),
        np.asarray(located.covariance_m2, dtype=np.float64).reshape(2, 2),
        np.asarray(located.radii_m, dtype=np.float64).reshape(3),
        status,
        hypotheses,
        nan,
        0,
        nan,
        reason,
    )


def _serving(epoch: Epoch, known: Callable[[str], Reason]) -> tuple[str, Reason]:
    """Return the serving cell, and whether the filter can start from it."""
    if not epoch.heard:
        return "", Reason.NO_READING
    named = [row.cell for row in epoch.heard if row.role == SERVING and row.cell is not None]
    return (named[0], known(named[0])) if named else ("", Reason.NO_SERVING_CELL)


def _cells_with_points(database: RadioRouteDatabase) -> Callable[[str], Reason]:
    cells = frozenset(database.cell_ids)

    @cache
    def known(cell: str) -> Reason:
        if cell not in cells:
            return Reason.UNKNOWN_CELL
        row, _, _ = database.cell_points(cell)
        return Reason.USED if row.size else Reason.NO_POINTS_IN_CELL

    return known


def _check_types(taken: Step[Any, Epoch]) -> None:
    if not isinstance(taken.motion_reason, Reason):
        raise TypeError("predict returns (belief, Reason)")
    if taken.info is not None and not isinstance(taken.info, UpdateInfo):
        raise TypeError("update returns (belief, UpdateInfo)")
