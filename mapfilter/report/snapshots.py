"""The belief about one track at up to six moments, a map each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil, sqrt
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Status
from mapfilter.positioning.positioned_track import Snapshot
from mapfilter.report.basemap import (
    BaseMap,
    Bounds,
    LocalFrame,
    attribute,
    draw_base,
    map_height_in,
)
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    STREET,
    VERMILLION,
    Look,
    bottom_legend,
    grouped,
    letters_in,
    mark,
    new_figure,
    styled,
)
from mapfilter.report.ground import MAX_PANELS as MAX_PANELS

_PANEL_IN, _TITLE_PT, _LINE_IN = 4.0, 10.5, 0.2
_SIDE_M, _MOST_SQUARES = 10.0, 200
_DECADES, _FAINTEST = 2.0, 0.12
_FAINTEST_CANDIDATE = 0.15
_LETTERS_PER_IN = 13
_HELD, _MARGIN_SHARE, _LEAST_MARGIN_M, _LEAST_SIDE = 0.95, 0.06, 30.0, 0.6
_OFF_STREETS = (
    "Squares of {side_m:.0f} m. A little of the belief lies off the streets, in water, too: "
    "maps lack ways."
)

_Draw = Callable[[Axes, LocalFrame, Snapshot], None]


@styled
def plot_belief(
    snapshots: Sequence[Snapshot], truth: Truth | None, base: BaseMap, *, zoom: bool = True
) -> Figure:
    """Draw the probabilities of places at one to six moments, one panel each.

    A square of 10 m (or of half a percent of a larger area) fades with its probability, down to a
    hundredth of the likeliest square's; squares with less than a thousandth are not drawn. All
    panels show the same extent, which holds 95 % of each belief, the estimates and the true path so
    far, and name the distance travelled, in true metres where the truth is known. Without
    ``zoom`` they show the whole map.

    Raises
    ------
    InputError
        There is no snapshot, or more than six.
    """
    if zoom:
        base = base.zoomed(story_bounds_m(snapshots, truth, base.bounds_m))
    west, south, east, north = base.bounds_m
    side_m = max(_SIDE_M, max(east - west, north - south) / _MOST_SQUARES)

    def draw(axes: Axes, frame: LocalFrame, snapshot: Snapshot) -> None:
        if not snapshot.weight.size:
            return
        at_m = np.array([snapshot.hypothesis_east_m, snapshot.hypothesis_north_m])
        low = np.floor(at_m.min(axis=1) / side_m).astype(np.int64)
        col, row = np.floor(at_m / side_m).astype(np.int64) - low[:, None]
        mass = np.zeros((int(row.max()) + 1, int(col.max()) + 1))
        np.add.at(mass, (row, col), snapshot.weight)
        pixels = np.empty((*mass.shape, 4), dtype=np.uint8)
        pixels[..., :3] = np.round(255 * np.array(to_rgb(BLUE)))
        pixels[..., 3] = np.round(255 * fading(mass / mass.max()))
        extent = frame.extent((*(low * side_m), *((low + mass.shape[1::-1]) * side_m)))
        limits = axes.get_xlim(), axes.get_ylim()
        axes.imshow(pixels, extent=extent, origin="lower", interpolation="nearest", zorder=4)
        axes.set(xlim=limits[0], ylim=limits[1])

    shares = {"likeliest": 1.0, "a tenth of it": 0.1, "a hundredth": 0.01}
    look = Look(markeredgewidth=0, color=BLUE)
    marks = [
        mark(name, "s", 7, alpha=float(fading(np.array(share))), **look)
        for name, share in shares.items()
    ]
    note = _OFF_STREETS.format(side_m=side_m)
    return _plot_panels(snapshots, truth, base, draw, _mass_text, marks, note)


@styled
def plot_candidates(snapshots: Sequence[Snapshot], truth: Truth | None, base: BaseMap) -> Figure:
    """Draw the hypotheses at up to six moments, one panel each, with truth and estimate.

    Every panel names the number of hypotheses left; a hypothesis fades with its share of the
    belief. Errors are those of :func:`plot_belief`.
    """

    def draw(axes: Axes, frame: LocalFrame, snapshot: Snapshot) -> None:
        count = snapshot.hypothesis_east_m.size
        if not count:
            return
        x, y = frame(snapshot.hypothesis_east_m, snapshot.hypothesis_north_m)
        colours = np.empty((count, 4))
        colours[:, :3] = to_rgb(BLUE)
        share = snapshot.weight / snapshot.weight.max()
        colours[:, 3] = _FAINTEST_CANDIDATE + (1 - _FAINTEST_CANDIDATE) * np.clip(share, 0.0, 1.0)
        # Few are drawn large, thousands small enough to show the streets they lie on.
        size = float(np.clip(90.0 / sqrt(count), 2.0, 36.0))
        axes.scatter(x, y, s=size, c=colours, linewidths=0, zorder=4)

    def text(snapshot: Snapshot) -> str:
        left = snapshot.hypothesis_east_m.size
        return f"{grouped(left)} {'candidate' if left == 1 else 'candidates'}"

    dot = mark("candidates", "o", 5, color=BLUE)
    return _plot_panels(snapshots, truth, base, draw, text, [dot])


def _plot_panels(
    snapshots: Sequence[Snapshot],
    truth: Truth | None,
    base: BaseMap,
    draw: _Draw,
    text: Callable[[Snapshot], str],
    marks: Sequence[Line2D],
    note: str = "",
) -> Figure:
    count = len(snapshots)
    if not 1 <= count <= MAX_PANELS:
        raise fail(InputError, "snapshots", f"1 to {MAX_PANELS}", count)
    if truth is not None and not truth.time_s.size:
        truth = None
    columns = count if count <= 3 else ceil(count / 2)
    rows = ceil(count / columns)
    height_in = rows * (map_height_in(base, _PANEL_IN) + 0.45) + (1.15 if note else 0.9)
    if columns == 1:
        height_in += 0.7  # the legend takes several lines
    titles = _titles(snapshots, truth, text)
    height_in += rows * _LINE_IN * ("\n" in titles[0])
    figure = new_figure(columns * (_PANEL_IN + 0.1) + 0.6, height_in)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for index, (axes, snapshot) in enumerate(zip(panels, snapshots, strict=False)):
        north_at = _free_corner(snapshot, truth, base.bounds_m)
        frame = draw_base(axes, base, scale_bar=index == 0, north_at=north_at)
        draw(axes, frame, snapshot)
        _draw_path(axes, frame, snapshot, truth)
        axes.set_title(titles[index], fontsize=_TITLE_PT)
        if index % columns:
            axes.set_ylabel("")
            axes.set_yticklabels([])
        if index + columns < count:
            axes.set_xlabel("")
            axes.set_xticklabels([])
    for axes in panels[count:]:
        axes.set_visible(False)
    attribute(panels[count - 1], base)
    handles = [Line2D([], [], color=STREET, linewidth=2, label="where one can be"), *marks]
    if truth is not None:
        rim = Look(markerfacecolor="none", markeredgecolor=BLACK, markeredgewidth=1.6)
        handles.append(Line2D([], [], color=BLACK, linewidth=1.3, label="true path so far"))
        handles.append(mark("true position", "D", 7, **rim))
    if any(np.isfinite(s.east_m) for s in snapshots):
        ring = Look(markerfacecolor="none", markeredgecolor=VERMILLION, markeredgewidth=2.0)
        handles.append(mark("estimate", "o", 9, **ring))
    line = int(_LETTERS_PER_IN * figure.get_figwidth())
    bottom_legend(figure, len(handles), handles, fill(note, line) or None)
    return figure


def _titles(
    snapshots: Sequence[Snapshot], truth: Truth | None, text: Callable[[Snapshot], str]
) -> list[str]:
    """Return the titles of the panels; all have two lines where one is too long for its panel."""
    titles = []
    for letter, snapshot in zip("abcdef", snapshots, strict=False):
        travelled = f"{snapshot.travelled_m:.0f} m by dead reckoning"
        if truth is not None:
            travelled = f"{float(truth.distance_at(snapshot.time_s)):.0f} m travelled"
        panel = f"({letter}) " if len(snapshots) > 1 else ""
        titles.append((f"{panel}{travelled},", text(snapshot)))
    most = letters_in(_PANEL_IN, _TITLE_PT)
    long = any(len(" ".join(parts)) > most for parts in titles)
    return [("\n" if long else " ").join(parts) for parts in titles]


def story_bounds_m(snapshots: Sequence[Snapshot], truth: Truth | None, whole_m: Bounds) -> Bounds:
    """Return the part of a map where nearly all of some beliefs, and their estimates, lie.

    West, south, east, north: 95 % of each belief by its weights, in east and in north, all
    estimates and the true path until the last snapshot, with a margin, inside ``whole_m``.
    """
    corners: list[Floats] = []
    for one in snapshots:
        corners.append(np.array([[one.east_m, one.north_m]]))
        if one.weight.size:
            corners.append(_middle(one))
    if truth is not None and truth.time_s.size and snapshots:
        past = truth.time_s <= max(one.time_s for one in snapshots)
        corners.append(np.column_stack([truth.east_m[past], truth.north_m[past]]))
    places = np.concatenate([np.empty((0, 2)), *corners])
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        return whole_m
    low, high = places.min(axis=0), places.max(axis=0)
    margin_m = max(_LEAST_MARGIN_M, _MARGIN_SHARE * float((high - low).max()))
    half = np.maximum((high - low) / 2, _LEAST_SIDE * float((high - low).max()) / 2) + margin_m
    whole_low, whole_high = np.array(whole_m[:2]), np.array(whole_m[2:])
    half = np.minimum(half, (whole_high - whole_low) / 2)
    middle = np.clip((low + high) / 2, whole_low + half, whole_high - half)
    (west, south), (east, north) = (middle - half).tolist(), (middle + half).tolist()
    return west, south, east, north


def _middle(snapshot: Snapshot) -> Floats:
    """Return the lower and upper corner of what holds most of a belief, in east and in north."""
    ends = []
    for at_m in (snapshot.hypothesis_east_m, snapshot.hypothesis_north_m):
        order = np.argsort(at_m, kind="stable")
        below = np.cumsum(snapshot.weight[order]) / snapshot.weight.sum()
        at = np.searchsorted(below, [(1 - _HELD) / 2, (1 + _HELD) / 2]).clip(max=order.size - 1)
        ends.append(at_m[order][at])
    return np.stack(ends, axis=1)


def _free_corner(snapshot: Snapshot, truth: Truth | None, bounds_m: Bounds) -> float:
    """Return where along the upper edge the north arrow covers neither truth nor estimate."""
    east_m = snapshot.east_m
    if truth is not None:
        east_m = float(truth.at(snapshot.time_s)[0])
    return 0.04 if east_m > (bounds_m[0] + bounds_m[2]) / 2 else 0.96


def _draw_path(axes: Axes, frame: LocalFrame, snapshot: Snapshot, truth: Truth | None) -> None:
    if truth is not None:
        past = truth.time_s <= snapshot.time_s
        axes.plot(
            *frame(truth.east_m[past], truth.north_m[past]), color=BLACK, linewidth=1.3, zorder=5
        )
        at = frame(*truth.at(snapshot.time_s))
        rim = Look(facecolors="none", edgecolors=BLACK, linewidths=1.6)
        axes.scatter(*at, s=52, marker="D", zorder=7, **rim)
    if np.isfinite(snapshot.east_m) and np.isfinite(snapshot.north_m):
        at = frame(np.array([snapshot.east_m]), np.array([snapshot.north_m]))
        # A ring: a small belief, and the truth, are seen in it.
        ring = Look(facecolors="none", edgecolors=VERMILLION, linewidths=2.0)
        axes.scatter(*at, s=110, marker="o", zorder=8, **ring)


def fading(share: Floats) -> Floats:
    """Return the opacity of a square by its share of the likeliest square's probability.

    Examples
    --------
    >>> fading(np.array([1.0, 0.1, 0.01, 0.001, 0.0005])).round(2).tolist()
    [1.0, 0.5, 0.12, 0.12, 0.0]
    """
    with np.errstate(divide="ignore"):
        decades = np.log10(share)
    opaque = np.clip(1.0 + decades / _DECADES, _FAINTEST, 1.0)
    return np.where(share >= 1e-3, opaque, 0.0)


def _mass_text(snapshot: Snapshot) -> str:
    off_m = np.hypot(
        snapshot.hypothesis_east_m - snapshot.east_m, snapshot.hypothesis_north_m - snapshot.north_m
    )
    share = float(snapshot.weight[off_m <= SUCCESS_RADIUS_M].sum())
    shown = "> 99.9" if share > 0.999 else f"{100 * share:.{1 if share > 0.99 else 0}f}"
    words = f"{shown} % within {SUCCESS_RADIUS_M:.0f} m"
    return f"{words}: converged" if snapshot.status is Status.CONVERGED else words
