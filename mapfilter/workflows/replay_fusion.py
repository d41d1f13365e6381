"""``mapfilter replay`` with Kalman-type filters: sites and a log, no database."""

from __future__ import annotations

from pathlib import Path

from mapfilter._io import ensure_writable_folder, write_json
from mapfilter._parallel import Progress
from mapfilter.errors import ConfigError, fail
from mapfilter.evaluation.accuracy import accuracy
from mapfilter.evaluation.outcome import outcome
from mapfilter.filters.gaussian import METHODS
from mapfilter.positioning.estimate_store import write_estimate, write_geojson, write_gpx
from mapfilter.positioning.fusion_models import FusionOptions, SiteModels
from mapfilter.positioning.fusion_replay import position_by_fusion
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.msi import read_antennas
from mapfilter.report.error_curve import plot_error_over_distance
from mapfilter.tracks.leave_out import leave_out
from mapfilter.tracks.store import list_logs, read_log
from mapfilter.workflows.facts import facts
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
from mapfilter.workflows.world import planned_cells

FUSION_FILTERS = tuple(METHODS)


def run_replay_fusion(
    config: Config, out: Path, *, progress: Progress | None = None
) -> ReplayResult:
    """Locate logs by their fixes, timing advances and levels; write what a replay writes.

    Parameters
    ----------
    config : Config
        Its cells, track and filter sections count; ``cells.plan`` tells the sites.
    out : Path
    progress : callable, optional
        Called with logs done and logs in all.

    Raises
    ------
    MapfilterError
        There is no cell plan, it, an antenna or a log is missing or damaged, or the output cannot
        be written.
    """
    if config.cells.plan is None:
        hint = "filters without a map take the sites from there"
        raise fail(ConfigError, "cells.plan", "a cell plan", "none", hint)
    folders = list_logs(config.track_path)
    ensure_writable_folder(out)
    clear_results(out)
    method = METHODS[config.filter.name]
    logs: list[ReplayedLog] = []
    for index, folder in enumerate(folders):
        log = leave_out(read_log(folder), config.track.without)
        plan = planned_cells(config, log.crs)
        sites = SiteModels(plan, FusionOptions(), _antennas(config, plan))
        track = position_by_fusion(sites, plan.crs, log, method, smooth=config.filter.smooth)
        into = out if len(folders) == 1 else out / folder.name
        files = tuple(into / file for file in ESTIMATES)
        write_estimate(track.estimate, files[0])
        write_gpx(track.estimate, files[1], folder.name)
        write_geojson(track.estimate, files[2])
        truth = truth_of(log)
        pictures: tuple[Path, ...] = ()
        wanted = config.output.pictures
        if truth is not None and (wanted == "all" or (wanted == "first" and not index)):
            pictures = (into / "error.png",)
            plot_error_over_distance(track.estimate, truth, pictures[0])
        score = accuracy(track.estimate, truth) if truth is not None else None
        lack = "" if track.estimate.converged_at is not None else "too little was measured"
        replayed = ReplayedLog(
            folder.name, outcome(track.estimate), score, log.notes, lack, track.filter_s,
            (*files, into / FIGURES, *pictures), route_of(log),
        )  # fmt: skip
        head = {"log": folder.name, "filter": method.name}
        write_json(into / FIGURES, {**head, **facts(replayed.figures)})
        logs.append(replayed)
        if progress is not None:
            progress(index + 1, len(folders))
    result = ReplayResult(method.name, tuple(logs), summary_of(logs), out)
    if len(folders) > 1:
        write_json(out / SUMMARY, facts(summary_figures(result)))
    return result


def _antennas(config: Config, plan: CellPlan) -> dict[str, MeasuredAntenna]:
    folder = config.cells.antennas
    return {} if folder is None else read_antennas(folder, (cell.antenna for cell in plan.cells))
