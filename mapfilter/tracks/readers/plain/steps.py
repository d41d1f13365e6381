"""Lengths of steps in a plain CSV, with the directions of their rows or of those beside them."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.tracks.pdr.mean_direction import mean_direction
from mapfilter.tracks.readers.plain.mapped import Mapped, add_rows
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.tables import RECORDED

_DIRECTIONS = ("heading_rad", "compass_deg", "turn_rad")


def are_counted(mapped: Mapped) -> bool:
    """Return whether steps are counted, and have no lengths."""
    return mapped.has("steps") and not mapped.holds("step_m")


def add_steps(mapped: Mapped, reading: Reading, time_s: Floats) -> None:
    """Add the rows with lengths of steps; where they have no direction, with one of other rows."""
    columns = {name: mapped.number(name) for name in ("step_m", "heading_rad", "compass_deg")}
    columns["turn_rad"] = mapped.radians("turn")
    stepped = np.isfinite(columns["step_m"])
    if not any(np.isfinite(columns[name][stepped]).any() for name in _DIRECTIONS):
        _add_directions(mapped, reading, time_s, columns, stepped)
    add_rows(reading, "motion", {"time_s": time_s, **columns}, mapped.rows, stepped)


def _add_directions(
    mapped: Mapped, reading: Reading, time_s: Floats, columns: dict[str, Floats], stepped: Bools
) -> None:
    """Give steps the mean headings of rows beside them, else add the turns of these."""
    at = np.flatnonzero(stepped & np.isfinite(time_s))
    at = at[np.argsort(time_s[at], kind="stable")]
    for name, unit_deg in (("heading_rad", np.degrees(1.0)), ("compass_deg", 1.0)):
        (known,) = (field for field in RECORDED["motion"] if field.name == name)
        values = np.where(np.isfinite(time_s), columns[name], np.nan)
        values = np.where((values >= known.low) & (values <= known.high), values, np.nan)
        mean_deg, _ = mean_direction(time_s[at], time_s, unit_deg * values)
        if np.isfinite(mean_deg).any():
            found = np.full(time_s.size, np.nan)
            found[at] = mean_deg / unit_deg
            columns[name] = found
            reading.note(f"{mapped.rows.find(*mapped.names(name))}: of rows beside those of steps")
            return
    turns = {"time_s": time_s, "turn_rad": columns["turn_rad"]}
    add_rows(reading, "turns", turns, mapped.rows, np.isfinite(columns["turn_rad"]))
