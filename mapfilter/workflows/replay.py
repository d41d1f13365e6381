"""``mapfilter replay``: locates one log, or every log of a folder, and scores it against truth."""

from __future__ import annotations

from pathlib import Path

from mapfilter._io import ensure_writable_folder, write_json
from mapfilter._parallel import Progress
from mapfilter.database.store import open_database
from mapfilter.evaluation.accuracy import accuracy
from mapfilter.evaluation.outcome import outcome
from mapfilter.positioning.estimate_store import write_estimate, write_geojson, write_gpx
from mapfilter.positioning.global_positioning import PositionedTrack
from mapfilter.positioning.locators import open_locator
from mapfilter.radio.shadowing import named_rng
from mapfilter.tracks.leave_out import leave_out
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.store import list_logs, read_log
from mapfilter.workflows.facts import facts
from mapfilter.workflows.filters import filter_choice
from mapfilter.workflows.log_checks import check_logs, lacking
from mapfilter.workflows.pictures import draw_track
from mapfilter.workflows.replay_fusion import FUSION_FILTERS, run_replay_fusion
from mapfilter.workflows.replayed import (
    ReplayedLog,
    ReplayResult,
    route_of,
    summary_figures,
    summary_of,
)
from mapfilter.workflows.results import ESTIMATES, FIGURES, SUMMARY, clear_results
from mapfilter.workflows.sections import Config
from mapfilter.workflows.truth import truth_of


def run_replay(
    config: Config,
    out: Path,
    *,
    progress: Progress | None = None,
) -> ReplayResult:
    """Locate the log or logs of a configuration and write estimates, figures and pictures.

    Parameters
    ----------
    config : Config
        Its database, track, filter and output sections count.
    out : Path
        Folder of the results; one log writes straight into it, several into a folder each.
    progress : callable, optional
        Called with logs done and logs in all.

    Raises
    ------
    MapfilterError
        The database or a log is missing or damaged, or the output cannot be written.
    """
    if config.filter.name in FUSION_FILTERS:
        return run_replay_fusion(config, out, progress=progress)
    database = open_database(config.database_path, verify="full")
    folders = list_logs(config.track_path)
    check_logs(folders, database.lattice)
    choice = filter_choice(config.filter, database.lattice.resolution_m)
    locate = open_locator(database, choice)
    ensure_writable_folder(out)
    clear_results(out)
    logs: list[ReplayedLog] = []
    for index, folder in enumerate(folders):
        log = leave_out(read_log(folder), config.track.without)
        rng = named_rng(config.journeys.seed, "replay", folder.name)
        track = locate(log, rng)
        into = out if len(folders) == 1 else out / folder.name
        drawn = config.output.pictures == "all" or (config.output.pictures == "first" and not index)
        pictures: tuple[Path, ...] = ()
        if drawn:
            pictures = draw_track(database, log, track, into)
        logs.append(_write(folder.name, log, track, into, pictures))
        if progress is not None:
            progress(index + 1, len(folders))
    result = ReplayResult(choice.name, tuple(logs), summary_of(logs), out)
    if len(folders) > 1:
        write_json(out / SUMMARY, facts(summary_figures(result)))
    return result


def _write(
    name: str, log: TrackLog, track: PositionedTrack, out: Path, pictures: tuple[Path, ...]
) -> ReplayedLog:
    files = tuple(out / file for file in ESTIMATES)
    write_estimate(track.estimate, files[0])
    write_gpx(track.estimate, files[1], name)
    write_geojson(track.estimate, files[2])
    truth = truth_of(log)
    replayed = ReplayedLog(
        name,
        outcome(track.estimate),
        accuracy(track.estimate, truth) if truth is not None else None,
        log.notes,
        lacking(log, track.estimate),
        track.filter_s,
        (*files, out / FIGURES, *pictures),
        route_of(log),
    )
    head = {"log": name, "filter": track.estimate.filter}
    write_json(out / FIGURES, {**head, **facts(replayed.figures)})
    return replayed
