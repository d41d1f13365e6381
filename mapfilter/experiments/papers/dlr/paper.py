"""DLR's paper: 90 % errors with intervals, their ratios, and what the paper prints."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from mapfilter.evaluation.accuracy import percentile_m
from mapfilter.evaluation.track_percentiles import Percentile, ratio_of_tracks
from mapfilter.experiments.papers.dlr import experiment as dlr
from mapfilter.experiments.papers.dlr.pictures import pictures
from mapfilter.experiments.papers.dlr.scene import ASSUMPTIONS
from mapfilter.experiments.papers.paper import Paper

SHARES = (0.5, 0.67, dlr.SHARE, 0.95)

CLAIMS = (
    "Fig. 7, GPS + Galileo, 90 %: static 40 m, PKF about 27 m, EKF about 9 m, close to the PF",
    "Fig. 8, two time differences at the cell edge, 90 %: PF about 40 m, EKF slightly worse; "
    "static and PKF tell nothing of use; near a base station neither EKF nor PF does",
    "Fig. 9, 90 %: about 17 m by GPS + Galileo, nearly 10 m with time differences at the cell edge "
    "above -17 dB, better than three fixed stations",
    "Fig. 10, fewer than four satellites, 90 %: GPS 30 m, with Galileo about 18 m, with time "
    "differences near a base station about 15 m, at the cell edge below 11 m",
)
"""The paper's claims; its Figs. 7 and 9 disagree on the EKF."""

_ALL = {"static": dlr.STATIC, "pkf": dlr.PKF, "ekf": dlr.EKF, "pf": dlr.PF}
FIGURES: dict[str, tuple[str, dict[str, dlr.Run]]] = {
    "all": ("fixed", _ALL),
    "tdoa_only": (
        "every",
        {"ekf_edge": dlr.TDOA_EKF, "pf_edge": dlr.TDOA_PF, "pf_near": dlr.TDOA_PF_NEAR},
    ),
    "hybrid": (
        "every",
        {"ekf_gnss": dlr.EKF, "ekf_edge": dlr.AT_EDGE, "ekf_near": dlr.AT_NEAR}
        | {"fixed3_edge": dlr.FIXED_EDGE},
    ),
    "critical": (
        "critical",
        {"gps": dlr.GPS, "gps_galileo": dlr.EKF, "near": dlr.AT_NEAR, "edge": dlr.AT_EDGE},
    ),
    "every_epoch": ("every", _ALL),
}
"""By group: the set of epochs that count, and filters by name.

In ``every_epoch`` those without a static fix count as failures of it.
"""

_RATIOS = {
    "pkf_over_static": ("fixed", dlr.PKF, dlr.STATIC),
    "ekf_over_pkf": ("fixed", dlr.EKF, dlr.PKF),
    "pf_over_ekf": ("fixed", dlr.PF, dlr.EKF),
    "edge_over_gnss": ("every", dlr.AT_EDGE, dlr.EKF),
    "near_over_gnss": ("every", dlr.AT_NEAR, dlr.EKF),
    "edge_over_near": ("every", dlr.AT_EDGE, dlr.AT_NEAR),
    "edge_over_fixed3": ("every", dlr.AT_EDGE, dlr.FIXED_EDGE),
    "critical_edge_over_gnss": ("critical", dlr.AT_EDGE, dlr.EKF),
    "critical_near_over_gnss": ("critical", dlr.AT_NEAR, dlr.EKF),
}
"""By name: the set of epochs that count, and the two filters."""


def figures(run: dlr.PaperRun) -> dict[str, dict[str, Percentile]]:
    """Return the 90 % errors of :data:`FIGURES`."""
    return {
        group: {name: run.error_90(key, epochs) for name, key in names.items()}
        for group, (epochs, names) in FIGURES.items()
    }


def ratios(run: dlr.PaperRun) -> dict[str, Percentile]:
    """Return ratios of 90 % errors on the same epochs, with intervals over tracks."""
    return {
        name: ratio_of_tracks(run.errors_m[one], run.errors_m[other], run.epochs[epochs], dlr.SHARE)
        for name, (epochs, one, other) in _RATIOS.items()
    }


