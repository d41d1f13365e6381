"""What is assumed of fixes that state no error."""

from __future__ import annotations

from collections.abc import Collection
from math import sqrt
from typing import Any

import numpy as np

from mapfilter._words import number_of
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.fixes import widened
from mapfilter.positioning.kalman.filter import KalmanFilter
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
        assumed_m, by = sqrt(widened(GnssFix(0.0, 0.0), 1.0).var_east_m2), ""
    return (
        f"gnss: {number_of(unstated, 'fix', 'fixes')} without an error: a standard deviation of "
        f"{assumed_m:g} m east and north is assumed ({by}in a CSV a column accuracy_m gives it)",
    )
