"""Figures of a case of the benchmark, with intervals: one row of the table for each case."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapfilter._types import Floats
from mapfilter.evaluation.accuracy import RADII, mean_of, percentile_m
from mapfilter.evaluation.intervals import rate_interval, share_interval, statistic_interval
from mapfilter.evaluation.stanford import REGIONS
from mapfilter.evaluation.success import wilson_interval_of_routes
from mapfilter.experiments.benchmarks.cases import Case
from mapfilter.experiments.benchmarks.scores import ERRORS

_NAN = float("nan")
_MEANS = ("switch_mean_m", "error_mean_m", "error_95_m")


@dataclass(frozen=True)
class CaseResult:
    """One row of the table; ``_low`` and ``_high`` are the ends of 95 % intervals.

    The intervals are over journeys, not over epochs: each run has a route and a ground truth of its
    own, and its epochs are alike (:mod:`mapfilter.evaluation.intervals`).

    Parameters
    ----------
    success : float
        Share of the runs that were at most 50 m off when they converged; in the cases of a
        displacement, within 50 m again, and for 10 s, soon enough.
    wrong : float
        Share of the runs that converged more than 50 m off; after a displacement, that still were
        so at the end.
    switch_mean_m, switch_p90_m : float
        Metres travelled until converged; after a displacement, until found again.
    error_mean_m, error_67_m, error_95_m : float
        Means over the successful runs of each run's figure, from then on; of the whole track where
        it is smoothed.
    worst_100m_mean_m, worst_100m_95_m : float
        Of each run that converged, the largest mean error over 100 m travelled after it: mean and
        95 % over the runs.
    claimed : float
        Share of all epochs at which a position was claimed (CONVERGED or TRACKING).
    within_50m, off_50m : float
        Shares of the claimed epochs that were at most 50 m off, and that were farther off.
    coverage_50, coverage_67, coverage_95, coverage_99 : float
        Share of the claimed epochs whose radius held the truth.
    converged : int
        How often CONVERGED was reported, the first time or after LOST.
    wrong_converged : float
        Share of these that were more than 50 m off.
    false_converged_per_journey, false_converged_per_km : float
        How often a claim began more than 50 m off, also after LOST.
    false_lost_per_journey, false_lost_per_km : float
        How often LOST was reported right after a position at most 50 m off, claimed or UNCERTAIN.
    lost_per_km : float
        How often LOST was reported at all, before any displacement.
    seconds_per_track : float
        Processor time of the filter, median.
    window_median_m : float
        In the cases with satellites, mean over the runs of the median error in the two minutes
        from when a spoofer begins, or would.
    protection_m : float
        Median over the runs of the median protection level of their claimed epochs.
    epochs_available, epochs_misleading, epochs_hazardous, epochs_unavailable, \
