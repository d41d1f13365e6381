"""``mapfilter reproduce``: a paper's experiments from the map to figure and table."""

from __future__ import annotations

import csv
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from mapfilter._io import atomic_file, ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter.config.load import load_config
from mapfilter.config.sections import Config
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, fail
from mapfilter.evaluation.success import SuccessCell, success_cells
from mapfilter.experiments.papers.khalaf_allah_2007 import experiment as paper
from mapfilter.experiments.papers.khalaf_allah_2007.experiment import Fit
from mapfilter.experiments.sweep.run import sweep
from mapfilter.experiments.sweep.table import read_runs
from mapfilter.workflows.build import run_build
from mapfilter.workflows.paper_pictures import draw_khalaf_allah_2007
from mapfilter.workflows.predict import run_predict
from mapfilter.workflows.reproduce_dlr import DLR
from mapfilter.workflows.reproduce_fusion import FUSION_PAPERS
from mapfilter.workflows.reproduce_tesa import TESA
from mapfilter.workflows.sweep import sweep_executor
from mapfilter.workflows.sweep_plan import sweep_world

PAPERS = ("khalaf-allah-2007",)
CITY = "synthetic"
"""The map where none is given."""


@dataclass(frozen=True)
class ReproduceResult:
    """What came of a paper's experiments.

    Parameters
    ----------
    paper, map : str
    success : tuple of SuccessCell
        For every reading and every pair of noises.
    fits : tuple of Fit
        How near each reading comes to the paper's claims, the nearest first.
    outputs : tuple of Path
        Table and pictures.
    runs : int
    seconds : float
        Wall time, prediction and database included.
    """

    paper: str
    map: str
    success: tuple[SuccessCell, ...]
    fits: tuple[Fit, ...]
    outputs: tuple[Path, ...]
    runs: int
    seconds: float


def run_reproduce(
    name: str,
    out: Path,
    *,
    map_name: str | None = None,
    bbox: Sequence[float] | None = None,
    trials: int = 100,
    seed: int = 0,
    workers: int = 1,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> ReproduceResult:
    """Predict, build and run a paper's experiments.

    Parameters
    ----------
    name : str
        ``khalaf-allah-2007``.
    out : Path
        Folder of everything.
    map_name : str, optional
        As ``area.map``; by default the made city ``synthetic``.
    bbox : sequence of float, optional
        West, south, east, north, degrees.
    trials : int
        Runs in each cell of the grid, at least.
    seed : int
    workers, cluster
        As for :func:`mapfilter.workflows.sweep.run_sweep`.
    progress : callable, optional
        Called with runs done and runs in all.

    Raises
    ------
    MapfilterError
        There is no such paper, the map or the box is wrong, or the output cannot be written.
    """
    began_s = time.perf_counter()
    if name not in PAPERS:
        known = (*PAPERS, *FUSION_PAPERS, TESA, DLR)
        raise fail(ConfigError, "reproduce", f"one of {', '.join(known)}", repr(name))
    config = paper_config(out, map_name, bbox)
    plans = paper.plans(trials, seed)
    ensure_writable_folder(out)
    run_predict(config)
    run_build(config)
    world = sweep_world(config, [radio for plan in plans for radio in plan.radios])
    databases = {"database": open_database(config.database_path).path}
    total, done = sum(plan.runs for plan in plans), 0
    tables = []
    with sweep_executor(workers, cluster) as (executor, in_flight):
        for number, plan in enumerate(plans, start=1):
            table = sweep(
                plan,
                world,
                databases,
                out / "sweeps" / str(number),
                executor=executor,
                in_flight=in_flight,
                progress=_part(progress, done, total),
            )
            done += plan.runs
            tables.append(read_runs(table))
    runs = pd.concat(tables, ignore_index=True)
    cells = success_cells(runs)
    fits = paper.fits(cells)
    table_4 = out / "table-4.csv"
    _write_table_4(fits, table_4)
    pictures = draw_khalaf_allah_2007(runs, cells, out, Path(config.area.map).name)
    took_s = time.perf_counter() - began_s
    outputs = (table_4, *pictures)
    return ReproduceResult(name, config.area.map, cells, fits, outputs, len(runs), took_s)


def paper_config(out: Path, map_name: str | None, bbox: Sequence[float] | None) -> Config:
    """Return the configuration of the paper's set-up: two sites of three sectors, four indoor."""
    settings = [f"area.resolution_m={paper.RESOLUTION_M}", "output.pictures=none"]
    settings += ["cells.sites=2", "cells.sectors=3", "cells.indoor=4", "database.margin_db=6.0"]
    # Random clutter stands for the detail of the paper's measured map.
    settings.append("prediction.shadowing_db=6.0")
    settings.append(f"area.map={CITY if map_name is None else map_name}")
    if bbox is not None:
        settings.append(f"area.bbox={','.join(map(str, bbox))}")
    return load_config(None, settings, out=out)


def _part(progress: Progress | None, before: int, total: int) -> Progress | None:
    if progress is None:
        return None
    return lambda done, _: progress(before + done, total)


def _write_table_4(fits: Sequence[Fit], path: Path) -> None:
    """Write each reading's figures beside the paper's."""
    errors, shares = tuple(paper.TABLE_4_M), ("success_3_deg", "success_6_deg")
    ranges = [f"{low:g}-{high:g}" for low, high in paper.TABLE_4_M.values()]
    claims = [f"> {claim:g}" for _, claim in paper.CLAIMS]
    with (
        atomic_file(path) as temporary,
        temporary.open("w", newline="", encoding="utf-8") as stream,
    ):
        rows = csv.writer(stream, lineterminator="\n")
        rows.writerow(["reading", *errors, *shares])
        rows.writerow(["Khalaf-Allah 2007", *ranges, *claims])
        for fit in fits:
            figures = [f"{getattr(fit, name):.1f}" for name in errors]
            figures += [f"{getattr(fit, name):.3f}" for name in shares]
            rows.writerow([fit.reading, *figures])
