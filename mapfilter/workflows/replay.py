"""``mapfilter replay``: locates one log, or every log of a folder, and scores it against truth."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, cast

from mapfilter._inputs import shown
from mapfilter._io import atomic_file, replaced_files
from mapfilter._json_files import write_json
from mapfilter._parallel import Progress, SerialExecutor
from mapfilter.config.sections import Config
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, fail, noted
from mapfilter.evaluation.accuracy import accuracy, held_by_radius_95
from mapfilter.evaluation.outcome import outcome
from mapfilter.evaluation.stanford import IntegrityOptions
from mapfilter.evaluation.truth import Truth
from mapfilter.positioning.assumed_errors import assumed_note, undirected_notes
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.estimate_store import write_estimate, write_geojson, write_gpx
from mapfilter.positioning.filter import Filter, FilterOptions
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.kalman.siteless import without_cells
from mapfilter.positioning.log_lacks import advice_of
from mapfilter.positioning.log_options import STREETS_ALONE, by_streets_alone, fitted_to_log
from mapfilter.positioning.loop import locate
from mapfilter.positioning.positioned_track import PositionedTrack, Snapshot
from mapfilter.positioning.timing_steps import with_one_step, with_plan_technologies
from mapfilter.propagation.shadowing import named_rng
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plan_notes import assumed_notes
from mapfilter.report.ground import BaseMap
from mapfilter.tracks.foreign_cells import foreign_cells, unknown_neighbours_note
from mapfilter.tracks.identify import name_by_plan
from mapfilter.tracks.kinds import leave_out
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.open_log import OpenedLog
from mapfilter.tracks.range_units import with_range_notes
from mapfilter.workflows.apart import check_inputs_kept, check_out_apart, named_inputs
from mapfilter.workflows.filter_choice import filter_choice
from mapfilter.workflows.kernels import compiled_beside
from mapfilter.workflows.planned_cells import cells_beside_log, plan_antennas
from mapfilter.workflows.replay_baseline import Baselines, SingleReports
from mapfilter.workflows.replay_lacks import lack_of, notes_after
from mapfilter.workflows.replay_logs import ReplayLogs
from mapfilter.workflows.replayed import (
    ReplayedLog,
    ReplayResult,
    route_of,
    summary_figures,
    summary_of,
)
from mapfilter.workflows.result_text import to_jsonable
from mapfilter.workflows.results import (
    ESTIMATES,
    FIGURES,
    SUMMARY,
    check_figures_of_replay,
    older_results,
    replaced_by_replay,
)
from mapfilter.workflows.served import served_points, street_map
from mapfilter.workflows.track_pictures import (
    Handed,
    TrackPictures,
    begin_belief,
    begin_pictures,
    drawn_beside,
    with_error_picture,
)

_SITES = "a cell plan (cells.plan) or a database (--db)"


def run_replay(
    config: Config,
    out: Path,
    *,
    html: bool = False,
    beside: bool = False,
    drawers: Executor | None = None,
    progress: Progress | None = None,
    on_notes: Callable[[tuple[str, ...]], None] | None = None,
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
    beside : bool
        Whether other processes may compile and draw meanwhile. They import the main module of the
        program again, so a script says so below ``if __name__ == "__main__"`` only.
    drawers : Executor, optional
        What draws, where it was started before (``workflows.drawer``).
    progress : callable, optional
        Called with logs done and logs in all.
    on_notes : callable, optional
        Called before a log is located with its notes known then; not where there are several logs.

    Raises
    ------
    MapfilterError
        The database, the cell plan, an antenna or a log is missing or damaged, or the output
        cannot be written.
    """
    options = filter_choice(config.filter)
    compiles = beside and isinstance(options, BayesFilter)
    with compiled_beside() if compiles else nullcontext():
        database = _database(config, options)
        journeys = ReplayLogs(config, database)

    @cache
    def sites(crs: str) -> CellPlan:
        if database is not None:
            return database.plan
        return cells_beside_log(config, crs)

    @cache
    def over(crs: str, fitted: FilterOptions, *, cells: bool) -> Filter[Any]:
        if database is not None and not isinstance(fitted, KalmanFilter):
            return fitted.over(database if cells else database.without_cells())
        plan = sites(crs)
        return cast(KalmanFilter, fitted).over_sites(plan, plan_antennas(config, plan))

    own = [database.path] if database is not None else []
    # Several logs are folders of these names.
    several = journeys.paths if len(journeys.paths) > 1 else []
    for folder in (out, *(out / path.name for path in several)):
        check_out_apart(folder, [*own, *journeys.paths, *config.track.recordings])
        check_figures_of_replay(folder)
        check_inputs_kept([*journeys.paths, *named_inputs(config)], replaced_by_replay(folder))
    has_sites = database is not None or config.cells.plan is not None
    if not has_sites:
        journeys.check_siteless()
    journeys.check(None if database is None else database.lattice)
    if database is not None:
        over(database.lattice.crs, options, cells=True)
    baselines = Baselines(database, config.journeys.seed)
    wanted, count = config.output.pictures, len(journeys.paths)
    risk = config.integrity.of(IntegrityOptions).risk

    def located(index: int, opened: OpenedLog, new: Path) -> ReplayedLog:
        name, crs = opened.name, opened.log.crs if database is None else database.lattice.crs
        log = leave_out(name_by_plan(opened.log, sites(crs)), config.track.without)
        log = with_range_notes(log, sites(crs)) if has_sites else without_cells(log, _SITES)
        log = with_one_step(with_plan_technologies(log, sites(crs)), options)
        fitted, notes = fitted_to_log(options, log)
        notes = (*notes, *(sites(crs).notes if database is None else assumed_notes(database.plan)))
        if database is not None and by_streets_alone(fitted, log, database):
            notes = (*notes, STREETS_ALONE)
        if has_sites:
            notes = (*notes, *unknown_neighbours_note(log.radio, sites(crs)))
        notes = (*notes, *undirected_notes(log, fitted))
        filter_ = over(crs, fitted, cells=STREETS_ALONE not in notes)
        notes = (*notes, *assumed_note(log, fitted, filter_.uses))
        log = replace(log, notes=(*log.notes, *notes))
        if on_notes is not None and count == 1:
            on_notes(log.notes)
        rng = named_rng(config.journeys.seed, "replay", name)
        drawn = wanted == "all" or (wanted == "first" and not index)
        recorder = None
        if html:
            # Here, as most replays write no page.
            from mapfilter.viewing.trace import TraceRecorder

            recorder = TraceRecorder(filter_)
        truth, pictures = Truth.of_table(log.truth), Handed()
        base = _base_map(database) if drawn else None

        def draw_belief(snapshots: tuple[Snapshot, ...], has_evidence: bool) -> None:
            # By another process while the rest of the log is located.
            if base is not None:
                pictures.update(begin_belief(snapshots, has_evidence, truth, base, drawing))

        track = locate(
            log,
            filter_,
            rng,
            snapshots=drawn,
            risk=risk,
            recorder=recorder,
            on_snapshots=draw_belief,
        )
        into = new if count == 1 else new / name
        shown = TrackPictures.of_log(track.estimate, log, base) if drawn else None
        if shown is not None:
            pictures = begin_pictures(shown, drawing, pictures)
        baseline = baselines.of(log)
        if shown is not None:
            beside_m = baseline.error_m if baseline is not None else None
            pictures = with_error_picture(pictures, shown, drawing, beside_m)
        alone = database is not None and (STREETS_ALONE in notes or not database.cell_ids)
        advice = advice_of(log, fitted, track.estimate) if alone else ()
        later = notes_after(
            opened, log, fitted, track.estimate, database, config.track.truth, filter_.uses
        )
        log = replace(log, notes=(*log.notes, *advice, *later))
        lack = lack_of(opened, log, options, track.estimate, database)
        written = _write(name, log, track, into, pictures, lack, baseline)
        if recorder is not None:
            from mapfilter.workflows.replay_page import with_page

            written = with_page(written, log, track, recorder, database, into)
        files = tuple(out / file.relative_to(new) for file in written.outputs)
        foreign = foreign_cells(written.outcome.unknown_cells, sites(crs))
        return replace(written, outputs=files, foreign=foreign)

    place: AbstractContextManager[Executor] = nullcontext(drawers or SerialExecutor())
    if drawers is None and beside and wanted != "none":
        place = drawn_beside()
    # Older results stay until all of these are whole.
    with (
        place as drawing,
        replaced_files(out, partial(older_results, out)) as new,
    ):
        logs = []
        for index, path in enumerate(journeys.paths):
            opened = journeys.open(path)
            with noted(opened.log.notes):
                logs.append(located(index, opened, new))
            if progress is not None:
                progress(index + 1, count)
        result = ReplayResult(config.filter.name, tuple(logs), summary_of(logs), out)
        if count > 1:
            write_json(new / SUMMARY, to_jsonable(summary_figures(result)))
    return result


def unnamed_database(config: Config) -> Path | None:
    """Return the database of a replay where no setting names it, nor the folder that it lies in."""
    needs_none = isinstance(filter_choice(config.filter), KalmanFilter)
    is_named = config.database.path is not None or config.output.dir != Path.cwd() / "out"
    if needs_none or is_named or not config.database_path.exists():
        return None
    return config.database_path


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


def _base_map(database: RadioRouteDatabase | None) -> BaseMap | None:
    return None if database is None else street_map(database, served_points(database))


def _write(
    name: str,
    log: TrackLog,
    track: PositionedTrack,
    out: Path,
    pictures: Handed,
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
        (*files, out / FIGURES, *(out / picture for picture in pictures)),
        route_of(log),
        baseline,
    )
    if truth is not None:
        replayed = replace(replayed, held_95=held_by_radius_95(track.estimate, truth))
    head = {"log": name, "filter": track.estimate.filter}
    write_json(out / FIGURES, {**head, **to_jsonable(replayed.figures)})
    for picture, png in pictures.items():
        with atomic_file(out / picture) as temporary:
            temporary.write_bytes(png())
    return replayed
