"""The table of formats, finding the format of a file, and reading it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from mapfilter.errors import ConfigError, InputError, fail
from mapfilter.tracks.readers import (
    antennas,
    can_frames,
    cell_csv,
    gnettrack,
    gnsslogger,
    gpx,
    indoor,
    nemo,
    nmea,
    phone_sensors,
    plain_csv,
    poses,
    rinex,
    rinex_navigation,
    rtklib,
    sensorlog,
    smartloc,
    tems,
    wigle,
)
from mapfilter.tracks.readers.contained.opening import OF_TABLES, is_of_levels, read_any
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Recording
from mapfilter.tracks.readers.texts import long_tables
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.separated_values import (
    header_columns,
    header_names,
    likely_separator,
)
from mapfilter.tracks.readers.texts.text import Text, parts_of
from mapfilter.tracks.readers.texts.title_lines import below_title
from mapfilter.tracks.readers.texts.zipped import has_recording
from mapfilter.tracks.readers.unknown_formats import JSON, NOT_READ, unknown_format

FORMATS: tuple[Format, ...] = (
    gnettrack.FORMAT,
    cell_csv.TOWER_COLLECTOR,
    cell_csv.UPLOAD,
    cell_csv.CELL_LIST,
    gpx.FORMAT,
    nmea.FORMAT,
    gnsslogger.FORMAT,
    rinex.FORMAT,
    rinex_navigation.FORMAT,
    rtklib.FORMAT,
    smartloc.FORMAT,
    smartloc.RAW,
    indoor.FORMAT,
    phone_sensors.PHYPHOX,
    phone_sensors.SENSOR_LOGGER,
    sensorlog.FORMAT,
    antennas.FORMAT,
    poses.KITTI,
    poses.TUM,
    nemo.FORMAT,
    tems.FORMAT,
    wigle.FORMAT,
    can_frames.FORMAT,
    long_tables.FORMAT,
    plain_csv.FORMAT,
)
"""All formats, in the order in which a file is compared with them."""

_BY_NAMES = (plain_csv.FORMAT, long_tables.FORMAT)
_TOLD_BY_LITTLE = (phone_sensors.PHYPHOX, poses.KITTI, poses.TUM)
_PEEKED_BYTES = 1 << 18


def format_named(name: str) -> Format:
    """Return a format by its name; ConfigError when there is none."""
    for known in FORMATS:
        if known.name == name:
            return known
    names = ", ".join(known.name for known in FORMATS)
    raise fail(ConfigError, "--format", f"one of {names}", repr(name))


def find_format(text: Text) -> Format | None:
    """Return the format that a file looks like, or None."""
    if text.first_line.lstrip().startswith(JSON):
        return None
    return next((known for known in FORMATS if known.matches(text)), None)


def _is_known(text: Text) -> bool:
    return find_format(text) is not None


def format_of(path: str | Path) -> Format | None:
    """Return the format that a file looks like by its beginning; None for another file."""
    try:
        text = read_any(Path(path), _is_known, _PEEKED_BYTES)
    except InputError:
        return None
    found = find_format(text)
    if found is None and (below := _below_title(text, None)) is not None:
        return find_format(below) or plain_csv.FORMAT
    return found


def has_levels(path: Path) -> bool:
    """Return whether the columns of a table in another file are those of placed levels."""
    try:
        return is_of_levels(read_any(path, _is_known, _PEEKED_BYTES))
    except InputError:
        return False


def read_recording(
    path: str | Path, name: str = "", options: ReadOptions | None = None
) -> Recording:
    """Read a recording of another program.

    Parameters
    ----------
    path : str or Path
        Plain or gzip.
    name : str
        Of a format; "" to find it by the file's content.
    options : ReadOptions, optional

    Raises
    ------
    InputError
        The file is missing, damaged, of no known format, or holds no usable row.
    """
    path = Path(path)
    if path.is_dir():
        raise fail(InputError, str(path), "a file", "a folder", "name the files in it")
    try:
        text = read_any(path, _is_known, own=options.columns.values() if options else ())
    except InputError as error:
        suffix = path.suffix.lower()
        hint = NOT_READ.get(suffix, "") if has_recording(path) else ""
        of_table = [f.hint if suffix in OF_TABLES else "" for f in error.faults]
        hints = [own or hint or f.hint for own, f in zip(of_table, error.faults, strict=True)]
        faults = zip(error.faults, hints, strict=True)
        raise InputError(tuple(replace(f, hint=told) for f, told in faults)) from error
    found = find_format(text)
    known = format_named(name) if name else found
    own = options is not None and bool(options.columns)
    if found is None and known in (None, plain_csv.FORMAT) and not (own and _named(text, options)):
        below = _below_title(text, options)
        if below is not None:
            text, known = below, find_format(below) or plain_csv.FORMAT
    if own and not name and (known is None or _is_chosen(known, text, options)):
        # The columns of such an export are chosen, and may be named.
        known = plain_csv.FORMAT if _is_of(text, options) else None
    if known is None:
        raise unknown_format(path, text, find_format)
    reading = Reading(path, notes=list(text.notes))
    options = options or ReadOptions()
    if own and known not in _BY_NAMES and not options.shared:
        reading.note(f"names of columns (--column) have no effect: this is {known.title}")
    try:
        # Numbers of any size occur in damaged files; what comes of them is checked in the end.
        with np.errstate(all="ignore"):
            for at, part in enumerate(parts_of(text) if known.by_rows else (text,)):
                reading.later = partial(_columns_after, text, at) if known.by_rows else tuple
                known.read(part, reading, options)
        reading.later = tuple
        # A large text and the tables need not be in memory at the same time.
        del text
        return reading.done(known.name)
    except InputError as error:
        if found is None or found is known:
            raise
        named = tuple(
            replace(fault, hint=f"this is {found.title}; use --format {found.name}, or none")
            for fault in error.faults
        )
        raise InputError(named) from error


def _columns_after(text: Text, at: int) -> Iterator[Columns]:
    """Yield the columns of the parts of a text after one of them."""
    for part in islice(parts_of(text), at + 1, None):
        yield header_columns(part.data, Reading(text.path), part.line)


def _below_title(text: Text, options: ReadOptions | None) -> Text | None:
    """Return a table below lines of a title, with known columns or those of a column map."""
    if text.first_line.lstrip().startswith(JSON):
        return None
    own = options if options is not None and options.columns else None
    tables = (long_tables.FORMAT, plain_csv.FORMAT)
    return below_title(
        text,
        lambda line: (
            any(known.matches(line) for known in tables) or (own is not None and _named(line, own))
        ),
    )


def _is_chosen(known: Format, text: Text, options: ReadOptions | None) -> bool:
    """Return whether a column map takes the columns of a file of some format as they are."""
    if options is None or known is None:
        return False
    if known is long_tables.FORMAT:
        return long_tables.has_columns_of(text, options.columns.values())
    # Formats that are told by little: a map that names more than times knows better.
    chosen = known is tems.FORMAT or (known in _TOLD_BY_LITTLE and {*options.columns} != {"time"})
    return chosen and _named(text, options)


def _named(text: Text, options: ReadOptions | None) -> bool:
    """Return whether a file has every column of a column map."""
    columns = {} if options is None else options.columns
    names = header_names(text.first_line, likely_separator(text.first_line))
    return all(column.lower() in names for column in columns.values())


def _is_of(text: Text, options: ReadOptions | None) -> bool:
    """Return whether a column map may be that of a file: of several it names a column of it."""
    if options is None or not options.shared:
        return True
    names = header_names(text.first_line, likely_separator(text.first_line))
    return any(column.lower() in names for column in options.columns.values())
