"""Causes of the worst stretch of a journey, by rules over what was recorded of it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mapfilter._types import Bools, Floats
from mapfilter.angles import wrap_rad
from mapfilter.evaluation.accuracy import position_errors_m
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.benchmarks.worst_run import WorstEpoch
from mapfilter.filters.contract import Reason
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.sensors.watch import UNMEASURED

OFF_MAP_M = 30.0
"""Farther from every point of the map the true way is not on it."""
_BEFORE_M = 200.0
_LEAST_SHARE = 0.2
_LEG_M = 20.0
_STRAIGHT_DEG, _LEAST_STRAIGHT_M = 60.0, 150.0
_ALONG, _LEAST_ALONG_M = 0.8, 5.0
_AMBIGUOUS = 0.01
_SHORT_M = 300.0
_FIX_SHARE, _EARLIER_S = 0.5, 10.0
_UNKNOWN = (Reason.UNKNOWN_CELL, Reason.NO_CELL, Reason.NO_POINTS_IN_CELL, Reason.AMBIGUOUS_CELL)
_NO_REPORT = (Reason.NO_READING, Reason.NOT_MOVED_ENOUGH)
_REFUSED = (Reason.REJECTED_BY_EVIDENCE, Reason.ON_PROBATION)


@dataclass(frozen=True, eq=False)
class _Stretch:
    """A journey, and which of its epochs belong to the worst stretch or the 200 m before it."""

    estimate: TrackEstimate
    truth: Truth
    worst: WorstEpoch
    inside: Bools
    map_m: Floats | None
    fixes: Floats | None

    @property
    def way_m(self) -> float:
        """True distance travelled in the stretch."""
        gone_m = self.truth.distance_at(self.estimate.time_s[self.inside])
        return float(gone_m[-1] - gone_m[0])

    def share(self, reasons: Collection[Reason]) -> float:
        """Return the share of the stretch's epochs with one of some reasons; 0 without any."""
        return self._share_of(reasons, self.inside)

    def share_of_reports(self, reasons: Collection[Reason]) -> float:
        """Return the share of the stretch's radio reports with one of some reasons."""
        report = np.array([why not in _NO_REPORT for why in self.estimate.reason])
        return self._share_of(reasons, self.inside & report)

    def _share_of(self, reasons: Collection[Reason], which: Bools) -> float:
        found = np.array([why in reasons for why in self.estimate.reason])
        return float(np.mean(found[which])) if which.any() else 0.0


def causes_of(
    estimate: TrackEstimate,
    truth: Truth,
    worst: WorstEpoch,
    map_m: Floats | None = None,
    fixes: Floats | None = None,
) -> tuple[str, ...]:
    """Return what can have caused the worst stretch of a journey, in words; empty if no rule holds.

    Looked at are the epochs of the stretch and those of the 200 m before it; all epochs where no
    position was ever claimed.

    Parameters
    ----------
    worst : WorstEpoch
        From :func:`mapfilter.experiments.benchmarks.worst_run.explain`.
    map_m : (N, 2) array, optional
        East and north of the map's points in the CRS of the estimate, m.
    fixes : (K, 3) array, optional
        Time, east and north of the fixes that the filter was given.
    """
    gone_m = truth.distance_at(estimate.time_s)
    inside = (gone_m >= gone_m[worst.first] - _BEFORE_M) & (gone_m <= gone_m[worst.last])
    if estimate.converged_at is None:
        inside = np.isfinite(truth.at(estimate.time_s)[0])
    if not inside.any():
        return ()
    stretch = _Stretch(estimate, truth, worst, inside, map_m, fixes)
    return tuple(filter(None, (rule(stretch) for rule in _RULES)))


def _off_map(stretch: _Stretch) -> str:
    if stretch.map_m is None or not len(stretch.map_m):
        return ""
    places = np.stack(stretch.truth.at(stretch.estimate.time_s[stretch.inside]), axis=1)
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        return ""
    share = float(np.mean(cKDTree(stretch.map_m).query(places)[0] > OFF_MAP_M))
    if share < _LEAST_SHARE:
        return ""
    return (
        f"off the map: {100 * share:.0f} % of the true way is more than {OFF_MAP_M:.0f} m from it"
    )


def _frozen(stretch: _Stretch) -> str:
    share = stretch.share_of_reports((Reason.STALE_RADIO,))
    return f"radio frozen: {100 * share:.0f} % of the reports are stale" if share >= 0.5 else ""


def _unknown(stretch: _Stretch) -> str:
    share = stretch.share_of_reports(_UNKNOWN)
    if share < _LEAST_SHARE:
        return ""
    return f"the database does not have the serving cell of {100 * share:.0f} % of the reports"


def _silent(stretch: _Stretch) -> str:
    reasons = stretch.estimate.reason
    used = np.array([why is Reason.USED for why in reasons])
    if not used.any() or used[stretch.inside].any():
        return ""
    return f"no radio reading was used over {stretch.way_m:.0f} m"