def rows(run: dlr.PaperRun) -> list[dict[str, Any]]:
    """Return every filter on every set of epochs that has any; errors in metres, east and north.

    ``where`` in the network time differences are taken (None without them) and ``above_db`` the
    SINR below which stations are dropped (None for the three best ones); ``located``, the share of
    epochs at which there is a position: the others count as worse than any error; percentiles of
    the error, and ``interval_m``, 95 % over tracks, of the 90 % error.
    """
    found = []
    for key, errors in run.errors_m.items():
        for name, counted in run.epochs.items():
            if not counted.any():
                continue
            own = errors[counted]
            failing = np.where(np.isnan(own), np.inf, own)
            at = {f"error_{100 * share:.0f}_m": percentile_m(failing, share) for share in SHARES}
            interval = run.error_90(key, name)
            found.append(
                {
                    "filter": key.filter,
                    "satellites": key.satellites,
                    "where": key.where,
                    "above_db": key.above_db,
                    "sky": "open" if key.open_sky else "canyon",
                    "mobility": key.mobility,
                    "epochs": name,
                    "count": own.size,
                    "located": float(np.isfinite(own).mean()),
                    **{one: value if np.isfinite(value) else np.nan for one, value in at.items()},
                    "interval_m": (interval.low, interval.high),
                }
            )
    return found


def summary(run: dlr.PaperRun) -> dict[str, Any]:
    """Return 90 % errors in metres, by the paper's comparisons; each compares on the same epochs.

    ``all``: ``static``, ``pkf``, ``ekf``, ``pf`` by GPS and Galileo, on the epochs with a static
    fix. ``tdoa_only``: time differences of the three best stations alone. ``hybrid``: satellites
    without and with time differences, on every epoch. ``critical``: by the EKF, on epochs with
    fewer than four satellites. ``static_availability``: share of the epochs with a static fix.
    ``every_epoch``: as ``all``, on every epoch; those without a static fix are failures of it.
    ``critical_share``: share of the epochs with fewer than four satellites. ``intervals``: 95 %
    over tracks, of each of these figures. ``published``: the paper's, where it prints them.
    ``ratios``: of two 90 % errors on the same epochs, with intervals. ``trials``, ``epochs``:
    tracks, and epochs of all of them.
    """
    found = figures(run)
    values = {group: {name: one.value for name, one in own.items()} for group, own in found.items()}
    return {
        **{group: values[group] for group in dlr.PUBLISHED},
        "static_availability": float(run.epochs["fixed"].mean()),
        "every_epoch": values["every_epoch"],
        "critical_share": float(run.epochs["critical"].mean()),
        "intervals": {
            group: {name: (one.low, one.high) for name, one in own.items()}
            for group, own in found.items()
        },
        "published": dlr.PUBLISHED,
        "ratios": {
            name: {"ratio": one.value, "interval": (one.low, one.high)}
            for name, one in ratios(run).items()
        },
        "rows": rows(run),
        "claims": CLAIMS,
        "trials": len(run.satellites),
        "epochs": run.satellites.size,
        "assumptions": ASSUMPTIONS,
    }


def tables(run: dlr.PaperRun) -> dict[str, pd.DataFrame]:
    """Return the errors of every filter on every set of epochs."""
    found = []
    for row in rows(run):
        low, high = row.pop("interval_m")
        picked = None if row["where"] is None else "three best"
        above = picked if row["above_db"] is None else f"{row['above_db']:g}"
        ends = {"error_90_low_m": low, "error_90_high_m": high}
        found.append(row | {"above_db": above, "located": f"{row['located']:.4f}"} | ends)
    return {"errors": pd.DataFrame(found, dtype=object)}


PAPER = Paper(
    name="dlr",
    title="DLR: satellites and LTE time differences in a street canyon",
    trials=40,
    trial_limits=(2, None),
    why="a single track has no interval",
    run=dlr.run_paper,
    summary=summary,
    tables=tables,
    pictures=pictures,
)
