"""A log's tables merged into one stream of events, in the order in which they are processed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.run import Event
from mapfilter.positioning.estimate import UnusedReading
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SERVING


@dataclass(frozen=True, slots=True)
class ServingEvents:
    """What a filter that knows only serving cells can use of a log.

    Parameters
    ----------
    events : tuple of Event
        Motion and serving cells by time. A report at the end of a motion interval is one event
        with it: first move, then measure.
    unused : tuple of UnusedReading
        Everything else, and why it is left out; whole kinds are told once.
    """

    events: tuple[Event[str], ...]
    unused: tuple[UnusedReading, ...]


def serving_events(log: TrackLog) -> ServingEvents:
    """Merge motion and serving cells of a log.

    A report that names no serving cell makes no event. Neighbours and all that GNSS and times of
    arrival tell is told as not used.
    """
    serving, unused = _serving_cells(log)
    moves: dict[float, list[MotionStep]] = {}
    columns = (
        log.motion[name].tolist() for name in ("time_s", "step_m", "heading_rad", "turn_rad")
    )
    for time_s, step_m, heading_rad, turn_rad in zip(*columns, strict=True):
        moves.setdefault(time_s, []).append(MotionStep(step_m, heading_rad, turn_rad))
    events: list[Event[str]] = []
    for time_s in sorted(moves.keys() | serving.keys()):
        *earlier, last = moves.get(time_s, [None])
        events.extend(Event(time_s, motion=motion) for motion in earlier)
        events.append(Event(time_s, motion=last, reading=serving.get(time_s)))
    return ServingEvents(tuple(events), (*unused, *_left_out(log)))


def _serving_cells(log: TrackLog) -> tuple[dict[float, str], list[UnusedReading]]:
    """Return the serving cell by time, and the reports that name none or more than one."""
    rows = log.radio[log.radio["role"] == SERVING]
    cells: dict[float, str] = {}
    unused: list[UnusedReading] = []
    for time_s, cell in zip(rows["time_s"].tolist(), rows["cell"].tolist(), strict=True):
        if not isinstance(cell, str):
            continue
        if time_s in cells:
            unused.append(UnusedReading(time_s, SERVING, cell, Reason.SECOND_SERVING_CELL))
        else:
            cells[time_s] = cell
    without = np.setdiff1d(log.radio["time_s"].to_numpy(), list(cells)).tolist()
    unused += [UnusedReading(time_s, SERVING, "", Reason.NO_SERVING_CELL) for time_s in without]
    return cells, unused


def _left_out(log: TrackLog) -> list[UnusedReading]:
    neighbours = log.radio[log.radio["role"] != SERVING]
    return [
        UnusedReading(
            float(rows["time_s"].iloc[0]), kind, f"{len(rows)} rows", Reason.NOT_USED_BY_FILTER
        )
        for kind, rows in (
            ("neighbour", neighbours),
            ("gnss", log.gnss),
            ("pseudorange", log.pseudoranges),
            ("tdoa", log.tdoa),
        )
        if len(rows)
    ]
