"""``mapfilter reproduce``: a paper's experiments, from the map to figures and tables."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter._partial import nothing_left
from mapfilter.config.load import load_config
from mapfilter.config.sections import Config
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, Faults, fail
from mapfilter.experiments.papers import find_paper
from mapfilter.experiments.papers.paper import PaperSettings
from mapfilter.experiments.sweep.plan import SweepPlan
from mapfilter.experiments.sweep.run import sweep
from mapfilter.experiments.sweep.table import read_runs
from mapfilter.report.saving import save
from mapfilter.report.table import write_table
from mapfilter.workflows.build import run_build
from mapfilter.workflows.predict import run_predict
from mapfilter.workflows.sweep import sweep_executor
from mapfilter.workflows.sweeps.plan import sweep_world
from mapfilter.workflows.sweeps.tables import brief

CITY = "synthetic"
"""The map where none is given."""


def run_reproduce(
    name: str,
    out: Path,
    *,
    map_name: str | None = None,
    bbox: Sequence[float] | None = None,
    layout_file: Path | None = None,
    trials: int | None = None,
    seed: int = 0,
    workers: int = 1,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Run a paper's experiments, draw its figures and write its tables.

    Parameters
    ----------
    name, out
        One of :data:`mapfilter.experiments.papers.PAPERS`; folder of everything.
    map_name, bbox
        Only for papers that run on a map: as ``area.map``, by default a synthetic city; west,
        south, east, north in degrees.
    layout_file : Path, optional
        Only for ``fritsche-klein-2009``: TOML with fields of
        :class:`mapfilter.experiments.papers.fritsche_klein_2009.scene.Layout`.
    trials : int, optional
        Trials, or runs in each cell of a grid; the paper's by default.
    workers, cluster, progress
        As for :func:`mapfilter.workflows.sweep.run_sweep`; progress counts parts of the work.

    Returns
    -------
    dict
        The figures that the paper's ``summary`` documents; ``outputs``, the paths of tables and
        pictures; ``seconds``, the wall time.

    Raises
    ------
    MapfilterError
        There is no such paper, it does not take an option or so many trials, the map, the box or
        the layout is wrong, or the output cannot be written.
    """
    began_s = time.perf_counter()
    paper = find_paper(name)
    faults = Faults()
    for option, value in (("--map", map_name), ("--bbox", bbox), ("--layout", layout_file)):
        if value is not None and option not in paper.options:
            faults.add(option, f"nothing, as {name} takes none", value)
    faults.raise_if_any(ConfigError)
    count = paper.trials if trials is None else trials
    least, most = paper.trial_limits
    if count < least or (most is not None and count > most):
        expected = f"at least {least}" if most is None else f"a number in {least}..{most}"
        raise fail(ConfigError, "--trials", expected, count, paper.why)

    with nothing_left(out), sweep_executor(workers, cluster) as (executor, in_flight):
        ensure_writable_folder(out)

        def run_sweeps(
            settings: Sequence[str], plans: Sequence[SweepPlan]
        ) -> tuple[str, pd.DataFrame]:
            config = paper_config(settings, out, map_name, bbox)
            run_predict(config)
            run_build(config)
            world = sweep_world(config, [radio for plan in plans for radio in plan.radios])
            databases = {"database": open_database(config.database_path).path}
            total, done, tables = sum(plan.runs for plan in plans), 0, []
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
            return config.area.map, pd.concat(tables, ignore_index=True)

        settings = PaperSettings(count, seed, executor, run_sweeps, progress, layout_file)
        run = paper.run(settings)
    found = paper.summary(run)
    outputs = []
    for file, table in paper.tables(run).items():
        outputs += [write_table(table, out / f"{file}.{kind}") for kind in ("csv", "tex")]
    outputs += [save(drawn, out / f"{file}.png") for file, drawn in paper.pictures(run)]
    return found | {"outputs": tuple(outputs), "seconds": time.perf_counter() - began_s}


def brief_figures(found: dict[str, Any]) -> dict[str, Any]:
    """Return the figures to print for people: without rows, which the tables hold, too."""
    kept = {name: value for name, value in found.items() if name != "rows"}
    return kept | ({"success": brief(found["success"])} if "success" in found else {})


def paper_config(
    settings: Sequence[str], out: Path, map_name: str | None, bbox: Sequence[float] | None
) -> Config:
    """Return the configuration of a paper's set-up, on a map or in a synthetic city."""
    area = [f"area.map={CITY if map_name is None else map_name}"]
    if bbox is not None:
        area.append(f"area.bbox={','.join(map(str, bbox))}")
    return load_config(None, ["output.pictures=none", *settings, *area], out=out)


def _part(progress: Progress | None, before: int, total: int) -> Progress | None:
    if progress is None:
        return None
    return lambda done, _: progress(before + done, total)
