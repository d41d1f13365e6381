"""What people read of a replay: its figures, with shares of time and reasons in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mapfilter.filters.contract import Reason
from mapfilter.viewing.words import REASONS


def replay_text(figures: Mapping[str, Any]) -> dict[str, Any]:
    """Return the figures of a replay as text shows them, without its notes.

    Parameters
    ----------
    figures : mapping
        As of :func:`mapfilter.workflows.replays.figures.replay_figures`.

    Examples
    --------
    >>> found = {"seconds_by_status": {"TRACKING": 30.0, "UNCERTAIN": 10.0}, "notes": ["a note"]}
    >>> replay_text(found | {"unused": {"no_step": 2}})
    {'seconds_by_status': {'TRACKING': '30 (75 %)', 'UNCERTAIN': '10 (25 %)'}, \
'unused': {'no_step': '2 (the length of the step is unknown)'}}
    """
    shown = {name: value for name, value in figures.items() if name != "notes"}
    if lasted_s := shown.get("seconds_by_status"):
        whole_s = sum(lasted_s.values()) or 1.0
        shown["seconds_by_status"] = {
            status: f"{_rounded(seconds)} ({seconds / whole_s:.0%})".replace("%", " %")
            for status, seconds in lasted_s.items()
        }
    if unused := shown.get("unused"):
        shown["unused"] = {
            reason: f"{count} ({REASONS[Reason(reason)]})" for reason, count in unused.items()
        }
    return shown


def _rounded(seconds: float) -> str:
    """Format a duration: whole seconds from 1000 s on, never with an exponent."""
    return f"{seconds:.0f}" if seconds >= 1000 else f"{seconds:.4g}"
