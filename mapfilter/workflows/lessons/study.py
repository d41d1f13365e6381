"""Journeys located, and what they teach: the passes of ``mapfilter learn``."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._parallel import Progress, local_executor, ordered_results
from mapfilter._resume import FinishedParts
from mapfilter.config.sections import Config
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, Faults, InputError, MapfilterError, fail
from mapfilter.learning.apply import apply_patch
from mapfilter.learning.blank import blank_database, blank_log
from mapfilter.learning.learn import (
    Lesson,
    UnlistedCell,
    changes_of,
    lesson_of,
    unlisted_cells,
)
from mapfilter.learning.missing_ways import missing_ways
from mapfilter.learning.patch import Patch
from mapfilter.learning.phone import PhoneNoise, phone_noise
from mapfilter.learning.tracks import JourneyTrack, placed
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.filter import Filter, FilterOptions
from mapfilter.positioning.log_options import fitted_to_log
from mapfilter.positioning.loop import locate
from mapfilter.positioning.timing_steps import with_one_step, with_plan_technologies
from mapfilter.propagation.shadowing import named_rng
from mapfilter.tracks.joining.identify import name_by_plan
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.open_log import OpenedLog
from mapfilter.workflows.inputs.filter_choice import filter_choice
from mapfilter.workflows.inputs.logs import journeys_of, open_journey
from mapfilter.workflows.lessons.key import study_key
from mapfilter.workflows.lessons.lacks import log_notes, unused_notes
from mapfilter.workflows.replays.lacks import check_log

_LEAST_KNOWN = 0.3
_KNOWN_M = 50.0
_PASSES = 3
"""By the map alone; where that does not do, by the database as it is; by the patched one."""


@dataclass(frozen=True)
class _Task:
    """One journey to locate."""

    name: str
    log: TrackLog
    database: Path
    sha256: str
    choice: FilterOptions
    seed: int
    is_blank: bool


@dataclass(frozen=True, eq=False)
class Taught:
    """What journeys teach of a database.

    Parameters
    ----------
    database : RadioRouteDatabase
    names : tuple of str
        Of the logs.
    lesson : Lesson
    tracks : tuple of JourneyTrack
    patch : Patch
        All that is proposed.
    unlisted : tuple of UnlistedCell
    phone : PhoneNoise or None
    notes : tuple of str
    unused : tuple of str
        Notes on journeys that taught nothing.
    """

    database: RadioRouteDatabase
    names: tuple[str, ...]
    lesson: Lesson
    tracks: tuple[JourneyTrack, ...]
    patch: Patch
    unlisted: tuple[UnlistedCell, ...]
    phone: PhoneNoise | None
    notes: tuple[str, ...]
    unused: tuple[str, ...]


def study_logs(
    config: Config,
    out: Path,
    *,
    use_truth: bool = True,
    workers: int = 1,
    resume: bool = False,
    progress: Progress | None = None,
) -> Taught:
    """Locate the journeys of a configuration, and learn from them.

    Parameters
    ----------
    out : Path
        Beside it the tracks lie until all of them are finished.
    config, use_truth, workers, resume, progress
        As for :func:`mapfilter.workflows.learn.run_learn`.
    """
    choice, path, seed = (
        _smoothing(filter_choice(config.filter)),
        config.database_path,
        config.journeys.seed,
    )
    database = open_database(path, verify="full")
    paths = journeys_of(config)
    opened = _opened(config, paths, database)
    names, logs = [one.name for one in opened], [one.log for one in opened]
    key = study_key(database, names, logs, choice, seed, use_truth)
    with (
        FinishedParts(out, lambda: key, keep=resume, name="journey") as finished,
        tempfile.TemporaryDirectory() as scratch,
        local_executor(workers) as executor,
    ):
        lesson, tracks, notes = _Study(
            database,
            opened,
            choice,
            seed,
            use_truth,
            Path(scratch),
            finished,
            executor,
            2 * workers,
            progress,
        ).run()
    trusted = lesson.trusted.tolist()
    good = [(log, track) for log, track, use in zip(logs, tracks, trusted, strict=True) if use]
    ways = missing_ways(database.field(), [pair[1] for pair in good], [pair[0] for pair in good])
    cells = lesson.learned.network.cells
    offsets = dict(zip(database.cell_ids, (state.offset_db for state in cells), strict=True))
    changes = (*changes_of(lesson.learned.network.findings, offsets), *ways)
    journeys = [placed(log, track) for log, track in zip(logs, tracks, strict=True)]
    return Taught(
        database,
        tuple(names),
        lesson,
        tuple(tracks),
        Patch(database.lattice.crs, database.generation, len(logs), changes),
        unlisted_cells(journeys, database.plan),
        phone_noise(good, lesson.learned.phone_db[lesson.trusted], lesson.learned.sd_db),
        (*log_notes(opened), *notes),
        unused_notes(opened, journeys, lesson.visits_by_journey, lesson.learned.trust),
    )


@dataclass(frozen=True, eq=False)
class _Study:
    """The passes over all journeys."""

    database: RadioRouteDatabase
    opened: Sequence[OpenedLog]
    choice: FilterOptions
    seed: int
    use_truth: bool
    scratch: Path
    finished: FinishedParts
    executor: Executor
    in_flight: int
    progress: Progress | None

    @property
    def logs(self) -> list[TrackLog]:
        """The logs, with cells named as in the plan."""
        return [one.log for one in self.opened]

    def run(self) -> tuple[Lesson, list[JourneyTrack], tuple[str, ...]]:
        """Locate by map and dead reckoning, learn, locate with what was learned, learn again."""
        notes: list[str] = []
        blank = blank_database(self.database, self.scratch / "blank")
        tracks = self._tracks(blank, 0, is_blank=True)
        radii_m = np.concatenate([track.radius_m for track in tracks])
        if np.sum(radii_m <= _KNOWN_M) < _LEAST_KNOWN * radii_m.size:
            notes.append(
                "map and dead reckoning do not place these journeys: they were located with the "
                "database as it is, whose faults may hide in the tracks"
            )
            tracks = self._tracks(self.database, 1, is_blank=False)
        lesson = self._lesson(tracks)
        changes = changes_of(lesson.learned.network.findings, {})
        patch = Patch(self.database.lattice.crs, "0" * 64, len(self.logs), changes)
        patched = apply_patch(self.database, patch, self.scratch / "patched")
        again = self._tracks(patched, 2, is_blank=False)
        second = self._lesson(again)
        # A journey that was lost with the patched database may be right without any.
        worse = lesson.trusted & ~second.trusted
        if worse.any():
            again = [a if w else b for a, b, w in zip(tracks, again, worse, strict=True)]
            second = self._lesson(again)
        return second, again, tuple(notes)

    def _lesson(self, tracks: Sequence[JourneyTrack]) -> Lesson:
        journeys = [placed(log, track) for log, track in zip(self.logs, tracks, strict=True)]
        database = self.database
        lesson = lesson_of(journeys, database.plan, database.field(), database.floor_dbm)
        if not len(lesson.visits):
            expected = "levels of cells of the database along a located journey"
            none = np.zeros(len(journeys), dtype=np.int64)
            hint = "; ".join(unused_notes(self.opened, journeys, none, lesson.learned.trust))
            raise fail(InputError, "logs", expected, "none", hint)
        return lesson

    def _tracks(
        self, database: RadioRouteDatabase, number: int, *, is_blank: bool
    ) -> list[JourneyTrack]:
        """Return the tracks of all journeys over a database; finished ones from disk."""
        sha256, count = database.generation, len(self.logs)
        found: dict[int, JourneyTrack] = {}
        tasks: dict[int, _Task] = {}
        for i, (name, log) in enumerate((one.name, one.log) for one in self.opened):
            part = number * count + i
            kept = self.finished.load(part) if self.finished.keep else None
            if self.use_truth and len(log.truth) > 1:
                found[i] = JourneyTrack.of_truth(log)
            elif kept is not None:
                found[i] = JourneyTrack.from_bytes(kept)
            else:
                tasks[i] = _Task(name, log, database.path, sha256, self.choice, self.seed, is_blank)
        done = ordered_results(
            self.executor, _located, list(tasks.values()), in_flight=self.in_flight
        )
        for at, (i, data) in enumerate(zip(tasks, done, strict=True), start=1):
            self.finished.save(number * count + i, data)
            found[i] = JourneyTrack.from_bytes(data)
            if self.progress is not None:
                self.progress(number * count + count - len(tasks) + at, _PASSES * count)
        return [found[i] for i in range(count)]


def _located(task: _Task) -> bytes:
    """Locate one journey, on a worker."""
    log = with_one_step(blank_log(task.log) if task.is_blank else task.log, task.choice)
    rng = named_rng(task.seed, "learn", task.name)
    choice, _ = fitted_to_log(task.choice, log)
    filter_ = _filter(task.database, choice, task.sha256)
    return JourneyTrack.of_estimate(locate(log, filter_, rng).estimate).to_bytes()


@lru_cache(maxsize=2)
def _filter(database: Path, choice: FilterOptions, sha256: str) -> Filter[Any]:
    return choice.over(open_database(database, generation=sha256), ways=False)


def _smoothing(choice: FilterOptions) -> FilterOptions:
    if not isinstance(choice, BayesFilter) or choice.name != "bayes":
        hint = "learning needs smoothed tracks"
        raise fail(ConfigError, "filter.name", "bayes", choice.name, hint)
    return replace(choice, smooth=True)


def _opened(config: Config, paths: Sequence[Path], database: RadioRouteDatabase) -> list[OpenedLog]:
    """Return the logs of all journeys; InputError with the faults of all of them."""
    faults, logs = Faults(), list[OpenedLog]()
    for path in paths:
        try:
            opened = open_journey(config, path, database.lattice)
        except ConfigError:
            raise
        except MapfilterError as error:
            faults.take(error)
            continue
        check_log(path, opened.log, database.lattice, faults)
        log = with_plan_technologies(name_by_plan(opened.log, database.plan), database.plan)
        logs.append(replace(opened, log=log))
    faults.raise_if_any(InputError)
    return logs
