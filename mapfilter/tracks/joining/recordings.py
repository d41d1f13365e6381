"""Reading the recordings of one journey, each of which another program has made."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from mapfilter.clocks.local_times import parse_zone
from mapfilter.errors import ConfigError, Faults, InputError, MapfilterError, fail, listed
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.log_folders import files_in, is_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.tracks.readers.contained.opening import OF_TABLES
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import format_of, read_recording
from mapfilter.tracks.readers.recorded.recording import Recording
from mapfilter.tracks.readers.texts.zipped import check_zipped, files_in_zip, is_zip
from mapfilter.tracks.zipped_logs import UNPACK, is_zipped_log


def read_recordings(
    paths: Sequence[Path], options: OpenOptions
) -> tuple[list[Recording], tuple[str, ...]]:
    """Read recordings, and those in folders and ZIPs; notes name files of these that are none.

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
            faults.take(error)
    if reading.shared and not faults.found:
        _check_named(recordings, options.columns, faults)
    faults.raise_if_any(InputError)
    recordings = _told_apart(recordings)
    return recordings, (*notes, *_zone_note(options.zone, recordings))


def _told_apart(recordings: Sequence[Recording]) -> list[Recording]:
    """Return recordings of which those of one name have names with their folders."""
    count = Counter(one.path.name for one in recordings)
    inside = Counter(_in_folder(one.path) for one in recordings)
    return [
        one
        if count[one.path.name] == 1
        else replace(one, name=name if inside[name := _in_folder(one.path)] == 1 else str(one.path))
        for one in recordings
    ]


def _in_folder(path: Path) -> str:
    return "/".join(path.parts[-2:])


def _zone_note(zone: str, recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Return a note on a zone that no recording needed; none without one."""
    if not zone or any(one.by_zone for one in recordings):
        return ()
    clocks = listed([f"{one.name} {one.clock}" for one in recordings], 3)
    return (f"--zone has no effect: no times are local without a zone ({clocks})",)


def _check_named(
    recordings: Sequence[Recording], columns: Mapping[str, str], faults: Faults
) -> None:
    """Note columns that none of several recordings has."""
    names = ", ".join(one.name for one in recordings)
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


def with_remarks(log: TrackLog, notes: Sequence[str], recordings: Sequence[Recording]) -> TrackLog:
    """Return a log whose notes begin with others, and with those of its recordings' files."""
    of_files = (remark for recording in recordings for remark in recording.remarks)
    return replace(log, notes=tuple(dict.fromkeys((*notes, *of_files, *log.notes))))


def _folders_with_recordings(path: Path) -> list[str]:
    """Return the folders within one that hold recordings, as an app exports one for each."""
    folders = (one for one in sorted(path.iterdir()) if one.is_dir() and one.name[0] != ".")
    return [str(one) for one in folders if any(format_of(file) for file in files_in(one))]


def _expanded(paths: Sequence[Path]) -> tuple[list[Path], tuple[str, ...]]:
    """Return files, and of folders and ZIPs the recordings in them; notes name other files."""
    found: list[Path] = []
    notes = []
    for path in paths:
        is_folder = path.is_dir()
        if not (is_folder or is_zip(path)):
            found.append(path)
            continue
        if is_folder and is_log(path):
            hint = "name it alone; recordings cannot be added to it"
            hint = hint if len(paths) > 1 else "it is used as it is, and needs no conversion"
            raise fail(InputError, str(path), "recordings of other programs", "a track log", hint)
        if is_zipped_log(path):
            raise fail(InputError, str(path), "recordings of other programs", "a track log", UNPACK)
        inner = files_in(path) if is_folder else files_in_zip(path)
        known = [p for p in inner if format_of(p) is not None]
        if not is_folder:
            for other in (p for p in inner if p not in known):
                check_zipped(other, path)
        if not (known or is_folder) and len(inner) == 1 and inner[0].suffix.lower() in OF_TABLES:
            # What it lacks is told when it is read.
            known = inner
        if not known:
            expected = f"recordings in the {'folder' if is_folder else 'ZIP'}"
            logs = [p.name for p in sorted(path.iterdir()) if is_log(p)] if is_folder else []
            got = "track logs" if logs else "none in a known format"
            hint = f"name one of them: {listed(logs)}" if logs else ""
            if is_folder and not logs and (inside := _folders_with_recordings(path)):
                hint = f"they are in folders in it, each of a journey: name {listed(inside)}"
            raise fail(InputError, str(path), expected, got, hint)
        others = [p.name for p in inner if p not in known]
        if others:
            notes.append(f"{path.name}: {', '.join(others)[:200]} left out, no recordings")
        found += known
    return found, tuple(notes)
