"""``mapfilter replay``: locates one log, or every log of a folder, and scores it against truth."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from mapfilter._inputs import path_fault, shown
from mapfilter._io import replaced_files, write_json
from mapfilter._parallel import Progress
from mapfilter.config.sections import Config
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, Faults, InputError, MapfilterError, fail
from mapfilter.evaluation.accuracy import Accuracy, Outcome, Truth, accuracy, outcome
from mapfilter.evaluation.stanford import IntegrityOptions
from mapfilter.evaluation.success import SuccessSummary, summarise
from mapfilter.filters.contract import Reason
from mapfilter.geodesy import Lattice
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.estimate import PositionedTrack
from mapfilter.positioning.estimate_store import write_estimate, write_geojson, write_gpx
from mapfilter.positioning.filter import Filter, FilterOptions, locate
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.log_options import STREETS_ALONE, by_streets_alone, fitted_to_log
from mapfilter.propagation.shadowing import named_rng
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plan_notes import assumed_notes
from mapfilter.report.canvas import save
from mapfilter.report.errors import plot_error_over_distance
from mapfilter.tracks.identify import name_by_plan
from mapfilter.tracks.log import TrackLog, leave_out
from mapfilter.tracks.open_log import OpenedLog
from mapfilter.tracks.placeless import in_frame
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.store import is_log
from mapfilter.viewing.bundle import replay_bundle
from mapfilter.viewing.page import write_page
from mapfilter.viewing.runs import ViewedRun
from mapfilter.viewing.trace import TraceRecorder
from mapfilter.workflows.apart import check_out_apart
from mapfilter.workflows.kernels import compiled_beside
from mapfilter.workflows.logs import journeys_of, open_journey
from mapfilter.workflows.pictures import (
    ESTIMATES,
    FIGURES,
    REPLAY_HTML,
    SUMMARY,
    draw_track,
    older_results,
)
from mapfilter.workflows.replay_baseline import Baselines, SingleReports, together
from mapfilter.workflows.replay_lacks import advice_of, check_log, lack_of
from mapfilter.workflows.terminal import to_jsonable
from mapfilter.workflows.views import run_figures
from mapfilter.workflows.world import filter_choice, plan_antennas, planned_cells


class _Logs:
    """The logs of a configuration, which are read for checks first.

    They are kept for what follows: recordings, as reading them may take long, and of others so many
    that they need little memory.
    """

    def __init__(self, config: Config, database: RadioRouteDatabase | None) -> None:
        self.config, self.paths = config, journeys_of(config)
        self._crs = "" if database is None else database.lattice.crs
        self._kept: dict[Path, OpenedLog] = {}
        self._left_rows = _MOST_KEPT_ROWS

    def open(self, path: Path) -> OpenedLog:
        if path in self._kept:
            return self._kept[path]
        opened = open_journey(self.config, path, self._crs)
        if self._crs:
            opened = replace(opened, log=in_frame(opened.log, self._crs))
        tables = [getattr(opened.log, table) for table in TABLES]
        rows = sum(map(len, (*tables, *opened.sensors.values())))
        if opened.recordings or rows <= self._left_rows:
            self._kept[path] = opened
            self._left_rows -= rows
        return opened

    def check(self, lattice: Lattice) -> None:
        """Read every log before any is located, so that all faults come before any result."""
        faults = Faults()
        for path in self.paths:
            if wrong := path_fault(path):
                faults.add("logs", wrong, shown(str(path)))
                continue
            try:
                check_log(path, self.open(path).log, lattice, faults)
            except ConfigError:
                raise
            except MapfilterError as error:
                faults.found.extend(error.faults)
        faults.raise_if_any(InputError)

    def check_siteless(self) -> None:
        """Refuse logs of which a filter without a map would need sites."""
        for path in self.paths:
            log = leave_out(self.open(path).log, self.config.track.without)
            if len(log.radio) or len(log.tdoa):
                hint = (
                    "filters without a map take the sites from there, or from a database (--db); "
                    "--without radio,tdoa leaves positions and dead reckoning"
                )
                raise fail(ConfigError, "cells.plan", "a cell plan", "none", hint)


_NAMED = 3
_MOST_KEPT_ROWS = 1_000_000


@dataclass(frozen=True)
class ReplayedLog:
    """One log, located.

    Parameters
    ----------
    name : str
        Of the log's folder.
    outcome : Outcome
        As the filter reports it, without ground truth.
    accuracy : Accuracy or None
        Against the truth, where the log has it.
    notes : tuple of str
        What was mended or passed over when the log was read.
    lack : str
        What it lacks so that nothing could be located in it, or an empty text.
    filter_s : float
        Processor time of the filter.
    outputs : tuple of Path
        Files written.
    route : str
        Equal for logs with the same true path; empty without a truth.
    baseline : SingleReports or None
        Errors of the reports, each located by itself; None without truth, reports or cells.
    """

    name: str
    outcome: Outcome
    accuracy: Accuracy | None
    notes: tuple[str, ...]
    lack: str
    filter_s: float
    outputs: tuple[Path, ...]
    route: str = ""
    baseline: SingleReports | None = None

    @property
    def figures(self) -> dict[str, Any]:
        """Outcome, notes and, with ground truth, the score beside that of single reports."""
        score = asdict(self.accuracy) if self.accuracy is not None else {}
        return {**asdict(self.outcome), "notes": self.notes, **score, **_beside(self.baseline)}


@dataclass(frozen=True)
class ReplayResult:
    """All logs, located.

    Parameters
    ----------
    filter : str
        Its name.
    logs : tuple of ReplayedLog
        In the order of their names.
    summary : SuccessSummary or None
        Over the logs with truth.
    out : Path
        Folder of the results.
    """

    filter: str
    logs: tuple[ReplayedLog, ...]
    summary: SuccessSummary | None
    out: Path

    @property
    def partial(self) -> bool:
        """Whether something was done in part only."""
        return bool(self.warnings)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was done in part only: cells unknown to the database, logs that lack something."""
        found = []
        unknown = _most_frequent(log.outcome.unknown_cells for log in self.logs)
        if unknown:
            verb = "cell is" if len(unknown) == 1 else "cells are"
            where = _named([log.name for log in self.logs if log.outcome.unknown_cells])
            found.append(
                f"{len(unknown)} {verb} unknown to the database ({_named(list(unknown))}; in "
                f"{where}); their readings are labelled {Reason.UNKNOWN_CELL}"
            )
        for lack in sorted({log.lack for log in self.logs if log.lack}):
            names = [log.name for log in self.logs if log.lack == lack]
            found.append(f"nothing is located in {_named(names)}: {lack}")
        return tuple(found)


