"""Reports beyond the edge of an area, where what is predicted at the edge may hold, or nothing.

A hypothesis there keeps which of both holds: how much each explained so far. Were it drawn anew at
each report, the better of the two would explain each report, which no hypothesis in the area can.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

BEYOND_COST_PER_M = 0.03
"""Negative log-likelihood of each metre beyond the area, in a database with cells."""
_MOST_LOG_ODDS = 8.0
"""Bound of the log odds that are kept: either may begin to hold."""


class BeyondEdge(NamedTuple):
    """What a report says of hypotheses beyond the area.

    Parameters
    ----------
    gained : array of float, shape (M,)
        Log-likelihood of the report.
    log_odds : array of float, shape (M,)
        That nothing predicted holds, given the report.
    """

    gained: Any
    log_odds: Any


def beyond_edge(log_odds: Any, held: Any, unknown: float, arrays: Any = np) -> BeyondEdge:
    """Mix what a report says if the prediction at the edge holds, and if nothing does.

    Parameters
    ----------
    log_odds : array of float, shape (M,)
        That nothing predicted holds, before the report.
    held : array of float, shape (M,)
        Log-likelihood of the report by the prediction at the edge.
    unknown : float
        Log-likelihood of the report without any prediction.
    arrays : module
        NumPy, or the one of the arrays.
    """
    gained = arrays.logaddexp(held, log_odds + unknown) - arrays.logaddexp(0.0, log_odds)
    after = arrays.maximum(log_odds + unknown - held, -_MOST_LOG_ODDS)
    after = arrays.minimum(after, _MOST_LOG_ODDS)
    return BeyondEdge(gained, after)
