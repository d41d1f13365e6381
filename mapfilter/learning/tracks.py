"""Tracks of journeys as learning needs them: where, how sure, and whether to be used."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter.learning.visits import Placed
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.merging import epochs
from mapfilter.tracks.log import TrackLog

TRUTH_RADIUS_M = 5.0
_NAMES = ("time_s", "east_m", "north_m", "radius_m")


@dataclass(frozen=True, eq=False)
class JourneyTrack:
    """A smoothed track.

    Parameters
    ----------
    time_s, east_m, north_m : (N,) arrays
        NaN where there is no position.
    radius_m : (N,) array
        Radius that holds the position with 95 %.
    """

    time_s: Floats
    east_m: Floats
    north_m: Floats
    radius_m: Floats

    @classmethod
    def of_estimate(cls, estimate: TrackEstimate) -> JourneyTrack:
        """Return the positions of an estimate."""
        return cls(estimate.time_s, estimate.east_m, estimate.north_m, estimate.radii_m[:, 2])

    @classmethod
    def of_truth(cls, log: TrackLog) -> JourneyTrack:
        """Return the true track of a log, taken to be known within 5 m."""
        time_s, east_m, north_m = (
            log.truth[name].to_numpy(dtype=np.float64) for name in _NAMES[:3]
        )
        return cls(time_s, east_m, north_m, np.full(time_s.size, TRUTH_RADIUS_M))

    def to_bytes(self) -> bytes:
        """Return the track as a compressed archive of arrays."""
        into = io.BytesIO()
        np.savez_compressed(into, **{name: getattr(self, name) for name in _NAMES})
        return into.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes) -> JourneyTrack:
        """Return the track that :meth:`to_bytes` wrote."""
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return cls(**{name: arrays[name] for name in _NAMES})

    def at(self, time_s: Floats) -> tuple[Floats, Floats, Floats]:
        """Return positions and radii at some times; NaN outside the track and in its gaps."""
        if self.time_s.size == 0:
            nothing = np.full(time_s.shape, np.nan)
            return nothing, nothing, nothing
        found = (
            np.interp(time_s, self.time_s, values, left=np.nan, right=np.nan)
            for values in (self.east_m, self.north_m, self.radius_m)
        )
        east_m, north_m, radius_m = found
        return east_m, north_m, radius_m


def placed(log: TrackLog, track: JourneyTrack) -> Placed:
    """Return the reports of a log where a track has them.

    Reports that alone tell where they were heard prove nothing: their positions are unknown.
    """
    merged = epochs(log)
    time_s = np.array([epoch.time_s for epoch in merged])
    east_m, north_m, radius_m = track.at(time_s)
    others = len(log.gnss) + len(log.truth) + len(log.pseudoranges)
    if not others and not log.motion["step_m"].notna().any():
        radius_m = np.full_like(radius_m, np.inf)
    return Placed(merged, east_m, north_m, radius_m)
