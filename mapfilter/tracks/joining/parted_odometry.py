"""A vehicle's odometry in two recordings: speeds in one, yaw rates in another."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from mapfilter.tracks.joining.equal_times import joined_times
from mapfilter.tracks.readers.recorded.recording import Recording


def parted_odometry(
    recordings: Sequence[Recording],
) -> tuple[list[Recording], list[Recording]]:
    """Return the recordings with speeds, and those with yaw rates alone."""
    fast: list[Recording] = []
    turning: list[Recording] = []
    for one in recordings:
        has_speeds = one.tables["odometry"]["speed_mps"].notna().any()
        (fast if has_speeds else turning).append(one)
    return fast, turning


def with_turns(
    rows: pd.DataFrame, turning: Sequence[Recording]
) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Return odometry with the yaw rates of another recording where it has none, and a note.

    Parameters
    ----------
    rows : pandas.DataFrame
        time_s, speed_mps, yaw_rate_radps and others.
    turning : sequence of Recording
        With yaw rates alone, on the same clock.
    """
    if not turning:
        return rows, ()
    names = [one.name for one in turning]
    if rows["yaw_rate_radps"].notna().any():
        own = "yaw rates not used, the speeds have their own"
        return rows, tuple(f"{name}: {own}" for name in names)
    first, *others = turning
    by_time = joined_times(rows).set_index("time_s")
    rates = joined_times(first.tables["odometry"]).set_index("time_s")
    joined = by_time.combine_first(rates[["yaw_rate_radps"]]).sort_index().reset_index()
    notes = [f"odometry: yaw rates are those of {first.name}"]
    notes += [f"{one.name}: yaw rates not used, {names[0]} has them, too" for one in others]
    return joined[list(rows.columns)], tuple(notes)
