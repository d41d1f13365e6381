"""The logs of a replay: read and checked before any is located, and kept where they are small."""

from __future__ import annotations

from pathlib import Path

from mapfilter._inputs import path_fault, shown
from mapfilter.config.sections import Config
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import ConfigError, Faults, InputError, MapfilterError, fail, noted
from mapfilter.lattice import Lattice
from mapfilter.positioning.kalman.siteless import needs_sites
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.checks.motion_fault import MotionFault
from mapfilter.tracks.checks.refused_motion import AS_HEADING, note_refused
from mapfilter.tracks.kinds import leave_out
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.open_log import OpenedLog
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.sensors import MOTION_TABLES
from mapfilter.workflows.inputs.logs import journeys_of, open_journey
from mapfilter.workflows.inputs.planned_cells import cells_of_unplaced_logs
from mapfilter.workflows.replays.lacks import check_log

_MOST_KEPT_ROWS = 1_000_000

_UNREAD, _DEGREES = ": not used: ", ("lat_deg", "lon_deg")
"""How a note begins on rows that were left out, and the columns of positions."""


class ReplayLogs:
    """The logs of a configuration, which are read for checks first.

    They are kept for what follows: recordings, as reading them may take long, and of others so many
    that they need little memory.
    """

    def __init__(self, config: Config, database: RadioRouteDatabase | None) -> None:
        self.config, self.paths = config, journeys_of(config)
        self._area = None if database is None else database.lattice
        self._sites: CellPlan | None = None
        self._kept: dict[Path, OpenedLog] = {}
        self._left_rows = _MOST_KEPT_ROWS

    def open(self, path: Path) -> OpenedLog:
        """Return a log in the frame of the database, or of the cells: kept, or read again."""
        if path in self._kept:
            return self._kept[path]
        opened = open_journey(self.config, path, self._area)
        if self._area is None and self.config.cells.plan is not None and _is_unplaced(opened.log):
            opened = open_journey(self.config, path, sites=self._sites_beside(opened.log.crs))
        tables = [getattr(opened.log, table) for table in TABLES]
        rows = sum(map(len, (*tables, *opened.sensors.values())))
        if opened.recordings or rows <= self._left_rows:
            self._kept[path] = opened
            self._left_rows -= rows
        return opened

    def _sites_beside(self, frame: str) -> CellPlan:
        """Return the cells of the configuration, by whose places logs without any are turned."""
        if self._sites is None:
            self._sites = cells_of_unplaced_logs(self.config, frame)
        return self._sites

    def check(self, lattice: Lattice | None) -> None:
        """Read every log before any is located, so that all faults come before any result.

        Parameters
        ----------
        lattice : Lattice or None
            Of the database; None without one.
        """
        faults = Faults()
        for path in self.paths:
            if wrong := path_fault(path):
                faults.add("logs", wrong, shown(str(path)))
                continue
            before = len(faults.found)
            try:
                opened = self.open(path)
                self._check_motion(path, opened, faults)
                if lattice is not None:
                    check_log(path, opened.log, lattice, faults)
            except ConfigError:
                raise
            except MapfilterError as error:
                # Those of the cell plan are the same for every log.
                if any(one not in faults.found for one in error.faults):
                    faults.take(error)
            else:
                faults.notes += opened.log.notes if len(faults.found) > before else ()
        faults.raise_if_any(InputError)

    def _check_motion(self, path: Path, opened: OpenedLog, faults: Faults) -> None:
        """Note columns of motion that the log's fixes prove to be of another unit or sense."""

        def mends(fault: MotionFault) -> tuple[str, str]:
            mended = f"{fault.option} mends it"
            if fault.remedy and not opened.recordings:
                # A column of a recording is none of the log that was made of it.
                mended = f"convert the recording again with {fault.option}, or write {AS_HEADING}"
            return mended, f"--factor {fault.column}=1"

        moved = [one.path for one in opened.recordings if MOTION_TABLES & set(one.tables)] or [path]
        given = self.config.track.factors.given
        note_refused(opened.log, given, ", ".join(map(str, moved)), mends, faults)

    def check_siteless(self) -> None:
        """Refuse logs that a filter without a map can only locate by the sites of their cells."""
        for path in self.paths:
            log = leave_out(self.open(path).log, self.config.track.without)
            if not needs_sites(log):
                continue
            with noted(log.notes):
                for note in log.notes:
                    _, unread, why = note.partition(_UNREAD)
                    if unread and any(name in why for name in _DEGREES):
                        expected = "positions, or the sites of cells (cells.plan, or --db)"
                        raise fail(InputError, shown(path.name), expected, f"none used of {why}")
                hint = (
                    f"{shown(path.name)} has no positions to start from, and filters without a map "
                    "take the sites of its cells from there, or from a database (--db)"
                )
                raise fail(ConfigError, "cells.plan", "a cell plan", "none", hint)


def _is_unplaced(log: TrackLog) -> bool:
    """Return whether a log has no positions by which its place is known."""
    return bool(log.truth.empty and log.gnss.empty)
