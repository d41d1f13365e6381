"""The inputs of ``mapfilter locate``: databases, logs, recordings and tables, as reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from mapfilter._words import likely_of_no_file, number_of
from mapfilter.database.manifest import MANIFEST
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, Faults, InputError, MapfilterError, fail, noted
from mapfilter.geodesy import short_crs
from mapfilter.positioning.fingerprints.options import LEVEL_ERROR_DB
from mapfilter.positioning.fingerprints.reports import Reports
from mapfilter.positioning.fingerprints.sources import (
    is_table,
    reports_of_database,
    reports_of_logs,
)
from mapfilter.positioning.fingerprints.tables import read_fingerprint_table
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.checks.range_units import with_range_notes
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.log_folders import is_log
from mapfilter.tracks.open_log import list_journeys, open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.tracks.readers import plain_csv
from mapfilter.tracks.readers.formats import find_format, format_of
from mapfilter.tracks.readers.plain.fields import FIELDS
from mapfilter.tracks.readers.texts.separated_values import header_names, likely_separator
from mapfilter.tracks.readers.texts.text import read_text

_PEEKED_BYTES = 1 << 18
WITHOUT_STEPS = OpenOptions(combine=CombineOptions(walk=None))
"""Single reports need no motion."""


def read_database(
    path: Path, crs: str | None, level_error_db: float | None
) -> tuple[Reports, CellPlan | None]:
    """Return a radio-route database, or fingerprints, as reports; and the plan of the former.

    Raises
    ------
    MapfilterError
        There is none of these, it is damaged, or a CRS or an error is given that it does not take.
    """
    if not path.exists():
        expected = "a radio-route database, or logs or a table of reports whose places are known"
        raise fail(InputError, str(path), expected, "nothing", likely_of_no_file(path))
    if (path / MANIFEST).is_file():
        opened = open_database(path)
        _refuse("--crs", crs, path, f"none, as it is in {short_crs(opened.lattice.crs)}")
        error_db = LEVEL_ERROR_DB if level_error_db is None else level_error_db
        return reports_of_database(opened, error_db), opened.plan
    _refuse("--level-error", level_error_db, path, "a radio-route database, whose levels have one")
    if not _is_fingerprints(path) and all(is_log(one) for one in _journeys(path)):
        _refuse("--crs", crs, path, "none, as track logs have theirs")
    return read_reports(path, crs)[0], None


def read_reports(
    path: Path,
    crs: str | None,
    plan: CellPlan | None = None,
    options: OpenOptions = WITHOUT_STEPS,
) -> tuple[Reports, Sequence[str]]:
    """Return the reports of logs, recordings or a table, and the name of each block.

    Parameters
    ----------
    crs : str, optional
        For recordings, and for metres in a table.
    plan : CellPlan, optional
        Gives cells its ids.
    options : OpenOptions
        How recordings are read: a plain CSV with columns of fields is no table. Ground truth is
        that of one recording.

    Raises
    ------
    InputError
        With the faults of all logs.
    ConfigError
        There is a zone, a column, an offset or a ground truth for what is no recording, or a zone,
        an offset or a ground truth for several.
    """
    if not options.columns and _is_fingerprints(path):
        _check_recording(path, "a table of fingerprints", options)
        return read_fingerprint_table(path, crs), ()
    journeys = _journeys(path)
    several = number_of(len(journeys), "journey")
    if all(is_log(one) for one in journeys):
        _check_recording(path, several if len(journeys) > 1 else "a track log", options)
    elif options.combine.truth and len(journeys) > 1:
        _check_recording(path, several, replace(options, columns={}))
    faults, logs, names = Faults(), list[TrackLog](), list[str]()
    for one in journeys:
        try:
            frame = crs or (logs[0].crs if logs else "")
            opened = open_log(one, crs=frame, plan=plan, options=options)
        except MapfilterError as error:
            faults.take(error)
        else:
            log = _with_positions(opened.log)
            logs.append(log if plan is None else with_range_notes(log, plan))
            names.append(opened.name)
    faults.raise_if_any(InputError)
    with noted(note for log in logs for note in log.notes):
        return reports_of_logs(logs, plan), names


def _refuse(option: str, given: object, path: Path, expected: str) -> None:
    """Refuse an option that has no effect on a database."""
    if given is not None:
        raise fail(ConfigError, f"{option} of {path}", expected, str(given))


def _check_recording(path: Path, got: str, options: OpenOptions) -> None:
    """Refuse options that only one recording can have."""
    faults = Faults()
    of_recordings = {
        "--zone": options.zone,
        "--truth": options.combine.truth,
        "--offset": options.combine.offsets_s,
        "--column": options.columns,
    }
    for option, given in of_recordings.items():
        if given:
            faults.add(f"{option} of {path}", "a recording of one journey", got)
    faults.raise_if_any(ConfigError)


def _journeys(path: Path) -> list[Path]:
    """Return the logs of a folder, or its recordings: each is a visit of its own."""
    found = list_journeys(path)
    if found == [path] and path.is_dir() and not is_log(path):
        return [one for one in sorted(path.iterdir()) if one.is_file() and format_of(one)]
    return found


def _with_positions(log: TrackLog) -> TrackLog:
    """Return a log whose ground truth is the GNSS fixes, where it has no other."""
    if len(log.truth) or log.gnss.empty:
        return log
    fixes = log.gnss[["time_s", "east_m", "north_m"]]
    note = "positions by GNSS taken for the truth, as there is no other"
    return replace(log, truth=fixes.drop_duplicates("time_s"), notes=(*log.notes, note))


def _is_fingerprints(path: Path) -> bool:
    """Return whether a file is a table with a column for each transmitter."""
    if not is_table(path):
        return False
    try:
        text = read_text(path, _PEEKED_BYTES)
    except InputError:
        return True
    found = find_format(text)
    if found is not plain_csv.FORMAT:
        return found is None and not is_log(path.parent)
    # Times and positions are in both; levels in one column are those of a recording.
    names = header_names(text.first_line, likely_separator(text.first_line))
    levels = {*FIELDS["level_dbm"], *FIELDS["bars"], *FIELDS["cell"]}
    return not levels & set(names)
