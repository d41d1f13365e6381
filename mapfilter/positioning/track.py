"""What locating one log gives."""

from __future__ import annotations

from dataclasses import dataclass

from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class PositionedTrack:
    """One log, located.

    Parameters
    ----------
    estimate : TrackEstimate
        A fix per epoch and a reason for every reading not used.
    snapshots : tuple of Snapshot
        What the filter held on its way until it switched (or failed).
    filter_s : float
        Processor time that the filter took, databases already in memory.
    """

    estimate: TrackEstimate
    snapshots: tuple[Snapshot, ...]
    filter_s: float
