"""The motion of a vehicle by its odometry: speeds, with headings, yaw rates or turns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail, listed
from mapfilter.tracks.checks.exchanged import check_turning
from mapfilter.tracks.checks.headings import compass_notes
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.joining.equal_times import joined_times
from mapfilter.tracks.joining.moved import by_compass
from mapfilter.tracks.joining.parted_odometry import with_turns
from mapfilter.tracks.pdr.mounted import turning_of_mounted
from mapfilter.tracks.pdr.mounted_clock import clock_shift_s
from mapfilter.tracks.pdr.turns import AXES, Turning, samples, turning_of
from mapfilter.tracks.pdr.vehicle import reckon_odometry
from mapfilter.tracks.pdr.vehicle_headings import has_headings, reckon_headings
from mapfilter.tracks.readers.recorded.recording import Recording

_LONGEST_GAP_S = 3600.0
_SUMMER_HOURS = 1.1
_FEWEST = 3


@dataclass(frozen=True, eq=False)
class Drive:
    """Motion of a vehicle and its errors; ``compass`` as of a ``Moved``."""

    rows: pd.DataFrame
    imu: ImuNoise
    compass: bool = False


def drive_of(
    wheels: Recording,
    turns: Sequence[Recording],
    sensors: Mapping[str, pd.DataFrame],
    convergence_rad: float,
    recordings: Sequence[Recording],
) -> tuple[Drive, tuple[str, ...]]:
    """Return the motion of a vehicle, and notes.

    Its directions are headings of its own; else yaw rates, its own or another recording's; else
    turns of its own; else those that a phone's sensors show.

    Parameters
    ----------
    wheels : Recording
        With speeds in its table ``odometry``.
    turns : sequence of Recording
        With yaw rates alone, on the same clock.
    sensors : mapping of str to pandas.DataFrame
        Tables of raw sensors.
    convergence_rad : float
        Clockwise angle from true north to grid north.
    recordings : sequence of Recording
        All of the journey.

    Raises
    ------
    InputError
        Odometry pauses for more than an hour, or a phone's turns are too fast for the vehicle.
    """
    rows = joined_times(wheels.tables["odometry"])
    _check_gaps(wheels, rows["time_s"].to_numpy(dtype=np.float64))
    headed = by_compass(rows, convergence_rad)
    if has_headings(headed):
        unused = "yaw rates not used, the speeds have headings"
        notes = tuple(f"{one.name}: {unused}" for one in turns)
        moved, imu, words = reckon_headings(headed)
        azimuth_deg = rows.set_index("time_s")["compass_deg"]
        at_rows = azimuth_deg.reindex(moved["time_s"]).reset_index(drop=True)
        notes = (*notes, *words, *compass_notes(at_rows, moved["step_m"]))
        return Drive(moved, imu, compass=bool(rows["heading_rad"].isna().all())), notes
    rows, notes = with_turns(rows, turns)
    turning = None
    if rows["yaw_rate_radps"].isna().all():
        turning = own_turning(wheels)
        if turning is not None:
            notes = (*notes, f"{wheels.name}: turns are those from row to row")
        else:
            turning, of_phone = _turning_of_phone(wheels, rows, sensors, recordings)
            notes = (*notes, *of_phone)
    moved, imu, words = reckon_odometry(rows, turning)
    return Drive(moved, imu), (*notes, *words)


def own_turning(recording: Recording) -> Turning | None:
    """Return the turns that a recording has beside speeds or steps; None where it has none."""
    if "turns" not in recording.tables:
        return None
    return turning_of({"turns": recording.tables["turns"]})[0]


def _turning_of_phone(
    wheels: Recording,
    rows: pd.DataFrame,
    sensors: Mapping[str, pd.DataFrame],
    recordings: Sequence[Recording],
) -> tuple[Turning | None, tuple[str, ...]]:
    """Return the turns of a phone in the vehicle on the clock of its speeds, and notes."""
    turning, notes = turning_of_mounted(sensors)
    if turning is None:
        return None, notes
    turning, late = _on_the_clock_of(wheels, rows, turning, sensors, recordings)
    check_turning(rows, turning, ", ".join(r.name for r in recordings))
    return turning, (*notes, *late)


def _on_the_clock_of(
    wheels: Recording,
    rows: pd.DataFrame,
    turning: Turning,
    sensors: Mapping[str, pd.DataFrame],
    recordings: Sequence[Recording],
) -> tuple[Turning, tuple[str, ...]]:
    """Return a phone's turns on the clock of a vehicle's speeds, and a note where it is another."""
    phones = [r.name for r in recordings if "gyroscope" in r.tables and r is not wheels]
    force = samples(sensors, "accelerometer", AXES) or samples(sensors, "linear_acceleration", AXES)
    speed = rows.dropna(subset=["speed_mps"])
    if not phones or force is None or len(speed) < _FEWEST:
        return turning, ()
    speeds = speed["time_s"].to_numpy(np.float64), speed["speed_mps"].to_numpy(np.float64)
    shift_s, best, now = clock_shift_s(speeds, force)
    if not shift_s:
        return turning, ()
    note = (
        f"{listed(phones)}: accelerations agree with the speeds of {wheels.name} best "
        f"{shift_s:+.1f} s shifted (explained: {best:.2f}, not {now:.2f}); its turns are shifted, "
        "--offset shifts all of it"
    )
    return replace(turning, time_s=turning.time_s + shift_s), (note,)


def _check_gaps(recording: Recording, time_s: Floats) -> None:
    """Raise InputError where odometry pauses for more than an hour, as between journeys."""
    gaps = np.flatnonzero(np.diff(time_s) > _LONGEST_GAP_S)
    if not gaps.size:
        return
    row = int(gaps[0]) + 1
    before, after = (_shown_time(recording, float(time)) for time in time_s[row - 1 : row + 1])
    hours = (time_s[row] - time_s[row - 1]) / 3600
    more = f"; {gaps.size} such gaps" if gaps.size > 1 else ""
    got = f"{hours:.1f} h from {before} (row {row}) to {after} (row {row + 1}){more}"
    where, expected = f"{recording.path}, odometry", "rows at most 1 h apart"
    hint = "a recording of several journeys: split it there, convert each alone"
    if recording.clock.kind == "local" and not recording.clock.zone and hours < _SUMMER_HOURS:
        hint = f"a clock that was set forward for summer: --zone; or {hint}"
    raise fail(InputError, where, expected, got, hint)


def _shown_time(recording: Recording, time_s: float) -> str:
    if recording.clock.kind == "monotonic":
        return f"{time_s:g} s"
    return datetime.fromtimestamp(time_s, UTC).isoformat(" ", "seconds").removesuffix("+00:00")