def _motionless(stretch: _Stretch) -> str:
    share = stretch.share(UNMEASURED)
    return f"motion missing or stuck in {100 * share:.0f} % of the epochs" if share >= 0.1 else ""


def _wrong_fixes(stretch: _Stretch) -> str:
    """Return how far off the fixes of the stretch are, where that is half of the error or more."""
    if stretch.fixes is None or not len(stretch.fixes):
        return ""
    time_s = stretch.estimate.time_s[stretch.inside]
    errors_m = position_errors_m(stretch.estimate, stretch.truth)
    own_m = float(errors_m[stretch.worst.index])
    at_s = stretch.fixes[:, 0]
    given = stretch.fixes[(at_s >= time_s[0] - _EARLIER_S) & (at_s <= time_s[-1])]
    east, north = stretch.truth.at(given[:, 0])
    off_m = np.hypot(given[:, 1] - east, given[:, 2] - north)
    off_m = off_m[np.isfinite(off_m)]
    if not off_m.size or not np.median(off_m) >= _FIX_SHARE * own_m:
        return ""
    if off_m.size == 1:
        return f"the only fix there is itself {off_m[0]:.0f} m off"
    return f"the {off_m.size} fixes there are themselves {np.median(off_m):.0f} m off (median)"


def _refused(stretch: _Stretch) -> str:
    time_s = stretch.estimate.time_s[stretch.inside]
    times = {
        one.time_s
        for one in stretch.estimate.unused
        if one.reason in _REFUSED
        and one.kind in ("gnss", "pseudorange")
        and time_s[0] <= one.time_s <= time_s[-1]
    }
    if not times:
        return ""
    return f"fixes or satellites contradict the belief and were rejected at {len(times)} moments"


def _straight(stretch: _Stretch) -> str:
    turned_deg = turning_deg(stretch.truth, stretch.estimate.time_s[stretch.inside])
    if turned_deg > _STRAIGHT_DEG or stretch.way_m < _LEAST_STRAIGHT_M:
        return ""
    return f"no corner: the way turns by {turned_deg:.0f}° over {stretch.way_m:.0f} m"


def _along(stretch: _Stretch) -> str:
    index, estimate, truth = stretch.worst.index, stretch.estimate, stretch.truth
    error_m = float(position_errors_m(estimate, truth)[index])
    gone_m = truth.distance_at(truth.time_s)
    here_m = float(truth.distance_at(estimate.time_s[index]))
    ends = [float(np.interp(here_m + d, gone_m, truth.time_s)) for d in (-_LEG_M, _LEG_M)]
    east, north = truth.at(ends)
    way = np.array([np.diff(east)[0], np.diff(north)[0]])
    if not np.isfinite(error_m) or error_m < _LEAST_ALONG_M or not np.hypot(*way) > 0:
        return ""
    true_east, true_north = truth.at([estimate.time_s[index]])
    apart = np.array(
        [estimate.east_m[index] - true_east[0], estimate.north_m[index] - true_north[0]]
    )
    along_m = float(abs(apart @ way) / np.hypot(*way))
    if along_m < _ALONG * error_m or estimate.converged_at is None:
        return ""
    return f"the error is along the way ({along_m:.0f} of {error_m:.0f} m)"


def _ambiguous(stretch: _Stretch) -> str:
    evidence, index = stretch.estimate.evidence, stretch.worst.index
    if evidence is None or not evidence.runner_up_mass[index] >= _AMBIGUOUS:
        return ""
    return (
        f"ambiguous: another place has {100 * evidence.runner_up_mass[index]:.0f} % of the belief"
    )


def _short(stretch: _Stretch) -> str:
    way_m = float(stretch.truth.distance_at(stretch.truth.time_s[-1]))
    if stretch.estimate.converged_at is not None or way_m >= _SHORT_M:
        return ""
    return f"short: {way_m:.0f} m in all"


_RULES: tuple[Callable[[_Stretch], str], ...] = (
    _off_map,
    _frozen,
    _unknown,
    _silent,
    _motionless,
    _wrong_fixes,
    _refused,
    _straight,
    _short,
    _along,
    _ambiguous,
)


def turning_deg(truth: Truth, time_s: Floats) -> float:
    """Return the sum of all turns of the true way between the first and last of some times.

    Directions are those of legs of 20 m, so that noise of positions adds little.
    """
    gone_m = truth.distance_at(truth.time_s)
    first_m, last_m = truth.distance_at([time_s[0], time_s[-1]])
    at_s = np.interp(np.arange(first_m, last_m, _LEG_M), gone_m, truth.time_s)
    east, north = truth.at(at_s)
    heading = np.arctan2(np.diff(north), np.diff(east))
    return float(np.degrees(np.nansum(np.abs(wrap_rad(np.diff(heading))))))
