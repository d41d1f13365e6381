"""The motion of a journey: from the recording that tells it most directly, or from raw sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from mapfilter.angles import wrap_rad
from mapfilter.errors import InputError, fail, listed
from mapfilter.tracks.checks.exchanged import check_columns
from mapfilter.tracks.checks.headings import compass_notes
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.joining.drive import drive_of, own_turning
from mapfilter.tracks.joining.frame import Frame
from mapfilter.tracks.joining.moved import (
    UNDIRECTED,
    by_compass,
    course_errors,
    motion_from_course,
    motion_from_poses,
)
from mapfilter.tracks.joining.parted_odometry import parted_odometry
from mapfilter.tracks.joining.position_motion import motion_from_positions
from mapfilter.tracks.joining.position_sources import measured_positions
from mapfilter.tracks.pdr.counted import reckon_counted
from mapfilter.tracks.pdr.options import WalkOptions, without_effect
from mapfilter.tracks.pdr.vehicle import reckon_velocity
from mapfilter.tracks.pdr.walk import reckon_walk
from mapfilter.tracks.readers.recorded.recording import Recording

OF_RECEIVER = "motion comes from GNSS"


@dataclass(frozen=True, eq=False)
class Moved:
    """A motion table, its errors, its rows' further columns, and whose it is, as far as known.

    ``source`` is, in notes, where motion comes from that is no walk by a phone's sensors;
    ``compass`` tells whether headings were made of azimuths, and so have the right sense.
    """

    rows: pd.DataFrame | None = None
    imu: ImuNoise | None = None
    reckoning: pd.DataFrame | None = None
    vehicle: bool | None = None
    source: str = ""
    compass: bool = False


def journey_motion(
    recordings: Sequence[Recording],
    sensors: Mapping[str, pd.DataFrame],
    frame: Frame,
    notes: list[str],
    *,
    course_motion: bool,
    walk: WalkOptions | None,
    true: Sequence[Recording] = (),
) -> Moved:
    """Return motion of the recording that tells it most directly; others stay sensors.

    Parameters
    ----------
    recordings : sequence of Recording
        Without those of the truth, on one clock.
    sensors : mapping of str to pandas.DataFrame
        Tables of raw sensors of all of them.
    frame : Frame
    notes : list of str
        Grows by what was found.
    course_motion : bool
        Whether speed and course of a receiver, else its positions, make motion where nothing
        better does.
    walk : WalkOptions or None
        How steps are made of a phone's sensors, None for no steps.
    true : sequence of Recording
        Those of the truth: their speed and course, no positions, serve where no other has any.

    Raises
    ------
    InputError
        Odometry pauses for more than an hour, columns of motion are exchanged or in another unit,
        or there are no positions where motion is to come from them.
    """
    for recording in recordings:
        notes += check_columns(recording)
    moved = _recorded(recordings, sensors, frame, notes)
    if moved is None and course_motion:
        moved = _course([*recordings, *true], sensors, frame, notes)
    elif moved is not None and course_motion:
        notes.append(f"--course-motion has no effect: {moved.source}")
    if moved is not None:
        notes += without_effect(walk, (), moved.source) if walk is not None else ()
        return moved
    return Moved() if walk is None else _walked(sensors, walk, frame, notes)


def _recorded(
    recordings: Sequence[Recording],
    sensors: Mapping[str, pd.DataFrame],
    frame: Frame,
    notes: list[str],
) -> Moved | None:
    """Return motion that a recording holds as such, odometry or poses; None without any."""
    for name in ("motion", "odometry", "poses"):
        having = [r for r in recordings if name in r.tables]
        if name == "odometry":
            having, turns = parted_odometry(having)
            if turns and not having:
                some = listed([one.name for one in turns])
                notes.append(f"{some}: yaw rates without speeds (wheel_speed_mps): no motion")
        if not having:
            continue
        for other in having[1:]:
            notes.append(f"{other.name}: {name} not used, {having[0].name} has it, too")
        rows, source = having[0].tables[name], f"motion is that of {having[0].name}"
        if name == "odometry":
            drive, words = drive_of(having[0], turns, sensors, frame.convergence_rad, recordings)
            notes += words
            return Moved(drive.rows, drive.imu, None, True, source, drive.compass)
        poses, compass = name == "poses", False
        if "compass_deg" in rows and rows["compass_deg"].notna().any():
            compass = bool(rows["heading_rad"].isna().all())
            source += ", whose compass_deg counts from true north"
            notes += compass_notes(rows["compass_deg"], rows["step_m"])
        moved = motion_from_poses(rows) if poses else by_compass(rows, frame.convergence_rad)
        moved = moved.assign(heading_rad=wrap_rad(moved["heading_rad"]))
        # The first row turns by nothing.
        directions = moved["heading_rad"], moved["turn_rad"].iloc[1:]
        undirected = not any(known.notna().any() for known in directions)
        if undirected and (turning := own_turning(having[0])) is not None:
            of = "rows beside those of steps" if turning.source == "turns" else turning.source
            notes.append(f"{having[0].name}: turns are those of {of}")
            moved = moved.assign(turn_rad=turning.between(moved["time_s"].to_numpy(np.float64)))
        elif undirected:
            lacking = "no headings and no turns (a column compass_deg, heading_rad or turn_rad)"
            notes.append(f"motion: {lacking}: {UNDIRECTED}")
        return Moved(moved, source=source, compass=compass)
    return None


def _walked(
    sensors: Mapping[str, pd.DataFrame], walk: WalkOptions, frame: Frame, notes: list[str]
) -> Moved:
    """Return motion of the steps that a phone's sensors show, else of those that it counted."""
    walked, words = reckon_walk(sensors, walk, frame.convergence_rad)
    if walked is not None:
        notes += walked.notes
        with_compass, why = _compass_of(walked.motion)
        why = f"steps and their lengths are those of the accelerometer, {why}"
        used = {"step_factor"} if walk.step_m is None else {"step_m"}
        used |= {"pose", "declination_deg", "field_ut"} if with_compass else set()
        notes += without_effect(walk, used, why)
        return Moved(walked.motion, walked.imu, walked.reckoning, compass=with_compass)
    counted, noise, reasons = reckon_counted(sensors, walk, frame.convergence_rad)
    notes += words if counted is None else ()
    notes += reasons
    if counted is None:
        notes += without_effect(walk, (), "the log has no motion")
        return Moved()
    with_compass, why = _compass_of(counted)
    why = f"steps are counted by the phone, {why}"
    used = {"step_m", "declination_deg"} if with_compass else {"step_m"}
    used |= {"pose"} if with_compass and "compass" not in sensors else set()
    notes += without_effect(walk, used, why)
    return Moved(counted, noise, compass=with_compass)


