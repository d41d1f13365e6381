"""Several recordings of one journey as one track log, with raw sensors beside it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import (
    grid_convergence_rad,
    heading_from_azimuth_rad,
    project,
    projected_crs,
    utm_crs,
    wrap_rad,
)
from mapfilter.gnss.broadcast import place_by_broadcast
from mapfilter.tracks.alignment import Alignment, align
from mapfilter.tracks.log import TrackLog, make_log
from mapfilter.tracks.moved import (
    motion_from_course,
    motion_from_odometry,
    motion_from_poses,
    places_of_poses,
)
from mapfilter.tracks.readers.recording import Recording
from mapfilter.tracks.sensors import SENSOR_COLUMNS

_LOCAL = "+proj=tmerc +lat_0={lat} +lon_0={lon} +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m +type=crs"
_RADIUS_68 = 1.515
"""Radius of 68 % of a two-dimensional normal distribution, in standard deviations."""

_PROVIDERS = ("gps", "fused", "flp", "network", "nlp")
_CELL_COLUMNS = ("technology", "mcc", "mnc", "lac", "ci")


@dataclass(frozen=True)
class CombineOptions:
    """How recordings become a log.

    Parameters
    ----------
    crs : str
        Projected CRS of the log; "" for the UTM zone of its positions.
    origin_deg : (float, float) or None
        Latitude and longitude at which a local frame of metres has its origin.
    truth : collection of Path
        Recordings whose positions are the truth, and no measurements.
    offsets_s : mapping of Path to float
        Seconds to add to the times of a recording.
    course_motion : bool
        Whether steps are made from the speed and course of positions where nothing else gives them.
    """

    crs: str = ""
    origin_deg: tuple[float, float] | None = None
    truth: Collection[Path] = ()
    offsets_s: Mapping[Path, float] = field(default_factory=dict)
    course_motion: bool = False


@dataclass(frozen=True, eq=False)
class Combined:
    """A log made of recordings, its sensor tables, and how the clocks were aligned."""

    log: TrackLog
    sensors: Mapping[str, pd.DataFrame]
    alignment: Alignment
    notes: tuple[str, ...]


def combine(recordings: Sequence[Recording], options: CombineOptions | None = None) -> Combined:
    """Make one log of the recordings of one journey.

    Raises
    ------
    InputError
        Clocks cannot be aligned, frames do not fit together, or the tables make no sense.
    """
    options = options or CombineOptions()
    if not any(set(r.tables) - {"cells", "ephemerides"} for r in recordings):
        names = ", ".join(r.path.name for r in recordings)
        expected = "a recording of a journey"
        got = "only lists of cells or orbits"
        raise fail(InputError, names, expected, got, "give a list as [cells] path")
    timed = [r for r in recordings if any("time_s" in rows for rows in r.tables.values())]
    alignment = align([r for r in timed if set(r.tables) - {"ephemerides"}], options.offsets_s)
    journey = [r for r in timed if set(r.tables) - {"ephemerides"}]
    shifted = [
        _shifted(recording, offset)
        for recording, offset in zip(journey, alignment.offsets_s, strict=True)
    ]
    frame = _Frame(shifted, options)
    notes = [*alignment.notes, *frame.notes]
    for recording in recordings:
        if "cells" in recording.tables:
            count = len(recording.tables["cells"])
            notes.append(f"{recording.path.name}: a list of {count} cells; give it as [cells] path")
    tables = {
        "motion": _motion(shifted, frame, options, notes),
        "radio": _joined(shifted, "radio"),
        "gnss": _fixes(shifted, frame, options, notes),
        "truth": _truth(shifted, frame, options),
        "pseudoranges": _satellites(recordings, shifted, notes),
    }
    start_s = min(
        float(rows["time_s"].min()) for r in shifted for rows in r.tables.values() if len(rows)
    )
    start_s = float(np.floor(start_s))
    given = {
        name: rows.assign(time_s=rows["time_s"] - start_s)
        for name, rows in tables.items()
        if rows is not None and len(rows)
    }
    if "radio" in given:
        given["radio"] = _radio(given["radio"])
    log = make_log(
        frame.crs,
        **given,
        start_utc_s=start_s if alignment.absolute else float("nan"),
        notes=notes,
    )
    sensors = {
        name: rows.assign(time_s=rows["time_s"] - start_s)
        for name, rows in _sensors(shifted, frame, options.truth).items()
    }
    if not given and not sensors:
        names = ", ".join(r.path.name for r in recordings)
        raise fail(InputError, names, "rows of a journey", "none")
    return Combined(log, sensors, alignment, tuple(notes))


def _shifted(recording: Recording, offset_s: float) -> Recording:
    if offset_s == 0.0:
        return recording
    tables = {
        name: rows.assign(time_s=rows["time_s"] + offset_s) if "time_s" in rows else rows
        for name, rows in recording.tables.items()
    }
    return _with_tables(recording, tables)


def _with_tables(recording: Recording, tables: Mapping[str, pd.DataFrame]) -> Recording:
    return Recording(
        recording.path, recording.format, recording.program, recording.clock, tables,
        recording.rows, recording.unusable, recording.notes, recording.crs,
    )  # fmt: skip


class _Frame:
    """The CRS of the log, and how positions of recordings come into it."""

    def __init__(self, recordings: Sequence[Recording], options: CombineOptions) -> None:
        self.notes: list[str] = []
        self.local = ""
        places = [
            r.tables[name][["lat_deg", "lon_deg"]]
            for r in recordings
            for name in ("positions", "truth")
            if name in r.tables
        ]
        own = [r for r in recordings if not r.crs and {"places", "true_places"} & set(r.tables)]
        stated = [r.crs for r in recordings if r.crs]
        self.lat_deg, self.lon_deg = float("nan"), float("nan")
        if places:
            middle = pd.concat(places).median()
            self.lat_deg, self.lon_deg = float(middle["lat_deg"]), float(middle["lon_deg"])
        elif options.origin_deg is not None:
            self.lat_deg, self.lon_deg = options.origin_deg
        if options.origin_deg is not None:
            self.local = _LOCAL.format(lat=options.origin_deg[0], lon=options.origin_deg[1])
        if options.crs:
            self.crs = projected_crs(options.crs, "--crs")
        elif own and (options.origin_deg is not None or not places):
            lat, lon = options.origin_deg or (0.0, 0.0)
            self.crs = projected_crs(_LOCAL.format(lat=lat, lon=lon))
            if options.origin_deg is None:
                self.notes.append(
                    f"{own[0].path.name}: metres in a frame of its own, placed at latitude 0 and "
                    "longitude 0; see --origin and --crs"
                )
        elif stated:
            self.crs = projected_crs(stated[0])
        elif places:
            self.crs = utm_crs(self.lon_deg, self.lat_deg)
        else:
            self.crs = projected_crs(_LOCAL.format(lat=0, lon=0))
            self.notes.append("no positions: the CRS of the log is a local frame")
        if own and places and options.origin_deg is None and not options.crs:
            names = ", ".join(r.path.name for r in own)
            expected = "one frame of positions"
            got = "degrees in one file, metres in a frame of its own in this one"
            raise fail(InputError, names, expected, got, "give --origin LAT,LON of the frame")

    @property
    def convergence_rad(self) -> float:
        """Clockwise angle from true north to grid north; 0 where the place is unknown."""
        if not np.isfinite(self.lat_deg):
            return 0.0
        return grid_convergence_rad(self.crs, self.lon_deg, self.lat_deg)

    def east_north(self, rows: pd.DataFrame, crs: str) -> tuple[Floats, Floats]:
        """Return positions of a table in the log's CRS; ``crs`` is that of its metres."""
        if "lat_deg" in rows:
            return project(self.crs, rows["lon_deg"], rows["lat_deg"])
        east, north = rows["east_m"].to_numpy(), rows["north_m"].to_numpy()
        source = crs or self.local
        if not source or source == self.crs:
            return east, north
        from pyproj import Transformer

        moved = Transformer.from_crs(source, self.crs, always_xy=True).transform(east, north)
        return np.asarray(moved[0], dtype=np.float64), np.asarray(moved[1], dtype=np.float64)


