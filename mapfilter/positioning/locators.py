"""From a filter's options to a function that locates logs: the seam that all commands share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.filters.candidate import CandidateOptions
from mapfilter.positioning.bayes.options import BayesOptions, open_area
from mapfilter.positioning.bayes.replay import position_by_bayes
from mapfilter.positioning.candidate import (
    PositionedTrack,
    cell_points,
    position_by_candidates,
)
from mapfilter.positioning.custom_filter import CustomFilter, make_filter, position_by_own
from mapfilter.tracks.log import TrackLog

Locator = Callable[[TrackLog, np.random.Generator], PositionedTrack]
"""Locates one log; what it read of the database is kept and shared by all logs."""


@dataclass(frozen=True, slots=True)
class FilterChoice:
    """Which filter, and how it is set; the kind of the options tells the filter.

    Parameters
    ----------
    options : CandidateOptions, BayesOptions or CustomFilter
    margin_db : float, optional
        A point belongs to every cell within this margin of its best server; None takes the
        margin that the database was built with.
    """

    options: CandidateOptions | BayesOptions | CustomFilter = field(
        default_factory=CandidateOptions
    )
    margin_db: float | None = None

    @property
    def name(self) -> str:
        """The filter's name, as estimates and commands call it."""
        match self.options:
            case CandidateOptions():
                return "candidate"
            case BayesOptions() as options:
                return "grid" if options.grid else "bayes"
            case CustomFilter() as own:
                return own.name


def open_locator(
    database: RadioRouteDatabase, choice: FilterChoice, *, ways: bool = True
) -> Locator:
    """Return the function that locates logs on a database by a filter.

    Parameters
    ----------
    database : RadioRouteDatabase
    choice : FilterChoice
    ways : bool
        Whether positions are matched to ways; success and errors do not need it.

    Examples
    --------
    >>> choice = FilterChoice(CandidateOptions(threshold=1), margin_db=0.0)
    >>> choice.name
    'candidate'
    """
    match choice.options:
        case CandidateOptions() as options:
            points_of = cell_points(database, choice.margin_db)

            def locate(log: TrackLog, rng: np.random.Generator) -> PositionedTrack:
                return position_by_candidates(database, points_of, log, options, rng, ways=ways)

            return locate
        case BayesOptions() as bayes:
            positioner = bayes.over(open_area(database))

            def locate_by_bayes(log: TrackLog, rng: np.random.Generator) -> PositionedTrack:
                return position_by_bayes(positioner, log, rng, smooth=bayes.smooth, pictures=ways)

            return locate_by_bayes
        case CustomFilter() as own:
            made = make_filter(own, database)

            def locate_by_own(log: TrackLog, rng: np.random.Generator) -> PositionedTrack:
                return position_by_own(database, made, log, rng, name=own.name, ways=ways)

            return locate_by_own