epochs_unavailable_misleading : int
        Claimed epochs in each region of the Stanford diagram
        (:mod:`mapfilter.evaluation.stanford`).
    available, misleading, hazardous : float
        Shares of the claimed epochs.
    exceeded : float
        Share of the claimed epochs whose error exceeded the protection level: the risk, where it
        is kept.
    fault_wrong, fault_unnoticed : float
        With faults of the sensors: shares of the runs in which a position more than 50 m off was
        claimed after the fault had begun, and in which the first such claim lasted to the end.
    fault_noticed_s, fault_noticed_max_s : float
        Over the runs with such a claim, seconds from the fault's begin to the first epoch after it
        at which nothing more than 50 m off is claimed, or to the last epoch: median and largest.
    """

    name: str
    filter: str
    runs: int
    success: float
    success_low: float
    success_high: float
    wrong: float
    wrong_low: float
    wrong_high: float
    switch_mean_m: float
    switch_mean_m_low: float
    switch_mean_m_high: float
    switch_p90_m: float
    error_mean_m: float
    error_mean_m_low: float
    error_mean_m_high: float
    error_67_m: float
    error_95_m: float
    error_95_m_low: float
    error_95_m_high: float
    worst_100m_mean_m: float
    worst_100m_95_m: float
    claimed: float
    within_50m: float
    within_50m_low: float
    within_50m_high: float
    off_50m: float
    off_50m_low: float
    off_50m_high: float
    coverage_50: float
    coverage_50_low: float
    coverage_50_high: float
    coverage_67: float
    coverage_67_low: float
    coverage_67_high: float
    coverage_95: float
    coverage_95_low: float
    coverage_95_high: float
    coverage_99: float
    coverage_99_low: float
    coverage_99_high: float
    converged: int
    wrong_converged: float
    wrong_converged_low: float
    wrong_converged_high: float
    false_converged_per_journey: float
    false_converged_per_km: float
    false_lost_per_journey: float
    false_lost_per_km: float
    false_lost_per_km_low: float
    false_lost_per_km_high: float
    lost_per_km: float
    seconds_per_track: float
    seconds_per_track_low: float
    seconds_per_track_high: float
    protection_m: float
    epochs_available: int
    epochs_misleading: int
    epochs_hazardous: int
    epochs_unavailable: int
    epochs_unavailable_misleading: int
    available: float
    available_low: float
    available_high: float
    misleading: float
    misleading_low: float
    misleading_high: float
    hazardous: float
    hazardous_low: float
    hazardous_high: float
    exceeded: float
    exceeded_low: float
    exceeded_high: float
    window_median_m: float = _NAN
    fault_wrong: float = _NAN
    fault_unnoticed: float = _NAN
    fault_noticed_s: float = _NAN
    fault_noticed_max_s: float = _NAN


def summarise(case: Case, filter_name: str, rows: Sequence[Mapping[str, Any]]) -> CaseResult:
    """Put the runs of a case together.

    Parameters
    ----------
    rows : sequence of mapping
        As by :func:`mapfilter.experiments.benchmarks.scores.score`.
    """
    runs, km = len(rows), [float(row["km"]) for row in rows]
    good = [row for row in rows if row["success"]]
    worst_m, switch_m = _known(rows, "worst_100m_m"), _known(rows, "switch_m")
    claimed = [int(row["claimed"]) for row in rows]
    figures: dict[str, Any] = {}
    for name in ("success", "wrong"):
        counts = np.array([int(row[name]) for row in rows])
        interval = wilson_interval_of_routes(counts, np.ones(runs)) if runs else (0.0, 1.0)
        figures |= _with_ends(name, _ratio(counts.sum(), runs), interval)
    off = [whole - int(row["within_50m"]) for row, whole in zip(rows, claimed, strict=True)]
    figures |= _share("within_50m", [int(row["within_50m"]) for row in rows], claimed)
    figures |= _share("off_50m", off, claimed)
    for share in RADII:
        known = [row for row in rows if row[f"covered_{share}"] is not None]
        held = [int(row[f"covered_{share}"]) for row in known]
        figures |= _share(f"coverage_{share}", held, [int(row["claimed"]) for row in known])
    converged = [int(row["converged"]) for row in rows]
    figures |= _share("wrong_converged", [int(row["wrong_converged"]) for row in rows], converged)
    figures |= _regions(rows) | _of_faults(rows)
    for name in ERRORS:
        figures[name] = mean_of(_known(good, name))
    figures["switch_mean_m"] = mean_of(switch_m)
    for name in _MEANS:
        values = switch_m if name == "switch_mean_m" else _known(good, name)
        figures |= _with_ends(name, figures[name], statistic_interval(values))
    for name in ("false_converged", "false_lost"):
        figures[f"{name}_per_journey"] = _ratio(_total(rows, name), runs)
        figures[f"{name}_per_km"] = _ratio(_total(rows, name), sum(km))
    interval = rate_interval([row["false_lost"] for row in rows], km)
    figures |= _with_ends("false_lost_per_km", figures["false_lost_per_km"], interval)
    seconds = [float(row["seconds"]) for row in rows]
    median_s = float(np.median(seconds)) if runs else 0.0
    ends = statistic_interval(seconds, "median")
    figures |= _with_ends("seconds_per_track", median_s, ends)
    return CaseResult(
        name=case.name,
        filter=filter_name,
        runs=runs,
        switch_p90_m=percentile_m(switch_m, 0.9),
        worst_100m_mean_m=mean_of(worst_m),
        worst_100m_95_m=percentile_m(worst_m, 0.95),
        claimed=_ratio(sum(claimed), _total(rows, "epochs")),
        converged=sum(converged),
        lost_per_km=_ratio(_total(rows, "lost"), sum(km)),
        window_median_m=mean_of(_known(rows, "window_median_m")),
        **figures,
    )


def _of_faults(rows: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Return the figures of faults of the sensors, over the runs that have one."""
    known = [row for row in rows if "fault_unnoticed" in row]
    noticed_s = _known(known, "fault_noticed_s")
    return {
        "fault_wrong": _ratio(noticed_s.size, len(known)),
        "fault_unnoticed": _ratio(_total(known, "fault_unnoticed"), len(known)),
        "fault_noticed_s": float(np.median(noticed_s)) if noticed_s.size else _NAN,
        "fault_noticed_max_s": float(noticed_s.max()) if noticed_s.size else _NAN,
    }


def _regions(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the figures of the Stanford diagram, over the runs with protection levels."""
    known = [row for row in rows if row["available"] is not None]
    counts = {name: [int(row[name]) for row in known] for name in REGIONS}
    wholes = [sum(one) for one in zip(*counts.values(), strict=True)]
    figures: dict[str, Any] = {f"epochs_{name}": sum(counts[name]) for name in REGIONS}
    for name in ("available", "misleading", "hazardous"):
        figures |= _share(name, counts[name], wholes)
    over = ("misleading", "hazardous", "unavailable_misleading")
    exceeded = [sum(one) for one in zip(*(counts[name] for name in over), strict=True)]
    levels_m = _known(known, "protection_m")
    # A run whose median level is infinite has none in its row.
    missing = np.full(len(known) - levels_m.size, np.inf)
    every = np.concatenate([levels_m, missing])
    figures["protection_m"] = float(np.median(every)) if every.size else _NAN
    return figures | _share("exceeded", exceeded, wholes)


def _share(name: str, parts: Sequence[int], wholes: Sequence[int]) -> dict[str, float]:
    """Return a share of epochs and its interval over runs."""
    return _with_ends(name, _ratio(sum(parts), sum(wholes)), share_interval(parts, wholes))


def _with_ends(name: str, value: float, interval: tuple[float, float]) -> dict[str, float]:
    low, high = interval
    return {name: float(value), f"{name}_low": low, f"{name}_high": high}


def _total(rows: Sequence[Mapping[str, Any]], name: str) -> float:
    return float(sum(row[name] for row in rows))


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else _NAN


def _known(rows: Iterable[Mapping[str, Any]], name: str) -> Floats:
    values = (row.get(name) for row in rows)
    return np.array([value for value in values if value is not None], dtype=np.float64)
