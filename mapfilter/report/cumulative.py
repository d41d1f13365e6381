"""Cumulative distributions of errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from mapfilter._types import Floats
from mapfilter.report.canvas import GREY, Look, draw_shares, legend, single_axes, styled, tidy

_SIZE_IN = (7.6, 5.2)
_NEAR, _FAR = 0.98, 1.5
"""An axis of errors holds all, unless the largest are beyond this many times those of a share."""
_PUBLISHED = Look(markersize=8, markerfacecolor="white", markeredgewidth=1.8)


class Distribution(NamedTuple):
    """The errors of one filter: NaN where it has no position; the curve then ends below 100 %.

    ``claim_m`` is what is published for the share that is marked.
    """

    name: str
    errors_m: Floats
    colour: str
    style: str = "-"
    claim_m: float | None = None


def axis_end_m(curves: Sequence[Distribution]) -> float:
    """Return where an axis ends that shows all errors but a few far ones; none is NaN.

    Examples
    --------
    >>> axis_end_m([Distribution("a", np.arange(101.0), "k")])
    100.0
    >>> axis_end_m([Distribution("a", np.append(np.arange(100.0), 500.0), "k")])
    98.0
    """
    most_m = max(float(np.quantile(curve.errors_m, _NEAR)) for curve in curves)
    largest_m = max(float(curve.errors_m.max()) for curve in curves)
    return max(largest_m if largest_m <= _FAR * most_m else most_m, 1.0)


@styled
def plot_cumulative(
    curves: Sequence[Distribution],
    ax: Axes | None = None,
    *,
    title: str,
    most_m: float,
    share: float = 0.9,
    of: str = "epochs",
) -> Axes:
    """Draw cumulative distributions, a line at a share (0 to 1), and what is claimed for it.

    ``most_m`` is the end of the axis of errors (:func:`axis_end_m`), and ``of`` what they are of.
    """
    axes = single_axes(ax, *_SIZE_IN)
    for curve in curves:
        look = Look(color=curve.colour, linestyle=curve.style, linewidth=1.6)
        draw_shares(axes, curve.errors_m, label=curve.name, **look)
    dotted = Look(color=GREY, linewidth=0.9, linestyle=(0, (2, 2)))
    axes.axhline(100 * share, label=f"{100 * share:g} % of the {of}", **dotted)
    claims = [(curve.claim_m, curve.colour) for curve in curves if curve.claim_m is not None]
    for claim_m, colour in claims:
        look = Look(markeredgecolor=colour, zorder=5, clip_on=False) | _PUBLISHED
        axes.plot([claim_m], [100 * share], "D", **look)
    if claims:
        name = f"published, {100 * share:g} %"
        axes.plot([], [], "D", markeredgecolor=GREY, label=name, **_PUBLISHED)
    axes.set_xlim(0, most_m)
    axes.set(xlabel="position error / m", ylabel=f"share of {of} / %", title=title)
    tidy(axes)
    legend(axes, ax, 3)
    return axes
