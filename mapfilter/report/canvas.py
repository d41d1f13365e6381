"""Figures and colours that all pictures share.

Pictures are drawn with matplotlib's object-oriented interface only: no pyplot, no state that
outlives a call. Equal data give equal bytes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mapfilter._io import atomic_file

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

_DISTINCT = (
    BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION, YELLOW, "#12355b", "#7a4b00", "#8c8c8c",
    "#7b2d63", "#b9b4e8", "#00563f", "#f5a58f", "#87871f",
)  # fmt: skip

_STYLE: dict[Any, Any] = {
    "axes.edgecolor": GREY,
    "axes.labelcolor": BLACK,
    "axes.labelsize": 10,
    "axes.linewidth": 0.8,
    "axes.titlesize": 11,
    "figure.facecolor": "white",
    "font.family": ["DejaVu Sans"],
    "font.size": 10,
    "legend.fontsize": 9,
    "legend.framealpha": 0.92,
    "legend.edgecolor": STREET,
    "savefig.bbox": None,
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


@contextmanager
def picture(path: Path, width_in: float, height_in: float) -> Iterator[Figure]:
    """Give an empty figure; write it to ``path`` as PNG, in one step, when the block succeeds.

    Parameters
    ----------
    path : Path
        Where the PNG goes; its folder is made.
    width_in, height_in : float
        Size in inches, at :data:`DPI` pixels each.

    Raises
    ------
    OutputError
        The folder cannot be made or written.
    """
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(width_in, height_in), layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
        with atomic_file(path) as temporary:
            # The library's version in the file would change its bytes from one to the next.
            figure.savefig(temporary, format="png", dpi=DPI, metadata={"Software": None})


def bottom_legend(
    figure: Figure, most_columns: int, handles: Sequence[Artist] | None = None
) -> None:
    """Put a legend under the axes, in as many columns as there is room for.

    Parameters
    ----------
    figure : Figure
        One of :func:`picture`.
    most_columns : int
    handles : sequence of Artist, optional
        What is in it; without, all that is labelled.
    """
    given: dict[str, Any] = {} if handles is None else {"handles": handles, "handletextpad": 0.4}
    for columns in range(most_columns, 0, -1):
        legend = figure.legend(loc="outside lower center", ncols=columns, frameon=False, **given)
        if columns == 1 or legend.get_window_extent().width <= figure.bbox.width:
            return
        legend.remove()


def distinct_colours(count: int) -> list[str]:
    """Return colours that tell ``count`` groups apart, also for the colour-blind.

    The first seven are those of Okabe and Ito (2008) with a darker yellow, the next eight differ
    from them in lightness; then they repeat, which is why maps also name every group in its place.

    Examples
    --------
    >>> len(set(distinct_colours(15))), len(distinct_colours(30))
    (15, 30)
    """
    return [_DISTINCT[i % len(_DISTINCT)] for i in range(count)]


def grouped(count: int) -> str:
    """Return a count with thin spaces between thousands.

    Examples
    --------
    >>> grouped(999), grouped(68600) == "68\N{THIN SPACE}600"
    ('999', True)
    """
    return f"{count:,}".replace(",", "\N{THIN SPACE}")
