"""Locate a log as ``mapfilter replay`` does: default options, and what the log itself states."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.log_options import by_streets_alone, fitted_to_log
from mapfilter.positioning.loop import locate
from mapfilter.positioning.positioned_track import PositionedTrack
from mapfilter.tracks.checks.placeless import in_frame
from mapfilter.tracks.joining.identify import name_by_plan
from mapfilter.tracks.log import TrackLog


@dataclass(frozen=True, eq=False)
class OpenMap:
    """A database that was opened once, and the filters over it that were asked for.

    Reading the area of a filter takes seconds, so several logs share it.
    """

    database: RadioRouteDatabase
    path: Path
    filters: dict[tuple[BayesFilter, bool], BayesPositioner] = field(default_factory=dict)

    @classmethod
    def open(cls, path: Path) -> OpenMap:
        """Open a database."""
        return cls(open_database(path), path)

    def filter_of(self, options: BayesFilter, *, alone: bool) -> BayesPositioner:
        """Return the filter with these options, by the streets alone if asked for."""
        key = options, alone
        if key not in self.filters:
            database = self.database.without_cells() if alone else self.database
            self.filters[key] = options.over(database)
        return self.filters[key]


def locate_log(
    log: TrackLog,
    over: OpenMap,
    rng: np.random.Generator,
    options: BayesFilter | None = None,
    *,
    smooth: bool = False,
    white_ranges: bool = False,
) -> PositionedTrack:
    """Locate a log over a database from an unknown start.

    Parameters
    ----------
    options : BayesFilter, optional
        The defaults when left out; what the log states takes the place of defaults.
    smooth : bool
        Whether positions are smoothed by the whole log.
    white_ranges : bool
        Whether errors of pseudoranges are white, of the sizes that the log states.
    """
    database = over.database
    named = name_by_plan(in_frame(log, database.lattice.crs), database.plan)
    fitted, _ = fitted_to_log(options or BayesFilter(), named)
    positioner = over.filter_of(fitted, alone=by_streets_alone(fitted, named, database))
    if white_ranges:
        positioner = replace(positioner, satellites=with_white_ranges(positioner.satellites))
    return locate(named, replace(positioner, smooth=smooth), rng)


def with_white_ranges(options: GnssOptions) -> GnssOptions:
    """Return options by which no satellite has a lasting error, reflected or not."""
    return replace(options, echo_m=0.0, reflection_m=0.0, reflection_times=0.0)
