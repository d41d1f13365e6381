"""A map against the measurements: levels, deviations, and sessions that were left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, NullLocator
from numpy.typing import NDArray

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.report.basemap import BaseMap, Bounds, LocalFrame, attribute, draw_base
from mapfilter.report.canvas import BLACK, BLUE, GREY, STREET, VERMILLION, grouped, picture
from mapfilter.report.layers import OVER_RASTER, keep_extent, raster_extent, shape_faults

MAX_CELLS = 4

_PANEL_IN = 4.4
_BAR_IN = 1.0
_ASPECT = 0.8
_LEVELS = "viridis"
_SCATTER_IN = (7.8, 6.6)
_NO_DATA = "#f2f2f2"
_DENSITY = LinearSegmentedColormap.from_list("density", ["#bcd9ee", BLUE, "#001d36"])
_BIN_DB = 1.5
_RIM_DB = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class SurveyedLevels:
    """The map of one cell and what it was made from.

    Parameters
    ----------
    cell_id : str
    lattice : Lattice
        Where the pixels lie.
    level_dbm, deviation_db : (rows, cols) arrays
        Mean level, and how far off a reading may be; NaN where nobody measured.
    east_m, north_m, measured_dbm : arrays of equal length
        The measurements.
    """

    cell_id: str
    lattice: Lattice
    level_dbm: NDArray[np.floating]
    deviation_db: NDArray[np.floating]
    east_m: Floats
    north_m: Floats
    measured_dbm: Floats


def plot_surveyed_levels(cells: Sequence[SurveyedLevels], base: BaseMap, path: Path) -> None:
    """Draw up to four cells: the level with the measured points in its colours, the deviation.

    A point that vanishes in its surroundings is told well. The ends of both scales are those of
    the data of all cells shown.

    Parameters
    ----------
    cells : sequence of SurveyedLevels
        One to four, in the order of the rows.
    base : BaseMap
        The map below.
    path : Path
        PNG to write.

    Raises
    ------
    InputError
        There is no cell, or more than four, or a raster does not fit its lattice.
    OutputError
        The picture cannot be written.
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
    with picture(path, 2 * (_PANEL_IN + _BAR_IN) + 0.4, height_in) as figure:
        panels = figure.subplots(count, 2, squeeze=False)
        for cell, (left, right) in zip(cells, panels, strict=True):
            shown = base.zoomed(_surroundings(cell))
            points = grouped(len(cell.measured_dbm))
            left.set_title(f"{cell.cell_id}: level, {points} measurements", fontsize=10)
            right.set_title(f"{cell.cell_id}: deviation", fontsize=10)
            frame = _draw_raster(figure, left, cell.level_dbm, cell.lattice, shown, _LEVELS,
                                 levels_dbm, "level / dBm", scale_bar=True)  # fmt: skip
            _draw_raster(figure, right, cell.deviation_db, cell.lattice, shown, "magma_r",
                         deviations_db, "deviation / dB", scale_bar=False)  # fmt: skip
            x, y = frame(cell.east_m, cell.north_m)
            left.scatter(
                x, y, s=15, c=cell.measured_dbm, cmap=_LEVELS, vmin=levels_dbm[0],
                vmax=levels_dbm[1], edgecolors="white", linewidths=0.25, zorder=5,
            )  # fmt: skip
            right.scatter(x, y, s=3, color=BLACK, linewidths=0, zorder=5)
            right.set_ylabel("")
            right.set_yticklabels([])
            attribute(right, shown)


