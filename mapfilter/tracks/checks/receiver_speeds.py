"""Speeds and courses of a receiver, compared with its positions: unit, and exchanged columns."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.angles import heading_from_azimuth_rad
from mapfilter.errors import InputError, fail
from mapfilter.tracks.checks.headings import headings_and_courses
from mapfilter.tracks.checks.motion_fault import MotionFault
from mapfilter.tracks.checks.motion_faults import step_fault
from mapfilter.tracks.checks.speed_labels import speed_label_fault
from mapfilter.tracks.readers.recorded.recording import Recording

_FEWEST = 20
_AGREED, _APART, _VARIED, _TURN_RAD = 0.8, 0.5, 0.9, 6.2832


def check_speeds(recording: Recording, east_m: Floats, north_m: Floats) -> tuple[str, ...]:
    """Return a note where a receiver's speeds are in another unit than m/s by its positions.

    Parameters
    ----------
    recording : Recording
        With a table ``positions``.
    east_m, north_m : (N,) array
        Those positions.

    Raises
    ------
    InputError
        Speed and course are exchanged: the speeds, as degrees, are the course of the positions; or
        courses are radians.
    """
    rows = recording.tables["positions"]
    places = pd.DataFrame({"time_s": rows["time_s"], "east_m": east_m, "north_m": north_m})
    known = rows.drop_duplicates("time_s").dropna(subset=["speed_mps"])
    if len(known) < _FEWEST:
        return ()
    where, expected = f"{recording.path}, positions", "speed in m/s and course in degrees"
    if _in_radians(known, places):
        got, hint = "courses that are, as radians, that of the positions", "radians for degrees"
        raise fail(InputError, where, expected, got, f"{hint}: call the column course [rad]")
    if _exchanged(known, places):
        got = "speeds that are, as degrees, the course of the positions"
        hint = "the columns of speed and course are exchanged"
        raise fail(InputError, where, expected, got, hint)
    time_s, speed_mps = known["time_s"], known["speed_mps"]
    fault = speed_label_fault(time_s, speed_mps, places)
    fault = fault or speed_unit_fault(time_s, speed_mps, places)
    if fault is None:
        return ()
    return (f"{recording.name}: positions, speed_mps: {fault.found}; expected m/s",)


def speed_unit_fault(
    time_s: pd.Series, speed_mps: pd.Series, places: pd.DataFrame
) -> MotionFault | None:
    """Return the fault of speeds as steps, by positions; None for speeds in m/s.

    Parameters
    ----------
    time_s, speed_mps : (N,) series
        In order.
    places : pandas.DataFrame
        time_s, east_m and north_m.
    """
    step_m = speed_mps * time_s.diff()
    motion = pd.DataFrame({"time_s": time_s, "step_m": step_m})
    motion = motion.assign(heading_rad=np.nan, turn_rad=np.nan)
    return step_fault(motion, places, "speeds are {} times those between positions")


def _in_radians(known: pd.DataFrame, places: pd.DataFrame) -> bool:
    """Return whether courses are radians, and as degrees none."""
    if "course_deg" not in known or not known["course_deg"].max() <= _TURN_RAD:
        return False
    return _fits_better(known, np.degrees(known["course_deg"]), places)


def _exchanged(known: pd.DataFrame, places: pd.DataFrame) -> bool:
    """Return whether speeds are courses, and courses are none."""
    return "course_deg" in known and _fits_better(known, known["speed_mps"], places)


def _fits_better(known: pd.DataFrame, azimuth_deg: pd.Series, places: pd.DataFrame) -> bool:
    """Return whether azimuths are the course of the positions, and those that are given are not.

    A straight way has one course only, which small numbers fit by chance.
    """
    given = known["course_deg"].notna() & azimuth_deg.notna()
    known, azimuth_deg = known[given], azimuth_deg[given]
    if len(known) < _FEWEST:
        return False
    varied = abs(np.mean(np.exp(1j * np.radians(azimuth_deg)))) < _VARIED
    return (
        bool(varied)
        and _agreement(known, azimuth_deg, places) >= _AGREED
        and _agreement(known, known["course_deg"], places) <= _APART
    )


def _agreement(known: pd.DataFrame, azimuth_deg: pd.Series, places: pd.DataFrame) -> float:
    """Return the mean cosine between azimuths and the course of the positions; 0 for a few."""
    heading = heading_from_azimuth_rad(azimuth_deg.to_numpy(dtype=np.float64))
    motion = pd.DataFrame({"time_s": known["time_s"], "step_m": 1.0, "heading_rad": heading})
    heading, course = headings_and_courses(motion, places)
    return float(np.mean(np.cos(course - heading))) if heading.size >= _FEWEST else 0.0
