"""One log located: its estimate, and the hypotheses that were held on the way."""

from __future__ import annotations

from dataclasses import dataclass, field

from mapfilter._same import EqualByContent
from mapfilter._types import Floats
from mapfilter.filters.contract import Status
from mapfilter.positioning.estimate import TrackEstimate


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot(EqualByContent):
    """The hypotheses that a filter held at one moment.

    Parameters
    ----------
    time_s : float
        Seconds since the start of the log.
    travelled_m : float
        Distance by dead reckoning since the start.
    hypothesis_east_m, hypothesis_north_m, weight : (n,) arrays
        Hypotheses and their shares of the belief (they sum to one).
    east_m, north_m : float
        The estimate; NaN while there is none.
    status : Status
        The filter's status.
    """

    time_s: float
    travelled_m: float
    hypothesis_east_m: Floats
    hypothesis_north_m: Floats
    weight: Floats
    east_m: float
    north_m: float
    status: Status


@dataclass(frozen=True, slots=True, eq=False)
class PositionedTrack(EqualByContent):
    """One log, located.

    Parameters
    ----------
    estimate : TrackEstimate
        A fix per epoch and a reason for every reading not used.
    snapshots : tuple of Snapshot
        Hypotheses at some epochs until the filter converged.
    filter_s : float
        Processor time that the filter took, databases already in memory. Tracks that took another
        time are equal.
    """

    estimate: TrackEstimate
    snapshots: tuple[Snapshot, ...]
    filter_s: float = field(compare=False)
