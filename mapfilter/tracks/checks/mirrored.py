"""Positions that are a mirror image of the way: latitude and longitude swapped, or a lost sign."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.angles import heading_from_azimuth_rad
from mapfilter.tracks.checks.headings import headings_and_courses
from mapfilter.tracks.checks.misplaced import UNDONE
from mapfilter.tracks.checks.motion_fault import BY_COMPASS, MIRRORED
from mapfilter.tracks.joining.journey_motion import Moved
from mapfilter.tracks.joining.position_units import metres_about_middle
from mapfilter.tracks.readers.recorded.recording import Recording

_FEWEST = 20
_AGREED = 0.85
_LEAST_GAIN = 0.3


def mirrored_notes(recordings: Sequence[Recording], moved: Moved) -> list[str]:
    """Return a note for each recording whose positions are a mirror image of the way.

    The way is that by steps and compass, else by the courses of the same receiver. Without either,
    as with headings that a recording gives as such, nothing can be said.

    Parameters
    ----------
    recordings : sequence of Recording
        On one clock.
    moved : Moved
        Motion of the journey on that clock.
    """
    found = []
    for recording in recordings:
        rows = recording.tables.get("positions", recording.tables.get("truth"))
        if rows is None:
            continue
        if moved.compass and moved.rows is not None:
            motion, by = moved.rows, BY_COMPASS
        elif "course_deg" in rows and rows["course_deg"].notna().any():
            heading = heading_from_azimuth_rad(rows["course_deg"])
            motion, by = rows[["time_s"]].assign(step_m=1.0, heading_rad=heading), "their courses"
        else:
            continue
        if cause := mirrored_by(motion, rows):
            other = ", or azimuths that run counter-clockwise" if moved.compass else ""
            text = f"{MIRRORED} {by}: {cause}{other}?"
            found.append(f"{recording.name}: {text}")
    return found


def mirrored_by(motion: pd.DataFrame, places: pd.DataFrame) -> str:
    """Return the mistake without which positions agree with headings; "" where there is none.

    Parameters
    ----------
    motion : pandas.DataFrame
        time_s, step_m and heading_rad.
    places : pandas.DataFrame
        time_s, lon_deg and lat_deg.
    """
    heading, course = headings_and_courses(motion, _in_metres(places, places))
    if heading.size < _FEWEST:
        return ""
    agreed = abs(_mean_turn(heading, course))
    if agreed > 1 - _LEAST_GAIN:
        return ""
    for cause, (lon, lat, lon_sign, lat_sign) in UNDONE.items():
        undone = places.assign(lon_deg=lon_sign * places[lon], lat_deg=lat_sign * places[lat])
        if (undone["lat_deg"].abs() > 90).any():
            continue
        score = _mean_turn(*headings_and_courses(motion, _in_metres(places, undone))).real
        if score >= _AGREED and score - agreed >= _LEAST_GAIN:
            return cause
    return ""


def _in_metres(places: pd.DataFrame, degrees: pd.DataFrame) -> pd.DataFrame:
    """Return positions about their middle on a plane that touches the earth there."""
    east_m, north_m = metres_about_middle(degrees["lon_deg"], degrees["lat_deg"])
    return pd.DataFrame({"time_s": places["time_s"], "east_m": east_m, "north_m": north_m})


def _mean_turn(heading: Floats, course: Floats) -> complex:
    return complex(np.mean(np.exp(1j * (course - heading)))) if heading.size else 0j
