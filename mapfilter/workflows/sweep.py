"""``mapfilter sweep``: success over a grid of inertial noise, filters and worlds."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress, executor_of
from mapfilter.errors import ConfigError, Faults
from mapfilter.evaluation.success_cells import SuccessCell, success_cells
from mapfilter.experiments.sweep.run import sweep
from mapfilter.experiments.sweep.table import read_runs
from mapfilter.workflows.config import load_config, load_keys
from mapfilter.workflows.sections import Config
from mapfilter.workflows.sweep_pictures import draw_sweep
from mapfilter.workflows.sweep_plan import sweep_databases, sweep_plan
from mapfilter.workflows.sweep_world import sweep_world

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
        As for :func:`mapfilter.workflows.config.load_config`.

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
