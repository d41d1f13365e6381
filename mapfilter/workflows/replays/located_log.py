"""One log of a replay: prepared for the filter, located, drawn, and written."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from mapfilter._io import atomic_file
from mapfilter._json_files import write_json
from mapfilter.config.sections import Config
from mapfilter.evaluation.accuracy import accuracy, held_by_radius_95
from mapfilter.evaluation.outcome import outcome
from mapfilter.evaluation.stanford import IntegrityOptions
from mapfilter.evaluation.truth import Truth
from mapfilter.positioning.assumed_errors import assumed_note, undirected_notes
from mapfilter.positioning.estimate_store import write_estimate, write_geojson, write_gpx
from mapfilter.positioning.filter import Filter, FilterOptions
from mapfilter.positioning.kalman.siteless import without_cells
from mapfilter.positioning.log_lacks import advice_of
from mapfilter.positioning.log_options import STREETS_ALONE, by_streets_alone, fitted_to_log
from mapfilter.positioning.loop import locate
from mapfilter.positioning.positioned_track import PositionedTrack, Snapshot
from mapfilter.positioning.timing_steps import with_one_step, with_plan_technologies
from mapfilter.propagation.shadowing import named_rng
from mapfilter.radio.plan_notes import assumed_notes
from mapfilter.report.ground import BaseMap
from mapfilter.tracks.checks.foreign_cells import foreign_cells, unknown_neighbours_note
from mapfilter.tracks.checks.range_units import with_range_notes
from mapfilter.tracks.joining.identify import name_by_plan
from mapfilter.tracks.kinds import leave_out
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.open_log import OpenedLog
from mapfilter.workflows.outputs.result_text import to_jsonable
from mapfilter.workflows.outputs.results import ESTIMATES, FIGURES
from mapfilter.workflows.outputs.served import served_points, street_map
from mapfilter.workflows.outputs.track_pictures import (
    Handed,
    TrackPictures,
    begin_belief,
    begin_pictures,
    with_error_picture,
)
from mapfilter.workflows.replays.baseline import Baselines, SingleReports
from mapfilter.workflows.replays.figures import ReplayedLog, route_of
from mapfilter.workflows.replays.filters import ReplayFilters
from mapfilter.workflows.replays.lacks import lack_of, notes_after

if TYPE_CHECKING:
    from mapfilter.viewing.trace import TraceRecorder

_SITES = "a cell plan (cells.plan) or a database (--db)"


class PreparedLog(NamedTuple):
    """A log as the filter takes it.

    Parameters
    ----------
    log : TrackLog
        Without what is hidden from the filter; its notes are all that are known before.
    options : FilterOptions
        Fitted to it.
    filter : Filter
    by_streets : bool
        Whether streets locate it without any cells, though a database may have some.
    """

    log: TrackLog
    options: FilterOptions
    filter: Filter[Any]
    by_streets: bool


class LocatedLog(NamedTuple):
    """A track, what draws its pictures, and the errors of single reports beside it.

    ``recorder`` has what a page shows; None where none is written.
    """

    track: PositionedTrack
    pictures: Handed
    baseline: SingleReports | None
    recorder: TraceRecorder | None


@dataclass(frozen=True, eq=False)
class LogReplay:
    """Replays logs, one after another, by the same options.

    Parameters
    ----------
    config : Config
        Its track, filter, integrity, journeys and output sections count.
    options : FilterOptions
        Of the filter, before they are fitted to a log.
    filters : ReplayFilters
    baselines : Baselines
        Errors of single reports.
    drawing : Executor
        What draws pictures.
    html : bool
        Whether a page is written for each log.
    """

    config: Config
    options: FilterOptions
    filters: ReplayFilters
    baselines: Baselines
    drawing: Executor
    html: bool

    def replayed(
        self,
        opened: OpenedLog,
        into: Path,
        *,
        drawn: bool,
        on_notes: Callable[[tuple[str, ...]], None] | None = None,
    ) -> ReplayedLog:
        """Locate a log; write its estimate, figures and pictures.

        Parameters
        ----------
        opened : OpenedLog
        into : Path
            Folder of the results.
        drawn : bool
            Whether pictures are drawn.
        on_notes : callable, optional
            Called with the notes that are known before it is located.
        """
        database = self.filters.database
        prepared = self._prepared(opened)
        log, fitted, filter_, by_streets = prepared
        if on_notes is not None:
            on_notes(log.notes)
        found = self._located(opened.name, prepared, drawn=drawn)
        estimate = found.track.estimate
        alone = database is not None and (by_streets or not database.cell_ids)
        advice = advice_of(log, fitted, estimate) if alone else ()
        truth_files = self.config.track.truth
        later = notes_after(opened, log, fitted, estimate, database, truth_files, filter_.uses)
        log = replace(log, notes=(*log.notes, *advice, *later))
        lack = lack_of(opened, log, self.options, estimate, database)
        written = _write(opened.name, log, found, into, lack)
        if found.recorder is not None:
            # Here, as most replays write no page.
            from mapfilter.workflows.replays.page import with_page

            written = with_page(written, log, found.track, found.recorder, database, into)
        plan = self.filters.plan(self._crs(opened.log))
        return replace(written, foreign=foreign_cells(written.outcome.unknown_cells, plan))

    def _crs(self, log: TrackLog) -> str:
        database = self.filters.database
        return log.crs if database is None else database.lattice.crs

    def _prepared(self, opened: OpenedLog) -> PreparedLog:
        """Return a log with its cells named, in the filter's units, and the filter fitted to it."""
        filters, database, crs = self.filters, self.filters.database, self._crs(opened.log)
        plan = filters.plan(crs)
        log = leave_out(name_by_plan(opened.log, plan), self.config.track.without)
        log = with_range_notes(log, plan) if filters.has_sites else without_cells(log, _SITES)
        log = with_one_step(with_plan_technologies(log, plan), self.options)
        fitted, notes = fitted_to_log(self.options, log)
        notes = (*notes, *(plan.notes if database is None else assumed_notes(database.plan)))
        by_streets = database is not None and by_streets_alone(fitted, log, database)
        notes = (*notes, STREETS_ALONE) if by_streets else notes
        if filters.has_sites:
            notes = (*notes, *unknown_neighbours_note(log.radio, plan))
        notes = (*notes, *undirected_notes(log, fitted))
        filter_ = filters.over(crs, fitted, cells=not by_streets)
        notes = (*notes, *assumed_note(log, fitted, filter_.uses))
        return PreparedLog(replace(log, notes=(*log.notes, *notes)), fitted, filter_, by_streets)

    def _located(self, name: str, prepared: PreparedLog, *, drawn: bool) -> LocatedLog:
        """Return the track of a log; its pictures are handed out as soon as each is known."""
        log, filter_, drawing = prepared.log, prepared.filter, self.drawing
        truth, base = Truth.of_table(log.truth), self._base_map() if drawn else None
        recorder, pictures = None, Handed()
        if self.html:
            # Here, as most replays write no page.
            from mapfilter.viewing.trace import TraceRecorder

            recorder = TraceRecorder(filter_)

        def draw_belief(snapshots: tuple[Snapshot, ...], has_evidence: bool) -> None:
            # By another process while the rest of the log is located.
            if base is not None:
                pictures.update(begin_belief(snapshots, has_evidence, truth, base, drawing))

        track = locate(
            log,
            filter_,
            named_rng(self.config.journeys.seed, "replay", name),
            snapshots=drawn,
            risk=self.config.integrity.of(IntegrityOptions).risk,
            recorder=recorder,
            on_snapshots=draw_belief,
        )
        if not drawn:
            return LocatedLog(track, pictures, self.baselines.of(log), recorder)
        shown = TrackPictures.of_log(track.estimate, log, base)
        pictures = begin_pictures(shown, drawing, pictures)
        # Located while those are drawn.
        baseline = self.baselines.of(log)
        beside_m = baseline.error_m if baseline is not None else None
        pictures = with_error_picture(pictures, shown, drawing, beside_m)
        return LocatedLog(track, pictures, baseline, recorder)

    def _base_map(self) -> BaseMap | None:
        database = self.filters.database
        return None if database is None else street_map(database, served_points(database))


def _write(name: str, log: TrackLog, found: LocatedLog, out: Path, lack: str) -> ReplayedLog:
    files, estimate = tuple(out / file for file in ESTIMATES), found.track.estimate
    write_estimate(estimate, files[0])
    write_gpx(estimate, files[1], name)
    write_geojson(estimate, files[2])
    truth = Truth.of_table(log.truth)
    replayed = ReplayedLog(
        name,
        outcome(estimate),
        accuracy(estimate, truth) if truth is not None else None,
        log.notes,
        lack,
        found.track.filter_s,
        (*files, out / FIGURES, *(out / picture for picture in found.pictures)),
        route_of(log),
        found.baseline,
    )
    if truth is not None:
        replayed = replace(replayed, held_95=held_by_radius_95(estimate, truth))
    head = {"log": name, "filter": estimate.filter}
    write_json(out / FIGURES, {**head, **to_jsonable(replayed.figures)})
    for picture, png in found.pictures.items():
        with atomic_file(out / picture) as temporary:
            temporary.write_bytes(png())
    return replayed
