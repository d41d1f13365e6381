"""``mapfilter sweep``: success over a grid of inertial noise, filters and worlds."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress, executor_of
from mapfilter.config.load import load_config, load_keys
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError, Faults
from mapfilter.evaluation.success import COORDINATES, SuccessCell, success_cells
from mapfilter.experiments.sweep.run import sweep
from mapfilter.experiments.sweep.table import read_runs
from mapfilter.report.canvas import save
from mapfilter.report.success import plot_run_distributions, plot_success_curves, plot_success_map
from mapfilter.workflows.sweep_plan import sweep_databases, sweep_plan, sweep_world

_NOISES = ("sigma_trans_m", "sigma_orient_deg")
_UNITS = {
    "prediction_error_db": "prediction error {:g} dB",
    "report_period_s": "reports every {:g} s",
    "imu_period_s": "dead reckoning every {:g} s",
    "update_length_m": "updates of {:g} m",
    "bias_sd_deg": "bias {:g}°",
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
    save(plot_success_curves(list(by_step.items())[:_MOST_CURVES], title=title), paths[0])
    save(plot_success_map(cells, title=title), paths[1])
    one = rows[rows["sigma_trans_m"] == sorted(rows["sigma_trans_m"].unique())[0]]
    by_heading = [(f"heading {sigma:g}°", some) for sigma, some in one.groupby("sigma_orient_deg")]
    save(plot_run_distributions(by_heading[:_MOST_CURVES], title=title), paths[2])
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
        if axis in _UNITS and pd.notna(at[axis]):
            told.append(_UNITS[axis].format(at[axis]))
        elif axis in ("database", "radio"):
            told.append(str(at[axis]))
    return ", ".join(told)


def _by_step(cells: tuple[SuccessCell, ...]) -> dict[str, list[SuccessCell]]:
    curves: dict[str, list[SuccessCell]] = {}
    for cell in sorted(cells, key=lambda one: one.sigma_trans_m):
        curves.setdefault(f"step {cell.sigma_trans_m:g} m", []).append(cell)
    return curves


_PLACES = ("sweep.databases", "database.path", "output.dir")


@dataclass(frozen=True)
class SweepResult:
    """What a sweep found.

    Parameters
    ----------
    runs : int
    cells : tuple of SuccessCell
        One for each cell of the grid.
    table : Path
        One row for each run.
    pictures : tuple of Path
    seconds : float
        Wall time.
    """

    runs: int
    cells: tuple[SuccessCell, ...]
    table: Path
    pictures: tuple[Path, ...]
    seconds: float


def load_sweep(
    file: Path | None, settings: Sequence[str] = (), *, out: Path | None = None
) -> Config:
    """Read and check the configuration of a sweep.

    Parameters
    ----------
    file, settings, out
        As for :func:`mapfilter.config.load.load_config`.

    Raises
    ------
    ConfigError
        With every fault of the configuration, databases that are not there included.
    """
    try:
        return load_config(file, settings, out=out)
    except ConfigError as error:
        faults = Faults(list(error.faults))
        known = load_keys(file, settings, out, _PLACES)
        for path in sweep_databases(known).values() if known is not None else ():
            if not (path / "manifest.json").is_file():
                faults.add(str(path), "a radio-route database", "none", "not built yet")
        faults.raise_if_any(ConfigError)
        raise


def run_sweep(
    config: Config,
    *,
    workers: int = 1,
    cluster: str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> SweepResult:
    """Run the sweep of a configuration; predict and build come before.

    Parameters
    ----------
    config : Config
    workers : int
        Local processes.
    cluster : str, optional
        Address of a Dask scheduler whose workers do it instead, or "local:N"; they must reach the
        output folder and the databases by the same paths.
    resume : bool
        Go on where a sweep of the same plan was cut short.
    progress : callable, optional
        Called with runs done and runs in all.

    Raises
    ------
    MapfilterError
        Plan, databases, area, map or rasters are wrong, or the output cannot be written.
    """
    began_s = time.perf_counter()
    plan, databases = sweep_plan(config)
    out = config.output.dir / "sweep"
    world = sweep_world(config, plan.radios)
    ensure_writable_folder(out)
    with sweep_executor(workers, cluster) as (executor, in_flight):
        table = sweep(
            plan,
            world,
            {name: database.path for name, database in databases.items()},
            out,
            executor=executor,
            in_flight=in_flight,
            resume=resume,
            progress=progress,
        )
    runs = read_runs(table)
    pictures = () if config.output.pictures == "none" else draw_sweep(runs, out)
    return SweepResult(
        len(runs), success_cells(runs), table, pictures, time.perf_counter() - began_s
    )


@contextlib.contextmanager
def sweep_executor(workers: int, cluster: str | None) -> Iterator[tuple[Executor, int]]:
    """Give an executor, and how many batches keep all of its workers busy."""
    with executor_of(workers, cluster) as (executor, at_once):
        yield executor, (2 if cluster is None else 3) * at_once


_FOUND = ("runs", "success", "low", "high", "wrong", "error_mean_m", "switch_distance_m")
_ACROSS, _NAME = "sigma_orient_deg", "reading"


def brief(cells: Sequence[SuccessCell]) -> list[dict[str, Any]]:
    """Return a row for each cell, or with several heading noises for all that differ in it alone.

    Rows hold those coordinates in which the cells differ. With one heading noise they hold the
    main figures, with several the success at each.

    Examples
    --------
    >>> from dataclasses import replace
    >>> place = dict.fromkeys(SuccessCell.__dataclass_fields__, 0.0)
    >>> cell = SuccessCell(**{**place, "runs": 4, "success": 0.75})
    >>> brief([cell, replace(cell, sigma_orient_deg=3.0, success=0.5)])
    [{'runs': 4, 'success at 0°': 0.75, '3°': 0.5}]
    >>> list(brief([cell, replace(cell, sigma_trans_m=0.4)])[0])[:3]
    ['sigma_trans_m', 'runs', 'success']
    """
    axes = [name for name in COORDINATES if len({repr(getattr(c, name)) for c in cells}) > 1]
    if _NAME in axes:
        # What belongs to a name is told by it.
        axes = [name for name in axes if name in (_NAME, _ACROSS) or not _belongs(cells, name)]
    if _ACROSS not in axes:
        return [{name: getattr(cell, name) for name in (*axes, *_FOUND)} for cell in cells]
    axes.remove(_ACROSS)
    degrees = sorted({cell.sigma_orient_deg for cell in cells})
    names = [f"{'' if place else 'success at '}{deg:g}°" for place, deg in enumerate(degrees)]
    rows: dict[str, dict[str, Any]] = {}
    for cell in cells:
        place = {name: getattr(cell, name) for name in axes}
        empty: dict[str, Any] = dict.fromkeys(names)
        row = rows.setdefault(repr(place), {**place, "runs": cell.runs, **empty})
        row[names[degrees.index(cell.sigma_orient_deg)]] = round(cell.success, 3)
    return list(rows.values())


def _belongs(cells: Sequence[SuccessCell], axis: str) -> bool:
    """Tell whether all cells of a reading have one value of a coordinate."""
    values = {(cell.reading, repr(getattr(cell, axis))) for cell in cells}
    return len(values) == len({cell.reading for cell in cells})
