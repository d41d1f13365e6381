"""Notes on the clocks of a journey's recordings: times without a zone, and hours apart."""

from __future__ import annotations

from collections.abc import Sequence

from mapfilter._constants import DAY_S, HOUR_S
from mapfilter.errors import listed
from mapfilter.tracks.joining.gps_dates import ERA_S, span_s
from mapfilter.tracks.readers.recorded.recording import Recording

_APART_S = HOUR_S


def zoneless_note(recordings: Sequence[Recording]) -> list[str]:
    """Return a note on recordings whose local times nothing turns into UTC."""
    names = [one.name for one in recordings if one.clock.kind == "local"]
    if not names:
        return []
    same = ", taken for one zone" if len(names) > 1 else ""
    return [
        f"{listed(names)}: local times that state no zone{same}: UTC is unknown "
        "(--zone of convert and replay gives it: that of your place, such as Europe/Brussels or "
        "+01:00)"
    ]


def apart_note(recordings: Sequence[Recording], offsets_s: Sequence[float]) -> list[str]:
    """Return a note where recordings lie hours apart, as those of several journeys do."""
    spans = [
        (begin + offset, end + offset)
        for (begin, end), offset in zip(map(span_s, recordings), offsets_s, strict=True)
    ]
    gaps_s = []
    before, *others = sorted(spans)
    for span in others:
        gap_s = span[0] - before[1]
        if gap_s > _APART_S or (gap_s > 0 and _hours_off(before, span)):
            gaps_s.append(gap_s)
        before = max(before, span, key=lambda one: one[1])
    if not gaps_s:
        return []
    gap_s = max(gaps_s)
    likely = "a wrong time zone; or several journeys: convert each alone"
    likely = week_fault(gap_s) or likely
    return [f"recordings lie up to {gap_s / 3600:.1f} h apart (likely: {likely})"]


def week_fault(gap_s: float) -> str:
    """Return the likely mistake of times that lie 1024 weeks, or a multiple, apart; "" for others.

    Old receivers count weeks of GPS from 0 to 1023, and not how often.
    """
    anew = round(gap_s / ERA_S)
    if not anew or abs(gap_s - anew * ERA_S) >= DAY_S:
        return ""
    seconds = anew * ERA_S
    return f"the date of a receiver whose week number began anew: --offset FILE={seconds:.0f}"


def _hours_off(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Return whether most of the shorter of two spans lies in the other one some hours earlier."""
    apart_s = other[0] - one[0]
    hours = round(apart_s / HOUR_S)
    shorter_s = min(end - begin for begin, end in (one, other))
    return hours > 0 and abs(apart_s - hours * HOUR_S) < 0.5 * shorter_s
