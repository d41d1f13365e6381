"""Pictures of the worst runs of a benchmark on recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from mapfilter.database.store import open_database
from mapfilter.errors import MapfilterError
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.experiments.benchmarks.worst_run import explain
from mapfilter.experiments.recorded.benchmark import Journey, Task
from mapfilter.experiments.recorded.kept import read_journey
from mapfilter.experiments.recorded.rows import Found, worst_of
from mapfilter.report.basemap import BaseMap
from mapfilter.report.canvas import save
from mapfilter.report.integrity import plot_worst_run
from mapfilter.workflows.served import served_points, street_map

_AROUND_M = 100.0


def draw_worst(by_task: Mapping[Task, Sequence[Found]], finished: Path, folder: Path) -> list[Path]:
    """Draw the worst run of each part and method of which a journey was kept; return the files."""
    made = []
    every = [one for found in by_task.values() for one in found]
    task_of = {id(one): task for task, found in by_task.items() for one in found}
    for part, method in dict.fromkeys((one.part, one.method) for one in every):
        worst = worst_of([one for one in every if (one.part, one.method) == (part, method)])
        if worst is None:
            continue
        task = task_of[id(worst)]
        journey = read_journey(finished, task, method)
        story = explain(journey.estimate, journey.truth) if journey is not None else None
        if journey is None or story is None:
            continue
        drawn = plot_worst_run(
            journey.estimate,
            journey.truth,
            _ground(journey),
            (story.index, story.first, story.last),
            SUCCESS_RADIUS_M,
            title=f"{part}, {method}, {task.unit} run {task.run}: {story.what}",
            reason=story.reason,
        )
        made.append(folder / f"{part}-{method}-worst.png".replace("/", "-"))
        save(drawn, made[-1])
    return made


def _ground(journey: Journey) -> BaseMap:
    """Return the streets of a journey's database, or an empty map about its truth."""
    if journey.database is not None:
        try:
            database = open_database(journey.database)
            return street_map(database, served_points(database))
        except MapfilterError:
            pass
    truth = journey.truth
    bounds = (
        float(np.min(truth.east_m)) - _AROUND_M,
        float(np.min(truth.north_m)) - _AROUND_M,
        float(np.max(truth.east_m)) + _AROUND_M,
        float(np.max(truth.north_m)) + _AROUND_M,
    )
    return BaseMap(bounds)
