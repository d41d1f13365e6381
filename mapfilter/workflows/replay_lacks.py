"""What a log lacks to be located, and logs that lie elsewhere."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import Faults, listed
from mapfilter.geodesy import Lattice, same_crs, short_crs
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.log_options import by_streets_alone
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.misplaced import check_near
from mapfilter.tracks.open_log import OpenedLog
from mapfilter.tracks.placeless import LOCAL_FRAME, LOCAL_FRAME_HINT, is_local_frame
from mapfilter.tracks.readers import plain_csv
from mapfilter.tracks.readers.csv_fields import MOTION_FIELDS
from mapfilter.tracks.schema import PLACE, SERVING

_MOTION_COLUMNS = (
    "columns step_m, steps (with compass_deg, turn_rad, turn_deg or a yaw rate), wheel_speed_mps "
    "or wheel_speed_kmh"
)
_BY_CELLS = ("candidate", "grid")
_BY_STREETS = "--filter bayes starts by the streets alone"


def check_log(path: Path, log: TrackLog, lattice: Lattice, faults: Faults) -> None:
    """Note a log in another CRS than the database, or far outside its lattice.

    Its truth, or its GNSS fixes, may not all lie more than 5 km outside.
    """
    if not same_crs(log.crs, lattice.crs):
        expected = f"{short_crs(lattice.crs)}, the database's"
        local = is_local_frame(log.crs)
        hint = LOCAL_FRAME_HINT if local else "log of another area or zone"
        if not local and short_crs(log.crs) == "unknown":
            hint = f"convert it with --crs {short_crs(lattice.crs)}"
        faults.add(f"{path}, crs", expected, LOCAL_FRAME if local else log.crs, hint)
        return
    for table in ("truth", "gnss"):
        places = getattr(log, table)
        east_m, north_m = places["east_m"].to_numpy(), places["north_m"].to_numpy()
        check_near(f"{path}, {table}", east_m, north_m, lattice, faults)


def lack_of(
    opened: OpenedLog,
    log: TrackLog,
    options: Any,
    estimate: TrackEstimate,
    database: RadioRouteDatabase | None,
) -> str:
    """Return what a log lacks that was not located, with a remedy; else an empty text.

    Parameters
    ----------
    opened : OpenedLog
        The log as it was opened, with its sensors and recordings.
    log : TrackLog
        What of it the filter was given.
    options
        Of the filter.
    database : RadioRouteDatabase or None
        None where the filter only takes sites.
    """
    if estimate.converged_at is not None:
        return ""
    if isinstance(options, KalmanFilter):
        return f"too little was measured{_unused_ranges(log)}"
    has_cells = database is None or bool(database.cell_ids)
    if database is not None and by_streets_alone(options, log, database):
        has_cells = False
    lack = lacking(log, estimate, cells=has_cells, turns=isinstance(options, BayesFilter))
    name = str(getattr(options, "name", ""))
    if lack and not has_cells and name in _BY_CELLS:
        return f"the filter {name} needs cells to start, the database has none ({_BY_STREETS})"
    alone = database is not None and by_streets_alone(BayesFilter(), log, database)
    if lack and name in _BY_CELLS and alone:
        return f"{lack} ({_BY_STREETS})"
    if "no motion" not in lack:
        return lack
    columns = columns_of_motion(opened)
    if source := receiver_motion(opened):
        return f"{lack} (--course-motion, track.course_motion, makes it from {source}){columns}"
    if has_cells and len(log.radio):
        return f"{lack} (mapfilter locate needs none){columns}"
    return f"{lack}{columns}"


def columns_of_motion(opened: OpenedLog) -> str:
    """Return which columns of motion tables were looked for, and which others there are."""
    tables = [one for one in opened.recordings if one.format == plain_csv.FORMAT.name]
    if not tables:
        return ""
    text = f"; looked for {_MOTION_COLUMNS}"
    for one in tables:
        found = [field for field in MOTION_FIELDS if field in one.fields]
        text += f"; {one.path.name} has {', '.join(found) or 'none of them'}"
        text += f", columns not used: {listed(one.unread)} (--column)" if one.unread else ""
    return text


def fixes_note(
    opened: OpenedLog,
    log: TrackLog,
    truth: Collection[Path],
    uses: Collection[str],
    estimate: TrackEstimate,
) -> tuple[str, ...]:
    """Return a note on positions of recordings that the filter took for GNSS fixes; none without.

    Parameters
    ----------
    opened : OpenedLog
        The log as it was opened.
    log : TrackLog
        What of it the filter was given.
    truth : collection of Path
        Recordings whose positions are the truth.
    uses : collection of str
        Kinds of measurements that the filter uses.
    """
    measured = (one for one in opened.recordings if one.path not in truth)
    placed = [one for one in measured if {"positions", "places"} & set(one.tables)]
    if not placed or log.gnss.empty or "gnss" not in uses:
        return ()
    unused = sum(one.readings for one in estimate.unused if one.kind == "gnss")
    names = listed([one.path.name for one in placed], 2)
    text = f"gnss: {len(log.gnss) - unused} of {len(log.gnss)} positions of {names} used as GNSS "
    text += "fixes; --without gnss leaves them out"
    return (text if len(log.truth) else f"{text}, --truth {placed[0].path.name} scores by them",)


def _unused_ranges(log: TrackLog) -> str:
    """Return why pseudoranges were of no use to a filter without a map; "" without any."""
    given = len(log.pseudoranges)
    if not given:
        return ""
    if log.pseudoranges[list(PLACE)].isna().any(axis=1).all():
        why = "their satellites have no places, for which the day's navigation file is needed"
        return f" ({given} pseudoranges: {why}; then the filter bayes uses them, over a map)"
    return f" ({given} pseudoranges: only the filter bayes uses them, over a map)"


def advice_of(log: TrackLog, options: Any, estimate: TrackEstimate) -> tuple[str, ...]:
    """Return notes on a log that streets alone did not locate.

    Parameters
    ----------
    options
        Of the filter, as fitted to the log.
    """
    by_streets = isinstance(options, BayesFilter) and not isinstance(options, GridFilter)
    if estimate.converged_at is not None or not by_streets:
        return ()
    along_m = float(log.motion["step_m"].abs().sum())
    notes = [
        f"never converged in {along_m:.0f} m: by streets alone it takes about a kilometre, with "
        "turns, all of it on the map"
    ]
    if not options.vehicle:
        notes.append(
            "motion taken for a walker's; where wheels, a camera or a lidar measured it, set "
            "filter.bayes.vehicle = true"
        )
    return tuple(notes)


def receiver_motion(opened: OpenedLog) -> str:
    """Return what positions of the log, or of its truth, make motion of; "" without them."""
    every = [r.tables.get("positions", r.tables.get("places")) for r in opened.recordings]
    placed = [rows for rows in every if rows is not None and rows["time_s"].nunique() > 1]
    courses = (rows["course_deg"] for rows in placed if "course_deg" in rows)
    if any(course.notna().any() for course in courses):
        return "speed and course"
    return "positions" if placed else ""


def lacking(
    log: TrackLog, estimate: TrackEstimate, *, cells: bool = True, turns: bool = False
) -> str:
    """Return the missing data of a log that was not located, or an empty text.

    Without ``cells`` in the database, motion is all that it needs. ``turns`` says whether the
    filter does without headings.
    """
    if estimate.converged_at is not None:
        return ""
    serving = (log.radio["role"] == SERVING) & log.radio["cell"].notna()
    moved = log.motion["step_m"].notna()
    lacks = []
    turned = log.motion[["heading_rad", "turn_rad"]].notna().any(axis=1) & moved
    if not cells:
        # The first row turns by nothing.
        if moved.any() and turned.sum() < 2:
            lacks.append("no headings and no turns")
        elif moved.any() and not (estimate.hypotheses > 0).any():
            lacks.append("too short a way with steps and headings, or turns")
    elif not serving.any() and not (estimate.hypotheses > 0).any():
        lacks.append("no serving cell")
    elif not (estimate.hypotheses > 0).any():
        lacks.append("no serving cell of which the database has points")
    if not moved.any():
        lacks.append("no motion")
    elif cells and not (moved & log.motion["heading_rad"].notna()).any() and not turned.any():
        lacks.append("no heading")
    elif cells and not (moved & log.motion["heading_rad"].notna()).any() and not turns:
        lacks.append("no heading (turns alone do not give one; the filter bayes needs none)")
    return " and ".join(lacks)
