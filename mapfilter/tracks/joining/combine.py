"""Several recordings of one journey as one track log, with raw sensors beside it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter._words import number_of
from mapfilter.angles import heading_from_azimuth_rad
from mapfilter.errors import InputError, MapfilterError, fail, listed
from mapfilter.tracks.checks.beyond_crs import within_crs
from mapfilter.tracks.checks.far_apart import check_far_apart
from mapfilter.tracks.checks.mirrored import mirrored_notes
from mapfilter.tracks.checks.two_phones import two_phones_notes
from mapfilter.tracks.joining.alignment import Alignment, align
from mapfilter.tracks.joining.equal_times import in_order
from mapfilter.tracks.joining.frame import Frame
from mapfilter.tracks.joining.gps_dates import later
from mapfilter.tracks.joining.journey_motion import OF_RECEIVER, journey_motion
from mapfilter.tracks.joining.moved import places_of_poses
from mapfilter.tracks.joining.parted_odometry import parted_odometry, with_turns
from mapfilter.tracks.joining.position_sources import fixes_of, measured_positions
from mapfilter.tracks.joining.raw_satellites import log_pseudoranges
from mapfilter.tracks.joining.speed_notes import speed_notes
from mapfilter.tracks.log import TrackLog, make_log
from mapfilter.tracks.motion_factors import scaled_motion
from mapfilter.tracks.open_options import CombineOptions
from mapfilter.tracks.readers.recorded.recording import Recording
from mapfilter.tracks.sensors import SENSOR_COLUMNS

_NO_JOURNEY = {"cells", "ephemerides", "ionosphere"}
_CELLS_HINT = "give it as [cells] plan"
_CELL_COLUMNS = ("technology", "mcc", "mnc", "lac", "ci", "level_step_db")


@dataclass(frozen=True, eq=False)
class Combined:
    """A log made of recordings, its sensor tables, and how the clocks were aligned."""

    log: TrackLog
    sensors: Mapping[str, pd.DataFrame]
    alignment: Alignment
    notes: tuple[str, ...]


def combine(recordings: Sequence[Recording], options: CombineOptions | None = None) -> Combined:
    """Make one log of the recordings of one journey.

    Raises
    ------
    InputError
        Clocks cannot be aligned, frames do not fit together, positions lie far apart by a mistake
        of their degrees, or the tables make no sense.
    """
    options = options or CombineOptions()
    journey = _journey(recordings)
    check_far_apart(journey)
    alignment = align(journey, options.offsets_s)
    shifted = [
        later(recording, offset)
        for recording, offset in zip(journey, alignment.offsets_s, strict=True)
    ]
    frame = Frame(shifted, options.crs, options.origin_deg, options.about_deg)
    shifted, beyond = within_crs(shifted, frame.crs, frame.local)
    notes = [*alignment.notes, *frame.notes, *beyond]
    notes += [*speed_notes(shifted, frame), *_list_notes(recordings), *two_phones_notes(shifted)]
    true_alone = set(options.truth) - set(options.measured)
    measured = [r for r in shifted if r.path not in true_alone]
    sensors = _sensors(measured, frame, options.truth, notes)
    moved = journey_motion(
        # Positions that are no truth first.
        sorted(measured, key=lambda r: r.path in options.truth),
        sensors,
        frame,
        notes,
        course_motion=options.course_motion,
        walk=options.walk,
        true=[r for r in shifted if r.path in true_alone],
    )
    names = ", ".join(r.name for r in measured)
    rows, given_factors = scaled_motion(moved.rows, options.factors, names)
    moved = replace(moved, rows=rows)
    mirrored = mirrored_notes(shifted, moved)
    notes += [*given_factors, *mirrored]
    by_receiver = moved.source == OF_RECEIVER
    others = [one for one in shifted if one.path not in options.truth]
    truth = _truth(shifted, frame, options)
    tables = {
        "motion": moved.rows,
        "radio": _joined(shifted, "radio"),
        "gnss": fixes_of(
            *(others, frame, None if by_receiver else moved.rows, notes, truth),
            driven=bool(moved.vehicle),
        ),
        "truth": truth,
        "pseudoranges": _satellites(recordings, shifted, notes),
    }
    start_s = float(np.floor(min(_first_times(shifted))))
    given = _since(start_s, tables)
    if "radio" in given:
        given["radio"] = _radio(given["radio"])
    if moved.reckoning is not None:
        sensors["reckoning"] = moved.reckoning
    sensors = {name: rows.assign(time_s=rows["time_s"] - start_s) for name, rows in sensors.items()}
    try:
        log = make_log(
            frame.crs,
            **given,
            start_utc_s=start_s if alignment.absolute else float("nan"),
            notes=notes,
            imu=moved.imu,
            vehicle=moved.vehicle,
        )
    except InputError as error:
        names = ", ".join(str(r.path) for r in journey)
        faults = (replace(one, where=f"{names}, {one.where}") for one in error.faults)
        raise InputError(tuple(faults)) from error
    if mirrored:
        log = _without_mirrored_turns(log, compass=moved.compass)
    if not given and not sensors:
        raise _nothing_found(recordings, shifted)
    return Combined(log, sensors, alignment, tuple(notes))


def _journey(recordings: Sequence[Recording]) -> list[Recording]:
    """Return the recordings with more than lists of cells and orbits; InputError without any."""
    journey = [r for r in recordings if set(r.tables) - _NO_JOURNEY]
    if journey:
        return journey
    names = ", ".join(r.name for r in recordings)
    orbits = any("ephemerides" in r.tables for r in recordings)
    got = "only orbits of satellites" if orbits else "only a list of cells"
    hint = "name them together with a recording of pseudoranges" if orbits else _CELLS_HINT
    raise fail(InputError, names, "a recording of a journey", got, hint)


def _list_notes(recordings: Sequence[Recording]) -> list[str]:
    """Return notes on lists of cells, which are no part of a journey."""
    lists = [(r.name, len(r.tables["cells"])) for r in recordings if "cells" in r.tables]
    return [f"{name}: a list of {number_of(n, 'cell')}; {_CELLS_HINT}" for name, n in lists]


def _first_times(recordings: Sequence[Recording]) -> list[float]:
    """Return the first time of each table with rows."""
    tables = (rows for r in recordings for rows in r.tables.values() if len(rows))
    return [float(rows["time_s"].min()) for rows in tables]


def _since(start_s: float, tables: Mapping[str, pd.DataFrame | None]) -> dict[str, pd.DataFrame]:
    """Return the tables with rows, their times counted from a start."""
    return {
        name: rows.assign(time_s=rows["time_s"] - start_s)
        for name, rows in tables.items()
        if rows is not None and len(rows)
    }


def _without_mirrored_turns(log: TrackLog, *, compass: bool) -> TrackLog:
    """Return a log without notes on turns, or headings of a compass, that run the other way.

    They are the other half of the same fault: either positions or azimuths are mirrored.
    """
    halves = ["motion, turn_rad: turns run"]
    halves += ["motion, heading_rad: headings run"] if compass else []
    kept = (note for note in log.notes if not note.startswith(tuple(halves)))
    return replace(log, notes=tuple(kept))


def _nothing_found(recordings: Sequence[Recording], journey: Sequence[Recording]) -> MapfilterError:
    names = ", ".join(r.name for r in recordings)
    odometry = [r.tables["odometry"] for r in journey if "odometry" in r.tables]
    turns = any(rows["yaw_rate_radps"].notna().any() for rows in odometry)
    got = "yaw rates without speeds or an odometer" if turns else "none"
    unread = [column for recording in recordings for column in recording.unread]
    hint = f"one of the columns not used ({listed(unread)}); name it by --column" if unread else ""
    return fail(InputError, names, "rows of a journey", got, hint)


def _joined(recordings: Sequence[Recording], table: str) -> pd.DataFrame | None:
    parts = [r.tables[table] for r in recordings if table in r.tables]
    if not parts:
        return None
    rows = pd.concat(parts, ignore_index=True)
    return rows.sort_values("time_s", kind="stable", ignore_index=True)


def _radio(rows: pd.DataFrame) -> pd.DataFrame:
    """Return reports with the columns of a log; empty columns of identities are left out."""
    whole = ("mcc", "mnc", "lac", "ci", "arfcn", "bsic", "timing_advance", "censored")
    rows = rows.assign(**{name: rows[name].round().astype("Int64") for name in whole})
    empty = [name for name in _CELL_COLUMNS if rows[name].isna().all()]
    return rows.drop(columns=empty)


def _truth(
    recordings: Sequence[Recording], frame: Frame, options: CombineOptions
) -> pd.DataFrame | None:
    parts = []
    for recording in recordings:
        rows = recording.tables.get("truth", recording.tables.get("true_places"))
        if rows is None and recording.path in options.truth:
            rows, _ = measured_positions(recording)
            if rows is None and "poses" in recording.tables:
                rows = places_of_poses(recording.tables["poses"])
            if rows is None:
                got = f"a recording of {', '.join(recording.tables)}"
                raise fail(InputError, str(recording.path), "positions, as the truth", got)
        if rows is not None:
            east, north = frame.east_north(rows, recording.crs)
            place = {"time_s": rows["time_s"], "east_m": east, "north_m": north}
            parts.append(pd.DataFrame(place))
    return in_order(parts) if parts else None


def _satellites(
    recordings: Sequence[Recording], shifted: Sequence[Recording], notes: list[str]
) -> pd.DataFrame | None:
    rows = _joined(shifted, "satellites")
    if rows is None:
        return None
    lists = [r for r in recordings if not set(r.tables) - _NO_JOURNEY]
    return log_pseudoranges([*shifted, *lists], rows, notes)


def _sensors(
    recordings: Sequence[Recording], frame: Frame, truth: Collection[Path], notes: list[str]
) -> dict[str, pd.DataFrame]:
    found: dict[str, pd.DataFrame] = {}
    for name, columns in SENSOR_COLUMNS.items():
        if name == "velocity":
            rows = _velocity([r for r in recordings if r.path not in truth], frame)
        elif name == "odometry":
            fast, turning = parted_odometry([r for r in recordings if name in r.tables])
            rows = _joined(_apart(fast, name, notes), name)
            rows = None if rows is None else with_turns(rows, turning)[0]
        else:
            rows = _joined(_apart(recordings, name, notes), name)
        if rows is not None and len(rows):
            found[name] = rows[list(columns)]
    return found


def _apart(recordings: Sequence[Recording], table: str, notes: list[str]) -> list[Recording]:
    """Return the recordings of one sensor that do not overlap in time, calibrated ones first."""
    having = [r for r in recordings if table in r.tables]
    kept: list[Recording] = []
    for recording in sorted(having, key=lambda r: "uncal" in r.path.name.lower()):
        first, last = recording.tables[table]["time_s"].iloc[[0, -1]]
        for other in kept:
            begin, end = other.tables[table]["time_s"].iloc[[0, -1]]
            if first < end and begin < last:
                notes.append(f"{recording.name}: {table} not used, {other.name} has it")
                break
        else:
            kept.append(recording)
    return kept


def _velocity(recordings: Sequence[Recording], frame: Frame) -> pd.DataFrame | None:
    parts = []
    for recording in recordings:
        rows, _ = measured_positions(recording)
        if rows is None or "speed_mps" not in rows:
            continue
        rows = rows[rows["speed_mps"].notna()]
        heading = heading_from_azimuth_rad(rows["course_deg"], frame.convergence_rad)
        columns = {"time_s": rows["time_s"], "speed_mps": rows["speed_mps"]}
        parts.append(pd.DataFrame({**columns, "heading_rad": heading}))
    return in_order(parts) if parts else None