def _joined(recordings: Sequence[Recording], table: str) -> pd.DataFrame | None:
    parts = [r.tables[table] for r in recordings if table in r.tables]
    if not parts:
        return None
    rows = pd.concat(parts, ignore_index=True)
    return rows.sort_values("time_s", kind="stable", ignore_index=True)


def _radio(rows: pd.DataFrame) -> pd.DataFrame:
    """Return reports with the columns of a log; empty columns of identities are left out."""
    whole = ("mcc", "mnc", "lac", "ci", "arfcn", "bsic", "timing_advance", "censored")
    rows = rows.assign(**{name: rows[name].round().astype("Int64") for name in whole})
    empty = [name for name in _CELL_COLUMNS if rows[name].isna().all()]
    return rows.drop(columns=empty)


def _positions(recording: Recording) -> tuple[pd.DataFrame | None, str]:
    """Return measured positions of the best provider, and a note on those of others."""
    rows = recording.tables.get("positions", recording.tables.get("places"))
    if rows is None or "provider" not in rows or rows["provider"].isna().all():
        return rows, ""
    named = rows["provider"].fillna("").str.lower()
    found = [name for name in _PROVIDERS if (named == name).any()]
    if not found or (named == found[0]).all():
        return rows, ""
    left = int((named != found[0]).sum())
    kept = rows[named == found[0]].reset_index(drop=True)
    return kept, f"{recording.path.name}: {left} fixes of other providers than {found[0]} left out"


