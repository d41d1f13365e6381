"""``mapfilter evaluate NAME --data DIR``: benchmarks on public recordings, in one table."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from mapfilter._io import atomic_dir, ensure_writable_folder, sha256_file
from mapfilter._json_files import write_json
from mapfilter._parallel import Progress, local_executor, ordered_results, part_of, rest_of
from mapfilter._resume import kept_when_stopped, start_or_resume
from mapfilter.errors import ConfigError, InputError, fail
from mapfilter.experiments.accuracy_row import Row
from mapfilter.experiments.benchmarks.ottawa import FOLDER as OTTAWA_FOLDER
from mapfilter.experiments.benchmarks.ottawa import PARTS as OTTAWA_PARTS
from mapfilter.experiments.recorded import (
    belgium,
    denver,
    kitti,
    mall,
    mountain_view,
    smartloc,
    wifi,
)
from mapfilter.experiments.recorded.benchmark import Benchmark, Task, check_there
from mapfilter.experiments.recorded.kept import (
    read_scores,
    scores_file,
    write_judged,
)
from mapfilter.experiments.recorded.rows import (
    UnitRow,
    table_intervals,
    table_rows,
    unit_rows,
)
from mapfilter.experiments.row_intervals import RowInterval
from mapfilter.workflows.evaluations.ottawa import OttawaResult, run_ottawa
from mapfilter.workflows.evaluations.recorded_pictures import WorstUnit, draw_worst
from mapfilter.workflows.outputs.result_text import to_jsonable

OTTAWA = "ottawa"
ALL = "all"
BENCHMARKS: Mapping[str, Benchmark] = {
    one.BENCHMARK.name: one.BENCHMARK
    for one in (kitti, mall, smartloc, belgium, wifi, mountain_view, denver)
}
"""All but ottawa, which has a workflow of its own, by name."""
NAMES = (OTTAWA, *BENCHMARKS)
HEAD, TABLE, PICTURES, WORK, UNITS = "benchmark.json", "table.json", "pictures", "work", "units"
PREPARED = "prepared.json"
"""In the folder of the work, written last: without it the work is not resumed."""
_VERSION = 1
_MOST_TOGETHER = 5


@dataclass(frozen=True)
class RecordedResult:
    """Results of one benchmark: seed of what is drawn, tables, pictures, wall time.

    ``intervals`` are those of the rows' errors; ``worst`` names the worst run of each part and
    method, the reason and its picture.
    """

    name: str
    seed: int
    rows: tuple[Row, ...]
    intervals: tuple[RowInterval, ...]
    units: tuple[UnitRow, ...]
    pictures: tuple[Path, ...]
    worst: tuple[WorstUnit, ...]
    seconds: float
    out: Path


@dataclass(frozen=True)
class AllResult:
    """Results of all benchmarks in one table; ``part`` begins with the benchmark's name.

    Parameters
    ----------
    intervals : tuple of RowInterval
        Of the rows' errors.
    missing : tuple of str
        What was not run, because its data set is not there or lacks files.
    failed : tuple of str
        What was begun and could not be finished, and why: damaged data.
    """

    seed: int
    rows: tuple[Row, ...]
    intervals: tuple[RowInterval, ...]
    missing: tuple[str, ...]
    failed: tuple[str, ...]
    seconds: Mapping[str, float]
    out: Path


def run_recorded(
    name: str,
    data: Path,
    out: Path,
    *,
    parts: Sequence[str] = (),
    runs: int | None = None,
    seed: int = 0,
    workers: int = 1,
    resume: bool = False,
    progress: Progress | None = None,
) -> RecordedResult:
    """Run one benchmark on recordings.

    Parameters
    ----------
    name : str
        Of :data:`BENCHMARKS`.
    data : Path
        Holds the folders of the data sets.
    out : Path
        Gets the finished units, ``table.json`` and ``pictures``.
    parts : sequence of str
        All when left out.
    runs : int, optional
        At most so many runs of each unit.
    workers : int
        Local processes.
    resume : bool
        Keep the units that the same benchmark has finished.
    progress : callable, optional
        Called with runs done and runs in all.

    Raises
    ------
    MapfilterError
        The data set is missing or damaged, there is something else to resume, or the output cannot
        be written.
    """
    began_s = time.perf_counter()
    benchmark = BENCHMARKS[name]
    work, finished = out / WORK, out / UNITS
    tasks = _chosen(benchmark.tasks(data, work, seed, runs), parts)
    ensure_writable_folder(out)
    head = {
        "version": _VERSION,
        "name": name,
        "seed": seed,
        "parts": list(parts),
        "runs": runs,
        "data": _digests(data / benchmark.folder),
    }
    # Without --resume the marker goes before the new head is written: older work, of other data
    # perhaps, is never taken for that of the new head.
    files = [work / PREPARED, *(scores_file(finished, task) for task in tasks)]
    start_or_resume(out / HEAD, head, files, resume=resume)
    _prepare(benchmark, data / benchmark.folder, work)
    todo = [task for task in tasks if not (resume and read_scores(finished, task) is not None)]
    report = rest_of(progress, len(tasks) - len(todo), len(tasks))
    with local_executor(workers) as executor, kept_when_stopped("runs"):
        jobs = [(name, some, finished) for some in benchmark.together(todo, _MOST_TOGETHER)]
        judged = ordered_results(executor, _judge, jobs, in_flight=2 * workers)
        for done, _ in enumerate(judged, 1):
            report(sum(len(some) for _, some, _ in jobs[:done]), len(tasks))
    by_task = {task: read_scores(finished, task) or () for task in tasks}
    found = [one for each in by_task.values() for one in each]
    rows = table_rows(found, benchmark.published_m, baseline=benchmark.baseline)
    worst = draw_worst(by_task, finished, out / PICTURES)
    result = RecordedResult(
        name,
        seed,
        tuple(rows),
        tuple(table_intervals(found)),
        tuple(unit_rows(found)),
        tuple(one.picture for one in worst),
        tuple(worst),
        time.perf_counter() - began_s,
        out,
    )
    write_json(out / TABLE, to_jsonable(result))
    return result


def run_all(
    data: Path,
    out: Path,
    *,
    names: Sequence[str] = NAMES,
    seed: int = 0,
    workers: int = 1,
    resume: bool = False,
    progress: Progress | None = None,
) -> AllResult:
    """Run every benchmark whose data set is there, and put their rows together.

    Parameters are those of :func:`run_recorded`.

    Raises
    ------
    InputError
        None of the data sets is there, in which case nothing is written; or none can be judged, as
        the table has it, too.
    """
    rows: list[Row] = []
    intervals: list[RowInterval] = []
    missing: list[str] = []
    failed: list[str] = []
    seconds: dict[str, float] = {}
    there: list[str] = []
    for name in names:
        try:
            _check_there(name, data)
        except InputError as error:
            missing.append(f"{name}: {error}")
        else:
            there.append(name)
    if not there:
        raise fail(InputError, str(data), *_nothing_judged(names, missing, failed))
    ensure_writable_folder(out)
    for number, name in enumerate(names):
        if name not in there:
            continue
        part = part_of(progress, number, len(names))
        run: Callable[..., RecordedResult | OttawaResult]
        run = run_ottawa if name == OTTAWA else partial(run_recorded, name)
        try:
            found = run(data, out / name, seed=seed, workers=workers, resume=resume, progress=part)
        except InputError as error:
            failed.append(f"{name}: {error}")
            continue
        seconds[name] = found.seconds
        rows += [replace(row, part=f"{name}/{row.part}") for row in found.rows]
        intervals += [replace(one, part=f"{name}/{one.part}") for one in found.intervals]
    result = AllResult(
        seed, tuple(rows), tuple(intervals), tuple(missing), tuple(failed), seconds, out
    )
    write_json(out / TABLE, to_jsonable(result))
    if not rows:
        raise fail(InputError, str(data), *_nothing_judged(names, missing, failed))
    return result


def _nothing_judged(
    names: Sequence[str], missing: Sequence[str], failed: Sequence[str]
) -> tuple[str, str, str]:
    """Return what was expected, what was found, and the likely mistake."""
    if failed:
        return "data sets that can be judged", "; ".join([*missing, *failed]), ""
    folders = ", ".join(_folder(name) for name in names)
    hint = f"--data is the folder that holds {folders}, or some of them"
    return "folders of the data sets", "none that holds what it needs", hint


def _folder(name: str) -> str:
    return OTTAWA_FOLDER if name == OTTAWA else BENCHMARKS[name].folder


def _check_there(name: str, data: Path) -> None:
    """Check that a data set is there; InputError otherwise."""
    if name == OTTAWA:
        check_there(data / OTTAWA_FOLDER, tuple(f"{part}/*.csv" for part in OTTAWA_PARTS))
    else:
        check_there(data / _folder(name), BENCHMARKS[name].needs)


def _prepare(benchmark: Benchmark, folder: Path, work: Path) -> None:
    """Make what all tasks share anew, or leave it where it is complete."""
    if benchmark.prepare is None or (work / PREPARED).is_file():
        return
    with atomic_dir(work) as new:
        benchmark.prepare(folder, new)
        write_json(new / PREPARED, {"name": benchmark.name})


def _judge(job: tuple[str, tuple[Task, ...], Path]) -> None:
    """Locate tasks that share what is read, and keep the results of each."""
    name, tasks, folder = job
    for task, judged in zip(tasks, BENCHMARKS[name].judged(tasks), strict=True):
        write_judged(judged, folder, task)


def _chosen(tasks: Sequence[Task], parts: Sequence[str]) -> list[Task]:
    known = list(dict.fromkeys(task.part for task in tasks))
    for part in parts:
        if part not in known:
            raise fail(ConfigError, "--case", ", ".join(known), repr(part))
    return [task for task in tasks if not parts or task.part in parts]


def _digests(folder: Path) -> dict[str, str]:
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): sha256_file(path) for path in files}
