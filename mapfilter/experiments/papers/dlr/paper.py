"""DLR's paper: 90 % errors with intervals, their ratios, and what the paper prints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from mapfilter.evaluation.accuracy import percentile_m
from mapfilter.evaluation.track_percentiles import Percentile, ratio_of_tracks
from mapfilter.experiments.papers.dlr import experiment as dlr
from mapfilter.experiments.papers.dlr import scene as dlr_scene
from mapfilter.experiments.papers.dlr.scene import ASSUMPTIONS, Where
from mapfilter.experiments.papers.paper import Paper, Picture
from mapfilter.gnss.sky import directions
from mapfilter.report.canvas import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILLION, Look
from mapfilter.report.curves import (
    Curve,
    Distribution,
    OverThreshold,
    Panel,
    SeenMap,
    plot_cumulative,
    plot_error_panels,
    plot_over_threshold,
    plot_seen_satellites,
)

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


_BOTH = "GPS + Galileo"
_ABOVE = f"above {dlr_scene.THRESHOLD_DB:g} dB".replace("-", "−")
_SYSTEMS: tuple[tuple[str, dlr.Systems, tuple[str, str]], ...] = (
    ("GPS", "gps", (ORANGE, VERMILLION)),
    (_BOTH, "gps+galileo", (SKY, BLUE)),
)
_TWO: tuple[dlr.Name, dlr.Name] = ("static", "ekf")

_LINES = {
    "figure-6": [
        (f"{sky}, {name}, {words}", dlr.Run(filter_, systems, open_sky=open_sky), colour, style, "")
        for sky, open_sky, style in (("canyon", False, "-"), ("free space", True, "--"))
        for name, systems, colours in _SYSTEMS
        for words, filter_, colour in zip(("static", "EKF"), _TWO, colours, strict=True)
    ],
    "figure-7": [
        ("static", dlr.STATIC, VERMILLION, "-", "static"),
        ("PKF", dlr.PKF, ORANGE, "-", "pkf"),
        ("EKF", dlr.EKF, BLUE, "-", "ekf"),
        ("PF, 10 000 particles", dlr.PF, BLACK, "--", "pf"),
    ],
    "figure-8": [
        ("edge, static", dlr.TDOA_STATIC, VERMILLION, "-", ""),
        ("edge, PKF", dlr.TDOA_PKF, ORANGE, "-", ""),
        ("edge, EKF", dlr.TDOA_EKF, BLUE, "-", ""),
        ("edge, PF", dlr.TDOA_PF, BLACK, ":", "pf_edge"),
        ("near a station, EKF", dlr.TDOA_EKF_NEAR, SKY, "--", ""),
        ("near a station, PF", dlr.TDOA_PF_NEAR, GREY, "--", ""),
    ],
    "figure-9": [
        (_BOTH, dlr.EKF, BLACK, "-", "ekf_gnss"),
        (f"edge, {_ABOVE}", dlr.AT_EDGE, BLUE, "-", "ekf_edge"),
        ("edge, three stations", dlr.FIXED_EDGE, SKY, "--", ""),
        (f"near, {_ABOVE}", dlr.AT_NEAR, ORANGE, "-", ""),
        ("near, three stations", dlr.FIXED_NEAR, VERMILLION, "--", ""),
    ],
    "figure-10": [
        ("GPS", dlr.GPS, GREY, "-", "gps"),
        (_BOTH, dlr.EKF, BLACK, "-", "gps_galileo"),
        ("with TDOA, near", dlr.AT_NEAR, ORANGE, "-", "near"),
        ("with TDOA, edge", dlr.AT_EDGE, BLUE, "-", "edge"),
        ("TDOA alone, near", dlr.TDOA_EKF_NEAR, VERMILLION, "--", ""),
        ("TDOA alone, edge", dlr.TDOA_EKF, SKY, "--", ""),
    ],
}
"""Name, run, colour and style of each curve, and the name of what is published of it."""


def pictures(run: dlr.PaperRun) -> Iterator[Picture]:
    """Draw Figs. 1 and 6 to 12, and the sweep of the SINR threshold."""
    tracks, few = f"{len(run.satellites)} tracks", f"fewer than {dlr.FEW} satellites"
    critical = run.epochs["critical"]

    def cumulative(figure: str, group: str, epochs: str, title: str, most_m: float) -> Picture:
        published = dlr.PUBLISHED.get(group, {})
        curves = [
            Distribution(
                name, run.errors_m[key][run.epochs[epochs]], colour, style, published.get(claim)
            )
            for name, key, colour, style, claim in _LINES[figure]
        ]
        return figure, plot_cumulative(curves, title=title, most_m=most_m)

    title = "Fig. 1: satellites in line of sight"
    houses = list(dlr_scene.dlr_scene().houses)
    yield "figure-1", plot_seen_satellites(_seen_maps(), houses, run.walks_m, title=title)

    title = f"Fig. 6: canyon and free space, {tracks}; epochs without a fix fail"
    yield cumulative("figure-6", "", "every", title, 60.0)
    title = f"Fig. 7: {_BOTH} in the canyon, epochs with a static fix, {tracks}"
    yield cumulative("figure-7", "all", "fixed", title, 60.0)
    title = f"Fig. 8: two time differences alone, {tracks}"
    yield cumulative("figure-8", "tdoa_only", "every", title, 200.0)
    title = f"Fig. 9: satellites and time differences, EKF, {tracks}"
    yield cumulative("figure-9", "hybrid", "every", title, 40.0)

    title = f"Fig. 9: 90 % error by SINR threshold, EKF, {tracks}, 95 % intervals"
    compared: tuple[tuple[Where, dlr.Run, str], ...] = (
        (dlr_scene.EDGE, dlr.FIXED_EDGE, BLUE),
        (dlr_scene.NEAR, dlr.FIXED_NEAR, ORANGE),
    )
    thresholds = []
    for where, key, colour in compared:
        at = dlr.THRESHOLDS_DB, over_threshold(run, where)
        three = run.error_90(key, "every")
        thresholds.append(OverThreshold(where, *at, three, f"{where}, three stations", colour))
    bound = "satellites alone", run.error_90(dlr.EKF, "every").value
    chosen_db = dlr_scene.THRESHOLD_DB
    axes = plot_over_threshold(thresholds, title=title, chosen_db=chosen_db, bound=bound)
    yield "figure-9-thresholds", axes

    title = f"Fig. 10: {few} ({100 * float(critical.mean()):.0f} % of epochs), EKF, {tracks}"
    yield cumulative("figure-10", "critical", "critical", title, 80.0)

    time = Look(across="time / s", shaded=(few, critical[run.shown]))
    both, gps = (count[run.shown].astype(np.float64) for count in (run.satellites, run.gps))
    seen = [Curve(_BOTH, both, BLACK), Curve("GPS", gps, ORANGE)]
    seen.append(Curve("Galileo", both - gps, GREEN))
    panel = Panel("", "satellites in line of sight", seen)
    title = f"Fig. 11: satellites over track {run.shown}"
    yield "figure-11", plot_error_panels([panel], title=title, **time)

    gnss, near, edge = np.sqrt(np.mean(run.over_time_m**2, axis=0))
    # Near a station there are often no differences: that curve lies on the first.
    errors = [Curve(_BOTH, gnss, BLACK), Curve("with TDOA, near", near, ORANGE, "--")]
    errors.append(Curve("with TDOA, edge", edge, BLUE))
    panel = Panel("", "root mean square error / m", errors)
    title = f"Fig. 12: track {run.shown}, EKF, {len(run.over_time_m)} draws"
    yield "figure-12", plot_error_panels([panel], title=title, **time)


def over_threshold(run: dlr.PaperRun, where: Where) -> list[Percentile]:
    """Return the 90 % error of the hybrid EKF on every epoch at each of the thresholds."""
    runs = [dlr.Run("ekf", where=where, above_db=above) for above in dlr.THRESHOLDS_DB]
    return [run.error_90(one, "every") for one in runs]


def _seen_maps() -> list[SeenMap]:
    """Return how many satellites are in line of sight at the start of the day."""
    scene = dlr_scene.dlr_scene()
    satellites, gps = dlr_scene.sky(0.0)
    row, col = np.nonzero(scene.ground.free)
    lattice = scene.ground.lattice
    height_m = np.full(row.size, dlr_scene.HEIGHT_M)
    places = np.column_stack([*lattice.east_north(row, col), height_m])
    seen = scene.skyline.seen(places, directions(satellites))
    west, south, east, north = lattice.bounds_m
    maps = []
    for title, which in (("GPS", gps), (_BOTH, np.ones_like(gps))):
        count = np.full(scene.ground.free.shape, np.nan)
        count[row, col] = seen[:, which].sum(axis=1)
        maps.append(SeenMap(title, count, (west, east, south, north)))
    return maps


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
