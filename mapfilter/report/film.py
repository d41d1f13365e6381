"""A replay as a film: belief, estimate and truth with their trails, moment after moment."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, isfinite
from pathlib import Path

import numpy as np
from matplotlib import animation
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from mapfilter._inputs import open_input, read_input
from mapfilter._io import atomic_file, check_replaceable
from mapfilter._parallel import Progress
from mapfilter._types import Floats
from mapfilter.errors import OutputError, fail
from mapfilter.report.basemap import BaseMap, LocalFrame, attribute, draw_base, map_height_in
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    SKY,
    VERMILLION,
    Look,
    bottom_legend,
    figure_of,
    mark,
    new_figure,
    styled,
)

FILM_FORMATS = {".gif": "pillow", ".mp4": "ffmpeg"}
"""Endings of films, and the writers of matplotlib that make them."""

_LAST_BYTES = {
    ".gif": b"!\xfe\x0emapfilter film\x00;",
    ".mp4": b"\x00\x00\x00\x16freemapfilter film",
}
"""What films end with, which no player shows: a comment and the trailer, and a free box."""
_MOST_BYTES = 1 << 31

_WIDTH_IN, _DPI = 6.4, 100
_LABELS_IN, _ROW_IN, _TITLE_IN = 0.75, 0.2, 0.85
_COLUMNS, _PER_SECOND = 4, 10
_BELIEF = (0.0, 0.45, 0.70)
_TRUTH = "#868686"
_SEARCHING = "#8c8c8c"
_TRAILS = {"CONVERGED": BLUE, "TRACKING": BLUE, "UNCERTAIN": SKY}
"""Statuses whose positions make a trail, by colours: the others jump about."""
_COLORS = {**_TRAILS, "SEARCHING": _SEARCHING, "LOST": VERMILLION, "OUTSIDE": VERMILLION}
_WORDS = {
    BLUE: "estimate",
    SKY: "while uncertain",
    _SEARCHING: "while searching",
    VERMILLION: "lost or outside",
}
_LEAP_M, _LEAP_STEPS = 40.0, 5.0
"""A longer step, and so many usual ones, is no movement: the trail is cut."""


@dataclass(frozen=True, slots=True, eq=False)
class FilmTrack:
    """What a film shows the way of; places are east and north in the map's CRS.

    Parameters
    ----------
    estimate_m, truth_m : ndarray, shape (n, 2)
        At each epoch; NaN for none.
    radius_95_m : ndarray, shape (n,)
        NaN for none.
    status : tuple of str
        Of each epoch.
    """

    estimate_m: Floats
    truth_m: Floats
    radius_95_m: Floats
    status: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class FilmMoment:
    """One picture of a film.

    Parameters
    ----------
    epoch : int
        Index into the track.
    caption : str
        Such as the time.
    squares_m : ndarray, shape (n, 2)
        South-western corners of the belief's squares, east and north in the map's CRS.
    side_m : float
        Of a square.
    shade : ndarray, shape (n,)
        0 to 1.
    """

    epoch: int
    caption: str
    squares_m: Floats
    side_m: float
    shade: Floats


@styled
def write_film(
    track: FilmTrack,
    moments: Sequence[FilmMoment],
    base: BaseMap,
    path: Path,
    *,
    title: str = "",
    progress: Progress | None = None,
) -> Path:
    """Write a film as GIF or, where ffmpeg is found, as MP4, by the suffix.

    An older film is replaced.

    Parameters
    ----------
    track : FilmTrack
        The run; each moment shows its way up to then.
    progress : callable, optional
        Called with the numbers of pictures drawn and of all.

    Raises
    ------
    OutputError
        The format is another one, its writer is missing, there is a file that is no older film, or
        the file cannot be written.
    """
    kind = path.suffix.lower()
    name = FILM_FORMATS.get(kind)
    where = str(path)
    if name is None:
        raise fail(OutputError, where, f"a film: {' or '.join(FILM_FORMATS)}", path.suffix)
    if not animation.writers.is_available(name):
        hint = "install the package ffmpeg, or write a .gif"
        raise fail(OutputError, where, "the program ffmpeg, which makes MP4", "none", hint)
    check_replaceable(path, _is_film, "an older film")
    marks = _marks(track, moments)
    rows = ceil(len(marks) / _COLUMNS)
    height_in = map_height_in(base, _WIDTH_IN - _LABELS_IN) + _TITLE_IN + _ROW_IN * rows
    figure = new_figure(_WIDTH_IN, height_in)
    axes = figure.subplots()
    frame = draw_base(axes, base)
    attribute(axes, base)
    bottom_legend(figure, _COLUMNS, marks)
    leap_m = _leap_m(track.estimate_m)
    writer = animation.writers[name](fps=_PER_SECOND)
    with atomic_file(path) as temporary:
        drawn: list[Artist] = []
        with writer.saving(figure_of(axes), str(temporary), _DPI):
            for number, moment in enumerate(moments, start=1):
                for one in drawn:
                    one.remove()
                drawn = [
                    *_draw_belief(axes, frame, moment),
                    *_draw_trails(axes, frame, track, moment.epoch, leap_m),
                    *_draw_place(axes, frame, track, moment.epoch),
                ]
                status = track.status[moment.epoch].lower()
                axes.set_title(f"{title}  {moment.caption}  {status}", fontsize=9)
                writer.grab_frame()
                if progress is not None:
                    progress(number, len(moments))
        _mark_as_film(temporary, kind)
    return path


def _mark_as_film(path: Path, kind: str) -> None:
    """Mark a film as one that a later one may replace."""
    film = read_input(path, _MOST_BYTES, "a film", OutputError)
    # The trailer of a GIF is its last byte.
    path.write_bytes((film[:-1] if kind == ".gif" else film) + _LAST_BYTES[kind])


def _is_film(path: Path) -> bool:
    last = _LAST_BYTES[path.suffix.lower()]
    try:
        with open_input(path, OutputError) as stream:
            stream.seek(-len(last), os.SEEK_END)
            return stream.read() == last
    except (OutputError, OSError):
        return False


def _marks(track: FilmTrack, moments: Sequence[FilmMoment]) -> list[Artist]:
    """Return the marks of the legend: of what is in the film."""
    found: list[Artist] = []
    if np.isfinite(track.truth_m).any():
        line = Look(color=_TRUTH, linewidth=4.0, marker="x", markeredgecolor=BLACK)
        found.append(Line2D([], [], label="truth", **line))
    located = np.isfinite(track.estimate_m[:, 0]).tolist()
    statuses = {one for one, known in zip(track.status, located, strict=True) if known}
    for color, words in _WORDS.items():
        own = [status for status in statuses if _COLORS.get(status, BLUE) == color]
        if own:
            line = Look(color=color, linewidth=1.6 if set(own) & set(_TRAILS) else 0.0)
            found.append(Line2D([], [], label=words, marker="o", markersize=6, **line))
    if np.isfinite(track.radius_95_m[located]).any():
        found.append(mark("95 % radius", "o", 9, fillstyle="none", color=BLACK))
    if any(len(moment.squares_m) for moment in moments):
        found.append(mark("belief", "s", 8, color=(*_BELIEF, 0.6)))
    return found


def _leap_m(estimate_m: Floats) -> float:
    """Return the longest step that is a movement."""
    step_m = np.hypot(*np.diff(estimate_m, axis=0).T)
    moved_m = step_m[step_m > 0]
    return max(_LEAP_M, _LEAP_STEPS * float(np.median(moved_m)) if moved_m.size else 0.0)


def _draw_belief(axes: Axes, frame: LocalFrame, moment: FilmMoment) -> list[Artist]:
    if not len(moment.squares_m):
        return []
    side = moment.side_m / frame.unit_m
    corner = np.column_stack(frame(*moment.squares_m.T))
    outline = np.array([[0, 0], [side, 0], [side, side], [0, side]])
    colors = np.zeros((len(corner), 4))
    colors[:, :3] = _BELIEF
    colors[:, 3] = 0.15 + 0.85 * moment.shade
    squares = PolyCollection(corner[:, None] + outline, facecolors=colors, zorder=3)
    squares.set_linewidth(0)
    return [axes.add_collection(squares)]


def _draw_trails(
    axes: Axes, frame: LocalFrame, track: FilmTrack, epoch: int, leap_m: float
) -> list[Artist]:
    """Draw the way of truth and estimate up to an epoch."""
    until = slice(0, epoch + 1)
    drawn: list[Artist] = []
    truth_m = track.truth_m[until]
    if np.isfinite(truth_m).any():
        drawn += axes.plot(*frame(*truth_m.T), color=_TRUTH, linewidth=4.0, alpha=0.5, zorder=2.5)
    at_m = track.estimate_m[until]
    ends = np.column_stack(frame(*at_m.T))
    pairs = np.stack([ends[:-1], ends[1:]], axis=1)
    moved = np.hypot(*np.diff(at_m, axis=0).T) <= leap_m
    status = np.array(track.status[until])
    moved &= np.isin(status[:-1], list(_TRAILS)) & np.isin(status[1:], list(_TRAILS))
    colors = [_TRAILS[one] for one in status[1:][moved].tolist()]
    lines = LineCollection(list(pairs[moved]), colors=colors, linewidths=1.6, zorder=4)
    return [*drawn, axes.add_collection(lines)]


def _draw_place(axes: Axes, frame: LocalFrame, track: FilmTrack, epoch: int) -> list[Artist]:
    drawn: list[Artist] = []
    color = _COLORS.get(track.status[epoch], BLUE)
    for places_m, shape, edge in ((track.truth_m, "x", BLACK), (track.estimate_m, "o", color)):
        if np.isfinite(places_m[epoch]).all():
            x, y = frame(*places_m[epoch : epoch + 1].T)
            drawn += axes.plot(x, y, shape, color=edge, markersize=6, zorder=6)
    radius_m = float(track.radius_95_m[epoch])
    if isfinite(radius_m) and np.isfinite(track.estimate_m[epoch]).all():
        x, y = frame(*track.estimate_m[epoch : epoch + 1].T)
        circle = Circle((float(x[0]), float(y[0])), radius_m / frame.unit_m, fill=False)
        circle.set(edgecolor=color, linewidth=1.2, zorder=5)
        drawn.append(axes.add_patch(circle))
    return drawn
