"""Pictures of the worst units of a benchmark on recordings, and the reasons in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapfilter._types import Floats
from mapfilter.database.store import open_database
from mapfilter.errors import MapfilterError
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.experiments.benchmarks.causes import causes_of
from mapfilter.experiments.benchmarks.worst_run import explain
from mapfilter.experiments.recorded.benchmark import Journey, Task
from mapfilter.experiments.recorded.kept import read_journey, read_report
from mapfilter.experiments.recorded.rows import Found, worst_of
from mapfilter.experiments.recorded.worst_report import WorstReport
from mapfilter.report.basemap import BaseMap
from mapfilter.report.integrity import plot_worst_run
from mapfilter.report.saving import save
from mapfilter.report.worst_report import plot_worst_report
from mapfilter.workflows.outputs.served import served_points, street_map

NO_CAUSE = "none of the known causes holds"
_AROUND_M = 100.0


@dataclass(frozen=True)
class WorstUnit:
    """The worst run of one part and method, and its picture.

    Parameters
    ----------
    what : str
        What went wrong, in a few words.
    reason : str
        Where, and what the filter stated there, in sentences.
    causes : tuple of str
        Rules that hold for what was recorded; empty if none does.
    """

    part: str
    method: str
    unit: str
    run: int
    what: str
    reason: str
    causes: tuple[str, ...]
    picture: Path


def draw_worst(
    by_task: Mapping[Task, Sequence[Found]], finished: Path, folder: Path
) -> list[WorstUnit]:
    """Draw the worst run of each part and method of which a journey or report was kept."""
    made = []
    every = [one for found in by_task.values() for one in found]
    task_of = {id(one): task for task, found in by_task.items() for one in found}
    for part, method in dict.fromkeys((one.part, one.method) for one in every):
        worst = worst_of([one for one in every if (one.part, one.method) == (part, method)])
        if worst is None:
            continue
        task = task_of[id(worst)]
        file = folder / f"{part}-{method}-worst.png".replace("/", "-")
        journey = read_journey(finished, task, method)
        report = read_report(finished, task, method)
        label = f"{part}, {method}, {task.unit} run {task.run}"
        if journey is not None:
            drawn = draw_journey(journey, label, file)
        elif report is not None:
            drawn = draw_report(report, label, file)
        else:
            continue
        if drawn is not None:
            made.append(WorstUnit(part, method, task.unit, task.run, *drawn, file))
    return made


def draw_journey(
    journey: Journey, label: str, file: Path
) -> tuple[str, str, tuple[str, ...]] | None:
    """Draw a journey; return what went wrong, reason and causes, or None without any epoch."""
    story = explain(journey.estimate, journey.truth)
    if story is None:
        return None
    ground, points_m = _ground(journey)
    causes = causes_of(journey.estimate, journey.truth, story, points_m, journey.fixes)
    drawn = plot_worst_run(
        journey.estimate,
        journey.truth,
        ground,
        (story.index, story.first, story.last),
        SUCCESS_RADIUS_M,
        title=f"{label}: {story.what}",
        reason=f"{story.reason} {in_words(causes)}",
    )
    save(drawn, file)
    return story.what, story.reason, causes


def draw_report(report: WorstReport, label: str, file: Path) -> tuple[str, str, tuple[str, ...]]:
    """Draw the worst of many reports; return what went wrong, reason and causes."""
    reason = f"Report {report.number}, the worst of {len(report.errors_m)} shown."
    drawn = plot_worst_report(
        report.truth_m,
        report.place_m,
        report.radius_m,
        report.map_m,
        report.places_m,
        report.errors_m,
        title=f"{label}: {report.what}",
        reason=f"{reason} {in_words(report.causes)}",
    )
    save(drawn, file)
    return report.what, reason, report.causes


def in_words(causes: Sequence[str]) -> str:
    """Return causes as one sentence."""
    return f"Found: {'; '.join(causes) or NO_CAUSE}."


def _ground(journey: Journey) -> tuple[BaseMap, Floats | None]:
    """Return the streets of a journey's database and its points, or an empty map."""
    if journey.database is not None:
        try:
            database = open_database(journey.database)
            base = street_map(database, served_points(database))
        except MapfilterError:
            pass
        else:
            return base, base.points_m
    truth = journey.truth
    bounds = (
        float(np.min(truth.east_m)) - _AROUND_M,
        float(np.min(truth.north_m)) - _AROUND_M,
        float(np.max(truth.east_m)) + _AROUND_M,
        float(np.max(truth.north_m)) + _AROUND_M,
    )
    return BaseMap(bounds), None
