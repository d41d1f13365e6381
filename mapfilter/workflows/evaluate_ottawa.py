"""``mapfilter evaluate ottawa``: real sessions, each found on the map that the others made."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapfilter._io import ensure_writable_folder, write_json
from mapfilter._parallel import Progress
from mapfilter.database.store import open_database
from mapfilter.errors import InputError, fail
from mapfilter.experiments.benchmarks.ottawa import (
    FOLDER,
    LEFT_OUT,
    PARTS,
    FoundSession,
    OttawaOptions,
    centroid_errors_m,
    find_session,
    surveyed_positioner,
)
from mapfilter.experiments.benchmarks.ottawa_sessions import Session, read_session
from mapfilter.experiments.benchmarks.ottawa_table import (
    PartRow,
    SessionRow,
    part_rows,
    session_rows,
)
from mapfilter.radio.rasters import open_rasters
from mapfilter.workflows.build import run_build
from mapfilter.workflows.facts import facts
from mapfilter.workflows.sections import Config
from mapfilter.workflows.survey import run_survey

TABLE = "table.json"
RUNS = 3
_FLOOR_DBM = -130.0
_HALF_WIDTH_M = 15.0


@dataclass(frozen=True)
class OttawaResult:
    """What came of all sessions.

    Parameters
    ----------
    seed, runs : int
        Of the noise; draws of it for each session.
    rows : tuple of PartRow
    sessions : tuple of SessionRow
    seconds : float
        Wall time.
    out : Path
    """

    seed: int
    runs: int
    rows: tuple[PartRow, ...]
    sessions: tuple[SessionRow, ...]
    seconds: float
    out: Path


def run_ottawa(
    data: Path,
    out: Path,
    *,
    runs: int = RUNS,
    seed: int = 0,
    parts: Sequence[str] = PARTS,
    options: OttawaOptions | None = None,
    progress: Progress | None = None,
) -> OttawaResult:
    """Leave each session out, build map and ways from the others, and find it.

    Parameters
    ----------
    data : Path
        Holds the folder ``cell-ottawa-lte`` with a folder for each part.
    out : Path
        Gets a folder for each part and session with its survey and database, and ``table.json``.
    runs : int
        Draws of the noise for each session.
    seed : int
    parts : sequence of str
    options : OttawaOptions, optional
    progress : callable, optional
        Called with sessions done and sessions in all.

    Raises
    ------
    InputError
        The data set is not there, or a file of it is no session.
    OutputError
        The output cannot be written.
    """
    began_s = time.perf_counter()
    chosen = options or OttawaOptions()
    ensure_writable_folder(out)
    sessions = {part: _sessions(data, part) for part in parts}
    total, done = sum(map(len, sessions.values())), 0
    rows: list[PartRow] = []
    told: list[SessionRow] = []
    for part, every in sessions.items():
        found: list[FoundSession] = []
        centroid_m = {}
        for session in every:
            others = [other for other in every if other is not session]
            made = _map_of(others, out / part / session.name)
            positioner = surveyed_positioner(
                open_database(made.database), others, chosen, made.level_sd_db
            )
            for draw in range(runs):
                found += find_session(part, session, positioner, chosen, seed, draw)
            crs = positioner.area.lattice.crs
            centroid_m[session.name] = centroid_errors_m(session, others, crs)
            done += 1
            if progress is not None:
                progress(done, total)
        rows += part_rows(part, found, centroid_m)
        told += session_rows(found, centroid_m)
    seconds = time.perf_counter() - began_s
    result = OttawaResult(seed, runs, tuple(rows), tuple(told), seconds, out)
    write_json(out / TABLE, facts(result))
    return result


@dataclass(frozen=True)
class _Made:
    """A map: its database, and by how much a new reading differs from its levels."""

    database: Path
    level_sd_db: float


def _sessions(data: Path, part: str) -> list[Session]:
    folder = data / FOLDER / part
    files = [path for path in sorted(folder.glob("*.csv")) if not path.name.startswith(LEFT_OUT)]
    if len(files) < 2:
        expected = "CSV files of two sessions or more"
        hint = f"--data is the folder that holds {FOLDER}"
        raise fail(InputError, str(folder), expected, len(files), hint)
    return [read_session(path) for path in files]


def _map_of(others: Sequence[Session], folder: Path) -> _Made:
    """Make levels, ways and database of sessions, as drive tests without a street map are."""
    files = [str(other.path.absolute()) for other in others]
    survey = {"files": files, "cross_validate": False}
    config = Config.model_validate(
        {
            "area": {"map": "none"},
            "prediction": {"model": "survey", "survey": survey},
            "roads": {"half_width_m": _HALF_WIDTH_M, "tracks": {"files": files}},
            "database": {"floor_dbm": _FLOOR_DBM},
            "output": {"dir": str(folder.absolute()), "pictures": "none"},
        },
        context={"folder": Path.cwd()},
    )
    surveyed = run_survey(config)
    built = run_build(config)
    deviation_db = open_rasters(surveyed.deviation).read()
    return _Made(built.database, float(np.sqrt(np.nanmedian(deviation_db**2))))
