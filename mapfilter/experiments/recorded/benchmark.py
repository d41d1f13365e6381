"""What a benchmark on recordings is: its folder, its units, and how each of them is located."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.recorded.rows import Found
from mapfilter.experiments.recorded.worst_report import WorstReport
from mapfilter.positioning.estimate import TrackEstimate


@dataclass(frozen=True)
class Task:
    """One unit to be located.

    Parameters
    ----------
    part, unit : str
        As in the table.
    run : int
        Which of the unit's runs: start, or draw of the noise.
    data : Path
        Folder of the data set.
    work : Path
        Holds what :attr:`Benchmark.prepare` made.
    seed : int
    """

    part: str
    unit: str
    run: int
    data: Path
    work: Path
    seed: int = 0

    @property
    def name(self) -> str:
        """Name of the task's files."""
        return f"{self.part}-{self.unit}-{self.run}".replace("/", "-")


@dataclass(frozen=True, eq=False)
class Journey:
    """A located journey and its truth, for pictures; and what it was located by.

    Parameters
    ----------
    database : Path, optional
        Its map.
    fixes : (K, 3) array, optional
        Time, east and north of the fixes that the filter was given.
    """

    estimate: TrackEstimate
    truth: Truth
    database: Path | None = None
    fixes: Floats | None = None


@dataclass(frozen=True, eq=False)
class Judged:
    """Results of one task by all methods, and of some of them, by method, what pictures show.

    That is a journey, or the worst of many single reports.
    """

    found: tuple[Found, ...]
    journeys: Mapping[str, Journey] = field(default_factory=dict)
    reports: Mapping[str, WorstReport] = field(default_factory=dict)


@dataclass(frozen=True)
class Benchmark:
    """A data set and how it is judged.

    Parameters
    ----------
    name : str
        Of the command.
    folder : str
        Of the data, in the folder of all data sets.
    needs : tuple of str
        Files or folders in it that have to be there.
    units : callable
        From the folder of the data to part and unit of each task and its number of runs.
    judge : callable
        Locates a task; also given what ``read`` returned, None without it.
    read : callable, optional
        From the first of several tasks: reads what all of them share.
    shared_by_part : bool
        Whether all tasks of a part share what is read, or only the runs of a unit.
    prepare : callable, optional
        From the folder of the data and a new, empty folder to write to: makes what all tasks share.
        The folder is moved to :attr:`Task.work` when all is made, so nothing in it may name it.
    published_m : mapping
        Published figures by part and method ("" for all methods).
    baseline : {"median", "mean"}
        Statistic of the baseline's errors.
    """

    name: str
    folder: str
    needs: tuple[str, ...]
    units: Callable[[Path], Sequence[tuple[str, str, int]]]
    judge: Callable[[Task, Any], Judged]
    prepare: Callable[[Path, Path], None] | None = None
    read: Callable[[Task], Any] | None = None
    published_m: Mapping[tuple[str, str], float] = field(default_factory=dict)
    baseline: str = "median"
    shared_by_part: bool = False

    def together(self, tasks: Sequence[Task], most: int) -> list[tuple[Task, ...]]:
        """Return neighbouring tasks that share what is read, at most so many together."""
        found: list[list[Task]] = []
        for task in tasks:
            last = found[-1] if found else []
            if last and len(last) < most and self._shared(last[0]) == self._shared(task):
                last.append(task)
            else:
                found.append([task])
        return [tuple(some) for some in found]

    def _shared(self, task: Task) -> tuple[str, ...]:
        return (task.part,) if self.shared_by_part else (task.part, task.unit)

    def judged(self, tasks: Sequence[Task]) -> Iterator[Judged]:
        """Yield the results of tasks that share what is read, in their order."""
        shared = self.read(tasks[0]) if self.read is not None and tasks else None
        for task in tasks:
            yield self.judge(task, shared)

    def tasks(self, data: Path, work: Path, seed: int, runs: int | None = None) -> list[Task]:
        """Return all tasks, at most ``runs`` of each unit.

        Raises
        ------
        InputError
            Files are missing, or there is nothing to judge.
        """
        folder = data / self.folder
        check_there(folder, self.needs)
        found = self.units(folder)
        if not found:
            faults = Faults()
            faults.add(str(folder), "recordings to be judged", "none", "see its README")
            faults.raise_if_any(InputError)
        return [
            Task(part, unit, run, folder, work, seed)
            for part, unit, count in found
            for run in range(min(count, runs or count))
        ]


def check_there(folder: Path, needs: Sequence[str]) -> None:
    """Check that files of a data set are there; InputError with all that are missing."""
    faults = Faults()
    if not folder.is_dir():
        hint = f"--data is the folder that holds {folder.name}"
        faults.add(str(folder), "the folder of the data set", "none", hint)
    else:
        for name in needs:
            if not any(folder.glob(name)):
                faults.add(str(folder / name), "a file of the data set", "none", "not unpacked")
    faults.raise_if_any(InputError)
