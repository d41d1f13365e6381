"""Missing ways: paths off the map that several journeys took.

Between two stretches where a journey is well known and on the map, its dead reckoning is turned,
stretched and closed so that it joins both. Where the path leaves the mapped ways there, and several
journeys leave them along the same path, a way is proposed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from scipy.ndimage import distance_transform_edt

from mapfilter._types import Bools, Floats
from mapfilter.database.field import RadioField
from mapfilter.errors import InputError
from mapfilter.learning.patch import Change
from mapfilter.learning.tracks import JourneyTrack
from mapfilter.roads.corridors import Positions, corridors
from mapfilter.tracks.log import TrackLog

LEAST_JOURNEYS = 3
_HALF_WIDTH_M = 5.0
_REACH_M = 12.0
_OFF_M = 9.0
_LEAST_M = 30.0
_KNOWN_M = 25.0
_ANCHOR_M = 20.0
_LONGEST_M = 500.0
_STEP_M = 5.0
_SAMPLE_M, _GAP_M = 2.0, 12.0
_TURN_RAD, _STRETCH = math.radians(20.0), 0.15
_PRIOR = 0.01


def missing_ways(
    field: RadioField, tracks: Sequence[JourneyTrack], logs: Sequence[TrackLog]
) -> tuple[Change, ...]:
    """Return the ways that journeys propose, the best supported first.

    The log Bayes factor compares a way with journeys that leave the map each for itself: then
    every further one is on the same path with the probability that a path anywhere off the map is.

    Parameters
    ----------
    field : RadioField
        The mapped points.
    tracks, logs : sequences
        Of journeys that were located where they were.
    """
    lattice = field.lattice
    away_m = distance_transform_edt(~field.on_way) * lattice.resolution_m
    pieces = []
    for number, (track, log) in enumerate(zip(tracks, logs, strict=True)):
        pieces += [(number, piece) for piece in off_map_pieces(track, log, field, away_m)]
    if len({number for number, _ in pieces}) < LEAST_JOURNEYS:
        return ()
    sessions = [
        Positions(
            np.concatenate([p[:, 0] for n, p in pieces if n == number]),
            np.concatenate([p[:, 1] for n, p in pieces if n == number]),
        )
        for number in sorted({number for number, _ in pieces})
    ]
    try:
        found = corridors(
            lattice.crs, sessions, _REACH_M, max_gap_m=3 * _STEP_M, min_sessions=LEAST_JOURNEYS
        )
    except InputError:
        return ()
    proposed = []
    open_m2 = float(np.sum(away_m > _OFF_M)) * lattice.resolution_m**2
    parts = (part for line in found.ways.geometry for part in _off_parts(line, field, away_m))
    for part in parts:
        number = _passing(part, pieces)
        if number < LEAST_JOURNEYS:
            continue
        share = min(2 * _REACH_M * part.length / max(open_m2, 1.0), 0.5)
        bayes = -(number - 1) * math.log(share)
        odds = bayes + math.log(_PRIOR)
        proposed.append(
            Change(
                "way",
                line_m=tuple(map(tuple, shapely.get_coordinates(part.simplify(2.0)).tolist())),
                half_width_m=_HALF_WIDTH_M,
                log_bayes_factor=bayes,
                probability=1 / (1 + math.exp(-min(odds, 700.0))),
                journeys=number,
                agreeing=number,
            )
        )
    return tuple(sorted(proposed, key=lambda one: -one.log_bayes_factor))


def off_map_pieces(
    track: JourneyTrack, log: TrackLog, field: RadioField, away_m: Floats
) -> Iterator[Floats]:
    """Yield the paths (n, 2) of one journey off the map, each with its ends on it."""
    motion = log.motion[log.motion["step_m"].notna() & log.motion["heading_rad"].notna()]
    if len(motion) < 2:
        return
    step, heading = motion["step_m"].to_numpy(), motion["heading_rad"].to_numpy()
    steps = np.column_stack([step * np.cos(heading), step * np.sin(heading)])
    reckoned, walked = np.cumsum(steps, axis=0), np.cumsum(np.abs(step))
    east, north, radius = track.at(motion["time_s"].to_numpy())
    place = np.column_stack([east, north])
    away = _sampled(away_m, field, place)
    good = _anchored((radius <= _KNOWN_M) & (away <= _OFF_M), walked)
    ends = np.flatnonzero(good)
    for a, b in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        if b == a + 1 or walked[b] - walked[a] > _LONGEST_M:
            continue
        joined = _joined(reckoned[a : b + 1], place[a], place[b])
        if joined is None:
            continue
        off = _sampled(away_m, field, joined) > _OFF_M
        if np.hypot(*np.diff(joined[off], axis=0).T).sum() >= _LEAST_M:
            length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(joined, axis=0).T))])
            at = np.arange(0.0, length[-1], _STEP_M)
            even = np.column_stack([np.interp(at, length, axis) for axis in joined.T])
            near = _sampled(away_m, field, even) > _OFF_M
            if not near.any():
                # It cuts corners of pixels only.
                continue
            # With what lies just before and after, so that the way joins the map.
            grown = np.convolve(near, np.ones(5), "same") > 0
            yield even[grown]


def _anchored(known: Bools, walked_m: Floats) -> Bools:
    """Return where a journey is known for some metres before and after."""
    found = np.zeros(known.shape, dtype=np.bool_)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], known.astype(np.int8), [0]])))
    for first, end in edges.reshape(-1, 2).tolist():
        run = np.arange(first, end)
        inner = walked_m[run] - walked_m[first] >= _ANCHOR_M
        inner &= walked_m[end - 1] - walked_m[run] >= _ANCHOR_M
        found[run[inner]] = True
    return found


def _joined(reckoned_m: Floats, start_m: Floats, end_m: Floats) -> Floats | None:
    """Return dead reckoning turned and stretched onto two places; None where that is too much."""
    path = reckoned_m - reckoned_m[0]
    along, across = complex(*path[-1]), complex(*(end_m - start_m))
    length = np.hypot(*np.diff(path, axis=0).T).sum()
    if abs(along) < 0.3 * length or abs(across) < _ANCHOR_M:
        # A loop tells nothing of turn and scale: only its gap is closed.
        gap = (end_m - start_m) - path[-1]
        if np.hypot(*gap) > _STRETCH * length:
            return None
        share = np.linspace(0.0, 1.0, len(path))[:, None]
        return np.asarray(start_m + path + share * gap)
    change = across / along
    if abs(np.angle(change)) > _TURN_RAD or abs(abs(change) - 1.0) > _STRETCH:
        return None
    turned = (path[:, 0] + 1j * path[:, 1]) * change
    return np.asarray(start_m + np.column_stack([turned.real, turned.imag]))


def _off_parts(
    line: shapely.LineString, field: RadioField, away_m: Floats
) -> Iterator[shapely.LineString]:
    """Yield the parts of a line that run off the map, each a little longer at its ends."""
    at = np.arange(0.0, line.length + 0.1, _SAMPLE_M)
    places = shapely.get_coordinates(shapely.line_interpolate_point(line, at))
    off = np.flatnonzero(_sampled(away_m, field, places) > _OFF_M - 3.0)
    runs = np.split(off, np.flatnonzero(np.diff(off) > _GAP_M / _SAMPLE_M) + 1)
    more = round(_OFF_M / _SAMPLE_M)
    for run in runs:
        if run.size > 1 and _SAMPLE_M * run.size >= 0.7 * _LEAST_M:
            yield shapely.LineString(places[max(run[0] - more, 0) : run[-1] + more + 1])


def _passing(line: shapely.LineString, pieces: Sequence[tuple[int, Floats]]) -> int:
    """Return how many journeys passed the middle of a line."""
    middle = shapely.get_coordinates(line.interpolate(0.5, normalized=True))[0]
    near = {n for n, place in pieces if np.hypot(*(place - middle).T).min() <= _REACH_M}
    return len(near)


def _sampled(values: Floats, field: RadioField, place_m: Floats) -> Floats:
    """Return the values of pixels at places; 0 where a place is unknown or beyond the lattice."""
    known: Bools = np.asarray(np.isfinite(place_m).all(axis=1), dtype=np.bool_)
    safe = np.where(known[:, None], place_m, 0.0)
    row, col = field.lattice.row_col(safe[:, 0], safe[:, 1])
    found = np.zeros(len(place_m))
    inside = np.flatnonzero(known & np.asarray(field.lattice.contains(row, col)))
    found[inside] = values[row[inside], col[inside]]
    return found
