"""``mapfilter sweep``: success over a grid of inertial noise, filters and worlds."""

from __future__ import annotations

import contextlib
import re
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pandas as pd

from mapfilter._io import ensure_writable_folder, replaced_files
from mapfilter._parallel import Progress, executor_of, warmed
from mapfilter._partial import nothing_left
from mapfilter.config.axes import parse_axis
from mapfilter.config.load import load_config, load_keys
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError, Faults
from mapfilter.evaluation.paired import PairedCell, paired_cells
from mapfilter.evaluation.success_cells import (
    COORDINATES,
    HEADING,
    READING,
    SuccessCell,
    success_cells,
    varied_keys,
)
from mapfilter.experiments.sweep.noises import NOISE_AXES
from mapfilter.experiments.sweep.run import run_batch, seconds_per_run, sweep
from mapfilter.experiments.sweep.table import read_runs
from mapfilter.report.canvas import Drawn
from mapfilter.report.claimed_radii import have_radii, plot_claimed_radii
from mapfilter.report.run_distributions import plot_run_distributions
from mapfilter.report.saving import save
from mapfilter.report.success import (
    place_words,
    plot_success_curves,
    plot_success_map,
)
from mapfilter.report.table import write_table
from mapfilter.workflows.sweeps.plan import sweep_databases, sweep_plans, sweep_world
from mapfilter.workflows.sweeps.tables import cell_table, pair_table

_WHITE = {f"{section}{name}" for section in ("", "imu.") for name in NOISE_AXES[:2]}
_MOST_CURVES, _MOST_GROUPS = 8, 16
_OWN = re.compile(
    r"table\.(csv|tex)|pairs\.csv|(success|success-map|radii|distributions)(-[0-9]+)?\.png"
)
_PLACES = ("sweep.databases", "database.path", "output.dir")


def draw_sweep(runs: pd.DataFrame, out: Path) -> tuple[Path, ...]:
    """Draw curves, a map and distributions for each group of a sweep.

    Returns
    -------
    pictures : tuple of Path
        ``success.png``, ``success-map.png``, ``distributions.png``, and ``radii.png`` of filters
        with radii, with numbers before the ending where there are several groups, of which the
        first 16 are drawn.
    """
    pictures: list[Path] = []
    groups = list(groups_of(runs))[:_MOST_GROUPS]
    for number, (title, rows) in enumerate(groups, start=1):
        cells = success_cells(rows)
        curves: dict[str, list[SuccessCell]] = {}
        for cell in sorted(cells, key=lambda one: one.sigma_trans_m):
            curves.setdefault(f"step {cell.sigma_trans_m:g} m", []).append(cell)
        one_step = rows[rows["sigma_trans_m"] == rows["sigma_trans_m"].min()]
        by_heading = [(f"heading {sigma:g}°", some) for sigma, some in one_step.groupby(HEADING)]
        shown = list(curves.items())[:_MOST_CURVES]
        drawn: dict[str, Drawn] = {
            "success": plot_success_curves(shown, title=title),
            "success-map": plot_success_map(cells, title=title),
            "distributions": plot_run_distributions(by_heading[:_MOST_CURVES], title=title),
        }
        if have_radii(cells):
            drawn["radii"] = plot_claimed_radii(shown, title=title)
        tail = f"-{number}" if len(groups) > 1 else ""
        pictures += [save(picture, out / f"{name}{tail}.png") for name, picture in drawn.items()]
    return tuple(pictures)


