"""A replay as a film: belief, estimate and truth on the map, moment after moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import animation
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Circle

from mapfilter._io import atomic_file
from mapfilter._types import Floats
from mapfilter.errors import OutputError, fail
from mapfilter.report.basemap import BaseMap, LocalFrame, draw_base, map_height_in
from mapfilter.report.canvas import BLACK, BLUE, SKY, VERMILLION, figure_of, new_figure, styled

FILM_FORMATS = {".gif": "pillow", ".mp4": "ffmpeg"}
"""Endings of films, and the writers of matplotlib that make them."""

_WIDTH_IN, _DPI = 6.4, 100
_COLORS = {
    "SEARCHING": "#8c8c8c",
    "UNCERTAIN": SKY,
    "LOST": VERMILLION,
    "OUTSIDE": VERMILLION,
}


@dataclass(frozen=True, slots=True)
class FilmMoment:
    """One picture of a film; places are east and north in the map's CRS.

    Parameters
    ----------
    caption : str
        Such as the time.
    squares_m : ndarray, shape (n, 2)
        South-western corners of the belief's squares.
    side_m : float
        Of a square.
    shade : ndarray, shape (n,)
        0 to 1.
    estimate_m, truth_m : tuple of float
        NaN for none.
    radius_95_m : float
        NaN for none.
    """

    caption: str
    squares_m: Floats
    side_m: float
    shade: Floats
    estimate_m: tuple[float, float]
    radius_95_m: float
    truth_m: tuple[float, float]
    status: str


@styled
def write_film(
    moments: Sequence[FilmMoment],
    base: BaseMap,
    path: Path,
    *,
    title: str = "",
    per_second: int = 10,
) -> Path:
    """Write a film as GIF or, where ffmpeg is found, as MP4, by the suffix.

    Parameters
    ----------
    per_second : float
        Pictures a second.

    Raises
    ------
    OutputError
        The format is another one, its writer is missing, or the file cannot be written.
    """
    name = FILM_FORMATS.get(path.suffix.lower())
    where = str(path)
    if name is None:
        raise fail(OutputError, where, f"a film: {' or '.join(FILM_FORMATS)}", path.suffix)
    if not animation.writers.is_available(name):
        hint = "install the package ffmpeg, or write a .gif"
        raise fail(OutputError, where, "the program ffmpeg, which makes MP4", "none", hint)
    figure = new_figure(_WIDTH_IN, map_height_in(base, _WIDTH_IN) + 0.6)
    axes = figure.subplots()
    frame = draw_base(axes, base)
    writer = animation.writers[name](fps=per_second)
    with atomic_file(path) as temporary:
        drawn: list[Any] = []
        with writer.saving(figure_of(axes), str(temporary), _DPI):
            for moment in moments:
                for one in drawn:
                    one.remove()
                drawn = _draw(axes, frame, moment)
                axes.set_title(f"{title}  {moment.caption}  {moment.status}", fontsize=9)
                writer.grab_frame()
    return path


def _draw(axes: Axes, frame: LocalFrame, moment: FilmMoment) -> list[Any]:
    drawn: list[Any] = []
    if len(moment.squares_m):
        side = moment.side_m / frame.unit_m
        corner = np.column_stack(frame(*moment.squares_m.T))
        outline = np.array([[0, 0], [side, 0], [side, side], [0, side]])
        colors = np.zeros((len(corner), 4))
        colors[:, :3] = 0.0, 0.45, 0.70
        colors[:, 3] = 0.15 + 0.85 * moment.shade
        squares = PolyCollection(corner[:, None] + outline, facecolors=colors, zorder=3)
        squares.set_linewidth(0)
        drawn.append(axes.add_collection(squares))
    color = _COLORS.get(moment.status, BLUE)
    for place, shape, edge in ((moment.truth_m, "x", BLACK), (moment.estimate_m, "o", color)):
        if isfinite(place[0]):
            x, y = frame(np.array([place[0]]), np.array([place[1]]))
            drawn += axes.plot(x, y, shape, color=edge, markersize=6, zorder=6)
    if isfinite(moment.radius_95_m) and isfinite(moment.estimate_m[0]):
        x, y = frame(*(np.array([at]) for at in moment.estimate_m))
        circle = Circle((float(x[0]), float(y[0])), moment.radius_95_m / frame.unit_m, fill=False)
        circle.set(edgecolor=color, linewidth=1.2, zorder=5)
        drawn.append(axes.add_patch(circle))
    return drawn
