"""What a log lacks to be located, and logs that lie elsewhere."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import Faults, listed
from mapfilter.evaluation.outcome import pauses_s
from mapfilter.evaluation.truth import Truth
from mapfilter.evaluation.truth_notes import truth_notes
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import same_crs, short_crs
from mapfilter.lattice import Lattice
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.log_lacks import (
    NO_MOTION,
    POSITIONS_ALONE,
    REPORTS_ALONE,
    check_places,
    coarse_pixels_note,
    follows_positions,
    has_reports_alone,
    is_of_reports_alone,
    lack_of_log,
)
from mapfilter.tracks.checks.log_checks import ends_early
from mapfilter.tracks.checks.placeless import LOCAL_FRAME, LOCAL_FRAME_HINT
from mapfilter.tracks.checks.rounded_degrees import rounded_notes
from mapfilter.tracks.checks.turn_drift import turn_drift_radps
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.open_log import OpenedLog
from mapfilter.tracks.readers.plain.fields import MOTION_FIELDS
from mapfilter.viewing.words import REASONS

_MOTION_COLUMNS = (
    "columns step_m, steps (with compass_deg, turn_rad, turn_deg or a yaw rate), wheel_speed_mps, "
    "wheel_speed_kmh, odometer_m or odometer_km"
)

_UNLOCATED = {
    Status.SEARCHING: "as several places are possible",
    Status.LOST: "as the readings contradict the position",
    Status.OUTSIDE: "as nothing on the map explains the readings",
}

_MOTION_AT_FAULT = "steps in another unit", "turns the other way round"
_POSITIONS_AT_FAULT = "another journey", "positions whose latitude and longitude are swapped"
_POSITIONS_ROUNDED = "positions in degrees of few decimals"
_DIFFERENCES_AT_FAULT = "time differences of a site whose clock is off, or without line of sight"


def check_log(path: Path, log: TrackLog, lattice: Lattice, faults: Faults) -> None:
    """Note a log in a local frame, unlike the database, or far outside its lattice.

    Its truth, or its GNSS fixes, may not all lie more than 5 km outside.
    """
    if not same_crs(log.crs, lattice.crs):
        expected = f"{short_crs(lattice.crs)}, the database's"
        faults.add(f"{path}, crs", expected, LOCAL_FRAME, LOCAL_FRAME_HINT)
        return
    check_places(str(path), log, lattice, faults)


def lack_of(
    opened: OpenedLog,
    log: TrackLog,
    options: Any,
    estimate: TrackEstimate,
    database: RadioRouteDatabase | None,
) -> str:
    """Return what a log lacks that was not located, with a remedy; else an empty text.

    Parameters
    ----------
    opened : OpenedLog
        The log as it was opened, with its sensors and recordings.
    log : TrackLog
        What of it the filter was given.
    options
        Of the filter.
    database : RadioRouteDatabase or None
        None where the filter only takes sites.
    """
    lack = lack_of_log(log, options, estimate, database)
    if NO_MOTION not in lack:
        alone = lack and database is not None and has_reports_alone(log)
        return f"{lack} (mapfilter locate locates each report by itself)" if alone else lack
    remedies = []
    if made := _made_of_course(opened):
        remedies.append(made)
    if len(log.radio) and (database is None or database.cell_ids):
        remedies.append("mapfilter locate needs none")
    if len(log.gnss):
        remedies.append("--filter ekf needs none beside positions")
    hint = f" ({'; '.join(remedies)})" if remedies else ""
    return f"{lack}{hint}{columns_of_motion(opened)}"


def _motion_note(
    opened: OpenedLog, log: TrackLog, options: Any, estimate: TrackEstimate
) -> tuple[str, ...]:
    """Return a note on a log without motion: what it was located by, and what locates it better."""
    if is_of_reports_alone(log, options, estimate):
        remedy = "mapfilter locate locates each report by itself"
        return (f"{REPORTS_ALONE} ({remedy}){columns_of_motion(opened)}",)
    if not follows_positions(log, options, estimate):
        return ()
    made = _made_of_course(opened)
    hint = f" ({made})" if made else ""
    return (f"{POSITIONS_ALONE}{hint}{columns_of_motion(opened)}",)


def _made_of_course(opened: OpenedLog) -> str:
    source = receiver_motion(opened)
    return f"--course-motion, track.course_motion, makes it from {source}" if source else ""


def columns_of_motion(opened: OpenedLog) -> str:
    """Return which columns of motion tables were looked for, and which others there are."""
    if not opened.recordings:
        return ""
    # Here, as it imports readers, of which a track log needs none.
    from mapfilter.tracks.readers import plain_csv

    tables = [one for one in opened.recordings if one.format == plain_csv.FORMAT.name]
    if not tables:
        return ""
    text = f"; looked for {_MOTION_COLUMNS}"
    for one in tables:
        found = [field for field in MOTION_FIELDS if field in one.fields]
        text += f"; {one.path.name} has {', '.join(found) or 'none of them'}"
        unread = [name for name in one.unread if name not in found]
        text += f", columns not used: {listed(unread)} (--column)" if unread else ""
    return text


def notes_after(
    opened: OpenedLog,
    log: TrackLog,
    options: Any,
    estimate: TrackEstimate,
    database: RadioRouteDatabase | None,
    truth: Collection[Path],
    uses: Collection[str],
) -> tuple[str, ...]:
    """Return the notes on a log that are known only after it was located.

    Parameters are those of :func:`lack_of` and :func:`fixes_note`.
    """
    path = Truth.of_table(log.truth)
    return (
        *(() if path is None else truth_notes(estimate, path)),
        *fixes_note(opened, log, truth, uses, estimate),
        *_motion_note(opened, log, options, estimate),
        *pause_note(estimate),
        *early_end_note(opened, log, estimate, uses, over_map=database is not None),
        *coarse_pixels_note(options, estimate, database),
    )


def fixes_note(
    opened: OpenedLog,
    log: TrackLog,
    truth: Collection[Path],
    uses: Collection[str],
    estimate: TrackEstimate,
) -> tuple[str, ...]:
    """Return a note on positions of recordings that the filter took for GNSS fixes; none without.

    Parameters
    ----------
    opened : OpenedLog
        The log as it was opened.
    log : TrackLog
        Without what is hidden from the filter.
    truth : collection of Path
        Recordings whose positions are the truth.
    uses : collection of str
        Kinds of measurements that the filter uses.
    """
    measured = (one for one in opened.recordings if one.path not in truth)
    placed = [one for one in measured if {"positions", "places"} & set(one.tables)]
    if not placed or log.gnss.empty or "gnss" not in uses:
        return ()
    unused = sum(one.readings for one in estimate.unused if one.kind == "gnss")
    names = listed([one.path.name for one in placed], 2)
    text = f"gnss: {len(log.gnss) - unused} of {len(log.gnss)} positions of {names} used as GNSS "
    text += "fixes; --without gnss leaves them out"
    return (text if len(log.truth) else f"{text}, --truth {placed[0].path.name} scores by them",)


def pause_note(estimate: TrackEstimate) -> tuple[str, ...]:
    """Return a note where nothing is located for a while as there is no row; else none."""
    pauses = pauses_s(estimate)
    if not len(pauses):
        return ()
    begin_s, end_s = pauses[np.argmax(np.diff(pauses, axis=1))].tolist()
    which = f"from {begin_s:.0f} to {end_s:.0f} s"
    if len(pauses) > 1:
        which = f"in {len(pauses)} pauses, the longest {which}"
    return (f"no position {which}: there are neither motion nor measurements",)


def early_end_note(
    opened: OpenedLog,
    log: TrackLog,
    estimate: TrackEstimate,
    uses: Collection[str],
    *,
    over_map: bool,
) -> tuple[str, ...]:
    """Return a note where a track is located until long before its rows end, and why; else none.

    Parameters
    ----------
    opened : OpenedLog
        The log as it was opened, with its sensors.
    log : TrackLog
        Without what is hidden from the filter.
    uses : collection of str
        Kinds of measurements that the filter uses.
    over_map : bool
        Whether a map may lack the way that was gone.
    """
    followed = [status.is_followed for status in estimate.status]
    if not any(followed):
        return ()
    last = max(at for at, located in enumerate(followed) if located)
    last_s, status = float(estimate.time_s[last]), estimate.status[-1]
    begin_s, end_s = float(estimate.time_s[0]), float(estimate.time_s[-1])
    if status.is_followed:
        ends_s = [float(rows["time_s"].iloc[-1]) for rows in opened.sensors.values() if len(rows)]
        end_s = max([end_s, *ends_s])
    if not ends_early(end_s - last_s, end_s - begin_s):
        return ()
    text = f"located until {last_s:.0f} s, rows go on until {end_s:.0f} s: "
    if status.is_followed:
        return (f"{text}neither motion nor measurements from there on, but sensors alone",)
    unused: Counter[Reason] = Counter()
    for one in estimate.unused:
        unused[one.reason] += one.readings if one.time_s > last_s else 0
    reason, count = unused.most_common(1)[0] if unused else (Reason.USED, 0)
    text += f"{status} from there on, {_UNLOCATED[status]}"
    if status is Status.LOST and (likely := _likely(log, uses, over_map=over_map)):
        text += f" (likely: {likely})"
    return (f"{text}; {count} readings: {reason} ({REASONS[reason]})" if count else text,)


def _likely(log: TrackLog, uses: Collection[str], *, over_map: bool) -> str:
    """Return why the readings of a log contradict each other, as far as they show it; else ""."""
    placed = len(log.gnss) > 0 and "gnss" in uses
    timed = len(log.tdoa) > 0 and "tdoa" in uses
    moved = len(log.motion) > 0
    drift_rad_per_s = turn_drift_radps(log.motion, log.gnss) if moved and placed else 0.0
    if (drift_deg_per_s := abs(float(np.degrees(drift_rad_per_s)))) > 0:
        return (
            f"a gyroscope noisier than stated: turns drift by {drift_deg_per_s:.2g} deg/s beside "
            "the course of the positions; convert a recording that begins with 10 s at rest"
        )
    causes = [*_MOTION_AT_FAULT] if moved and (placed or timed) else []
    causes += _POSITIONS_AT_FAULT if moved and placed else ()
    causes += [_POSITIONS_ROUNDED] if placed and rounded_notes(log.notes) else []
    causes += [_DIFFERENCES_AT_FAULT] if timed else []
    causes += ["ways that the map lacks"] if causes and over_map else []
    return ", or ".join(part for part in (", ".join(causes[:-1]), *causes[-1:]) if part)


def receiver_motion(opened: OpenedLog) -> str:
    """Return what positions of the log, or of its truth, make motion of; "" without them."""
    every = [r.tables.get("positions", r.tables.get("places")) for r in opened.recordings]
    placed = [rows for rows in every if rows is not None and rows["time_s"].nunique() > 1]
    moving = ("speed_mps", "course_deg")
    both = (rows[list(moving)] for rows in placed if set(moving) <= set(rows))
    if any(rows.notna().all(axis=1).any() for rows in both):
        return "speed and course"
    return "positions" if placed else ""
