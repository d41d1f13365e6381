"""Ways from repeated tracks, where there is no street map.

Tracks of one street are drawn together to their common centre line, then added one after another:
what runs along a way that is there already adds nothing, the rest becomes new ways that join it.
After Cao and Krumm (2009), "From GPS traces to a routable road map", ACM GIS, whose two steps
these are; here tracks are drawn across their direction only, by mean shift over what was measured.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from mapfilter._types import Floats, Ints
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError, fail
from mapfilter.roads.corridor_net import grown_lines
from mapfilter.roads.defaults import MAX_ACCURACY_M, MAX_GAP_M
from mapfilter.roads.ways import Ways

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

_CLASS = "corridor"
CORRIDOR_HALF_WIDTH_M = 15.0
_MANY_GAPS = 0.05
"""Of the steps of all sessions: with fewer gaps, other sessions close them, or they are pauses."""

_SHIFTS = 5
_AT_A_TIME = 4096
_SAME_DIRECTION = np.cos(np.radians(45.0))
_UNKNOWN_ACCURACY_M = 10.0
_BEST_ACCURACY_M = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Positions:
    """Positions of one session (m), in the order of time.

    ``accuracy_m`` is the receiver's own estimate; NaN where unknown.
    """

    east_m: Floats
    north_m: Floats
    accuracy_m: Floats | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Corridors:
    """Ways made of tracks.

    Parameters
    ----------
    ways : Ways
        Of one class, numbered from 1; they join in shared vertices.
    sessions : numpy.ndarray of int64, shape (N,)
        Number of sessions along each way, at its middle.
    half_width_m : float
        Half width of the corridor about each line.
    notes : tuple of str
        What was left out, and the width of the corridors.
    """

    ways: Ways
    sessions: Ints
    half_width_m: float
    notes: tuple[str, ...]


def corridors(
    crs: str,
    sessions: Sequence[Positions],
    half_width_m: float = CORRIDOR_HALF_WIDTH_M,
    *,
    max_accuracy_m: float = MAX_ACCURACY_M,
    max_gap_m: float = MAX_GAP_M,
    min_sessions: int = 1,
) -> Corridors:
    """Return the ways that the tracks of sessions follow.

    Parameters
    ----------
    crs : str
        Projected CRS of the positions, in metres.
    half_width_m : float
        Tracks nearer to each other than this are of one way. It should not be below the
        accuracy of the positions, nor above half the distance between parallel streets.
    max_accuracy_m : float
        Less accurate positions are left out; those of unknown accuracy are kept.
    max_gap_m : float
        Farther apart, the way between two positions is unknown.
    min_sessions : int
        Keep what at least so many sessions passed within the half width.

    Raises
    ------
    InputError
        A length is not > 0, columns of a session differ in length, a position is not finite, or
        no way is left.

    Examples
    --------
    >>> there = Positions(np.arange(0.0, 100.0, 5.0), np.full(20, 3.0))
    >>> back = Positions(np.arange(95.0, -5.0, -5.0), np.full(20, -3.0))
    >>> found = corridors("EPSG:32618", [there, back], 10.0)
    >>> len(found.ways), found.sessions.tolist(), shapely.length(found.ways.geometry).tolist()
    (1, [2], [95.0])
    """
    from scipy.spatial import cKDTree

    lengths_m = {"max_accuracy_m": max_accuracy_m, "max_gap_m": max_gap_m}
    _check(sessions, min_sessions, half_width_m=half_width_m, **lengths_m)
    step_m = half_width_m / 2
    pieces, coarse, alone = [], 0, 0
    for session, positions in enumerate(sessions):
        found, inaccurate, lonely = _pieces(positions, session, max_accuracy_m, max_gap_m, step_m)
        pieces += found
        coarse, alone = coarse + inaccurate, alone + lonely
    notes = [f"ways are corridors of {half_width_m:g} m to either side of tracks"]
    for count, why in (
        (coarse, f"less accurate than max_accuracy_m = {max_accuracy_m:g} m"),
        (alone, f"more than max_gap_m = {max_gap_m:g} m from the others, or standing"),
    ):
        if count:
            notes.append(f"{number_of(count, 'position')} left out: {why}")
    notes += _gap_notes(sessions, max_accuracy_m, max_gap_m, step_m)
    if not pieces:
        hint = "tracks with gaps: raise max_gap_m"
        raise fail(InputError, "tracks", "positions that follow each other", "none", hint)
    measured = cKDTree(np.concatenate([piece.place_m for piece in pieces]))
    of_session = np.concatenate([np.full(len(p.place_m), p.session) for p in pieces])
    drawn = _drawn_together(pieces, measured, half_width_m)
    passed = _sessions_near(np.concatenate(drawn), measured, of_session, half_width_m)
    kept = np.split(passed >= min_sessions, np.cumsum([len(part) for part in drawn])[:-1])
    lines = grown_lines(drawn, kept, half_width_m)
    if not lines:
        expected = f"a way of at least {half_width_m:g} m that {min_sessions} sessions went along"
        raise fail(InputError, "tracks", expected, "none")
    middle = np.array([line[len(line) // 2] for line in lines])
    ways = Ways.open(
        crs,
        np.arange(1, len(lines) + 1, dtype=np.int64),
        np.full(len(lines), _CLASS, dtype=object),
        np.array([shapely.LineString(line) for line in lines], dtype=object),
    )
    sessions_each = _sessions_near(middle, measured, of_session, half_width_m)
    return Corridors(ways, sessions_each, half_width_m, tuple(notes))


def _gap_notes(
    sessions: Sequence[Positions], max_accuracy_m: float, max_gap_m: float, step_m: float
) -> list[str]:
    """Return a note where so many positions are far apart that the ways are in pieces."""
    apart_m = [np.empty(0)]
    for one in sessions:
        place_m = np.column_stack([one.east_m, one.north_m])
        if one.accuracy_m is not None:
            place_m = place_m[~(one.accuracy_m > max_accuracy_m)]
        apart_m.append(np.hypot(*np.diff(place_m, axis=0).T))
    moved_m = np.concatenate(apart_m)
    moved_m = moved_m[moved_m >= step_m]
    gaps = int(np.sum(moved_m > max_gap_m))
    if gaps < _MANY_GAPS * len(moved_m) or not gaps:
        return []
    return [
        f"ways interrupted at {gaps} of {len(moved_m)} steps from position to position, longer "
        f"than max_gap_m = {max_gap_m:g} m (median step {np.median(moved_m):.0f} m): "
        "raise max_gap_m"
    ]


class _Piece(NamedTuple):
    """A part of a session without gaps, sampled evenly: places, directions, weights."""

    session: int
    place_m: Floats
    along: Floats
    weight: Floats


def _check(sessions: Sequence[Positions], min_sessions: int, **lengths_m: float) -> None:
    faults = Faults()
    faults.check_positive("", "metres", **lengths_m)
    if min_sessions < 1:
        faults.add("min_sessions", "a whole number >= 1", min_sessions)
    for number, positions in enumerate(sessions, start=1):
        columns = [positions.east_m, positions.north_m]
        if positions.accuracy_m is not None:
            columns.append(positions.accuracy_m)
        if len({column.shape for column in columns}) > 1:
            faults.add(f"session {number}", "columns of one length", [c.shape for c in columns])
        elif not np.isfinite(columns[:2]).all():
            faults.add(f"session {number}", "finite positions", "NaN or infinity")
    faults.raise_if_any(InputError)


def _pieces(
    positions: Positions, session: int, max_accuracy_m: float, max_gap_m: float, step_m: float
) -> tuple[list[_Piece], int, int]:
    """Return the parts of a session without gaps, and how many positions are in none of them.

    They are counted apart: those that are not accurate, and those that are alone.
    """
    place_m = np.column_stack([positions.east_m, positions.north_m])
    known = np.full(len(place_m), np.nan)
    if positions.accuracy_m is not None:
        known = positions.accuracy_m
    good = ~(known > max_accuracy_m)
    place_m, known = place_m[good], known[good]
    accuracy_m = np.fmax(np.where(np.isnan(known), _UNKNOWN_ACCURACY_M, known), _BEST_ACCURACY_M)
    gaps = np.flatnonzero(np.hypot(*np.diff(place_m, axis=0).T) > max_gap_m) + 1
    pieces, aside = [], 0
    for part in np.split(np.arange(len(place_m)), gaps):
        # Positions at least a step from the last one kept: none of standing still.
        kept: list[int] = []
        for i in part.tolist():
            if not kept or np.hypot(*(place_m[i] - place_m[kept[-1]])) >= step_m:
                kept.append(i)
        if len(kept) < 2:
            aside += len(part)
            continue
        pieces.append(_sampled(session, place_m[kept], accuracy_m[kept], step_m))
    return pieces, int((~good).sum()), aside


def _sampled(session: int, place_m: Floats, accuracy_m: Floats, step_m: float) -> _Piece:
    length_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(place_m, axis=0).T))])
    count = max(int(np.ceil(length_m[-1] / step_m)), 1) + 1
    at_m = np.linspace(0.0, length_m[-1], count)
    samples = np.column_stack([np.interp(at_m, length_m, axis) for axis in place_m.T])
    accuracy = np.interp(at_m, length_m, accuracy_m)
    # Unit vectors along the line; (1, 0) where it turns on the spot.
    along = np.gradient(samples, axis=0)
    length = np.hypot(*along.T)[:, None]
    unit: Floats = np.divide(along, length, out=np.zeros_like(along), where=length > 0)
    unit[length[:, 0] == 0, 0] = 1.0
    return _Piece(session, samples, unit, 1.0 / accuracy**2)


def _drawn_together(
    pieces: Sequence[_Piece], measured: cKDTree, half_width_m: float
) -> list[Floats]:
    """Shift samples across their direction to the weighted mean of what was measured nearby."""
    along = np.concatenate([piece.along for piece in pieces])
    weight = np.concatenate([piece.weight for piece in pieces])
    place_m = np.array(measured.data)
    for first in range(0, len(place_m), _AT_A_TIME):
        some = slice(first, first + _AT_A_TIME)
        across = np.column_stack([-along[some, 1], along[some, 0]])
        for _ in range(_SHIFTS):
            of, near = _pairs(measured, place_m[some], half_width_m)
            same = np.abs(np.sum(along[some][of] * along[near], axis=1)) >= _SAME_DIRECTION
            of, near = of[same], near[same]
            offset_m = np.sum((measured.data[near] - place_m[some][of]) * across[of], axis=1)
            total = np.bincount(of, weights=weight[near], minlength=len(across))
            moment = np.bincount(of, weights=weight[near] * offset_m, minlength=len(across))
            mean_m = np.divide(moment, total, out=np.zeros_like(moment), where=total > 0)
            place_m[some] += mean_m[:, None] * across
    return list(np.split(place_m, np.cumsum([len(piece.place_m) for piece in pieces])[:-1]))


def _sessions_near(place_m: Floats, measured: cKDTree, of_session: Ints, reach_m: float) -> Ints:
    """Return how many sessions passed within reach of each place."""
    counts = []
    for first in range(0, len(place_m), _AT_A_TIME):
        some = place_m[first : first + _AT_A_TIME]
        of, near = _pairs(measured, some, reach_m)
        passing = np.unique(np.column_stack([of, of_session[near]]), axis=0)[:, 0]
        counts.append(np.bincount(passing, minlength=len(some)))
    return np.concatenate(counts).astype(np.int64)


def _pairs(measured: cKDTree, place_m: Floats, reach_m: float) -> tuple[Ints, Ints]:
    """Return all pairs of a place and a measured one within reach, by their indices."""
    found = measured.query_ball_point(place_m, reach_m, return_sorted=True)
    of = np.repeat(np.arange(len(place_m)), [len(near) for near in found])
    return of, np.fromiter(itertools.chain.from_iterable(found), np.int64, count=of.size)
