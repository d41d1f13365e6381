"""What a replay found: figures of each log, their sums, and what was done in part only."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._types import Bools
from mapfilter._words import number_of
from mapfilter.evaluation.accuracy import Accuracy, mean_of
from mapfilter.evaluation.outcome import Outcome
from mapfilter.evaluation.success import SuccessSummary, summarise
from mapfilter.filters.contract import Reason, Status
from mapfilter.tracks.log import TrackLog
from mapfilter.workflows.replays.baseline import SingleReports, together

_NAMED = 3

_SHOWN = {
    "switched": "converged",
    "switch_time_s": "converged after, s",
    "switch_distance_m": "converged after, m",
    "error_at_switch_m": "error then, m",
    "error_mean_m": "mean error, m",
    "error_67_m": "error at 67 %, m",
    "error_95_m": "error at 95 %, m",
    "within_95": "share within the 95 % radius",
    "final_status": "status at the end",
}
"""Figures of a run that a page shows, and their names there."""


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
    foreign : str
        Why the database may lack all of its unknown cells, or an empty text.
    held_95 : ndarray of bool
        Whether the 95 % radius holds the truth, of each scored epoch with a radius.
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
    foreign: str = ""
    held_95: Bools = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))

    @property
    def figures(self) -> dict[str, Any]:
        """Outcome, notes and, with ground truth, the score beside that of single reports."""
        score = {}
        if self.accuracy is not None:
            score = asdict(self.accuracy) | {"within_95": mean_of(self.held_95)}
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
            some = number_of(len(unknown), "cell is", "cells are")
            where = _named([log.name for log in self.logs if log.outcome.unknown_cells])
            found.append(
                f"{some} unknown to the database ({_named(list(unknown))}; in "
                f"{where}); their readings are labelled {Reason.UNKNOWN_CELL}"
            )
            found += sorted({f"unknown cells: {log.foreign}" for log in self.logs if log.foreign})
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
    scores = {}
    if result.summary is not None:
        held = mean_of(np.concatenate([log.held_95 for log in result.logs]))
        scores = asdict(result.summary) | {"within_95": held}
    return {
        "logs": len(outcomes),
        **scores,
        "switched": sum(outcome.switched for outcome in outcomes),
        "final_statuses": _sum({o.final_status: 1} for o in outcomes if o.final_status),
        "seconds_by_status": _seconds_by_status(outcomes),
        "seconds_without_epochs": sum(outcome.seconds_without_epochs for outcome in outcomes),
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


def _seconds_by_status(outcomes: Sequence[Outcome]) -> dict[str, float]:
    lasted = [outcome.seconds_by_status for outcome in outcomes]
    names = [str(status) for status in Status if any(str(status) in one for one in lasted)]
    return {name: sum(one.get(name, 0.0) for one in lasted) for name in names}


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
            where, colon, told = note.partition(": ")
            _, _, rest = where.rpartition(f"{log.name}/")
            owners.setdefault(rest + colon + told, []).append(log.name)
    return [f"{note} (in {_named(names)})" for note, names in owners.items()]


def run_figures(figures: Mapping[str, Any]) -> dict[str, str]:
    """Return the figures of a run as a page shows them."""
    found: dict[str, str] = {}
    for name, label in _SHOWN.items():
        value = figures.get(name)
        if isinstance(value, bool):
            found[label] = "yes" if value else "no"
        elif isinstance(value, float):
            if isfinite(value):
                found[label] = f"{value:.2f}" if name == "within_95" else f"{value:.1f}"
        elif value is not None:
            found[label] = str(value)
    return found
