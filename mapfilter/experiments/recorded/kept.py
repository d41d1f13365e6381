"""Finished tasks as files: scores, and the journeys that pictures are drawn of."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapfilter._json_files import read_sealed, write_sealed
from mapfilter.errors import StoreError, fail
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.recorded.benchmark import Journey, Judged, Task
from mapfilter.experiments.recorded.rows import Found, read_found, write_found
from mapfilter.experiments.recorded.worst_report import (
    WorstReport,
    read_worst_report,
    write_worst_report,
)
from mapfilter.positioning.estimate_store import read_estimate, write_estimate

_TRUTH = ("time_s", "east_m", "north_m")


def scores_file(folder: Path, task: Task) -> Path:
    """Return the file of a task's scores, which is written last."""
    return folder / f"{task.name}.json"


def write_judged(judged: Judged, folder: Path, task: Task) -> None:
    """Write journeys and reports, then scores."""
    folder.mkdir(parents=True, exist_ok=True)
    for method, journey in judged.journeys.items():
        write_estimate(journey.estimate, _estimate_file(folder, task, method))
        truth = {name: getattr(journey.truth, name).tolist() for name in _TRUTH}
        database = None if journey.database is None else str(journey.database)
        fixes = None if journey.fixes is None else journey.fixes.tolist()
        kept = {"truth": truth, "database": database, "fixes": fixes}
        write_sealed(_truth_file(folder, task, method), kept)
    for method, report in judged.reports.items():
        write_worst_report(report, _report_file(folder, task, method))
    write_found(judged.found, scores_file(folder, task))


def read_scores(folder: Path, task: Task) -> tuple[Found, ...] | None:
    """Return the scores of a finished task; None where there are none, or they are damaged."""
    try:
        return read_found(scores_file(folder, task))
    except StoreError:
        return None


def read_journey(folder: Path, task: Task, method: str) -> Journey | None:
    """Return a journey of a finished task; None where none was kept."""
    file = _truth_file(folder, task, method)
    if not file.is_file():
        return None
    read = read_sealed(file)
    try:
        truth = Truth(*(np.array(read["truth"][name], dtype=np.float64) for name in _TRUTH))
        database = None if read["database"] is None else Path(read["database"])
        fixes = read.get("fixes")
        given = None if fixes is None else np.array(fixes, dtype=np.float64).reshape(-1, 3)
    except (KeyError, TypeError, ValueError) as error:
        raise fail(StoreError, str(file), "a true track", error, "cut off") from error
    return Journey(read_estimate(_estimate_file(folder, task, method)), truth, database, given)


def read_report(folder: Path, task: Task, method: str) -> WorstReport | None:
    """Return the worst report of a finished task; None where none was kept."""
    return read_worst_report(_report_file(folder, task, method))


def _report_file(folder: Path, task: Task, method: str) -> Path:
    return folder / f"{task.name}-{method}-report.json"


def _estimate_file(folder: Path, task: Task, method: str) -> Path:
    return folder / f"{task.name}-{method}.parquet"


def _truth_file(folder: Path, task: Task, method: str) -> Path:
    return folder / f"{task.name}-{method}-truth.json"