def route_of(log: TrackLog) -> str:
    """Return what is equal for logs with the same true path; an empty text without a truth."""
    if log.truth.empty:
        return ""
    path = log.truth[["east_m", "north_m"]].to_numpy(dtype=np.float64)
    return hashlib.sha256(np.ascontiguousarray(path).tobytes()).hexdigest()


def summary_of(logs: Sequence[ReplayedLog]) -> SuccessSummary | None:
    """Put the scores of the logs with truth together; None without any."""
    scored = [(log.accuracy, log.route) for log in logs if log.accuracy is not None]
    if not scored:
        return None
    return summarise([score for score, _ in scored], [route for _, route in scored])


def summary_figures(result: ReplayResult) -> dict[str, Any]:
    """Return the sums over several logs, and the success rate of those with truth."""
    outcomes = [log.outcome for log in result.logs]
    scores = asdict(result.summary) if result.summary is not None else {}
    return {
        "logs": len(outcomes),
        **scores,
        "switched": sum(outcome.switched for outcome in outcomes),
        "final_statuses": _sum({o.final_status: 1} for o in outcomes if o.final_status),
        "unused": _sum(outcome.unused for outcome in outcomes),
        "unknown_cells": _most_frequent(outcome.unknown_cells for outcome in outcomes),
        "logs_with_unknown_cells": [log.name for log in result.logs if log.outcome.unknown_cells],
        "notes": _shared_notes(result.logs),
        **_beside(together([log.baseline for log in result.logs])),
    }


