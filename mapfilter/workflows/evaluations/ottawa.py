"""``mapfilter evaluate ottawa``: real sessions, each found on the map that the others made."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mapfilter._io import ensure_writable_folder, sha256_file
from mapfilter._json_files import write_json
from mapfilter._parallel import Progress, local_executor, ordered_results, rest_of
from mapfilter._resume import kept_when_stopped, start_or_resume
from mapfilter.config.sections import Config
from mapfilter.database.store import open_database
from mapfilter.errors import InputError, StoreError, fail
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.accuracy_row import Row
from mapfilter.experiments.benchmarks.ottawa import (
    FOLDER,
    LEFT_OUT,
    PARTS,
    OttawaOptions,
    centroid_errors_m,
    find_session,
    locate_session,
)
from mapfilter.experiments.benchmarks.ottawa_sessions import (
    Session,
    read_session,
    step_factor_of,
)
from mapfilter.experiments.benchmarks.ottawa_table import (
    LeftOut,
    SessionRow,
    part_intervals,
    part_rows,
    read_left_out,
    session_rows,
    worst_session,
    write_left_out,
)
from mapfilter.experiments.recorded.benchmark import Journey
from mapfilter.experiments.row_intervals import RowInterval
from mapfilter.report.canvas import BLUE, GREEN, GREY
from mapfilter.report.cumulative import Distribution, plot_cumulative
from mapfilter.report.saving import save
from mapfilter.workflows.build import run_build
from mapfilter.workflows.evaluations.recorded_pictures import WorstUnit, draw_journey
from mapfilter.workflows.outputs.result_text import to_jsonable
from mapfilter.workflows.survey import run_survey

HEAD, TABLE, FOUND = "benchmark.json", "table.json", "found.json"
PICTURE, WORST, DATABASE = "errors.png", "worst.png", "database"
RUNS = 3
_VERSION = 1
_FLOOR_DBM = -140.0
_HALF_WIDTH_M = 15.0
_MOST_M = 300.0
_COLOURS = {"bayes": BLUE, "smoothed": GREEN, "centroid": GREY}


@dataclass(frozen=True)
class OttawaResult:
    """Results of all sessions: seed and draws of the noise, tables, worst runs, wall time.

    ``intervals`` are those of the rows' errors, over sessions.
    """

    seed: int
    runs: int
    rows: tuple[Row, ...]
    intervals: tuple[RowInterval, ...]
    sessions: tuple[SessionRow, ...]
    worst: tuple[WorstUnit, ...]
    seconds: float
    out: Path


@dataclass(frozen=True)
class Task:
    """One session to be left out and found on the map that the others make.

    ``folder`` gets survey, database and results.
    """

    part: str
    session: Path
    others: tuple[Path, ...]
    folder: Path
    options: OttawaOptions = field(default_factory=OttawaOptions)
    runs: int = RUNS
    seed: int = 0

    @property
    def result(self) -> Path:
        """File of the results."""
        return self.folder / FOUND


def run_ottawa(
    data: Path,
    out: Path,
    *,
    runs: int = RUNS,
    seed: int = 0,
    parts: Sequence[str] = PARTS,
    options: OttawaOptions | None = None,
    workers: int = 1,
    resume: bool = False,
    progress: Progress | None = None,
) -> OttawaResult:
    """Leave each session out, build map and ways from the others, and find it.

    Parameters
    ----------
    data : Path
        Holds the folder ``cell-ottawa-lte`` with a folder for each part.
    out : Path
        Gets a folder for each part and session with its survey and database, ``table.json`` and
        ``errors.png``.
    runs : int
        Draws of the noise for each session.
    workers : int
        Local processes.
    resume : bool
        Keep the sessions that the same benchmark has finished.
    progress : callable, optional
        Called with sessions done and sessions in all.

    Raises
    ------
    MapfilterError
        The data set is not there, a file of it is no session, there is something else to resume, or
        the output cannot be written.
    """
    began_s = time.perf_counter()
    chosen = options or OttawaOptions()
    files = {part: session_files(data, part) for part in parts}
    tasks = [
        Task(
            part,
            file,
            tuple(other for other in every if other != file),
            out / part / file.stem,
            chosen,
            runs,
            seed,
        )
        for part, every in files.items()
        for file in every
    ]
    ensure_writable_folder(out)
    data_sha256 = {part: [sha256_file(file) for file in every] for part, every in files.items()}
    head = {
        "version": _VERSION,
        "seed": seed,
        "runs": runs,
        "options": repr(chosen),
        "data": data_sha256,
    }
    start_or_resume(out / HEAD, head, [task.result for task in tasks], resume=resume)
    todo = [task for task in tasks if not (resume and _is_whole(task.result))]
    report = rest_of(progress, len(tasks) - len(todo), len(tasks))
    with local_executor(workers) as executor:
        results = ordered_results(
            executor, find_left_out, todo, in_flight=2 * workers, progress=report
        )
        with kept_when_stopped("sessions"):
            deque(results, maxlen=0)
    rows: list[Row] = []
    intervals: list[RowInterval] = []
    sessions: list[SessionRow] = []
    worst: list[WorstUnit] = []
    for part in parts:
        own = [task for task in tasks if task.part == part]
        every = [read_left_out(task.result) for task in own]
        found = [one for left_out in every for one in left_out.found]
        centroid_m = {left_out.session: left_out.centroid_m for left_out in every}
        rows += part_rows(part, found, centroid_m)
        intervals += part_intervals(part, found, centroid_m)
        sessions += session_rows(found, centroid_m)
        title = f"Ottawa, {part}: real phones, each session on the map of the others"
        picture = out / part / PICTURE
        save(plot_cumulative(_curves(every), title=title, most_m=_MOST_M, share=0.95), picture)
        worst += _worst_of(own, every)
    seconds = time.perf_counter() - began_s
    result = OttawaResult(
        seed, runs, tuple(rows), tuple(intervals), tuple(sessions), tuple(worst), seconds, out
    )
    write_json(out / TABLE, to_jsonable(result))
    return result


def find_left_out(task: Task) -> None:
    """Make the map of the other sessions, find the one that was left out, and keep the results."""
    session, others = read_session(task.session), [read_session(file) for file in task.others]
    positioner = task.options.filter.over(open_database(_map_of(others, task.folder)))
    crs = positioner.area.lattice.crs
    factor = step_factor_of(others, crs)
    found = [
        one
        for draw in range(task.runs)
        for one in find_session(
            task.part, session, positioner, task.options, task.seed, draw, factor
        )
    ]
    errors_m = centroid_errors_m(session, others, crs)
    write_left_out(LeftOut(session.name, errors_m, tuple(found)), task.result)


def _worst_of(tasks: Sequence[Task], every: Sequence[LeftOut]) -> list[WorstUnit]:
    """Locate the worst run of a part once more, and draw it."""
    found = worst_session(every)
    if found is None:
        return []
    task, draw = tasks[found[0]], found[1]
    session, others = read_session(task.session), [read_session(file) for file in task.others]
    path = task.folder / DATABASE
    if not path.is_dir():
        return []
    positioner = task.options.filter.over(open_database(path))
    factor = step_factor_of(others, positioner.area.lattice.crs)
    log, estimate = locate_session(session, positioner, task.options, task.seed, draw, factor)
    truth = Truth.of_table(log.truth)
    if truth is None:
        return []
    file = task.folder.parent / WORST
    label = f"{task.part}, bayes, {session.name} draw {draw}"
    drawn = draw_journey(Journey(estimate, truth, path), label, file)
    return [WorstUnit(task.part, "bayes", session.name, draw, *drawn, file)] if drawn else []


def session_files(data: Path, part: str) -> list[Path]:
    """Return the files of the sessions of a part; InputError below two."""
    folder = data / FOLDER / part
    files = [path for path in sorted(folder.glob("*.csv")) if not path.name.startswith(LEFT_OUT)]
    if len(files) < 2:
        expected = "CSV files of two sessions or more"
        hint = f"--data is the folder that holds {FOLDER}"
        raise fail(InputError, str(folder), expected, len(files), hint)
    return [file.absolute() for file in files]


def _is_whole(result: Path) -> bool:
    try:
        read_left_out(result)
    except StoreError:
        return False
    return True


def _map_of(others: Sequence[Session], folder: Path) -> Path:
    """Make levels, ways and database of sessions, as drive tests without a street map are."""
    files = [str(other.path) for other in others]
    # The trend stays where there is no measurement, which does not mean that nothing is received.
    survey = {"files": files, "cross_validate": False, "fill": True}
    config = Config.model_validate(
        {
            "area": {"map": "none"},
            "prediction": {"model": "survey", "survey": survey},
            "roads": {"half_width_m": _HALF_WIDTH_M, "tracks": {"files": files}},
            "database": {"floor_dbm": _FLOOR_DBM},
            "output": {"dir": str(folder.absolute()), "pictures": "none"},
        },
        context={"folder": Path.cwd()},
    )
    run_survey(config)
    return run_build(config).database


def _curves(every: Sequence[LeftOut]) -> list[Distribution]:
    """Return all errors by method, for the picture."""
    errors_m = {"centroid": [left_out.centroid_m for left_out in every]}
    for left_out in every:
        for one in left_out.found:
            errors_m.setdefault(one.method, []).append(one.error_m)
    curves = []
    for name, colour in _COLOURS.items():
        errors = np.concatenate([np.empty(0), *errors_m[name]])
        if errors.size:
            label = f"{name}, median {np.median(errors):.0f} m"
            curves.append(Distribution(label, errors, colour))
    return curves
