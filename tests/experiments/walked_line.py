"""A straight walk and estimates of it with stated errors, radii and statuses."""

import numpy as np
import pandas as pd

from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.benchmarks.journeys import Walk
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.positioned_track import PositionedTrack
from mapfilter.positioning.step_output import Fix

CRS = "EPSG:32629"
STATUS = {
    "S": Status.SEARCHING,
    "C": Status.CONVERGED,
    "T": Status.TRACKING,
    "L": Status.LOST,
}


def line(last_s, speed_mps=10.0):
    """East at constant speed, one row a second."""
    time_s = np.arange(last_s + 1.0)
    return pd.DataFrame({"time_s": time_s, "east_m": speed_mps * time_s, "north_m": 0.0 * time_s})


def truth_of(table):
    return Truth(*(table[name].to_numpy() for name in ("time_s", "east_m", "north_m")))


def estimate(
    table, statuses, errors_m, radii_m=(10.0, 20.0, 30.0), time_s=None, levels_m=None, wide_m=None
):
    """One epoch a second from the first row on, off to the north."""
    truth = truth_of(table)
    times = np.arange(float(len(statuses))) if time_s is None else np.asarray(time_s, dtype=float)
    errors = np.broadcast_to(np.asarray(errors_m, dtype=float), times.shape)
    radii = np.broadcast_to(np.asarray(radii_m, dtype=float), (times.size, 3))
    levels = np.broadcast_to(np.nan if levels_m is None else levels_m, times.shape)
    wide = np.broadcast_to(np.nan if wide_m is None else wide_m, times.shape)
    east = np.interp(times, truth.time_s, truth.east_m)
    north = np.interp(times, truth.time_s, truth.north_m)
    fixes = [
        Fix(
            times[i],
            east[i],
            north[i] + errors[i],
            np.eye(2),
            radii[i],
            STATUS[statuses[i]],
            1,
            1.0,
            0,
            0.0,
            Reason.USED,
            wide[i],
            levels[i],
        )
        for i in range(times.size)
    ]
    return TrackEstimate.of_fixes(CRS, "bayes", fixes)


def located(found, seconds=0.5):
    return PositionedTrack(found, (), seconds)


def walked(table, displaced_at_s=float("inf")):
    return Walk(table, displaced_at_s)
