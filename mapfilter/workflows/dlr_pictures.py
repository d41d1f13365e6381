"""The pictures of DLR's comparison."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapfilter.evaluation.track_percentiles import percentile_of_tracks
from mapfilter.experiments.papers.dlr import experiment as dlr
from mapfilter.experiments.papers.dlr import scene as dlr_scene
from mapfilter.experiments.papers.dlr import table as dlr_table
from mapfilter.gnss.sky import directions
from mapfilter.report.canvas import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILLION
from mapfilter.report.cumulative import (
    Distribution,
    OverThreshold,
    plot_cumulative,
    plot_over_threshold,
)
from mapfilter.report.fusion import Curve, Panel, plot_error_panels
from mapfilter.report.visible_sky import SeenMap, plot_seen_satellites

NAMES = (
    "figure-1", "figure-6", "figure-7", "figure-8", "figure-9", "figure-9-thresholds", "figure-10",
    "figure-11", "figure-12",
)  # fmt: skip

_BOTH = "GPS + Galileo"
_SYSTEMS: tuple[tuple[str, dlr.Systems, tuple[str, str]], ...] = (
    ("GPS", "gps", (ORANGE, VERMILLION)),
    (_BOTH, "gps+galileo", (SKY, BLUE)),
)


def draw_dlr(run: dlr.PaperRun, seed: int, out: Path) -> tuple[Path, ...]:
    """Draw Figs. 1 and 6 to 12, and the sweep of the SINR threshold."""
    paths = {name: out / f"{name}.png" for name in NAMES}
    told = f"{len(run.satellites)} tracks"
    _visible(run, seed, paths["figure-1"])
    _free_space(run, paths["figure-6"], told)
    _filters(run, paths["figure-7"], told)
    _differences(run, paths["figure-8"], told)
    _hybrid(run, paths["figure-9"], told)
    _thresholds(run, paths["figure-9-thresholds"], told)
    _critical(run, paths["figure-10"], told)
    _over_time(run, paths["figure-11"], paths["figure-12"])
    return tuple(paths.values())


def _visible(run: dlr.PaperRun, seed: int, path: Path) -> None:
    scene = dlr_scene.dlr_scene()
    satellites, gps = dlr_scene.sky(0.0)
    ground = scene.ground
    row, col = np.nonzero(ground.free)
    east, north = ground.lattice.east_north(row, col)
    places = np.column_stack([east, north, np.full(row.size, dlr_scene.HEIGHT_M)])
    seen = scene.skyline.seen(places, directions(satellites))
    maps = []
    for title, which in (("GPS", gps), (_BOTH, np.ones_like(gps))):
        count = np.full(ground.free.shape, np.nan)
        count[row, col] = seen[:, which].sum(axis=1)
        west, south, east_m, north_m = ground.lattice.bounds_m
        maps.append(SeenMap(title, count, (west, east_m, south, north_m)))
    tracks = [
        dlr.paper_track(trial, seed).place_m[:, :2] for trial in range(len(run.satellites))
    ]  # fmt: skip
    plot_seen_satellites(
        maps, list(scene.houses), tracks, path, title="Fig. 1: satellites in line of sight"
    )


def _free_space(run: dlr.PaperRun, path: Path, told: str) -> None:
    curves = [
        Distribution(f"{sky}, {name}, {filter_}", run.errors_m[key], colour, style)
        for sky, open_sky, style in (("canyon", False, "-"), ("free space", True, "--"))
        for name, systems, colours in _SYSTEMS
        for filter_, key, colour in (
            ("static", dlr.Run("static", systems, open_sky=open_sky), colours[0]),
            ("EKF", dlr.Run("ekf", systems, open_sky=open_sky), colours[1]),
        )
    ]  # fmt: skip
    plot_cumulative(
        curves, path, title=f"Fig. 6: canyon and free space, {told}; epochs without a fix fail",
        most_m=60.0,
    )  # fmt: skip


def _filters(run: dlr.PaperRun, path: Path, told: str) -> None:
    published = dlr_table.PUBLISHED["all"]
    curves = [
        Distribution(name, run.errors_m[key][run.fixed], colour, style, published[claim])
        for name, key, colour, style, claim in (
            ("static", dlr.STATIC, VERMILLION, "-", "static"),
            ("PKF", dlr.PKF, ORANGE, "-", "pkf"),
            ("EKF", dlr.EKF, BLUE, "-", "ekf"),
            ("PF, 10 000 particles", dlr.PF, BLACK, "--", "pf"),
        )
    ]
    plot_cumulative(
        curves, path, title=f"Fig. 7: {_BOTH} in the canyon, epochs with a static fix, {told}",
        most_m=60.0,
    )  # fmt: skip


def _differences(run: dlr.PaperRun, path: Path, told: str) -> None:
    published = dlr_table.PUBLISHED["tdoa_only"]
    curves = [
        Distribution(name, run.errors_m[key], colour, style, claim)
        for name, key, colour, style, claim in (
            ("edge, static", dlr.TDOA_STATIC, VERMILLION, "-", None),
            ("edge, PKF", dlr.TDOA_PKF, ORANGE, "-", None),
            ("edge, EKF", dlr.TDOA_EKF, BLUE, "-", None),
            ("edge, PF", dlr.TDOA_PF, BLACK, ":", published["pf_edge"]),
            ("near a station, EKF", dlr.TDOA_EKF_NEAR, SKY, "--", None),
            ("near a station, PF", dlr.TDOA_PF_NEAR, GREY, "--", None),
        )
    ]
    plot_cumulative(curves, path, title=f"Fig. 8: two time differences alone, {told}", most_m=200.0)


def _hybrid(run: dlr.PaperRun, path: Path, told: str) -> None:
    published = dlr_table.PUBLISHED["hybrid"]
    above = f"{dlr_scene.THRESHOLD_DB:g} dB".replace("-", "−")
    curves = [
        Distribution(name, run.errors_m[key], colour, style, claim)
        for name, key, colour, style, claim in (
            (_BOTH, dlr.EKF, BLACK, "-", published["ekf_gnss"]),
            (f"edge, above {above}", dlr.AT_EDGE, BLUE, "-", published["ekf_edge"]),
            ("edge, three stations", dlr.FIXED_EDGE, SKY, "--", None),
            (f"near, above {above}", dlr.AT_NEAR, ORANGE, "-", None),
            ("near, three stations", dlr.FIXED_NEAR, VERMILLION, "--", None),
        )
    ]
    plot_cumulative(
        curves, path, title=f"Fig. 9: satellites and time differences, EKF, {told}", most_m=40.0
    )


def _thresholds(run: dlr.PaperRun, path: Path, told: str) -> None:
    found = dlr_table.figures(run)
    three = {
        where: percentile_of_tracks(run.errors_m[key], run.every, dlr_table.SHARE)
        for where, key in ((dlr_scene.EDGE, dlr.FIXED_EDGE), (dlr_scene.NEAR, dlr.FIXED_NEAR))
    }
    lines = [
        OverThreshold(
            name, dlr.THRESHOLDS_DB, dlr_table.over_threshold(run, where, run.every), three[where],
            f"{name}, three stations", colour,
        )
        for name, where, colour in (
            ("edge", dlr_scene.EDGE, BLUE), ("near", dlr_scene.NEAR, ORANGE),
        )
    ]  # fmt: skip
    plot_over_threshold(
        lines, path, title=f"Fig. 9: 90 % error by SINR threshold, EKF, {told}, 95 % intervals",
        chosen_db=dlr_scene.THRESHOLD_DB,
        bound=("satellites alone", found["hybrid"]["ekf_gnss"].value),
    )  # fmt: skip


def _critical(run: dlr.PaperRun, path: Path, told: str) -> None:
    published = dlr_table.PUBLISHED["critical"]
    curves = [
        Distribution(name, run.errors_m[key][run.critical], colour, style, claim)
        for name, key, colour, style, claim in (
            ("GPS", dlr.GPS, GREY, "-", published["gps"]),
            (_BOTH, dlr.EKF, BLACK, "-", published["gps_galileo"]),
            ("with TDOA, near", dlr.AT_NEAR, ORANGE, "-", published["near"]),
            ("with TDOA, edge", dlr.AT_EDGE, BLUE, "-", published["edge"]),
            ("TDOA alone, near", dlr.TDOA_EKF_NEAR, VERMILLION, "--", None),
            ("TDOA alone, edge", dlr.TDOA_EKF, SKY, "--", None),
        )
    ]
    share = 100 * float(run.critical.mean())
    plot_cumulative(
        curves, path,
        title=f"Fig. 10: fewer than {dlr.FEW} satellites ({share:.0f} % of epochs), EKF, {told}",
        most_m=80.0,
    )  # fmt: skip


def _over_time(run: dlr.PaperRun, seen_path: Path, error_path: Path) -> None:
    shown = run.shown
    shaded = (f"fewer than {dlr.FEW} satellites", run.critical[shown])
    galileo = run.satellites[shown] - run.gps[shown]
    panel = Panel("", "satellites in line of sight", [
        Curve(_BOTH, run.satellites[shown].astype(np.float64), BLACK),
        Curve("GPS", run.gps[shown].astype(np.float64), ORANGE),
        Curve("Galileo", galileo.astype(np.float64), GREEN),
    ])  # fmt: skip
    plot_error_panels(
        [panel], seen_path, title=f"Fig. 11: satellites over track {shown}", across="time / s",
        shaded=shaded,
    )  # fmt: skip
    rmse = np.sqrt(np.mean(run.over_time_m**2, axis=0))
    # Near a station there are often no differences: that curve lies on the first.
    looks = (
        (_BOTH, BLACK, "-"), ("with TDOA, near", ORANGE, "--"), ("with TDOA, edge", BLUE, "-"),
    )  # fmt: skip
    curves = [
        Curve(name, one, colour, style)
        for (name, colour, style), one in zip(looks, rmse, strict=True)
    ]
    panel = Panel("", "root mean square error / m", curves)
    plot_error_panels(
        [panel], error_path, across="time / s", shaded=shaded,
        title=f"Fig. 12: track {shown}, EKF, {len(run.over_time_m)} draws",
    )  # fmt: skip