def _compass_of(motion: pd.DataFrame) -> tuple[bool, str]:
    """Return whether a walk has headings, and so in words."""
    found = bool(motion["heading_rad"].notna().any())
    return found, "with a compass" if found else "without a compass"


def _course(
    recordings: Sequence[Recording],
    sensors: Mapping[str, pd.DataFrame],
    frame: Frame,
    notes: list[str],
) -> Moved:
    """Return motion by speed and course of positions, and by a gyroscope where there is one.

    Where no positions have a course, motion is that from each position to the next.
    """
    turned = reckon_velocity(sensors) if "gyroscope" in sensors else None
    if turned is not None:
        notes += ["motion from the speed of positions and the gyroscope", *turned[2]]
        return Moved(turned[0], turned[1], source=OF_RECEIVER)
    placed = [(r, rows) for r in recordings if (rows := _placed(r)) is not None]
    for recording, rows in placed:
        moving = ["speed_mps", "course_deg"]
        if set(moving) <= set(rows) and rows[moving].notna().all(axis=1).any():
            motion = motion_from_course(rows, frame.convergence_rad)
            imu = course_errors(motion, *frame.east_north(rows, recording.crs))
            told = "speed and course of its fixes", "as they differ from its positions"
            notes.append(_receiver_note(recording, imu, *told))
            return Moved(motion, imu, source=OF_RECEIVER)
    for recording, rows in placed:
        time_s = rows["time_s"].to_numpy(dtype=np.float64)
        motion, imu = motion_from_positions(time_s, *frame.east_north(rows, recording.crs))
        told = "its positions, one to the next", "by their scatter about straight lines, with turns"
        notes.append(_receiver_note(recording, imu, *told))
        return Moved(motion, imu, source=OF_RECEIVER)
    names = ", ".join(r.name for r in recordings)
    expected = "positions, with speed and course or without"
    raise fail(InputError, names, expected, "none", "leave out --course-motion")


def _placed(recording: Recording) -> pd.DataFrame | None:
    """Return measured positions of different times; None where there are not two."""
    rows, _ = measured_positions(recording)
    if rows is None:
        return None
    rows = rows.drop_duplicates("time_s")
    return rows if len(rows) > 1 else None


def _receiver_note(recording: Recording, imu: ImuNoise | None, source: str, how: str) -> str:
    """Return what motion by a receiver is made of, and its errors."""
    text = f"{recording.name}: motion comes from GNSS: {source}"
    if imu is not None:
        text += f"; steps ± {imu.sigma_trans_m:.2g} m, headings ± {imu.sigma_orient_deg:.0f} deg, "
        text += f"{how}"
        text += f", scale {imu.scale:.0%}" if imu.scale else ""
    return f"{text}; it fails where GNSS does, and shares errors with the positions"
