"""A map against the measurements: levels, deviations, and sessions that were left out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, NullLocator
from numpy.typing import NDArray

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.report.basemap import (
    OVER_RASTER,
    BaseMap,
    Bounds,
    attribute,
    draw_base,
    draw_raster,
    local_frame,
    shape_faults,
)
from mapfilter.report.canvas import (
    BLACK,
    BLUE,
    GREY,
    STREET,
    VERMILLION,
    Look,
    figure_of,
    grouped,
    new_figure,
    single_axes,
    styled,
)
from mapfilter.survey.leave_out import rms

MAX_CELLS = 4

_PANEL_IN = 4.4
_BAR_IN = 1.0
_ASPECT = 0.8
_SCATTER_IN = (7.8, 6.6)
_NO_DATA = "#f2f2f2"
_DENSITY = LinearSegmentedColormap.from_list("density", ["#bcd9ee", BLUE, "#001d36"])
_BIN_DB = 1.5
_RIM_DB = 2.0


class SurveyedLevels(NamedTuple):
    """The map of one cell and its measurements.

    Mean level and its standard deviation, (rows, cols) on the lattice, NaN where nothing was
    measured; the measurements are arrays of equal length.
    """

    cell_id: str
    lattice: Lattice
    level_dbm: NDArray[np.floating]
    deviation_db: NDArray[np.floating]
    east_m: Floats
    north_m: Floats
    measured_dbm: Floats


@styled
def plot_surveyed_levels(cells: Sequence[SurveyedLevels], base: BaseMap) -> Figure:
    """Draw one to four cells: the level with the measured points in its colours, the deviation.

    A point of its surroundings' colour is predicted well. All panels show the same extent, where
    any of the cells was measured, and the ends of both scales are those of all cells shown.

    Raises
    ------
    InputError
        There is no cell, or more than four, or a raster does not fit its lattice.
    """
    count = len(cells)
    if not 1 <= count <= MAX_CELLS:
        raise fail(InputError, "cells to draw", f"1 to {MAX_CELLS}", count)
    for cell in cells:
        for raster in (cell.level_dbm, cell.deviation_db):
            shape_faults(raster, cell.lattice).raise_if_any(InputError)
    levels_dbm = _range([v for c in cells for v in (c.level_dbm, c.measured_dbm)], (-120, -60))
    deviations_db = _range([c.deviation_db for c in cells], (0, 10))
    height_in = count * (_PANEL_IN * _ASPECT + 0.95) + 0.15
    figure = new_figure(2 * (_PANEL_IN + _BAR_IN) + 0.4, height_in)
    panels = figure.subplots(count, 2, squeeze=False)
    shown = base.zoomed(_surroundings(cells))
    for cell, (left, right) in zip(cells, panels, strict=True):
        for axes, values, ends, colours, label in (
            (left, cell.level_dbm, levels_dbm, "viridis", "level / dBm"),
            (right, cell.deviation_db, deviations_db, "magma_r", "deviation / dB"),
        ):
            draw_base(axes, shown, streets=OVER_RASTER, scale_bar=axes is left)
            axes.set_facecolor(_NO_DATA)
            look = Look(cmap=colours, clim=ends, zorder=1)
            image = draw_raster(axes, shown, cell.lattice, values, **look)
            look = Look(shrink=0.8, pad=0.02, aspect=28)
            figure.colorbar(image, ax=axes, label=label, **look)
        at = local_frame(shown)(cell.east_m, cell.north_m)
        # A rim about all of them: rims of dense points would hide their colours.
        left.scatter(*at, s=32, color=BLACK, linewidths=0, zorder=5)
        look = Look(cmap="viridis", clim=levels_dbm, linewidths=0)
        left.scatter(*at, s=15, c=cell.measured_dbm, zorder=5.5, **look)
        right.scatter(*at, s=3, color=BLACK, linewidths=0, zorder=5)
        points = grouped(len(cell.measured_dbm))
        left.set_title(f"{cell.cell_id}: level, {points} measurements", fontsize=10)
        right.set_title(f"{cell.cell_id}: deviation", fontsize=10)
        right.set_ylabel("")
        right.set_yticklabels([])
        attribute(right, shown)
    return figure


@styled
def plot_left_out(
    measured_dbm: Floats,
    predicted_dbm: Floats,
    ax: Axes | None = None,
    *,
    title: str = "Measured against predicted",
    trend_dbm: Floats | None = None,
    attribution: str = "",
) -> Axes:
    """Draw measured against predicted levels of sessions that the map was made without.

    Levels are arrays, (n,); ``trend_dbm`` is what the trend alone predicts, to show what the
    residuals add. ``attribution`` names the owner of the measurements.

    Raises
    ------
    InputError
        The arrays are of different lengths, empty or not finite.
    """
    faults = Faults()
    for name, values in (("predicted", predicted_dbm), ("trend", trend_dbm)):
        if values is not None and values.shape != measured_dbm.shape:
            faults.add(f"{name} levels", f"{measured_dbm.size} of them", values.size)
    faults.raise_if_any(InputError)
    if not (measured_dbm.size and np.isfinite(np.stack([measured_dbm, predicted_dbm])).all()):
        raise fail(InputError, "left-out levels", "finite levels (dBm)", "none, or NaN")
    error_db = measured_dbm - predicted_dbm
    rmse_db = rms(error_db)
    low, high = _range([measured_dbm, predicted_dbm], (-120, -60))
    low, high = low - _RIM_DB, high + _RIM_DB
    axes = single_axes(ax, *_SCATTER_IN)
    hexagons = Look(
        gridsize=max(int((high - low) / _BIN_DB), 10),
        extent=(low, high, low, high),
        cmap=_DENSITY,
        norm=LogNorm(vmin=1),
        mincnt=1,
        linewidths=0.2,
    )
    density = axes.hexbin(predicted_dbm, measured_dbm, zorder=3, **hexagons)
    ends = np.array([low, high])
    axes.plot(ends, ends, color=BLACK, linewidth=1.4, zorder=4, label="as predicted")
    dashed = Look(color=VERMILLION, linewidth=1.2, linestyle=(0, (5, 3)), zorder=4)
    axes.plot(ends, ends + rmse_db, label="± RMSE", **dashed)
    axes.plot(ends, ends - rmse_db, **dashed)
    axes.set(xlim=(low, high), ylim=(low, high), aspect="equal", title=title)
    axes.grid(color=STREET, linewidth=0.5, zorder=0)
    axes.set(xlabel="predicted level / dBm", ylabel="measured level / dBm")
    text = f"RMSE {rmse_db:.1f} dB"
    if trend_dbm is not None:
        text += f" (trend alone {rms(measured_dbm - trend_dbm):.1f} dB)"
    mean_db = round(float(error_db.mean()), 1)
    bias = f"{mean_db:+.1f}".replace("-", "\N{MINUS SIGN}") if mean_db else "0.0"
    text += f"\nbias {bias} dB\n{grouped(error_db.size)} measurements"
    box = Look(facecolor="white", edgecolor=STREET, boxstyle="round,pad=0.45")
    look = Look(va="top", linespacing=1.5, bbox=box, zorder=6)
    axes.text(0.025, 0.975, text, transform=axes.transAxes, **look)
    axes.legend(loc="lower right", borderpad=0.6, bbox_to_anchor=(1.0, 0.02))
    most = float(np.asarray(density.get_array(), dtype=np.float64).max())
    figure = figure_of(axes)
    bar = figure.colorbar(density, ax=axes, shrink=0.8, pad=0.02, aspect=32)
    counts = [n * 10.0**power for power in range(8) for n in (1, 2, 5)]
    bar.set_ticks([count for count in counts if count <= most])
    bar.ax.yaxis.set_major_formatter(FormatStrFormatter("%.0f"))
    bar.ax.yaxis.set_minor_locator(NullLocator())
    bar.set_label("measurements per hexagon")
    if attribution and ax is None:
        small = Look(ha="right", va="bottom", fontsize=6.5, color=GREY)
        figure.text(0.995, 0.004, attribution, **small)
    return axes


def _surroundings(cells: Sequence[SurveyedLevels]) -> Bounds:
    """Return the extent of where any cell was measured, brought to the shape of the panels."""
    measured = np.array([_measured_m(cell) for cell in cells])
    low_m, high_m = measured[:, :2].min(axis=0), measured[:, 2:].max(axis=0)
    width_m, height_m = high_m - low_m
    half_m = max(width_m, height_m / _ASPECT) / 2 * np.array([1.0, _ASPECT])
    west, south = ((low_m + high_m) / 2 - half_m).tolist()
    east, north = ((low_m + high_m) / 2 + half_m).tolist()
    return west, south, east, north


def _measured_m(cell: SurveyedLevels) -> Bounds:
    """Return the extent of where a cell was measured with some room, the whole where nowhere."""
    row, col = np.nonzero(np.isfinite(cell.deviation_db))
    lattice = cell.lattice
    if not row.size:
        row, col = np.array([0, lattice.rows - 1]), np.array([0, lattice.cols - 1])
    ends = np.array([row.min(), row.max()]), np.array([col.min(), col.max()])
    east_m, north_m = lattice.east_north(*ends)
    around_m = 3 * lattice.resolution_m
    west, south = float(east_m.min()) - around_m, float(north_m.min()) - around_m
    return west, south, float(east_m.max()) + around_m, float(north_m.max()) + around_m


def _range(
    values: Sequence[NDArray[np.floating]], if_empty: tuple[float, float]
) -> tuple[float, float]:
    """Return the ends of the finite values, put out to whole numbers."""
    known = np.concatenate([v[np.isfinite(v)].ravel() for v in values])
    if not known.size:
        return if_empty
    low, high = np.floor(known.min()), np.ceil(known.max())
    return float(low), float(max(high, low + 1))
