"""What ``mapfilter info`` says of results: replays, their estimates, and single reports."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mapfilter._json_files import read_json
from mapfilter.errors import StoreError
from mapfilter.workflows.outputs.results import (
    ESTIMATES,
    FIGURES,
    REPLAY_HTML,
    SUMMARY,
    is_of_replay,
    is_of_reports,
)

_OF_REPLAY = (
    *("log", "logs", "filter", "epochs", "epochs_by_status", "final_status", "final_statuses"),
    *("switched", "switch_time_s", "switch_distance_m", "error_at_switch_m"),
    *("success", "wrong", "error_mean_m", "error_67_m", "error_95_m", "scored_epochs"),
    "within_95",
)
"""Figures of one replayed log, and of several, that are shown; those of errors need a truth."""
_OF_REPORTS = (
    *("method", "reports", "located", "unknown_transmitters", "scored"),
    *("error_mean_m", "error_median_m", "error_67_m", "error_95_m", "within_95"),
)
_JUDGED = "success"
"""None where there is a truth that says nothing of the switch; without any truth it is missing."""
_OF_SEVERAL = "final_statuses"
_LOCATE_USE = "located positions, not to be taken for a ground truth; QGIS opens positions.csv"


def result_info(path: Path) -> dict[str, Any] | None:
    """Describe a result of ``replay`` or ``locate``; None for others.

    A result is a folder, an estimate, or the figures of one or of several logs.

    Raises
    ------
    StoreError
        An estimate, or the figures beside one, are damaged.
    """
    if path.is_file() and path.name not in (*ESTIMATES, FIGURES, SUMMARY):
        return None
    folder = path if path.is_dir() else path.parent
    figures = {} if path.name == SUMMARY else _read(folder / FIGURES)
    if is_of_replay(figures):
        return _replay_info("estimate" if path.name in ESTIMATES else "replay", folder, figures)
    if path.name in ESTIMATES:
        return _estimate_info(path) if path.suffix == ".parquet" else None
    if is_of_reports(figures):
        return {"kind": "located reports", **_some(figures, _OF_REPORTS), "use": _LOCATE_USE}
    several = {} if path.name == FIGURES else _read(folder / SUMMARY)
    return _replay_info("replays", folder, several) if _OF_SEVERAL in several else None


def _read(path: Path) -> dict[str, Any]:
    """Return figures; none where there is no file, or one of another program."""
    try:
        return read_json(path) if path.is_file() else {}
    except StoreError:
        if any((path.parent / name).is_file() for name in ESTIMATES):
            raise
        return {}


def _replay_info(kind: str, folder: Path, figures: Mapping[str, Any]) -> dict[str, Any]:
    return {"kind": kind, **_some(figures, _OF_REPLAY), "use": _use_of(folder)}


def _some(figures: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    given = {name: figures[name] for name in names if name in figures}
    return {name: value for name, value in given.items() if value is not None or name == _JUDGED}


def _use_of(folder: Path) -> str:
    text = "what a filter estimated, not to be taken for a ground truth; "
    pages = (folder / REPLAY_HTML, *sorted(folder.glob(f"*/{REPLAY_HTML}")))
    for page in pages:
        if page.is_file():
            return f"{text}on a map: mapfilter view {page.parent}"
    return f"{text}on a map: replay with --html, then mapfilter view; QGIS opens estimate.geojson"


def _estimate_info(path: Path) -> dict[str, Any]:
    """Describe an estimate without figures beside it."""
    # Here, as it imports GeoPandas, which takes longer than all else of this command.
    from mapfilter.positioning.estimate_store import read_estimate

    estimate = read_estimate(path)
    held = {
        "crs": estimate.crs,
        "filter": estimate.filter,
        "epochs": len(estimate),
        "epochs_by_status": dict(Counter(status.value for status in estimate.status)),
        "switched": estimate.converged_at is not None,
    }
    return {"kind": "estimate", **held, "use": _use_of(path.parent)}