def _fixes(
    recordings: Sequence[Recording], frame: _Frame, options: CombineOptions, notes: list[str]
) -> pd.DataFrame | None:
    parts = []
    for recording in recordings:
        rows, note = _positions(recording)
        if rows is None or recording.path in options.truth:
            continue
        if note:
            notes.append(note)
        east, north = frame.east_north(rows, recording.crs)
        variance = np.full(len(rows), np.nan)
        if "accuracy_m" in rows:
            radius = rows["accuracy_m"].to_numpy()
            variance = np.where(radius > 0, (radius / _RADIUS_68) ** 2, np.nan)
        columns = {"time_s": rows["time_s"], "east_m": east, "north_m": north}
        columns |= {"var_east_m2": variance, "var_north_m2": variance}
        parts.append(pd.DataFrame({**columns, "cov_east_north_m2": 0.0 * variance}))
    return pd.concat(parts, ignore_index=True).sort_values("time_s") if parts else None


def _truth(
    recordings: Sequence[Recording], frame: _Frame, options: CombineOptions
) -> pd.DataFrame | None:
    parts = []
    for recording in recordings:
        rows = recording.tables.get("truth", recording.tables.get("true_places"))
        if rows is None and recording.path in options.truth:
            rows, _ = _positions(recording)
            if rows is None and "poses" in recording.tables:
                rows = places_of_poses(recording.tables["poses"])
            if rows is None:
                got = f"a recording of {', '.join(recording.tables)}"
                raise fail(InputError, str(recording.path), "positions, as the truth", got)
        if rows is not None:
            east, north = frame.east_north(rows, recording.crs)
            place = {"time_s": rows["time_s"], "east_m": east, "north_m": north}
            parts.append(pd.DataFrame(place))
    return pd.concat(parts, ignore_index=True).sort_values("time_s") if parts else None


def _motion(
    recordings: Sequence[Recording], frame: _Frame, options: CombineOptions, notes: list[str]
) -> pd.DataFrame | None:
    """Return motion of the recording that tells it most directly; others stay sensors."""
    makers: tuple[tuple[str, Callable[[pd.DataFrame], pd.DataFrame]], ...] = (
        ("motion", lambda rows: rows),
        ("odometry", motion_from_odometry),
        ("poses", motion_from_poses),
    )
    for name, make in makers:
        having = [r for r in recordings if name in r.tables and r.path not in options.truth]
        if not having:
            continue
        for other in having[1:]:
            notes.append(f"{other.path.name}: {name} not used, {having[0].path.name} has it, too")
        moved = make(having[0].tables[name])
        return moved.assign(heading_rad=wrap_rad(moved["heading_rad"]))
    if options.course_motion:
        for recording in recordings:
            rows, _ = _positions(recording)
            if rows is not None and "course_deg" in rows and rows["course_deg"].notna().any():
                notes.append(f"{recording.path.name}: motion from speed and course of its fixes")
                return motion_from_course(rows, frame.convergence_rad)
        faults = Faults()
        names = ", ".join(r.path.name for r in recordings)
        faults.add(names, "positions with speed and course", "none", "leave out --course-motion")
        faults.raise_if_any(InputError)
    return None


def _satellites(
    recordings: Sequence[Recording], shifted: Sequence[Recording], notes: list[str]
) -> pd.DataFrame | None:
    rows = _joined(shifted, "satellites")
    if rows is None:
        return None
    rank = rows["signal"].fillna("").str.contains("1").map({True: 0, False: 1})
    order = rows.assign(rank=rank).sort_values(["time_s", "rank"], kind="stable")
    first = order.drop_duplicates(["time_s", "satellite"]).drop(columns="rank")
    if len(first) < len(rows):
        notes.append(f"pseudoranges: {len(rows) - len(first)} of second signals left out")
    rows = first.reset_index(drop=True)
    orbits = [r.tables["ephemerides"] for r in recordings if "ephemerides" in r.tables]
    places = rows[["x_m", "y_m", "z_m"]]
    if orbits and places.isna().any(axis=None):
        every = pd.concat(orbits, ignore_index=True)
        rows, more = place_by_broadcast(rows, every)
        notes.extend(more)
    names = ("time_s", "satellite", "pseudorange_m", "sigma_m", "x_m", "y_m", "z_m")
    return rows[list(names)]


def _sensors(
    recordings: Sequence[Recording], frame: _Frame, truth: Collection[Path]
) -> dict[str, pd.DataFrame]:
    found: dict[str, pd.DataFrame] = {}
    measured = [r for r in recordings if r.path not in truth]
    for name, columns in SENSOR_COLUMNS.items():
        rows = _velocity(measured, frame) if name == "velocity" else _joined(recordings, name)
        if rows is not None and len(rows):
            found[name] = rows[list(columns)]
    return found


def _velocity(recordings: Sequence[Recording], frame: _Frame) -> pd.DataFrame | None:
    parts = []
    for recording in recordings:
        rows, _ = _positions(recording)
        if rows is None or "speed_mps" not in rows:
            continue
        rows = rows[rows["speed_mps"].notna()]
        heading = heading_from_azimuth_rad(rows["course_deg"], frame.convergence_rad)
        columns = {"time_s": rows["time_s"], "speed_mps": rows["speed_mps"]}
        parts.append(pd.DataFrame({**columns, "heading_rad": heading}))
    return pd.concat(parts, ignore_index=True).sort_values("time_s") if parts else None
