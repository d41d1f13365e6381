"""Faults of a phone's sensors and clocks during a walk, by name.

Walk, radio and phone are those of the foreign world; then something of what the phone writes goes
wrong. A fault is a function of a sound log, the time in which it holds, and a generator; what it
returns is read as any user's log is, see :func:`faulty_log`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from mapfilter.errors import ConfigError, fail
from mapfilter.simulation.worlds.clock_faults import (
    clock_steps_back,
    clocks_apart,
    epochs_twice,
    recording_paused,
    report_far_ahead,
)
from mapfilter.simulation.worlds.motion_faults import (
    headings_frozen,
    headings_mirrored,
    headings_reversed,
    motion_ends,
    steps_in_feet,
    steps_missing,
    steps_zero,
)
from mapfilter.simulation.worlds.radio_faults import (
    cell_stale,
    levels_backwards,
    neighbour_stuck,
    radio_ends,
    radio_frozen,
)
from mapfilter.simulation.worlds.windows import Window, drawn_window
from mapfilter.tracks.log import TrackLog, make_log

SensorFault = Callable[[TrackLog, Window, np.random.Generator], TrackLog]

NO_FAULT = "no-fault"


def no_fault(log: TrackLog, _window: Window, _rng: np.random.Generator) -> TrackLog:
    """Change nothing, to compare the others with."""
    return log


SENSOR_FAULTS: Mapping[str, SensorFault] = MappingProxyType(
    {
        NO_FAULT: no_fault,
        "motion-ends": motion_ends,
        "steps-missing": steps_missing,
        "steps-zero": steps_zero,
        "headings-frozen": headings_frozen,
        "headings-reversed": headings_reversed,
        "headings-mirrored": headings_mirrored,
        "steps-in-feet": steps_in_feet,
        "radio-ends": radio_ends,
        "radio-frozen": radio_frozen,
        "levels-backwards": levels_backwards,
        "neighbour-stuck": neighbour_stuck,
        "cell-stale": cell_stale,
        "report-far-ahead": report_far_ahead,
        "clock-steps-back": clock_steps_back,
        "clocks-apart": clocks_apart,
        "epochs-twice": epochs_twice,
        "recording-paused": recording_paused,
    }
)
"""All faults by name, in the order of the table."""

WHOLE_LOG = frozenset({"steps-in-feet", "clocks-apart"})
"""Faults of a setting or of a recording: they hold in the whole log."""


def faulty_log(name: str, log: TrackLog, rng: np.random.Generator) -> tuple[TrackLog, Window]:
    """Return a log as it is read after a fault of a sensor, and when the fault holds.

    Parameters
    ----------
    name : str
        Out of :data:`SENSOR_FAULTS`.
    log : TrackLog
        Without faults, with its truth.

    Raises
    ------
    ConfigError
        There is no such fault.
    InputError
        The log is refused as it is read.
    """
    if name not in SENSOR_FAULTS:
        raise fail(ConfigError, "fault", ", ".join(SENSOR_FAULTS), repr(name))
    time_s = log.truth["time_s"].to_numpy(dtype=np.float64)
    window = drawn_window(float(time_s[0]), float(time_s[-1]), rng)
    if name in WHOLE_LOG:
        window = Window(float(time_s[0]))
    found = SENSOR_FAULTS[name](log, window, rng)
    # As a user's log is: rows out of order are sorted, and exact duplicates dropped.
    read = make_log(
        found.crs, motion=found.motion, radio=found.radio, truth=found.truth, notes=log.notes
    )
    return read, window
