"""Open what a person has of a journey: a track log, or recordings of other programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas as pd

from mapfilter.errors import ConfigError, Faults, InputError, MapfilterError, fail
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.combine import CombineOptions, combine
from mapfilter.tracks.identify import name_by_plan
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.motion_factors import scaled_log
from mapfilter.tracks.pdr.options import without_effect
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import format_of, read_recording
from mapfilter.tracks.readers.recording import Recording
from mapfilter.tracks.readers.times import parse_zone
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.sensors import read_sensors
from mapfilter.tracks.store import HEAD, is_log, list_logs, read_log

_READY = "the motion of a track log is used as it is; convert the recording with it"


@dataclass(frozen=True)
class OpenOptions:
    """How recordings of other programs are read and joined; track logs need the factors alone.

    Parameters
    ----------
    format : str
        Name of the format of all files; "" to find it by their content.
    zone : str
        Zone of local times that state none.
    columns : mapping of str to str
        For plain CSV: column of each field. Of several files each has those of them that are in it.
    combine : CombineOptions
    """

    format: str = ""
    zone: str = ""
    columns: Mapping[str, str] = field(default_factory=dict)
    combine: CombineOptions = field(default_factory=CombineOptions)


@dataclass(frozen=True, eq=False)
class OpenedLog:
    """A log, its raw sensors, and the recordings that it was made of, if any."""

    name: str
    log: TrackLog
    sensors: Mapping[str, pd.DataFrame]
    recordings: tuple[Recording, ...] = ()


def open_log(
    paths: str | Path | Sequence[str | Path],
    *,
    crs: str = "",
    plan: CellPlan | None = None,
    options: OpenOptions | None = None,
) -> OpenedLog:
    """Open a track log, or the recordings of one journey by other programs.

    Nothing is written. A track log is read as it is; recordings are read, aligned and joined as
    ``mapfilter convert`` does. Notes of the log say what of each recording was not used.

    Parameters
    ----------
    paths : path, or sequence of paths
        A track log; or recordings, or a folder of them, of one journey.
    crs : str
        Projected CRS for recordings: that of the database. "" for the UTM zone of their positions.
        A track log keeps its own.
    plan : CellPlan, optional
        Gives reported cells its ids, see :func:`mapfilter.tracks.identify.name_by_plan`.
    options : OpenOptions, optional

    Raises
    ------
    InputError
        A file is missing, damaged or of no known format, or recordings do not fit together; with
        the faults of all files.
    StoreError
        A track log was cut off or changed since it was written.
    """
    given = [Path(paths)] if isinstance(paths, str | Path) else [Path(path) for path in paths]
    options = options or OpenOptions()
    if len(given) == 1 and _is_own(given[0]):
        log = scaled_log(read_log(given[0]), options.combine.factors, str(given[0]))
        walk = options.combine.walk
        unused = () if walk is None else without_effect(walk, (), _READY)
        log = replace(log, notes=(*log.notes, *unused)) if unused else log
        opened = OpenedLog(given[0].name, log, read_sensors(given[0]))
    else:
        recordings, notes = read_recordings(given, options)
        wanted = with_measured(options.combine, given)
        joined = combine(recordings, replace(wanted, crs=wanted.crs or crs))
        of_files = [remark for recording in recordings for remark in recording.remarks]
        every_note = dict.fromkeys((*notes, *of_files, *joined.log.notes))
        log = replace(joined.log, notes=tuple(every_note))
        name = given[0].name.partition(".")[0] or given[0].name
        opened = OpenedLog(name, log, joined.sensors, tuple(recordings))
    if plan is None:
        return opened
    return replace(opened, log=name_by_plan(opened.log, plan))


def list_journeys(path: str | Path) -> list[Path]:
    """Return what holds one journey each: logs in a folder, one log, or recordings.

    A file, and a folder of recordings without logs, is one journey.

    Raises
    ------
    InputError
        There is neither a log nor a recording.
    """
    path = Path(path)
    if path.is_file() and not _is_part(path):
        return [path]
    try:
        return list_logs(path)
    except InputError:
        inner = _files_in(path) if path.is_dir() else []
        if any(_is_table(p) for p in inner) or all(format_of(p) is None for p in inner):
            raise
        return [path]


def read_recordings(
    paths: Sequence[Path], options: OpenOptions
) -> tuple[list[Recording], tuple[str, ...]]:
    """Read recordings, and those in folders; notes name files of folders that are none.

    Raises
    ------
    InputError
        With the faults of all files.
    ConfigError
        A zone, format or column is unknown.
    """
    if options.zone:
        parse_zone(options.zone)
    inner, notes = _expanded(paths)
    truth = [path for path in options.combine.truth if path not in inner]
    files = [*dict.fromkeys(inner), *dict.fromkeys(truth)]
    reading = ReadOptions(options.zone, options.columns, shared=len(files) > 1)
    recordings, faults = [], Faults()
    for path in files:
        try:
            recordings.append(read_recording(path, options.format, reading))
        except ConfigError:
            raise
        except MapfilterError as error:
            faults.found.extend(error.faults)
    if reading.shared and not faults.found:
        _check_named(recordings, options.columns, faults)
    faults.raise_if_any(InputError)
    return recordings, notes


def _check_named(
    recordings: Sequence[Recording], columns: Mapping[str, str], faults: Faults
) -> None:
    """Note columns that none of several recordings has."""
    names = ", ".join(one.path.name for one in recordings)
    named = {name for one in recordings for name in one.named}
    for name, column in columns.items():
        if name not in named:
            expected = f"a column {column} for {name} in a plain CSV among them"
            faults.add(names, expected, "none", "misspelt; files of other formats need no columns")


def with_measured(options: CombineOptions, paths: Sequence[Path]) -> CombineOptions:
    """Return options by which a recording that is named as truth and as log keeps its motion.

    One that only lies in a folder of logs is the truth alone.
    """
    return replace(options, measured=[path for path in options.truth if path in paths])


def _is_own(path: Path) -> bool:
    """Return whether a path is a track log, or is refused best by its reader."""
    if path.is_file():
        return _is_part(path)
    return is_log(path) or not path.is_dir() or any(_is_table(inner) for inner in _files_in(path))


def _is_part(path: Path) -> bool:
    """Return whether a file is one of a track log."""
    return path.name == HEAD or (_is_table(path) and is_log(path.parent))


def _is_table(path: Path) -> bool:
    return path.stem in TABLES and path.suffix in (".csv", ".parquet")


def _files_in(folder: Path) -> list[Path]:
    return [p for p in sorted(folder.iterdir()) if p.is_file() and not p.name.startswith(".")]


def _expanded(paths: Sequence[Path]) -> tuple[list[Path], tuple[str, ...]]:
    """Return files, and of folders the recordings in them; notes name the other files."""
    found: list[Path] = []
    notes = []
    for path in paths:
        if not path.is_dir():
            found.append(path)
            continue
        if is_log(path):
            got, hint = "a track log", "name it alone; recordings cannot be added to it"
            raise fail(InputError, str(path), "recordings of other programs", got, hint)
        inner = _files_in(path)
        known = [p for p in inner if format_of(p) is not None]
        if not known:
            raise fail(InputError, str(path), "recordings in the folder", "none in a known format")
        others = [p.name for p in inner if p not in known]
        if others:
            notes.append(f"{path.name}: {', '.join(others)[:200]} left out, no recordings")
        found += known
    return found, tuple(notes)
