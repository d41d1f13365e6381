"""DLR's figures: 90 % errors with intervals, their ratios, and what the paper prints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools
from mapfilter.evaluation.accuracy import percentile_m
from mapfilter.evaluation.track_percentiles import (
    Percentile,
    percentile_of_tracks,
    ratio_of_tracks,
)
from mapfilter.experiments.papers.dlr import experiment as dlr
from mapfilter.experiments.papers.dlr.scene import Where

SHARE = 0.9
SHARES = (0.5, 0.67, SHARE, 0.95)

FIGURES: dict[str, dict[str, dlr.Run]] = {
    "all": {"static": dlr.STATIC, "pkf": dlr.PKF, "ekf": dlr.EKF, "pf": dlr.PF},
    "tdoa_only": {
        "ekf_edge": dlr.TDOA_EKF, "pf_edge": dlr.TDOA_PF, "pf_near": dlr.TDOA_PF_NEAR,
    },
    "hybrid": {
        "ekf_gnss": dlr.EKF, "ekf_edge": dlr.AT_EDGE, "ekf_near": dlr.AT_NEAR,
        "fixed3_edge": dlr.FIXED_EDGE,
    },
    "critical": {
        "gps": dlr.GPS, "gps_galileo": dlr.EKF, "near": dlr.AT_NEAR, "edge": dlr.AT_EDGE,
    },
    "every_epoch": {"static": dlr.STATIC, "pkf": dlr.PKF, "ekf": dlr.EKF, "pf": dlr.PF},
}  # fmt: skip
"""What is told, by group and name; see :func:`figures` for the epochs of each group."""

PUBLISHED: dict[str, dict[str, float | None]] = {
    "all": {"static": 40.0, "pkf": 27.0, "ekf": 9.0, "pf": None},
    "tdoa_only": {"ekf_edge": None, "pf_edge": 40.0, "pf_near": None},
    "hybrid": {"ekf_gnss": 17.0, "ekf_edge": 10.0, "ekf_near": None, "fixed3_edge": None},
    "critical": {"gps": 30.0, "gps_galileo": 18.0, "near": 15.0, "edge": 11.0},
}
"""The paper's 90 % errors in metres, where its text tells them (Figs. 7 to 10)."""

_RATIOS: dict[str, tuple[str, dlr.Run, dlr.Run]] = {
    "pkf_over_static": ("all", dlr.PKF, dlr.STATIC),
    "ekf_over_pkf": ("all", dlr.EKF, dlr.PKF),
    "pf_over_ekf": ("all", dlr.PF, dlr.EKF),
    "edge_over_gnss": ("hybrid", dlr.AT_EDGE, dlr.EKF),
    "near_over_gnss": ("hybrid", dlr.AT_NEAR, dlr.EKF),
    "edge_over_near": ("hybrid", dlr.AT_EDGE, dlr.AT_NEAR),
    "edge_over_fixed3": ("hybrid", dlr.AT_EDGE, dlr.FIXED_EDGE),
    "critical_edge_over_gnss": ("critical", dlr.AT_EDGE, dlr.EKF),
    "critical_near_over_gnss": ("critical", dlr.AT_NEAR, dlr.EKF),
}


@dataclass(frozen=True, slots=True)
class Row:
    """One filter on one set of epochs.

    Parameters
    ----------
    run : Run
    epochs : {"every", "fixed", "critical", "gps_critical"}
        All; those with a static fix of both systems; those with fewer than four satellites of both
        systems, and of GPS.
    count : int
    told : float
        Share of them at which the filter tells a position.
    percentiles_m : tuple of float
        Those of :data:`SHARES`; epochs without a position count as worse than any error.
    interval_m : (float, float)
        95 %, of the 90 % error, over tracks.
    """

    run: dlr.Run
    epochs: str
    count: int
    told: float
    percentiles_m: tuple[float, ...]
    interval_m: tuple[float, float]


def epochs_of(run: dlr.PaperRun) -> dict[str, Bools]:
    """Return the sets of epochs, (T, K) each, by the names of :class:`Row`."""
    return {
        "every": run.every, "fixed": run.fixed, "critical": run.critical,
        "gps_critical": run.gps < dlr.FEW,
    }  # fmt: skip


def figures(run: dlr.PaperRun) -> dict[str, dict[str, Percentile]]:
    """Return the 90 % errors of :data:`FIGURES`.

    ``all`` compares on the epochs with a static fix, ``critical`` on those with fewer than four
    satellites of both systems, the others on every epoch; in ``every_epoch`` those without a static
    fix count as failures of it.
    """
    return {
        group: {
            name: percentile_of_tracks(run.errors_m[key], _counted(run, group), SHARE)
            for name, key in names.items()
        }
        for group, names in FIGURES.items()
    }


def ratios(run: dlr.PaperRun) -> dict[str, Percentile]:
    """Return ratios of 90 % errors on the same epochs, with intervals over tracks."""
    return {
        name: ratio_of_tracks(
            run.errors_m[one], run.errors_m[other], _counted(run, group), SHARE
        )
        for name, (group, one, other) in _RATIOS.items()
    }  # fmt: skip


def rows(run: dlr.PaperRun) -> tuple[Row, ...]:
    """Return every filter on every set of epochs that has any."""
    found = []
    for key, errors in run.errors_m.items():
        for name, counted in epochs_of(run).items():
            if not counted.any():
                continue
            own = errors[counted]
            failing = np.where(np.isnan(own), np.inf, own)
            at = [percentile_m(failing, share) for share in SHARES]
            found.append(Row(
                key, name, own.size, float(np.isfinite(own).mean()),
                tuple(value if np.isfinite(value) else np.nan for value in at),
                _interval(percentile_of_tracks(errors, counted, SHARE)),
            ))  # fmt: skip
    return tuple(found)


def over_threshold(run: dlr.PaperRun, where: Where, counted: Bools) -> list[Percentile]:
    """Return the 90 % error of the hybrid EKF at each of the thresholds."""
    return [
        percentile_of_tracks(
            run.errors_m[dlr.Run("ekf", where=where, above_db=above)], counted, SHARE
        )
        for above in dlr.THRESHOLDS_DB
    ]


def values(found: Mapping[str, Mapping[str, Percentile]], group: str) -> dict[str, float]:
    """Return a group's figures by name."""
    return {name: one.value for name, one in found[group].items()}


def _interval(found: Percentile) -> tuple[float, float]:
    return found.low, found.high


def _counted(run: dlr.PaperRun, group: str) -> Bools:
    if group == "all":
        return run.fixed
    return run.critical if group == "critical" else run.every
