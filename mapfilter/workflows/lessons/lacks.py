"""Why journeys teach nothing, and notes of their logs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.errors import listed
from mapfilter.learning.visits import LARGEST_RADIUS_M, Placed
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.open_log import OpenedLog
from mapfilter.workflows.replays.lacks import columns_of_motion, receiver_motion


def unused_notes(
    opened: Sequence[OpenedLog], journeys: Sequence[Placed], visits: Ints, trust: Floats
) -> tuple[str, ...]:
    """Return a note for each reason why journeys were not used.

    Parameters
    ----------
    opened : sequence of OpenedLog
        The logs.
    journeys : sequence of Placed
        Their reports, and where they were located.
    visits : (journeys,) array of int
        Their visits of cells.
    trust : (journeys,) array
        Probability that a journey was located where it was.
    """
    reasons = []
    for one, journey, count, sure in zip(
        opened, journeys, visits.tolist(), trust.tolist(), strict=True
    ):
        reason = ""
        if not count:
            reason = _without_visits(one, journey)
        elif sure <= 0.5:
            reason = "levels do not fit where they were located (trust of 0.5 or less)"
            if not _has_motion(one.log) and len(one.log.truth) < 2:
                reason += f", and there is no motion{_remedy(one)}"
        reasons.append((one.name, reason))
    return tuple(f"{names} not used: {reason}" for reason, names in _by_text(reasons) if reason)


def log_notes(opened: Sequence[OpenedLog]) -> tuple[str, ...]:
    """Return the notes of logs: what of them was not used, and what was assumed."""
    notes = [(one.name, note) for one in opened for note in one.log.notes]
    if len(opened) == 1:
        return tuple(note for _, note in notes)
    return tuple(f"{names}: {note}" for note, names in _by_text(notes))


def _without_visits(opened: OpenedLog, journey: Placed) -> str:
    log = opened.log
    if not np.isfinite(log.radio["level_dbm"].to_numpy(dtype=np.float64)).any():
        return "no levels"
    near = np.asarray(journey.radius_m) <= LARGEST_RADIUS_M
    if near.any():
        return "no level of a cell of the database where it was located"
    if _has_motion(log):
        return f"no report located within {LARGEST_RADIUS_M:.0f} m"
    return f"no motion{_remedy(opened)}"


def _has_motion(log: TrackLog) -> bool:
    return bool(log.motion["step_m"].notna().any())


def _remedy(opened: OpenedLog) -> str:
    source = receiver_motion(opened)
    made = f" (track.course_motion makes it from {source})" if source else ""
    return made + columns_of_motion(opened)


def _by_text(named: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return each text once, with the names of those that it is of."""
    found: dict[str, list[str]] = {}
    for name, text in named:
        found.setdefault(text, []).append(name)
    return [(text, listed(names, 3)) for text, names in found.items()]
