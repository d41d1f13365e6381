"""Read a log, or recordings of other programs, in one call."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from numbers import Real
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter._arguments import PATH, Argument, Entries, Setting, check_arguments, shown
from mapfilter.api.python_words import python_log
from mapfilter.errors import ConfigError, Faults, fail
from mapfilter.geodesy import projected_crs, same_crs, short_crs, shown_crs
from mapfilter.tracks import log as tables
from mapfilter.tracks.checks.placeless import LOCAL_FRAME, is_local_frame
from mapfilter.tracks.joining.named_files import check_origin, offsets_by_path
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.motion_factors import check_factors
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.tracks.pdr.options import WalkOptions

_FILES = "a path, or several"
_WALK = WalkOptions()
TABLE = "a table; mf.make_log(crs, motion=…) makes a log of it"
"""What to do with a table that is given for a log."""

make_log = python_log(tables.make_log)


@python_log
def read_log(
    paths: str | Path | Iterable[str | Path],
    *,
    crs: str = "",
    truth: str | Path | Iterable[str | Path] = (),
    format: str = "",  # noqa: A002
    zone: str = "",
    offsets_s: Mapping[str, float] | None = None,
    origin_deg: tuple[float, float] | None = None,
    columns: Mapping[str, str] | None = None,
    course_motion: bool = False,
    walk: WalkOptions | None = _WALK,
    factors: Mapping[str, float] | None = None,
) -> TrackLog:
    """Read a track log, or recordings of one journey by other programs.

    Parameters
    ----------
    paths : path, or several
        A log's folder; or recordings (the page "Recordings of other programs" lists the formats),
        or a folder of them.
    crs : str
        Projected CRS of the log, such as ``database.lattice.crs``; else the UTM zone of the
        positions of recordings, and a track log's own. A track log of another one is projected,
        with a note.
    truth : path, or several
        Recordings whose positions are the truth, and no measurements.
    format : str
        Name of the format of all recordings, such as ``csv``; "" to find it by their content.
    zone : str
        Zone of local times that state none, such as ``Europe/Brussels``.
    offsets_s : mapping of str to float, optional
        Seconds to add to the times of a recording, by its name: ``{"imu.csv": -18.0}``.
    origin_deg : (float, float), optional
        Latitude and longitude at which positions in metres of a local frame have their origin.
    columns : mapping of str to str, optional
        For plain CSV: column of each field, such as ``{"time": "Zeit"}``.
    course_motion : bool
        Make motion from the speed and course of a receiver, else from its positions, where nothing
        else gives it.
    walk : WalkOptions or None
        How steps and headings are made of the raw sensors of a phone where nothing else gives
        motion; None for no steps.
    factors : mapping of str to float, optional
        By which columns of motion (``step_m``, ``heading_rad``, ``turn_rad``) are multiplied: -1
        for turns that run clockwise, 0.3048 for lengths in feet.

    Raises
    ------
    InputError
        There is neither a log nor a recording, or what there is makes no sense; with every fault.
    StoreError
        A file of a log is missing, cut off or changed since it was written.
    ConfigError
        There is no path, one is no path, such as an open file or a table, the CRS is no text, or
        another argument is of another type.
    """
    check_arguments(
        "read_log",
        Argument("paths", paths, PATH | Iterable, _FILES),
        Argument("crs", crs, str, "a CRS such as database.lattice.crs"),
        Argument("truth", truth, PATH | Iterable, _FILES),
        keywords=[
            Setting("format", format, str),
            Setting("zone", zone, str),
            Entries("offsets_s", offsets_s, Real, "seconds", "the seconds to add to each file"),
            Entries("columns", columns, str, "a column's name", "the column of each field"),
            Setting("course_motion", course_motion, bool),
            Argument("walk", walk, WalkOptions | None, "WalkOptions"),
            Entries("factors", factors, Real, "a number", "the factor of each column of motion"),
        ],
    )
    given, true = _several("paths", paths), _several("truth", truth)
    if not given:
        raise fail(ConfigError, "read_log, paths", _FILES, "none", "a pattern that no file matches")
    faults = Faults()
    check_factors(factors or {}, "factors", faults)
    place = _origin(origin_deg, faults)
    shifts = offsets_by_path(offsets_s or {}, [*given, *true], "read_log, offsets_s", faults)
    faults.raise_if_any(ConfigError)
    combine = CombineOptions(
        origin_deg=place,
        truth=true,
        offsets_s=shifts,
        course_motion=course_motion,
        walk=walk,
        factors=factors or {},
    )
    options = OpenOptions(format=format, zone=zone, columns=columns or {}, combine=combine)
    opened = open_log(given, crs=crs, options=options)
    log, kept = opened.log, bool(crs) and not opened.recordings
    if kept and not same_crs(projected_crs(crs, "read_log, crs"), log.crs):
        why = f"the track log is in {LOCAL_FRAME}"
        if not is_local_frame(log.crs):
            why = f"headings in {short_crs(log.crs)} turn by the place, and the log has no position"
        log = replace(log, notes=(*log.notes, f"crs = {shown_crs(crs)} has no effect: {why}"))
    return log


@python_log
def read_log_of_area(
    path: str | Path, crs: str, about_deg: tuple[float, float], factors: Mapping[str, float]
) -> TrackLog:
    """Read a log, or recordings, whose headings have to fit an area.

    Parameters
    ----------
    path : path
    crs, about_deg
        Of the area: its CRS, and a latitude and longitude in it.
    factors : mapping of str to float
        As of :func:`read_log`.
    """
    combine = CombineOptions(about_deg=about_deg, factors=factors)
    return open_log(Path(path), crs=crs, options=OpenOptions(combine=combine)).log


def _origin(given: object, faults: Faults) -> tuple[float, float] | None:
    """Return the origin of a local frame; None without one, or with faults."""
    if given is None:
        return None
    where = "read_log, origin_deg"
    pair = given if isinstance(given, tuple | list | np.ndarray) else ()
    if len(pair) != 2 or not all(isinstance(one, Real) for one in pair):
        faults.add(where, "a latitude and a longitude in degrees", shown(given))
        return None
    place = float(pair[0]), float(pair[1])
    check_origin(place, where, faults)
    return place


def _several(name: str, paths: object) -> list[Path]:
    """Return paths as a list; ConfigError for what is none."""
    if isinstance(paths, str | os.PathLike):
        return [Path(paths)]
    if isinstance(paths, pd.DataFrame):
        raise fail(ConfigError, f"read_log, {name}", _FILES, shown(paths), TABLE)
    if hasattr(paths, "read"):
        hint = "an open file; give its path"
        raise fail(ConfigError, f"read_log, {name}", _FILES, shown(paths), hint)
    if isinstance(paths, bytes | Mapping) or not isinstance(paths, Iterable):
        raise fail(ConfigError, f"read_log, {name}", _FILES, shown(paths))
    given = list(paths)
    items = (Argument(f"{name}[{i}]", one, PATH, "a path") for i, one in enumerate(given))
    check_arguments("read_log", *items)
    return [Path(path) for path in given]
