"""Pictures of a sweep: which of its runs go into which."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import pandas as pd

from mapfilter.evaluation.success_cells import COORDINATES, SuccessCell, success_cells
from mapfilter.report.run_distributions import plot_run_distributions
from mapfilter.report.success_curves import plot_success_curves
from mapfilter.report.success_map import plot_success_map

_NOISES = ("sigma_trans_m", "sigma_orient_deg")
_UNITS = {
    "prediction_error_db": "prediction error {:g} dB",
    "report_period_s": "reports every {:g} s",
    "imu_period_s": "dead reckoning every {:g} s",
    "update_length_m": "updates of {:g} m",
    "bias_deg": "bias {:g}°",
    "drift_deg_per_sqrt_s": "drift {:g}°/√s",
    "scale": "scale {:g}",
}
_MOST_CURVES, _MOST_GROUPS = 8, 16


def draw_sweep(runs: pd.DataFrame, out: Path) -> tuple[Path, ...]:
    """Draw curves, a map and distributions for each group of a sweep; groups differ in all but σ.

    Returns
    -------
    pictures : tuple of Path
        ``success.png``, ``success-map.png`` and ``distributions.png``, with numbers before the
        ending where there are several groups, of which the first 16 are drawn.
    """
    drawn: list[Path] = []
    groups = list(groups_of(runs))[:_MOST_GROUPS]
    for number, (title, rows) in enumerate(groups, start=1):
        tail = f"-{number}" if len(groups) > 1 else ""
        drawn += draw_group(rows, out, tail, title)
    return tuple(drawn)


def draw_group(rows: pd.DataFrame, out: Path, tail: str, title: str) -> list[Path]:
    """Draw the pictures of runs that differ in white noise only."""
    names = ("success", "success-map", "distributions")
    paths = [out / f"{name}{tail}.png" for name in names]
    cells = success_cells(rows)
    by_step = _by_step(cells)
    plot_success_curves(list(by_step.items())[:_MOST_CURVES], paths[0], title=title)
    plot_success_map(cells, paths[1], title=title)
    one = rows[rows["sigma_trans_m"] == sorted(rows["sigma_trans_m"].unique())[0]]
    by_heading = [(f"heading {sigma:g}°", some) for sigma, some in one.groupby("sigma_orient_deg")]
    plot_run_distributions(by_heading[:_MOST_CURVES], paths[2], title=title)
    return paths


def groups_of(runs: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield the runs by all coordinates but the white noises, each with a title."""
    axes = [name for name in COORDINATES if name not in _NOISES]
    several = [name for name in axes if runs[name].nunique(dropna=False) > 1]
    for place, rows in runs.groupby(axes, sort=False, dropna=False):
        at = dict(zip(axes, place, strict=True))
        yield _title(at, several), rows


def _title(at: Mapping[str, object], several: list[str]) -> str:
    name, reading = at["filter"], at["reading"]
    told = [f"{name} filter" if reading == name else f"{name} filter: {reading}"]
    for axis in several:
        if axis in _UNITS:
            told.append(_UNITS[axis].format(at[axis]))
        elif axis in ("database", "radio"):
            told.append(str(at[axis]))
    return ", ".join(told)


def _by_step(cells: tuple[SuccessCell, ...]) -> dict[str, list[SuccessCell]]:
    curves: dict[str, list[SuccessCell]] = {}
    for cell in sorted(cells, key=lambda one: one.sigma_trans_m):
        curves.setdefault(f"step {cell.sigma_trans_m:g} m", []).append(cell)
    return curves
