"""Notes on fixes without errors, and on motion without directions."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from mapfilter._words import number_of
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.epochs import FIX_SD_M
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.sensors.undirected import APART_M, APART_SD
from mapfilter.tracks.log import TrackLog


def assumed_note(log: TrackLog, options: Any, uses: Collection[str]) -> tuple[str, ...]:
    """Return a note on the error that a filter takes for fixes without one; none without any.

    Parameters
    ----------
    log : TrackLog
    options
        Of the filter; of a custom one nothing is known.
    uses : collection of str
        Kinds of measurements that the filter uses.
    """
    if "gnss" not in uses or log.gnss.empty:
        return ()
    variance_m2 = log.gnss[["var_east_m2", "var_north_m2"]].to_numpy(dtype=np.float64)
    unstated = int((~(variance_m2 > 0)).any(axis=1).sum())
    if not unstated or not isinstance(options, KalmanFilter | BayesFilter):
        return ()
    if isinstance(options, KalmanFilter):
        assumed_m, by = options.fix_sd_m, "filter.kalman.fix_sd_m; "
    else:
        assumed_m, by = FIX_SD_M, ""
    return (
        f"gnss: {number_of(unstated, 'fix', 'fixes')} without an error: a standard deviation of "
        f"{assumed_m:g} m east and north is assumed ({by}in a CSV a column accuracy_m gives it)",
    )


def undirected_notes(log: TrackLog, options: Any) -> tuple[str, ...]:
    """Return a note on what follows where no row of a log has a direction.

    Parameters
    ----------
    log : TrackLog
    options
        Of the filter.
    """
    motion = log.motion
    moves = bool((motion["step_m"].fillna(0.0) != 0).any())
    # The first row turns by nothing.
    turned = motion["turn_rad"].iloc[1:].notna().any() or motion["heading_rad"].notna().any()
    placed = len(log.gnss) or len(log.pseudoranges)
    if not isinstance(options, BayesFilter) or turned or not moves:
        return ()
    lacking = "motion: no headings and no turns at all (a yaw rate, turns or a compass)"
    if options.vehicle and not isinstance(options, GridFilter):
        return (f"{lacking}: hypotheses follow the ways, and are soon on many of them",)
    if not placed:
        return ()
    return (
        f"{lacking}: of positions "
        f"less than {APART_SD:g} of their deviations, or {APART_M:g} m, of way apart only the "
        "first is used: without directions the others would be taken for errors that last",
    )
