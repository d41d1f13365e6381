"""Clocks of several recordings of one journey: offsets by stamps, positions or speeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapfilter._constants import HOUR_S
from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.tracks.checks.clock_notes import apart_note, zoneless_note
from mapfilter.tracks.checks.misplaced import FAR_APART, FAR_M
from mapfilter.tracks.joining.gps_dates import early_dates, later, span_s, week_start_s
from mapfilter.tracks.joining.position_shift import (
    COMMON_SHARE,
    TimedPlaces,
    best_place_shift,
    median_apart_m,
    places_of,
)
from mapfilter.tracks.joining.position_units import metres_about_middle
from mapfilter.tracks.joining.speed_shift import (
    best_shift,
    measured,
    shift_note,
    speed_agreement,
    speeds_of_places,
)
from mapfilter.tracks.readers.recorded.recording import Recording

_QUARTER_S = 900.0
_MOST_ZONE_S = 14 * HOUR_S
_ZONE_QUARTERS = (*range(-48, 57, 4), -38, -14, -10, 14, 18, 22, 23, 26, 35, 38, 42, 51, 55)
"""Zones that are in use, in quarters of an hour ahead of UTC: whole hours, and others."""
_MOST_SHIFTS = 4000
_NEAR_M = 100.0
_MOVED_M = 50.0
_SEARCH_S = 30.0
_RATE_HZ = 5.0
_LEAST_CORRELATION = 0.5
_REMARKABLE_S = 1.5


@dataclass(frozen=True)
class Alignment:
    """Seconds to add to the times of each recording, and how they were found.

    ``absolute`` tells whether the common time is UTC.
    """

    offsets_s: tuple[float, ...]
    absolute: bool
    notes: tuple[str, ...] = ()


def align(recordings: Sequence[Recording], given_s: Mapping[Path, float]) -> Alignment:
    """Bring recordings to one clock.

    Clocks of UTC and GPS need no offset; local times without a zone take the quarter of an hour
    by which positions, or the times themselves, agree; clocks from an unknown start are aligned by
    positions, as seconds of the GPS week, or by speeds in common. Dates that are early by a mistake
    of GPS are mended where others tell (:mod:`mapfilter.tracks.joining.gps_dates`). Offsets that
    were given are taken as they are.

    Raises
    ------
    InputError
        A clock cannot be aligned.
    """
    early_s, notes = early_dates(recordings, given_s)
    given, offsets = recordings, []
    recordings = [later(one, s) for one, s in zip(given, early_s, strict=True)]
    reference = _reference(recordings)
    first = recordings[reference]
    for recording, dated_s in zip(recordings, early_s, strict=True):
        if recording.path in given_s:
            offsets.append(given_s[recording.path])
            notes.append(f"{recording.name}: {given_s[recording.path]:+g} s, as given")
            continue
        offset_s, note = 0.0, ""
        if recording is not first:
            offset_s, note = _offset(recording, first, given_s.get(first.path, 0.0))
        offsets.append(dated_s + offset_s)
        if note:
            notes.append(f"{recording.name}: {note}")
    if not first.clock.absolute:
        notes += zoneless_note([one for one in recordings if one.path not in given_s])
    notes += apart_note(given, offsets)
    return Alignment(tuple(offsets), first.clock.absolute, tuple(notes))


def _reference(recordings: Sequence[Recording]) -> int:
    """Return the recording whose clock is the common one."""

    def rank(recording: Recording) -> int:
        clock = recording.clock
        kind = 0 if clock.absolute else 4 if clock.kind == "local" else 8
        has = 0 if "positions" in recording.tables else 1 if "truth" in recording.tables else 2
        return kind + has

    return min(range(len(recordings)), key=lambda i: rank(recordings[i]))


def _offset(recording: Recording, given: Recording, late_s: float) -> tuple[float, str]:
    """Return the seconds to add to a recording's times, and a note.

    Those of the first one, as it was given, are ``late_s`` later; the clock of others is not.
    """
    first = later(given, late_s)
    one, other = places_of(first), places_of(recording)
    clock = recording.clock
    same = clock.kind == first.clock.kind and clock.kind != "utc"
    if clock.absolute or (same and clock.kind == "local"):
        if one is None or other is None:
            return 0.0, shift_note(first.name, _speed(first), _speed(recording))
        return 0.0, _disagreement(first.name, one, other)
    if clock.kind == "local":
        return _zone(recording, first, one, other)
    if same and _common(recording, given) >= COMMON_SHARE:
        far = one is not None and other is not None and median_apart_m(one, other, 0.0, 0.1) > FAR_M
        return 0.0, _disagreement(first.name, one, other) if far else ""
    if one is not None and other is not None:
        low, high = one[0][0] - other[0][-1], one[0][-1] - other[0][0]
        step_s = max(1.0, (high - low) / _MOST_SHIFTS)
        shift_s, apart_m = best_place_shift(one, other, np.arange(low, high + step_s, step_s))
        if apart_m < _NEAR_M:
            return shift_s, f"{shift_s:+.1f} s, by positions (median {apart_m:.1f} m apart)"
    speeds = _speed(first), _speed(recording)
    start_s = week_start_s(recording, first) if first.clock.absolute else None
    # An unknown agreement is not less.
    if start_s is not None and not speed_agreement(*speeds, start_s) < _LEAST_CORRELATION:
        return start_s, f"{start_s:+.1f} s, as seconds of the GPS week"
    shift, correlation = _by_speed(*speeds)
    if correlation >= _LEAST_CORRELATION:
        return shift, f"{shift:+.1f} s, by speeds (correlation {correlation:.2f})"
    expected = f"positions or speeds in common with {first.name}"
    got = f"times in {clock}, and none"
    hint = f"--offset {recording.name}=SECONDS, the seconds to add to its times"
    hint += " (Unix time of its time 0)" if first.clock.absolute else ""
    raise fail(InputError, str(recording.path), expected, got, hint)


def _common(recording: Recording, first: Recording, shift_s: float = 0.0) -> float:
    """Return the share of the shorter recording that lies within the other one."""
    (a, b), (c, d) = span_s(first), span_s(recording)
    overlap = min(b, d + shift_s) - max(a, c + shift_s)
    return overlap / max(min(b - a, d - c), 1e-9)


def _zone(
    recording: Recording, first: Recording, one: TimedPlaces | None, other: TimedPlaces | None
) -> tuple[float, str]:
    """Return the shift of local times by whole quarters of an hour."""
    shifts = np.arange(-_MOST_ZONE_S, _MOST_ZONE_S + 1, _QUARTER_S)
    if one is not None and other is not None:
        apart = np.array([median_apart_m(one, other, shift, 0.1) for shift in shifts])
        # Positions of two places do not tell a zone.
        if (apart <= FAR_M).any():
            shift_s = float(shifts[np.nanargmin(apart)])
            near = float(np.nanmin(apart))
            note = f"local time is UTC{_clock(-shift_s)} (by positions, median {near:.1f} m apart)"
            fine = _disagreement(first.name, one, (other[0] + shift_s, *other[1:]))
            return shift_s, f"{note}; {fine}" if fine else note
    shifts = -_QUARTER_S * np.array(_ZONE_QUARTERS)
    common = np.array([_common(recording, first, shift) for shift in shifts])
    if common.max() <= 0:
        expected = f"local times that overlap those of {first.name} in some zone"
        hint = "recordings of two journeys, or a wrong date; else give --zone or --offset"
        raise fail(InputError, str(recording.path), expected, "none", hint)
    found = best_shift(shifts[common > 0], _speed(first), _speed(recording))
    if found is not None:
        return found, f"local time is UTC{_clock(-found)} (by speeds)"
    good = shifts[common >= common.max() - 1e-6]
    # Where one of them lasts longer, both begin together, or both end.
    ends = np.abs(np.subtract(span_s(first), span_s(recording))[:, None] - good).min(axis=0)
    order = good[np.argsort(ends, kind="stable")]
    others = [f"UTC{_clock(-shift)}" for shift in order[1:].tolist() if shift % HOUR_S == 0]
    also = f"; {' or '.join(others[:2])} would do as well: --zone" if others else ""
    return float(order[0]), f"local time is UTC{_clock(-order[0])} (by the overlap of times{also})"


def _clock(shift_s: float) -> str:
    sign = "-" if shift_s < 0 else "+"
    return f"{sign}{int(abs(shift_s)) // 3600:02d}:{int(abs(shift_s)) % 3600 // 60:02d}"


def _disagreement(first: str, one: TimedPlaces | None, other: TimedPlaces | None) -> str:
    """Return a note where positions of two clocks agree better some seconds apart."""
    if one is None or other is None or not (_moved(one) and _moved(other)):
        return ""
    now_m = median_apart_m(one, other, 0.0, 0.1)
    if not np.isfinite(now_m):
        return ""
    shifts = np.arange(-_SEARCH_S, _SEARCH_S + 0.5, 0.5)
    shift_s, apart_m = best_place_shift(one, other, shifts)
    if now_m > FAR_M and apart_m > FAR_M:
        return (
            f"positions lie {now_m / 1000:.1f} {FAR_APART} in {first} (median) (likely: another "
            "journey, another day's times, or positions that were spoofed)"
        )
    if abs(shift_s) < _REMARKABLE_S or apart_m > 0.8 * now_m:
        return f"positions agree within {now_m:.1f} m (median)"
    return (
        f"positions agree best {shift_s:+.1f} s shifted ({apart_m:.1f} m, not {now_m:.1f} m); "
        "not applied, see --offset"
    )


def _moved(track: TimedPlaces) -> bool:
    east_m, north_m = metres_about_middle(*track[1:])
    return float(np.hypot(np.ptp(east_m), np.ptp(north_m))) > _MOVED_M


def _speed(recording: Recording) -> tuple[Floats, Floats] | None:
    """Return times and speeds of the first table that has or gives them."""
    tables = recording.tables
    for name in ("odometry", "positions"):
        if name in tables and tables[name]["speed_mps"].notna().sum() >= 10:
            rows = tables[name].dropna(subset="speed_mps")
            return rows["time_s"].to_numpy(), rows["speed_mps"].abs().to_numpy()
    if "motion" in tables and tables["motion"]["step_m"].notna().sum() >= 10:
        rows = tables["motion"].dropna(subset="step_m")
        return _rate(rows["time_s"].to_numpy(), rows["step_m"].abs().to_numpy()[1:])
    if "poses" in tables and len(tables["poses"]) >= 10:
        rows = tables["poses"]
        step = np.sqrt((rows[["x_m", "y_m", "z_m"]].diff().to_numpy()[1:] ** 2).sum(axis=1))
        return _rate(rows["time_s"].to_numpy(), step)
    track = places_of(recording)
    if track is None or len(track[0]) < 10:
        return None
    return speeds_of_places(track[0], *metres_about_middle(*track[1:]))


def _rate(time_s: Floats, step_m: Floats) -> tuple[Floats, Floats]:
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = step_m / np.diff(time_s)
    good = np.isfinite(speed)
    return time_s[1:][good], speed[good]


def _by_speed(
    one: tuple[Floats, Floats] | None, other: tuple[Floats, Floats] | None
) -> tuple[float, float]:
    """Return the shift of the greatest correlation of two speeds, and that correlation."""
    if one is None or other is None or len(one[0]) < 10 or len(other[0]) < 10:
        return 0.0, 0.0
    lengths = [min(float(np.ptp(time)), 6 * 3600.0) for time, _ in (one, other)]
    if not min(lengths) > 0:
        return 0.0, 0.0
    grids = [np.arange(0.0, length, 1 / _RATE_HZ) for length in lengths]
    at_s = [grid + time[0] for grid, (time, _) in zip(grids, (one, other), strict=True)]
    # Speeds within the gap of a receiver that is jammed are unknown.
    known_a, known_b = (
        measured(track, at).astype(np.float64) for at, track in zip(at_s, (one, other), strict=True)
    )
    a, b = known_a * np.interp(at_s[0], *one), known_b * np.interp(at_s[1], *other)
    size = 1 << int(np.ceil(np.log2(len(a) + len(b))))

    def lagged(x: Floats, y: Floats) -> Floats:
        product = np.fft.irfft(np.fft.rfft(x, size) * np.conj(np.fft.rfft(y, size)), size)
        return np.concatenate([product[-(len(y) - 1) :], product[: len(x)]])

    count = np.round(lagged(known_a, known_b))
    sum_a, sum_b = lagged(a, known_b), lagged(known_a, b)
    with np.errstate(divide="ignore", invalid="ignore"):
        shared = lagged(a, b) - sum_a * sum_b / count
        spread_a = lagged(a**2, known_b) - sum_a**2 / count
        spread_b = lagged(known_a, b**2) - sum_b**2 / count
        correlation = shared / np.sqrt(np.maximum(spread_a * spread_b, 1e-12))
    correlation[count < max(10, COMMON_SHARE * min(known_a.sum(), known_b.sum()))] = -1.0
    best = int(np.nanargmax(correlation))
    shift_s = (best - (len(b) - 1)) / _RATE_HZ + one[0][0] - other[0][0]
    return float(shift_s), float(min(correlation[best], 1.0))
