"""``mapfilter replay``: locates one log, or every log of a folder, and scores it against truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mapfilter._io import ensure_writable_folder, write_json
from mapfilter._parallel import Progress
from mapfilter.database.store import open_database
from mapfilter.evaluation.accuracy import Accuracy, accuracy
from mapfilter.evaluation.success import SuccessSummary, summarise
from mapfilter.filters.candidate_options import CandidateOptions
from mapfilter.filters.contract import Reason
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.estimate_store import write_estimate, write_geojson, write_gpx
from mapfilter.positioning.global_positioning import (
    PositionedTrack,
    cell_points,
    position_by_candidates,
)
from mapfilter.radio.shadowing import named_rng
from mapfilter.tracks.leave_out import leave_out
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.store import list_logs, read_log
from mapfilter.workflows.facts import facts
from mapfilter.workflows.log_checks import check_logs, lacking
from mapfilter.workflows.pictures import draw_track
from mapfilter.workflows.results import ESTIMATES, FIGURES, SUMMARY, clear_results
from mapfilter.workflows.sections import Config, FilterSection
from mapfilter.workflows.truth import truth_of

_NAMED = 3


@dataclass(frozen=True)
class ReplayedLog:
    """One log, located.

    Parameters
    ----------
    name : str
        Of the log's folder.
    accuracy : Accuracy or None
        Against the truth, where the log has it.
    unused : dict
        How many readings were not used, by reason.
    filter_s : float
        Processor time of the filter.
    outputs : tuple of Path
        Files written.
    """

    name: str
    accuracy: Accuracy | None
    unused: dict[str, int]
    filter_s: float
    outputs: tuple[Path, ...]


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
    warnings : tuple of str
        What was done in part only: cells unknown to the database, logs that lack what it takes.
    out : Path
        Folder of the results.
    """

    filter: str
    logs: tuple[ReplayedLog, ...]
    summary: SuccessSummary | None
    warnings: tuple[str, ...]
    out: Path

    @property
    def partial(self) -> bool:
        """Whether something was done in part only."""
        return bool(self.warnings)


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
    database = open_database(config.database_path, verify="full")
    folders = list_logs(config.track_path)
    check_logs(folders, database.lattice)
    ensure_writable_folder(out)
    clear_results(out)
    points_of = cell_points(database, config.filter.margin_db)
    options = candidate_options(config.filter, database.lattice.resolution_m)
    logs: list[ReplayedLog] = []
    scores: list[Accuracy] = []
    lacks: dict[str, str] = {}
    for index, folder in enumerate(folders):
        log = leave_out(read_log(folder), config.track.without)
        rng = named_rng(config.journeys.seed, "replay", folder.name)
        track = position_by_candidates(database, points_of, log, options, rng)
        into = out if len(folders) == 1 else out / folder.name
        drawn = config.output.pictures == "all" or (config.output.pictures == "first" and not index)
        pictures: tuple[Path, ...] = ()
        if drawn:
            pictures = draw_track(database, log, track, into)
        logs.append(_write(folder.name, log, track, into, pictures))
        if lack := lacking(log):
            lacks[folder.name] = lack
        score = logs[-1].accuracy
        if score is not None:
            scores.append(score)
        if progress is not None:
            progress(index + 1, len(folders))
    summary = summarise(scores) if scores else None
    if summary is not None and len(folders) > 1:
        write_json(out / SUMMARY, facts(summary))
    return ReplayResult("candidate", tuple(logs), summary, _warnings(logs, lacks), out)


def _warnings(logs: Sequence[ReplayedLog], lacks: Mapping[str, str]) -> tuple[str, ...]:
    told = []
    if any(str(Reason.UNKNOWN_CELL) in log.unused for log in logs):
        label = Reason.UNKNOWN_CELL
        told.append(f"some cells are unknown to the database; their readings are labelled {label}")
    for lack in sorted(set(lacks.values())):
        names = [name for name, its in lacks.items() if its == lack]
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        told.append(f"nothing is located in {', '.join(names[:_NAMED])}{more}: {lack}")
    return tuple(told)


def candidate_options(section: FilterSection, resolution_m: float) -> CandidateOptions:
    """Return the reading of the paper that a configuration asks for."""
    return CandidateOptions(
        resolution_m=resolution_m,
        update_length_m=section.update_length_m,
        tracking_length_m=section.tracking_length_m,
        prediction=section.prediction,
        duplicates=section.duplicates,
        threshold=section.threshold,
        at_threshold=section.at_threshold,
        switch_check=section.switch_check,
        when_empty=section.when_empty,
    )


def _write(
    name: str, log: TrackLog, track: PositionedTrack, out: Path, pictures: tuple[Path, ...]
) -> ReplayedLog:
    files = tuple(out / file for file in ESTIMATES)
    write_estimate(track.estimate, files[0])
    write_gpx(track.estimate, files[1], name)
    write_geojson(track.estimate, files[2])
    truth = truth_of(log)
    score = accuracy(track.estimate, truth) if truth is not None else None
    unused = _count_reasons(track.estimate)
    figures: dict[str, Any] = {
        "log": name,
        "filter": track.estimate.filter,
        "epochs": len(track.estimate),
        "unused": unused,
        "notes": list(log.notes),
        **(facts(score) if score is not None else {}),
    }
    write_json(out / FIGURES, figures)
    return ReplayedLog(name, score, unused, track.filter_s, (*files, out / FIGURES, *pictures))


def _count_reasons(estimate: TrackEstimate) -> dict[str, int]:
    counts: dict[str, int] = {}
    for reading in estimate.unused:
        counts[str(reading.reason)] = counts.get(str(reading.reason), 0) + 1
    return dict(sorted(counts.items()))


def replay_facts(result: ReplayResult) -> dict[str, Any]:
    """Return what a replay found, as JSON shows it.

    One log gives its own figures, several the summary of all.
    """
    shown: dict[str, Any] = {"filter": result.filter, "logs": len(result.logs)}
    if len(result.logs) == 1:
        log = result.logs[0]
        shown |= asdict(log.accuracy) if log.accuracy is not None else {}
        shown |= {"unused": log.unused, "outputs": log.outputs}
    elif result.summary is not None:
        shown |= asdict(result.summary)
    filter_s = sorted(log.filter_s for log in result.logs)
    shown["partial"] = result.partial
    return {**shown, "filter_s": filter_s[len(filter_s) // 2], "out": result.out}
