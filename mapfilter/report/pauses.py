"""Lines over the epochs of a track that end where there are none for a while."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats
from mapfilter.evaluation.outcome import pauses_s
from mapfilter.positioning.estimate import TrackEstimate


def broken_at_pauses(estimate: TrackEstimate, *columns: Floats) -> tuple[Floats, ...]:
    """Return columns with a value for each epoch, and NaN in each pause between two epochs.

    A line through them does not bridge the pause, in which nothing is known.
    """
    after = np.searchsorted(estimate.time_s, pauses_s(estimate)[:, 1])
    return tuple(np.insert(np.asarray(one, np.float64), after, np.nan, axis=0) for one in columns)