def groups_of(runs: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield the runs by all coordinates but the white noises, each with a title."""
    axes = [name for name in (*COORDINATES, *varied_keys(runs)) if name not in _WHITE]
    several = [name for name in axes if runs[name].nunique(dropna=False) > 1]
    for place, rows in runs.groupby(axes, sort=False, dropna=False):
        at = dict(zip(axes, place, strict=True))
        name, reading = at["filter"], at["reading"]
        named = f"{name} filter" if reading == name else f"{name} filter: {reading}"
        yield ", ".join([named, *place_words(at, several)]), rows


@dataclass(frozen=True)
class SweepResult:
    """Results of a sweep.

    ``table`` has one row for each run, ``tables`` (CSV, LaTeX) one for each cell of the grid, and
    ``pairs.csv`` among them one for each cell and each filter beside the first one, if there are
    several.
    """

    runs: int
    cells: tuple[SuccessCell, ...]
    pairs: tuple[PairedCell, ...]
    table: Path
    tables: tuple[Path, ...]
    pictures: tuple[Path, ...]
    seconds: float


def load_sweep(
    file: Path | None, settings: Sequence[str] = (), *, out: Path | None = None
) -> Config:
    """Read and check the configuration of a sweep, as :func:`mapfilter.config.load.load_config`.

    Databases that are not there are reported with the faults of the configuration.
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


def vary_axes(given: Sequence[str]) -> dict[str, tuple[float, ...]]:
    """Return the axes of ``--vary KEY=V1,V2,...``, checked; all faults are reported together."""
    axes: dict[str, tuple[float, ...]] = {}
    faults = Faults()
    for text in given:
        try:
            key, values = parse_axis(text)
        except ConfigError as error:
            faults.found.extend(error.faults)
            continue
        if key in axes:
            faults.add(f"--vary {key}", "every option once", "it twice", "values go in one list")
        axes[key] = values
    faults.raise_if_any(ConfigError)
    return axes


@dataclass(frozen=True)
class SweepForecast:
    """Runs of a sweep, combinations of varied options, and estimated times.

    ``seconds_per_run`` is that of one process, from a short trial, and ``seconds`` that of the
    whole sweep by its workers, without predictions, tables and pictures.
    """

    runs: int
    points: int
    seconds_per_run: float
    seconds: float


def forecast_sweep(
    config: Config, axes: Mapping[str, Sequence[float]] | None = None, *, workers: int = 1
) -> SweepForecast:
    """Check the inputs of :func:`run_sweep`, count its runs, and estimate its time from a few."""
    plans, databases = sweep_plans(config, axes)
    world = sweep_world(config, plans[0].radios)
    folders = {name: database.path for name, database in databases.items()}
    per_run_s = seconds_per_run(plans[0], world, folders)
    runs = sum(plan.runs for plan in plans)
    return SweepForecast(runs, len(plans), per_run_s, runs * per_run_s / workers)


def run_sweep(
    config: Config,
    axes: Mapping[str, Sequence[float]] | None = None,
    *,
    workers: int = 1,
    cluster: str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> SweepResult:
    """Run the sweep of a configuration; predict and build come before.

    Parameters
    ----------
    axes : mapping of str to sequence of float, optional
        Values of any numeric options of ``[imu]``, ``[journeys]``, ``[filter]`` and of
        ``database.margin_db``, by dotted key: the sweep is run for each combination.
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
    plans, databases = sweep_plans(config, axes)
    out = config.output.dir / "sweep"
    # Local workers start, and import what a batch needs, while the world is read; a cluster is
    # asked for when its inputs are right.
    read = None if cluster is None else sweep_world(config, plans[0].radios)
    with nothing_left(out), sweep_executor(workers, cluster) as (executor, in_flight):
        warmed(executor, workers, run_batch)
        world = read or sweep_world(config, plans[0].radios)
        ensure_writable_folder(out)
        table = sweep(
            plans,
            world,
            {name: database.path for name, database in databases.items()},
            out,
            executor=executor,
            in_flight=in_flight,
            resume=resume,
            progress=progress,
        )
    runs = read_runs(table)
    cells = success_cells(runs)
    shown, pairs = cell_table(cells), paired_cells(runs, str(runs[READING].iloc[0]))
    # Pictures of an older sweep do not stay beside the table of this one.
    with replaced_files(out, partial(_older, out)) as new:
        tables = [write_table(shown, new / f"table{suffix}") for suffix in (".csv", ".tex")]
        if pairs:
            tables.append(write_table(pair_table(pairs), new / "pairs.csv"))
        pictures = () if config.output.pictures == "none" else draw_sweep(runs, new)
    return SweepResult(
        len(runs),
        cells,
        pairs,
        table,
        tuple(out / file.name for file in tables),
        tuple(out / file.name for file in pictures),
        time.perf_counter() - began_s,
    )


def _older(out: Path) -> list[Path]:
    return [path for path in out.iterdir() if _OWN.fullmatch(path.name) and path.is_file()]


@contextlib.contextmanager
def sweep_executor(workers: int, cluster: str | None) -> Iterator[tuple[Executor, int]]:
    """Give an executor, and how many batches keep all of its workers busy."""
    with executor_of(workers, cluster) as (executor, at_once):
        yield executor, (2 if cluster is None else 3) * at_once
