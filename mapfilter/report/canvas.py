"""Figures, colours and legends that all pictures share.

Every ``plot_*`` function of this package draws only: on the matplotlib axes that it is given, or
on a figure of its own, and returns the axes (the figure where it has several panels).
:func:`mapfilter.report.saving.save` writes either. Pictures use matplotlib's object-oriented
interface: no pyplot, no state that outlives a call. Equal data give equal bytes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import fill
from typing import Any

import matplotlib
import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import hsv_to_rgb, to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from mapfilter._arguments import shown
from mapfilter._types import Bools
from mapfilter.errors import ConfigError, fail

DPI = 150
"""Pixels per inch of every picture."""

BLACK = "#1a1a1a"
GREY = "#6b6b6b"
STREET = "#d3d3d3"
BLUE = "#0072b2"
SKY = "#56b4e9"
GREEN = "#009e73"
ORANGE = "#e69f00"
VERMILLION = "#d55e00"
PURPLE = "#cc79a7"
YELLOW = "#d9c400"

_OKABE_ITO = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION, YELLOW)
_DISTINCT = (
    *_OKABE_ITO,
    *("#12355b", "#7a4b00", "#8c8c8c", "#7b2d63", "#b9b4e8", "#00563f", "#f5a58f", "#87871f"),
)
_TINTS = ((1.0, 0.5), (0.0, 0.35), (1.0, 0.72))
"""Grey level that is mixed in, and how much of it, from one round of the colours to the next."""

_LETTERS_PT, _LEAST_LETTERS = 130.0, 12
"""Points of type size times letters in an inch, of words and numbers in DejaVu Sans."""

_BESIDE_IN = 0.6
"""What the labels of the axes take of a figure's width, so that its middle is not theirs."""

_GOLDEN, _ROOT_2, _ROOT_3 = (5**0.5 - 1) / 2, 2**0.5, 3**0.5
"""Irrational steps of hue, saturation and value from one further colour to the next."""

_STYLE: dict[Any, Any] = {
    "axes.edgecolor": GREY,
    "axes.labelcolor": BLACK,
    "axes.labelsize": 10,
    "axes.linewidth": 0.8,
    "axes.titlesize": 11,
    # As nothing is above the axes, matplotlib would find the same, at each layout anew.
    "axes.titley": 1.0,
    "figure.facecolor": "white",
    "font.family": ["DejaVu Sans"],
    "font.size": 10,
    "legend.fontsize": 9,
    "legend.framealpha": 0.92,
    "legend.edgecolor": STREET,
    "savefig.bbox": None,
    "svg.hashsalt": "mapfilter",
    "text.color": BLACK,
    # A cell id may hold a dollar sign.
    "text.parse_math": False,
    "text.usetex": False,
    "xtick.color": GREY,
    "xtick.labelcolor": BLACK,
    "xtick.labelsize": 9,
    "ytick.color": GREY,
    "ytick.labelcolor": BLACK,
    "ytick.labelsize": 9,
}

Drawn = Axes | Figure
"""Result of a ``plot_*`` function."""

Look = dict[str, Any]
"""Keywords of artists: ``Look(color=BLUE, linewidth=1.5)``."""


styled = matplotlib.rc_context(_STYLE)
"""Decorator of all functions that draw: fonts, sizes and colours of the package."""

saved = matplotlib.rc_context({k: v for k, v in _STYLE.items() if k != "text.parse_math"})
"""Decorator of functions that write: ticks that matplotlib makes only then, such as those of
logarithmic axes, are mathematical text."""


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure of a size in inches, at :data:`DPI` pixels each."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def check_axes(given: Axes | None) -> None:
    """Check what is given to draw on.

    Raises
    ------
    ConfigError
        It is a figure, an array of axes, or anything else but axes or None.
    """
    hint = {
        "Figure": "a figure; give ax=figure.subplots()",
        "SubFigure": "a figure; give ax=figure.subplots()",
        "ndarray": "several axes of plt.subplots; give one of them",
    }.get(type(given).__name__, "")
    if not isinstance(given, Axes | None):
        raise fail(ConfigError, "plot, ax", "matplotlib axes, or None", shown(given), hint)


def single_axes(given: Axes | None, width_in: float, height_in: float) -> Axes:
    """Return the axes given, or those of a new figure of a size in inches."""
    check_axes(given)
    return new_figure(width_in, height_in).subplots() if given is None else given


def letters_in(width_in: float, size_pt: float) -> int:
    """Return about how many letters of running text fit into a width, at least a word's."""
    return max(int(_LETTERS_PT * width_in / size_pt), _LEAST_LETTERS)


