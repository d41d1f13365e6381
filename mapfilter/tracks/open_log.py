"""Open what a person has of a journey: a track log, or recordings of other programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from mapfilter.errors import InputError, noted
from mapfilter.geodesy import projected_crs
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.checks.placeless import in_frame
from mapfilter.tracks.joining.identify import name_by_plan
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.log_folders import HEAD, files_in, is_log, list_logs
from mapfilter.tracks.motion_factors import scaled_log
from mapfilter.tracks.open_options import OpenOptions
from mapfilter.tracks.pdr.options import without_effect
from mapfilter.tracks.readers.texts.zipped import zip_of
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.sensors import sensors_of
from mapfilter.tracks.store import read_log

if TYPE_CHECKING:
    from mapfilter.tracks.readers.recorded.recording import Recording

_READY = "the motion of a track log is used as it is; convert the recording with it"


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

    Nothing is written. A track log is read as it is, but for its CRS; recordings are read, aligned
    and joined as ``mapfilter convert`` does. Notes of the log say what of each recording was not
    used.

    Parameters
    ----------
    paths : path, or sequence of paths
        A track log; or recordings, or a folder or ZIP of them, of one journey.
    crs : str
        Projected CRS of the log: that of the database. "" for the UTM zone of the positions of
        recordings, and a track log's own. A track log of another one is projected, see
        :func:`mapfilter.tracks.checks.placeless.in_frame`.
    plan : CellPlan, optional
        Gives reported cells its ids, see :func:`mapfilter.tracks.joining.identify.name_by_plan`.
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
        unused = options.unused_by_log()
        unused += () if walk is None else without_effect(walk, (), _READY)
        sensors, cut = sensors_of(given[0])
        log = replace(log, notes=(*log.notes, *unused, *cut)) if unused or cut else log
        log = in_frame(log, projected_crs(crs), options.combine.about_deg) if crs else log
        opened = OpenedLog(given[0].name, log, sensors)
    else:
        # Here, as a track log needs none of what reads and joins recordings.
        from mapfilter.tracks.joining.combine import combine
        from mapfilter.tracks.joining.recordings import read_recordings, with_measured, with_remarks

        recordings, notes = read_recordings(given, options)
        wanted = with_measured(options.combine, given)
        of_files = [remark for recording in recordings for remark in recording.remarks]
        with noted((*notes, *of_files)):
            joined = combine(recordings, replace(wanted, crs=wanted.crs or crs))
        log = with_remarks(joined.log, notes, recordings)
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
        from mapfilter.tracks.readers.formats import format_of

        inner = files_in(path) if path.is_dir() else []
        if any(_is_table(p) for p in inner) or all(format_of(p) is None for p in inner):
            raise
        return [path]


def _is_own(path: Path) -> bool:
    """Return whether a path is a track log, or is refused best by its reader."""
    if path.is_file() or zip_of(path) is not None:
        return _is_part(path)
    return is_log(path) or not path.is_dir() or any(_is_table(inner) for inner in files_in(path))


def _is_part(path: Path) -> bool:
    """Return whether a file is one of a track log."""
    return path.name == HEAD or (_is_table(path) and is_log(path.parent))


def _is_table(path: Path) -> bool:
    return path.stem in TABLES and path.suffix in (".csv", ".parquet")
