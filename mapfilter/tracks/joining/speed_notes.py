"""Notes on speeds of receivers and of wheels that positions contradict."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from mapfilter.tracks.checks.receiver_speeds import check_speeds
from mapfilter.tracks.checks.speed_labels import speed_label_fault
from mapfilter.tracks.joining.frame import Frame
from mapfilter.tracks.readers.recorded.recording import Recording

_FEWEST = 20


def speed_notes(recordings: Sequence[Recording], frame: Frame) -> list[str]:
    """Return notes on the speeds of a journey's recordings, by their positions.

    Parameters
    ----------
    recordings : sequence of Recording
        On one clock.
    frame : Frame
    """
    notes: list[str] = []
    placed: list[pd.DataFrame] = []
    for one in recordings:
        rows = one.tables.get("positions")
        if rows is None:
            continue
        east_m, north_m = frame.east_north(rows, one.crs)
        placed.append(
            pd.DataFrame({"time_s": rows["time_s"], "east_m": east_m, "north_m": north_m})
        )
        if "speed_mps" in rows:
            notes += check_speeds(one, east_m, north_m)
    return notes + (_of_wheels(recordings, max(placed, key=len)) if placed else [])


def _of_wheels(recordings: Sequence[Recording], places: pd.DataFrame) -> list[str]:
    """Return notes on speeds of wheels whose column states another unit than theirs."""
    places = places.sort_values("time_s").drop_duplicates("time_s")
    notes = []
    for one in recordings:
        rows = one.tables.get("odometry")
        if rows is None or "speed_mps" not in rows:
            continue
        known = rows.drop_duplicates("time_s").dropna(subset=["speed_mps"])
        enough = len(known) >= _FEWEST
        if enough and (fault := speed_label_fault(known["time_s"], known["speed_mps"], places)):
            notes.append(f"{one.name}: wheel speed: {fault}")
    return notes
