"""Columns of a plain CSV that are not used, and the fields that they may be."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.errors import listed
from mapfilter.tracks.readers.plain.fields import FIELDS, column_options
from mapfilter.tracks.readers.plain.headers import likely_fields
from mapfilter.tracks.readers.plain.mapped import Mapped
from mapfilter.tracks.readers.plain.odometry import (
    has_odometry,
    has_rates_of_steps,
    has_turns_of_wheels,
    has_unused_odometry,
    heading_of_wheels,
    turns_alone,
)
from mapfilter.tracks.readers.plain.speed_units import speed_unit
from mapfilter.tracks.readers.plain.steps import are_counted

_OF_PLACES = ("altitude_m", "accuracy_m", "hdop", "course_deg", "speed_mps", "speed_kmh")
_OF_TURNS, _OF_RATES = ("turn_rad", "turn_deg"), ("yaw_rate_radps", "yaw_rate_degps")
_OF_ODOMETRY = ("speed_mps", "speed_kmh", *_OF_RATES)
OF_WHEELS = {"speed_mps": "wheel_speed_mps", "speed_kmh": "wheel_speed_kmh"}
_OF_STEPS = ("compass_deg", *_OF_TURNS)
_OF_COUNTED_STEPS = (*_OF_STEPS, *_OF_RATES)
_LATE_GUESSES = ("altitude_m", "odometer_m")
_OF_SPEEDS = {"": "", "m/s": "_mps", "km/h": "_kmh"}
"""Endings of fields of speeds by unit; of an unknown one of all."""
_MEASURED = {*_OF_PLACES, *_OF_ODOMETRY, *_OF_STEPS, "heading_rad", "step_m"}
"""Fields that are of use beside others only."""


def unused_columns(mapped: Mapped, time_s: Floats) -> tuple[str, ...]:
    """Return the columns that are not used, each with the fields that its name resembles.

    Parameters
    ----------
    mapped : Mapped
    time_s : (N,) array
        Times of the rows.
    """
    found = [field for field in FIELDS if mapped.has(field)]
    useless = _MEASURED.intersection(found) - _useful(mapped)
    columns = {mapped.rows.find(*mapped.names(field)): field for field in useless}
    taken = {name for field in FIELDS for name in mapped.names(field)} - set(columns)
    taken.update(mapped.beside)
    texts = []
    for name in mapped.rows.names:
        if not name or name in taken:
            continue
        likely = (
            [OF_WHEELS.get(columns[name], "")] if name in columns else likely_fields(name, found)
        )
        if likely == ["compass_deg"] and "heading" in name and not _walks(mapped):
            # Beside positions alone a compass is of no use, a course is.
            likely = ["course_deg"]
        if "step_m" in likely:
            likely = _of_steps(mapped, name, likely)
        if len(likely) > 1 and likely[0].endswith("_mps"):
            unit = speed_unit(mapped, name, time_s)
            if unit not in _OF_SPEEDS:
                texts.append(f"{name} (in {unit} by the positions: call it {name} [{unit}])")
                continue
            likely = [field for field in likely if field.endswith(_OF_SPEEDS[unit])]
        texts.append(_with_fields(name, [field for field in likely if field]))
    return tuple(texts)


def unused_note(unread: tuple[str, ...]) -> str:
    """Return a note on columns that are not used, with an option that names one of them."""
    guesses = [one for one in unread if one.endswith("?)")]
    # A height serves for little, and speeds go before an odometer.
    guessed = min(guesses, key=lambda one: sum(of in one for of in _LATE_GUESSES), default="")
    if not guessed:
        return f"columns not used: {listed(unread)}; see --column"
    name, _, fields = guessed[:-2].rpartition(" (")
    option = column_options(fields.split(" or "), name)
    return f"columns not used: {listed(unread)} (likely: {option})"


def _of_steps(mapped: Mapped, column: str, likely: list[str]) -> list[str]:
    """Return the fields that a column of steps may be by its values: lengths, or a counter."""
    number = pd.to_numeric(pd.Series(mapped.rows.texts(column)), errors="coerce").to_numpy()
    known = number[np.isfinite(number)]
    if not np.all(known == np.round(known)):
        return ["step_m"]
    grows = known.size > 1 and known[-1] > known[0] and bool(np.all(np.diff(known) >= 0))
    return [field for field in likely if field == "steps"] if grows else likely


def _walks(mapped: Mapped) -> bool:
    placed = mapped.has("lat_deg", "lon_deg") and not mapped.has("course_deg")
    return not placed or mapped.has("steps") or mapped.has("step_m")


def _with_fields(name: str, fields: list[str]) -> str:
    return f"{name} ({' or '.join(fields)}?)" if fields else name


def _useful(mapped: Mapped) -> set[str]:
    """Return the fields that are of use beside the others that there are."""
    useful: set[str] = set()
    if mapped.has("lat_deg", "lon_deg"):
        useful.update(_OF_PLACES)
    if mapped.has("east_m", "north_m"):
        useful.add("heading_rad")
    if mapped.has("step_m") and not mapped.holds("east_m", "north_m"):
        useful.update(("heading_rad", "step_m", *_OF_STEPS))
    if has_odometry(mapped) or has_unused_odometry(mapped) or turns_alone(mapped):
        useful.update(_OF_ODOMETRY)
    if has_turns_of_wheels(mapped):
        useful.update(_OF_TURNS)
    if has_rates_of_steps(mapped):
        useful.update(_OF_RATES)
    if heading := heading_of_wheels(mapped):
        useful.add(heading)
    if are_counted(mapped):
        useful.update(_OF_COUNTED_STEPS)
    return useful
