"""Locate a log as ``mapfilter replay`` does: default options, and what the log itself states."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from mapfilter.database.store import open_database
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.estimate import PositionedTrack
from mapfilter.positioning.filter import locate
from mapfilter.positioning.log_options import by_streets_alone, fitted_to_log
from mapfilter.tracks.identify import name_by_plan
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.placeless import in_frame


def locate_log(
    log: TrackLog,
    database: Path,
    rng: np.random.Generator,
    options: BayesFilter | None = None,
    *,
    smooth: bool = False,
) -> PositionedTrack:
    """Locate a log over a database from an unknown start.

    Parameters
    ----------
    options : BayesFilter, optional
        The defaults when left out; what the log states takes the place of defaults.
    smooth : bool
        Whether positions are smoothed by the whole log.
    """
    opened = open_database(database)
    named = name_by_plan(in_frame(log, opened.lattice.crs), opened.plan)
    fitted, _ = fitted_to_log(options or BayesFilter(), named)
    alone = by_streets_alone(fitted, named, opened)
    positioner = _over(database, fitted, alone)
    return locate(named, replace(positioner, smooth=smooth), rng)


# Tasks of one process share the map, which takes seconds to read.
@lru_cache(maxsize=2)
def _over(database: Path, options: BayesFilter, alone: bool) -> BayesPositioner:
    opened = open_database(database)
    return options.over(opened.without_cells() if alone else opened)