def plot_left_out(
    measured_dbm: Floats,
    predicted_dbm: Floats,
    path: Path,
    *,
    title: str = "Measured against predicted",
    trend_dbm: Floats | None = None,
    attribution: str = "",
) -> None:
    """Draw measured against predicted levels of sessions that the map did not know.

    Parameters
    ----------
    measured_dbm, predicted_dbm : (n,) arrays
        At least one finite pair.
    path : Path
        PNG to write.
    title : str
        What was left out.
    trend_dbm : (n,) array, optional
        What the trend alone predicts, to tell what the residuals bring.
    attribution : str
        Whose measurements they are.

    Raises
    ------
    InputError
        The arrays are of different lengths, empty or not finite.
    OutputError
        The picture cannot be written.
    """
    faults = Faults()
    for name, values in (("predicted", predicted_dbm), ("trend", trend_dbm)):
        if values is not None and values.shape != measured_dbm.shape:
            faults.add(f"{name} levels", f"{measured_dbm.size} of them", values.size)
    faults.raise_if_any(InputError)
    if not (measured_dbm.size and np.isfinite(np.stack([measured_dbm, predicted_dbm])).all()):
        raise fail(InputError, "left-out levels", "finite levels (dBm)", "none, or NaN")
    error_db = measured_dbm - predicted_dbm
    rmse_db = _rms(error_db)
    low, high = _range([measured_dbm, predicted_dbm], (-120, -60))
    low, high = low - _RIM_DB, high + _RIM_DB
    ends = np.array([low, high])
    with picture(path, *_SCATTER_IN) as figure:
        axes = figure.subplots()
        bins = max(int((high - low) / _BIN_DB), 10)
        density = axes.hexbin(
            predicted_dbm, measured_dbm, gridsize=bins, extent=(low, high, low, high),
            cmap=_DENSITY, norm=LogNorm(vmin=1), mincnt=1, linewidths=0.2, zorder=3,
        )  # fmt: skip
        axes.plot(ends, ends, color=BLACK, linewidth=1.4, zorder=4, label="as predicted")
        for sign in (-1, 1):
            axes.plot(
                ends, ends + sign * rmse_db, color=VERMILLION, linewidth=1.2,
                linestyle=(0, (5, 3)), zorder=4, label="± RMSE" if sign > 0 else None,
            )  # fmt: skip
        axes.set_xlim(low, high)
        axes.set_ylim(low, high)
        axes.set_aspect("equal")
        axes.grid(color=STREET, linewidth=0.5, zorder=0)
        axes.set_xlabel("predicted level / dBm")
        axes.set_ylabel("measured level / dBm")
        axes.set_title(title)
        told = f"RMSE {rmse_db:.1f} dB"
        if trend_dbm is not None:
            told += f" (trend alone {_rms(measured_dbm - trend_dbm):.1f} dB)"
        mean_db = round(float(error_db.mean()), 1)
        bias = f"{mean_db:+.1f}".replace("-", "\N{MINUS SIGN}") if mean_db else "0.0"
        told += f"\nbias {bias} dB\n{grouped(error_db.size)} measurements"
        axes.text(
            0.025, 0.975, told, transform=axes.transAxes, ha="left", va="top", linespacing=1.5,
            bbox={"facecolor": "white", "edgecolor": STREET, "boxstyle": "round,pad=0.45"},
            zorder=6,
        )  # fmt: skip
        axes.legend(loc="lower right", borderpad=0.6, bbox_to_anchor=(1.0, 0.02))
        most = float(np.asarray(density.get_array(), dtype=np.float64).max())
        bar = figure.colorbar(density, ax=axes, shrink=0.8, pad=0.02, aspect=32)
        bar.set_ticks([n * 10.0**power for power in range(8) for n in (1, 2, 5)
                       if n * 10.0**power <= most])  # fmt: skip
        bar.ax.yaxis.set_major_formatter(FormatStrFormatter("%.0f"))
        bar.ax.yaxis.set_minor_locator(NullLocator())
        bar.set_label("measurements per hexagon")
        if attribution:
            figure.text(
                0.995, 0.004, attribution, ha="right", va="bottom", fontsize=6.5, color=GREY
            )


def _draw_raster(
    figure: Figure, axes: Axes, values: NDArray[np.floating], lattice: Lattice, base: BaseMap,
    colours: str, ends: tuple[float, float], label: str, *, scale_bar: bool,
) -> LocalFrame:  # fmt: skip
    frame = draw_base(axes, base, streets=OVER_RASTER, scale_bar=scale_bar)
    axes.set_facecolor(_NO_DATA)
    image = axes.imshow(
        np.ma.masked_invalid(values), extent=raster_extent(lattice, base, frame.unit_m),
        cmap=colours, vmin=ends[0], vmax=ends[1], interpolation="nearest", zorder=1,
    )  # fmt: skip
    keep_extent(axes, base, frame.unit_m)
    bar = figure.colorbar(image, ax=axes, shrink=0.8, pad=0.02, aspect=28)
    bar.set_label(label)
    return frame


def _surroundings(cell: SurveyedLevels) -> Bounds:
    """Return the extent of where a cell was measured, brought to the shape of the panels."""
    row, col = np.nonzero(np.isfinite(cell.deviation_db))
    lattice = cell.lattice
    if not row.size:
        row, col = np.array([0, lattice.rows - 1]), np.array([0, lattice.cols - 1])
    east, north = lattice.east_north(
        np.array([row.min(), row.max()]), np.array([col.min(), col.max()])
    )
    around_m = 3 * lattice.resolution_m
    width_m, height_m = np.ptp(east) + 2 * around_m, np.ptp(north) + 2 * around_m
    half_m = max(width_m, height_m / _ASPECT) / 2
    return (
        float(east.mean() - half_m), float(north.mean() - half_m * _ASPECT),
        float(east.mean() + half_m), float(north.mean() + half_m * _ASPECT),
    )  # fmt: skip


def _range(
    values: Sequence[NDArray[np.floating]], if_empty: tuple[float, float]
) -> tuple[float, float]:
    """Return the ends of the finite values, put out to whole numbers."""
    known = np.concatenate([v[np.isfinite(v)].ravel() for v in values])
    if not known.size:
        return if_empty
    low, high = np.floor(known.min()), np.ceil(known.max())
    return float(low), float(max(high, low + 1))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
