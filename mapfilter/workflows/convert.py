"""``mapfilter convert``: recordings of other programs to one track log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mapfilter._words import number_of
from mapfilter.errors import ConfigError, OutputError, fail, noted
from mapfilter.geodesy import short_crs
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.joining.combine import Combined, combine
from mapfilter.tracks.joining.recordings import read_recordings, with_measured, with_remarks
from mapfilter.tracks.open_options import OpenOptions
from mapfilter.tracks.readers.recorded.recording import Recording
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.store import check_log_replaceable, write_log

_GAP_FACTOR = 5.0
_LEAST_GAP_S = 2.0
_OF_STEPS = {"accelerometer", "linear_acceleration", "steps"}
"""Sensors that steps are made of."""


@dataclass(frozen=True)
class FoundTable:
    """One table of a recording: rows, rate and gaps."""

    table: str
    rows: int
    rate_hz: float
    gaps: int
    longest_gap_s: float


@dataclass(frozen=True)
class FoundFile:
    """One recording: what was found in it and what could not be used."""

    file: str
    format: str
    program: str
    clock: str
    read: int
    used: tuple[FoundTable, ...]
    unused: dict[str, int]
    where: tuple[str, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Converted:
    """The log that was written, and what each recording held."""

    log: Path
    crs: str
    duration_s: float
    rows: dict[str, int]
    unused: dict[str, int]
    files: tuple[FoundFile, ...]
    notes: tuple[str, ...]
    imu: ImuNoise | None = None


def run_convert(files: Sequence[Path], out: Path, options: OpenOptions | None = None) -> Converted:
    """Write one track log from the recordings of one journey.

    Parameters
    ----------
    files : sequence of Path
        Recordings, as many as there are: cells from one, sensors from another; or folders
        or ZIPs of them.
    out : Path
        The log's folder; must be absent, empty or a log that mapfilter wrote.

    Raises
    ------
    InputError
        A recording cannot be read or holds nothing usable, or the recordings do not fit together;
        nothing is written then.
    """
    options = options or OpenOptions()
    truth = [path for path in options.combine.truth if path not in files]
    _check_out(out, [*files, *truth])
    recordings, notes = read_recordings([*files, *truth], options)
    of_files = (remark for recording in recordings for remark in recording.remarks)
    with noted((*notes, *of_files)):
        combined = combine(recordings, with_measured(options.combine, files))
    if options.combine.walk is None:
        notes += _no_steps_note(combined)
    # People are shown those of each file beneath it; the log has nothing but its notes.
    write_log(with_remarks(combined.log, notes, recordings), out, sensors=combined.sensors)
    rows = {table: len(getattr(combined.log, table)) for table in TABLES}
    rows |= {f"sensors/{name}": len(table) for name, table in combined.sensors.items()}
    found = tuple(_found(recording) for recording in recordings)
    unused: dict[str, int] = {}
    for one in found:
        for reason, count in one.unused.items():
            unused[reason] = unused.get(reason, 0) + count
    return Converted(
        out,
        combined.log.crs,
        combined.log.duration_s,
        {name: count for name, count in rows.items() if count or name in TABLES},
        unused,
        found,
        (*notes, *combined.log.notes),
        combined.log.imu,
    )


def _no_steps_note(combined: Combined) -> tuple[str, ...]:
    """Return a note where no steps would have been made either, and why."""
    why = ""
    if len(combined.log.motion):
        why = "motion is made of no phone's sensors anyway"
    elif not _OF_STEPS.intersection(combined.sensors):
        why = "there are no sensors of a phone to make steps of"
    return (f"--no-steps has no effect: {why}",) if why else ()


def _check_out(out: Path, inputs: Sequence[Path]) -> None:
    """Refuse to write a log over an input, or into a folder of inputs."""
    for path in inputs:
        if path.resolve() == out.resolve():
            raise fail(OutputError, str(out), "a new folder", "one of the recordings")
    check_log_replaceable(out)


def _found(recording: Recording) -> FoundFile:
    return FoundFile(
        str(recording.path),
        recording.format,
        recording.program,
        str(recording.clock),
        recording.rows,
        tuple(_table(name, rows) for name, rows in recording.tables.items()),
        {found.reason: found.count for found in recording.unusable},
        tuple(str(found) for found in recording.unusable),
        recording.notes,
    )


def _table(name: str, rows: pd.DataFrame) -> FoundTable:
    """Return the rate by the median interval, and the gaps of more than five of them."""
    if "time_s" not in rows or name == "ephemerides":
        return FoundTable(name, len(rows), float("nan"), 0, float("nan"))
    between = np.diff(np.unique(rows["time_s"].to_numpy()))
    if not between.size:
        return FoundTable(name, len(rows), float("nan"), 0, float("nan"))
    typical = float(np.median(between))
    gaps = between[between > max(_LEAST_GAP_S, _GAP_FACTOR * typical)]
    return FoundTable(
        name, len(rows), 1 / typical, len(gaps), float(gaps.max()) if gaps.size else 0.0
    )


def report_lines(result: Converted) -> list[str]:
    """Return what was converted as lines of text, for people."""
    lines = []
    for file in result.files:
        lines.append(f"{Path(file.file).name}: {file.program or file.format}, {file.clock}")
        for table in file.used:
            rate = "" if np.isnan(table.rate_hz) else f", {_rate(table.rate_hz)}"
            gaps = (
                f", {number_of(table.gaps, 'gap')}, longest {table.longest_gap_s:.1f} s"
                if table.gaps
                else ""
            )
            lines.append(f"  {table.table}: {number_of(table.rows, 'row')}{rate}{gaps}")
        lines += [f"  not used: {text}" for text in file.where]
        lines += [f"  note: {text}" for text in file.notes]
    lines += [f"note: {note}" for note in result.notes]
    if result.imu is not None:
        lines.append(f"errors of motion: {_errors(result.imu)}")
    held = ", ".join(f"{name} {count}" for name, count in result.rows.items() if count)
    crs = short_crs(result.crs)
    frame = "local frame" if crs == "unknown" else crs
    lines.append(f"log: {result.log} ({frame}, {result.duration_s:.1f} s; {held})")
    return lines


def _errors(imu: ImuNoise) -> str:
    """Return the main errors of motion in words."""
    turns = (
        f"heading {imu.bias_sd_deg:.0f} deg lasting, {imu.sigma_orient_deg:.1f} deg white"
        if imu.turns == "headings"
        else f"gyroscope {imu.gyro_bias_deg_per_s:.2g} deg/s, "
        f"{imu.gyro_noise_deg_per_sqrt_s:.2g} deg/sqrt(s)"
    )
    return f"step {imu.sigma_trans_m:.2g} m, scale {imu.scale:.0%}, {turns}"


def _rate(rate_hz: float) -> str:
    return f"{rate_hz:.3g} Hz" if rate_hz >= 0.95 else f"every {1 / rate_hz:.3g} s"


def parse_pairs(texts: Sequence[str], option: str) -> dict[str, str]:
    """Read ``NAME=VALUE`` options; ConfigError for others.

    Examples
    --------
    >>> parse_pairs(["time=Zeit", "lat_deg=Breite"], "--column")
    {'time': 'Zeit', 'lat_deg': 'Breite'}
    """
    pairs: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.rpartition("=")
        if not (name and equals and value):
            raise fail(ConfigError, option, "NAME=VALUE", repr(text))
        pairs[name.strip()] = value.strip()
    return pairs