def replay_figures(result: ReplayResult) -> dict[str, Any]:
    """Return what a replay found, as JSON shows it.

    One log gives its own figures, several the sums of all.
    """
    shown: dict[str, Any] = {"filter": result.filter, "logs": len(result.logs)}
    if len(result.logs) == 1:
        shown |= {**result.logs[0].figures, "outputs": result.logs[0].outputs}
    else:
        shown |= summary_figures(result)
    filter_s = sorted(log.filter_s for log in result.logs)
    shown["partial"] = result.partial
    return {**shown, "filter_s": filter_s[len(filter_s) // 2], "out": result.out}


def _beside(baseline: SingleReports | None) -> dict[str, Any]:
    return {} if baseline is None else {"baseline": baseline.figures}


def _sum(counts: Iterable[Mapping[str, int]]) -> dict[str, int]:
    total: Counter[str] = Counter()
    for count in counts:
        total.update(count)
    return dict(sorted(total.items()))


def _most_frequent(counts: Iterable[Mapping[str, int]]) -> dict[str, int]:
    return dict(sorted(_sum(counts).items(), key=lambda one: -one[1]))


def _named(names: Sequence[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"{', '.join(names[:_NAMED])}{more}"


def _shared_notes(logs: Sequence[ReplayedLog]) -> list[str]:
    """Return each note once, with the logs that it is of."""
    owners: dict[str, list[str]] = {}
    for log in logs:
        for note in log.notes:
            # A note begins with the file that it is of; logs differ in its folder.
            _, _, rest = note.rpartition(f"{log.name}/")
            owners.setdefault(rest, []).append(log.name)
    return [f"{note} (in {_named(names)})" for note, names in owners.items()]


def run_replay(
    config: Config, out: Path, *, html: bool = False, progress: Progress | None = None
) -> ReplayResult:
    """Locate the log or logs of a configuration and write estimates, figures and pictures.

    Parameters
    ----------
    config : Config
        Its database (for Kalman-type filters its cells), track, filter, integrity and output
        sections count.
    out : Path
        Folder of the results; one log writes straight into it, several into a folder each.
    html : bool
        Whether a page is written that shows each log's replay (``replay.html``).
    progress : callable, optional
        Called with logs done and logs in all.

    Raises
    ------
    MapfilterError
        The database, the cell plan, an antenna or a log is missing or damaged, or the output
        cannot be written.
    """
    options = filter_choice(config.filter)
    with compiled_beside() if isinstance(options, BayesFilter) else nullcontext():
        database = _database(config, options)
        journeys = _Logs(config, database)

    @cache
    def sites(crs: str) -> CellPlan:
        if database is not None:
            return database.plan
        return planned_cells(config, crs) if config.cells.plan else CellPlan(crs, ())

    @cache
    def over(crs: str, fitted: FilterOptions, *, cells: bool) -> Filter[Any]:
        if database is not None and not isinstance(fitted, KalmanFilter):
            return fitted.over(database if cells else database.without_cells())
        plan = sites(crs)
        return cast(KalmanFilter, fitted).over_sites(plan, plan_antennas(config, plan))

    own = [database.path] if database is not None else []
    check_out_apart(out, [*own, *(path for path in journeys.paths if is_log(path))])
    if database is None and config.cells.plan is None:
        journeys.check_siteless()
    if database is not None:
        journeys.check(database.lattice)
        over(database.lattice.crs, options, cells=True)
    baselines = Baselines(database, config.journeys.seed)
    wanted, count = config.output.pictures, len(journeys.paths)
    risk = config.integrity.of(IntegrityOptions).risk

    def located(index: int, path: Path, new: Path) -> ReplayedLog:
        opened = journeys.open(path)
        name, crs = opened.name, opened.log.crs if database is None else database.lattice.crs
        log = leave_out(name_by_plan(opened.log, sites(crs)), config.track.without)
        fitted, notes = fitted_to_log(options, log)
        notes = (*notes, *(sites(crs).notes if database is None else assumed_notes(database.plan)))
        if database is not None and by_streets_alone(fitted, log, database):
            notes = (*notes, STREETS_ALONE)
        filter_ = over(crs, fitted, cells=STREETS_ALONE not in notes)
        log = replace(log, notes=(*log.notes, *notes))
        rng = named_rng(config.journeys.seed, "replay", name)
        drawn = wanted == "all" or (wanted == "first" and not index)
        recorder = TraceRecorder(filter_) if html else None
        track = locate(log, filter_, rng, snapshots=drawn, risk=risk, recorder=recorder)
        into = new if count == 1 else new / name
        baseline = baselines.of(log)
        if database is None:
            pictures = _draw_errors(log, track, into) if drawn else ()
        else:
            beside_m = baseline.error_m if baseline is not None else None
            pictures = draw_track(database, log, track, into, beside_m) if drawn else ()
        if database is not None and (STREETS_ALONE in notes or not database.cell_ids):
            log = replace(log, notes=(*log.notes, *advice_of(log, fitted, track.estimate)))
        lack = lack_of(opened, log, options, track.estimate, database)
        written = _write(name, log, track, into, pictures, lack, baseline)
        if recorder is not None:
            written = _with_view(written, log, track, recorder, database, into)
        files = tuple(out / file.relative_to(new) for file in written.outputs)
        return replace(written, outputs=files)

    # Older results stay until all of these are whole.
    with replaced_files(out, partial(older_results, out)) as new:
        logs = []
        for index, path in enumerate(journeys.paths):
            logs.append(located(index, path, new))
            if progress is not None:
                progress(index + 1, count)
        result = ReplayResult(config.filter.name, tuple(logs), summary_of(logs), out)
        if count > 1:
            write_json(new / SUMMARY, to_jsonable(summary_figures(result)))
    return result


def _with_view(
    replayed: ReplayedLog,
    log: TrackLog,
    track: PositionedTrack,
    recorder: TraceRecorder,
    database: RadioRouteDatabase | None,
    into: Path,
) -> ReplayedLog:
    """Write the page of one log."""
    name, estimate = replayed.name, track.estimate
    figures = run_figures(replayed.figures)
    view = ViewedRun(
        f"{name}, {estimate.filter}",
        estimate,
        log,
        log_name=name,
        trace=recorder,
        figures=figures,
        smoothed=recorder.filter.smoother() is not None,
    )
    write_page(replay_bundle(f"Replay of {name}", [view], database), into / REPLAY_HTML)
    return replace(replayed, outputs=(*replayed.outputs, into / REPLAY_HTML))


def _database(config: Config, options: FilterOptions) -> RadioRouteDatabase | None:
    """Open the database, unless the filter only needs sites, or not even these."""
    stated = config.database.path is not None
    if isinstance(options, KalmanFilter) and (config.cells.plan is not None or not stated):
        return None
    if not (stated or config.database_path.exists()):
        found = f"none, and nothing at {shown(str(config.database_path))}"
        hint = (
            "give --db; mapfilter build makes one, of streets alone with --roads-only; without "
            "any, mapfilter locate takes logs, and --filter ekf positions"
        )
        raise fail(ConfigError, "database.path", "a radio-route database", found, hint)
    return open_database(config.database_path, verify="full")


def _draw_errors(log: TrackLog, track: PositionedTrack, into: Path) -> tuple[Path, ...]:
    truth = Truth.of_table(log.truth)
    if truth is None:
        return ()
    return (save(plot_error_over_distance(track.estimate, truth), into / "error.png"),)


def _write(
    name: str,
    log: TrackLog,
    track: PositionedTrack,
    out: Path,
    pictures: tuple[Path, ...],
    lack: str,
    baseline: SingleReports | None,
) -> ReplayedLog:
    files = tuple(out / file for file in ESTIMATES)
    write_estimate(track.estimate, files[0])
    write_gpx(track.estimate, files[1], name)
    write_geojson(track.estimate, files[2])
    truth = Truth.of_table(log.truth)
    replayed = ReplayedLog(
        name,
        outcome(track.estimate),
        accuracy(track.estimate, truth) if truth is not None else None,
        log.notes,
        lack,
        track.filter_s,
        (*files, out / FIGURES, *pictures),
        route_of(log),
        baseline,
    )
    head = {"log": name, "filter": track.estimate.filter}
    write_json(out / FIGURES, {**head, **to_jsonable(replayed.figures)})
    return replayed