def wrapped_title(axes: Axes, text: str) -> str:
    """Return a title in as many lines as it needs over the axes; see :func:`letters_in`.

    Over the only axes of a figure it may be as wide as that, otherwise as the axes.
    """
    figure = figure_of(axes)
    alone = len(figure.axes) == 1
    own_in = axes.get_window_extent().width / figure.dpi
    room_in = figure.get_figwidth() - _BESIDE_IN if alone else own_in
    return fill(text, letters_in(room_in, rcParams["axes.titlesize"]))


def figure_of(axes: Axes) -> Figure:
    """Return the figure that axes are part of."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    return figure


def tidy(axes: Axes, *, grid: bool = True) -> None:
    """Take away the upper and right edge, and draw a pale grid below the data."""
    axes.spines[["top", "right"]].set_visible(False)
    if grid:
        axes.grid(color="#e8e8e8", linewidth=0.7)
        axes.set_axisbelow(True)


def draw_shares(axes: Axes, values: ArrayLike, **line: Any) -> None:
    """Draw a cumulative distribution in percent, with a line as of ``axes.step``.

    NaN and infinity count as larger than any value: the line then ends below 100 %.
    """
    given = np.ravel(np.asarray(values, dtype=np.float64))
    known = np.sort(given[np.isfinite(given)])
    share = 100 * np.arange(known.size + 1) / max(given.size, 1)
    axes.step(np.concatenate([[0.0], known]), share, where="post", **line)
    axes.set_ylim(0, 101)


def mark(label: str, marker: Any, size: float, **style: Any) -> Line2D:
    """Return a mark for a legend, with its meaning."""
    return Line2D([], [], linestyle="", marker=marker, markersize=size, label=label, **style)


def stretches(where: Bools) -> Iterator[tuple[int, int]]:
    """Yield the first index of each stretch that is true, and the one after its last.

    Examples
    --------
    >>> list(stretches(np.array([True, False, True, True])))
    [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], where, [0]]).astype(np.int8)))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def bottom_legend(
    figure: Figure,
    most_columns: int,
    handles: Sequence[Artist] | None = None,
    title: str | None = None,
) -> None:
    """Put a legend under the axes, in as many columns as there is room for.

    It shows the handles, or without any all that is labelled, if anything is; the title is a line
    above them.
    """
    if handles is None and not any(ax.get_legend_handles_labels()[0] for ax in figure.axes):
        return
    given: dict[str, Any] = {} if handles is None else {"handles": handles, "handletextpad": 0.4}
    given |= {"title": title, "title_fontsize": 9, "frameon": False}
    for columns in range(most_columns, 0, -1):
        legend = figure.legend(loc="outside lower center", ncols=columns, **given)
        if columns == 1 or legend.get_window_extent().width <= figure.bbox.width:
            return
        legend.remove()


def legend(axes: Axes, given: Axes | None, most_columns: int) -> None:
    """Put a legend under the axes of a figure of ours, or into axes that were ``given``."""
    if given is None:
        bottom_legend(figure_of(axes), most_columns)
    elif axes.get_legend_handles_labels()[0]:
        axes.legend()


def distinct_colours(count: int) -> list[str]:
    """Return colours that distinguish ``count`` groups, also for the colour-blind.

    The first seven are those of Okabe and Ito (2008) with a darker yellow, the next eight differ
    from them in lightness, the next 45 are lighter and darker ones of these; further ones go round
    the hues by the golden angle. Of the first 10 000 no two are equal, but not all can
    be told apart by eye, which is why maps also name every group in its place.

    Examples
    --------
    >>> len(set(distinct_colours(60))), len(set(distinct_colours(10_000)))
    (60, 10000)
    """
    colours = list(_DISTINCT)
    for grey, share in _TINTS:
        mixed = (1 - share) * np.array([to_rgb(colour) for colour in _DISTINCT]) + share * grey
        colours += [to_hex(colour) for colour in mixed]
    more = range(max(count - len(colours), 0))
    hues = [
        (_GOLDEN * i % 1, 0.35 + 0.5 * (_ROOT_2 * i % 1), 0.55 + 0.4 * (_ROOT_3 * i % 1))
        for i in more
    ]
    return [*colours, *(to_hex(tuple(hsv_to_rgb(hue))) for hue in hues)][:count]


def grouped(count: int) -> str:
    """Return a count with thin spaces between thousands.

    Examples
    --------
    >>> grouped(999), grouped(68600) == "68\N{THIN SPACE}600"
    ('999', True)
    """
    return f"{count:,}".replace(",", "\N{THIN SPACE}")
