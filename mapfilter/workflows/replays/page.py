"""The page of a replay, which plays and explains it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.positioning.positioned_track import PositionedTrack
from mapfilter.tracks.log import TrackLog
from mapfilter.viewing.bundle import replay_bundle
from mapfilter.viewing.page import write_page
from mapfilter.viewing.runs import ViewedRun
from mapfilter.viewing.trace import TraceRecorder
from mapfilter.workflows.outputs.results import REPLAY_HTML
from mapfilter.workflows.replays.figures import ReplayedLog, run_figures


def with_page(
    replayed: ReplayedLog,
    log: TrackLog,
    track: PositionedTrack,
    recorder: TraceRecorder,
    database: RadioRouteDatabase | None,
    into: Path,
) -> ReplayedLog:
    """Write the page of one log, and return its result with the page among its outputs."""
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
