"""Pictures of DLR's paper: satellites in sight, cumulative errors, the SINR threshold, a track."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mapfilter.evaluation.track_percentiles import Percentile
from mapfilter.experiments.papers.dlr import experiment as dlr
from mapfilter.experiments.papers.dlr import scene as dlr_scene
from mapfilter.experiments.papers.dlr.scene import Where
from mapfilter.experiments.papers.paper import Picture
from mapfilter.gnss.sky import directions
from mapfilter.report.canvas import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILLION, Look
from mapfilter.report.cumulative import Distribution, plot_cumulative
from mapfilter.report.curves import (
    Curve,
    OverThreshold,
    Panel,
    SeenMap,
    plot_error_panels,
    plot_over_threshold,
    plot_seen_satellites,
)

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
