"""What a log lacks that a filter did not locate, and logs of another area."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import Faults, listed
from mapfilter.filters.contract import Status
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.kalman.models import KalmanOptions
from mapfilter.positioning.log_options import by_streets_alone
from mapfilter.tracks.checks.misplaced import check_near
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import PLACE, SERVING

if TYPE_CHECKING:
    import pandas as pd

NO_MOTION = "no motion"
POSITIONS_ALONE = f"{NO_MOTION}: positions alone are followed"
REPORTS_ALONE = f"{NO_MOTION} and no positions: a track needs one of them"

_WIDEST_PX_M = 10.0
"""Pixels of the database that ways are followed on; on those of 15 m few drives were located."""

_BY_CELLS = ("candidate", "grid")
_BY_STREETS = "the filter bayes starts by the streets alone"


def lack_of_log(
    log: TrackLog, options: Any, estimate: TrackEstimate, database: RadioRouteDatabase | None
) -> str:
    """Return what a log lacks that was not located, else an empty text.

    Parameters
    ----------
    log : TrackLog
        What the filter was given.
    options
        Of the filter.
    database : RadioRouteDatabase or None
        None where the filter only takes sites.
    """
    if estimate.converged_at is not None:
        return ""
    if isinstance(options, KalmanOptions):
        if log.gnss.empty and log.radio.empty and log.tdoa.empty:
            scored = " (those of the truth serve for scores only)" if len(log.truth) else ""
            return f"no positions and no radio to start from{scored}{_unused_ranges(log)}"
        return f"too little was measured{_unused_ranges(log)}"
    has_cells = database is None or bool(database.cell_ids)
    if database is not None and by_streets_alone(options, log, database):
        has_cells = False
    known = () if database is None else database.cell_ids
    by_turns = isinstance(options, BayesFilter)
    lack = lacking(log, estimate, cells=has_cells, turns=by_turns, known=known)
    name = str(getattr(options, "name", ""))
    if lack and not has_cells and name in _BY_CELLS:
        return f"the filter {name} needs cells to start, the database has none ({_BY_STREETS})"
    alone = database is not None and by_streets_alone(BayesFilter(), log, database)
    if lack and name in _BY_CELLS and alone:
        return f"{lack} ({_BY_STREETS})"
    return lack


def follows_positions(log: TrackLog, options: Any, estimate: TrackEstimate) -> bool:
    """Return whether a map filter located a log without motion, by its positions alone."""
    if estimate.converged_at is None or not isinstance(options, BayesFilter):
        return False
    if is_of_reports_alone(log, options, estimate):
        return False
    return not log.motion["step_m"].notna().any()


def is_of_reports_alone(log: TrackLog, options: Any, estimate: TrackEstimate) -> bool:
    """Return whether a map filter started in a log that has reports, but nothing to follow by.

    Without motion and positions each report can be located by itself as well, or better.
    """
    by_map = isinstance(options, BayesFilter) or getattr(options, "name", "") in _BY_CELLS
    return estimate.converged_at is not None and by_map and has_reports_alone(log)


def has_reports_alone(log: TrackLog) -> bool:
    """Return whether a log has reports of cells, and neither motion nor positions nor ranges."""
    others = (log.gnss, log.pseudoranges, log.tdoa, log.motion["step_m"].dropna())
    return len(log.radio) > 0 and not any(map(len, others))


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
    """Return notes on a log with motion that streets alone did not locate.

    Parameters
    ----------
    options
        Of the filter, as fitted to the log.
    """
    by_streets = isinstance(options, BayesFilter) and not isinstance(options, GridFilter)
    if estimate.converged_at is not None or not by_streets:
        return ()
    along_m = float(log.motion["step_m"].abs().sum())
    if not along_m:
        return ()
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


def coarse_pixels_note(
    options: Any, estimate: TrackEstimate, database: RadioRouteDatabase | None
) -> tuple[str, ...]:
    """Return a note where a map's pixels are too coarse and a log was lost; empty otherwise.

    The map weighs positions some metres beside a way. Pixels that are wider than the ways put
    positions on a way beside it, as if all of the map were wrong.

    Parameters
    ----------
    options
        Of the filter.
    """
    if database is None or not isinstance(options, BayesFilter) or not estimate.status:
        return ()
    pixel_m = database.lattice.resolution_m
    if pixel_m <= _WIDEST_PX_M:
        return ()
    gone = [status in (Status.LOST, Status.OUTSIDE) for status in estimate.status]
    if not gone[-1] and 2 * sum(gone) <= len(gone):
        return ()
    share = sum(gone) / len(gone)
    return (
        f"{Status.LOST} or {Status.OUTSIDE} in {share:.0%} of the epochs (likely: pixels of "
        f"{pixel_m:g} m in the database, on which ways cannot be followed; build it on pixels of "
        f"{_WIDEST_PX_M:g} m or less, with rasters.resolution_m and rasters.resampling = "
        '"bilinear", or area.resolution_m for predicted rasters)',
    )


def lacking(
    log: TrackLog,
    estimate: TrackEstimate,
    *,
    cells: bool = True,
    turns: bool = False,
    known: Sequence[str] = (),
) -> str:
    """Return the missing data of a log that was not located, or an empty text.

    Without ``cells`` in the database, motion is all that it needs. ``turns`` says whether the
    filter does without headings. ``known`` are the cells of the database.
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
        names = _names(log.radio.loc[serving, "cell"], known)
        lacks.append(f"no serving cell of which the database has points{names}")
    if not moved.any():
        lacks.append(NO_MOTION)
    elif cells and not turned.any():
        lacks.append("no heading")
    elif cells and not (moved & log.motion["heading_rad"].notna()).any() and not turns:
        lacks.append("no heading (turns alone do not give one; the filter bayes needs none)")
    return " and ".join(lacks)


def _names(served: pd.Series, known: Sequence[str]) -> str:
    """Return the cells of a log, the most frequent ones first, and some of the database."""
    if not known:
        return ""
    found = [str(cell) for cell in served.value_counts().index]
    same = {cell.casefold() for cell in found} & {cell.casefold() for cell in known}
    capitals = "; some differ by capitals alone" if same else ""
    return f" (the log has {listed(found, 3)}; the database has {listed(known, 3)}{capitals})"


def check_places(where: str, log: TrackLog, lattice: Lattice, faults: Faults) -> None:
    """Note ground truth or GNSS fixes that all lie more than 5 km outside of a database's area."""
    for table in ("truth", "gnss"):
        places = getattr(log, table)
        east_m, north_m = places["east_m"].to_numpy(), places["north_m"].to_numpy()
        check_near(f"{where}, {table}", east_m, north_m, lattice, faults)
