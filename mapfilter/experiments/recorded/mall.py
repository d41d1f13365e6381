"""Walks with a phone in a mall: raw sensors, Wi-Fi and a floor plan, from an unknown start.

The whole chain: the access points of the other walks are the radio map, each scan is located by
itself (``wifi``), and the positions with their radii go as fixes into the Bayes map filter over
the walkable part of the plan (``bayes``), and into a Kalman filter without a map (``ekf`` and
``ekf-smoothed``), with steps and headings made of the raw sensors. How much of the fixes' errors
lasts, and for how long, is found where walks of the radio map are left out in turn. Three oracles
show what these positions allow, smoothed: one is given the true first waypoint, one the true size
of each fix's error, one the true way between waypoints in place of steps. Walks are judged at their
surveyed waypoints, from the first scan on, claimed or not: most walks end before the map filter
claims one. The later half of the walks is judged, in two parts, each by all other walks: parameters
of steps and headings were chosen on walks of the first half.
"""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
import shapely

from mapfilter._inputs import json_value, read_input
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.benchmarks.single_reports import BASELINE, METHODS
from mapfilter.experiments.recorded.benchmark import Benchmark, Journey, Judged, Task
from mapfilter.experiments.recorded.ground import open_ground, roads_alone
from mapfilter.experiments.recorded.locating import OpenMap, locate_log
from mapfilter.experiments.recorded.oracles import (
    MOTION,
    NOISE,
    START,
    with_fix_errors,
    with_true_fixes,
    with_true_motion,
)
from mapfilter.experiments.recorded.outages import errors_at
from mapfilter.experiments.recorded.rows import Found
from mapfilter.experiments.recorded.scoring import score_journey
from mapfilter.lattice import Lattice
from mapfilter.positioning.fingerprints.lasting import LastingError, lasting_error
from mapfilter.positioning.fingerprints.located import LocatedReports
from mapfilter.positioning.fingerprints.locating import fit_locator, locate_by
from mapfilter.positioning.fingerprints.options import AUTO
from mapfilter.positioning.fingerprints.sources import reports_of_logs
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.log_options import fitted_to_log
from mapfilter.positioning.loop import locate
from mapfilter.positioning.positioned_track import PositionedTrack
from mapfilter.propagation.shadowing import named_rng
from mapfilter.radio.cells import CellPlan
from mapfilter.roads.lattice import RouteLattice
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.store import read_log, write_log

PARTS = 2
DECLINATION_DEG = -5.4
"""Of Hangzhou at the end of 2019."""
_ARCHIVE, _PLAN, _INFO = "*_paths.tar.xz", "geojson_map.json", "floor_info.json"
_RESOLUTION_M = 1.0
_LARGEST_BYTES, _LARGEST_WALK_BYTES = 100_000_000, 100_000_000
_SIGMA_OF_RADIUS_67 = 1 / 1.489
"""Deviation along one axis of a round normal distribution, of the radius of 67 %."""
_MAP, _WALKS = "floor", "walks"
_OPEN = OpenOptions(combine=CombineOptions(walk=WalkOptions(declination_deg=DECLINATION_DEG)))


def units(_: Path) -> list[tuple[str, str, int]]:
    """Return the two parts of the judged walks."""
    return [("floor", f"fold-{number + 1}", 1) for number in range(PARTS)]


def prepare(folder: Path, work: Path) -> None:
    """Read the walks once for all parts, and build a database of the floor that one can walk on."""
    with TemporaryDirectory(dir=work) as text:
        unpack(_first(folder, _ARCHIVE), Path(text))
        for file in _walks(Path(text)):
            log = open_log(file, options=_OPEN).log
            write_log(log, work / _WALKS / file.stem)
            crs = log.crs
    roads_alone(walkable(folder, crs), work / _MAP)


def read(task: Task) -> tuple[dict[str, TrackLog], OpenMap]:
    """Read the walks, and open the map of the floor."""
    return _logs(task.work), OpenMap.open(task.work / _MAP)


def judge(task: Task, shared: tuple[dict[str, TrackLog], OpenMap]) -> Judged:
    """Locate the walks of a part by all others."""
    logs, over = shared
    names = list(logs)
    later = names[len(names) // 2 :]
    own = later[int(task.unit.rpartition("-")[2]) - 1 :: PARTS]
    training = reports_of_logs([log for name, log in logs.items() if name not in own])
    fitted = {name: fit_locator(training, METHODS[name]) for name in (AUTO, BASELINE)}
    lasting = lasting_error(fitted[AUTO])
    found: list[Found] = []
    journeys: dict[str, Journey] = {}
    worst_m: dict[str, float] = {}
    for name in own:
        log = logs[name]
        truth = Truth.of_table(log.truth)
        if truth is None or log.radio.empty:
            continue
        reports = reports_of_logs([log])
        alone, baseline = (locate_by(one, reports) for one in fitted.values())
        baseline_m = baseline.error_m[np.isfinite(baseline.error_m)]
        known = np.isfinite(alone.error_m)
        held = (alone.error_m <= alone.radii_m[:, 2])[known]
        none = (None, None, None)
        note = f"{int((~known).sum())} of {len(known)} scans without a position, or a true one"
        wifi = (alone.error_m[known], held, baseline_m)
        found.append(Found("floor", "wifi", name, *none, *wifi, note=note))
        fixed = with_fixes(log, alone)
        first_s = float(fixed.gnss["time_s"].min()) if len(fixed.gnss) else inf
        for method, located in _located(fixed, truth, task, over, lasting).items():
            scored = score_journey(
                "floor", method, name, located.estimate, truth, seconds=located.filter_s
            )
            errors_m, covered = errors_at(located.estimate, truth, truth.time_s.tolist())
            # Before the first scan nobody has a position; afterwards one that lacks counts.
            since = truth.time_s >= first_s
            note = f"{int((~since).sum())} waypoints before the first scan. {scored.note}"
            found.append(
                replace(
                    scored,
                    error_m=errors_m[since],
                    covered=covered[since],
                    baseline_m=baseline_m,
                    note=note,
                )
            )
            located_m = errors_m[np.isfinite(errors_m)]
            if located_m.size and located_m.max() > worst_m.get(method, -1.0):
                worst_m[method] = float(located_m.max())
                given = fixed.gnss[["time_s", "east_m", "north_m"]].to_numpy()
                journeys[method] = Journey(located.estimate, truth, over.path, given)
    return Judged(tuple(found), journeys)


def _located(
    log: TrackLog, truth: Truth, task: Task, over: OpenMap, lasting: LastingError | None
) -> dict[str, PositionedTrack]:
    """Locate a walk with fixes, of whose errors a part lasts, by all filters."""
    usual = KalmanFilter()
    kalman = usual
    if lasting is not None:
        kalman = replace(usual, fix_lasting_m=lasting.sd_m, fix_lasting_s=lasting.memory_s)

    def rng() -> np.random.Generator:
        return named_rng(task.seed, "mall", task.unit, str(log.start_utc_s))

    found = {"bayes": locate_log(log, over, rng())}
    for name, smooth in (("ekf", False), ("ekf-smoothed", True)):
        found[name] = _without_map(log, replace(kalman, smooth=smooth), rng())
    if len(log.gnss):
        started = with_true_fixes(log, truth, truth.time_s <= truth.time_s[0])
        found[START] = _without_map(started, replace(kalman, smooth=True), rng())
        known = with_fix_errors(log, truth)
        found[NOISE] = _without_map(known, replace(usual, smooth=True), rng())
        moved = with_true_motion(log, truth)
        found[MOTION] = _without_map(moved, replace(kalman, smooth=True), rng())
    return found


def _without_map(log: TrackLog, kalman: KalmanFilter, rng: np.random.Generator) -> PositionedTrack:
    """Locate a walk by a Kalman filter."""
    options, _ = fitted_to_log(kalman, log)
    return locate(log, options.over_sites(CellPlan(log.crs, ())), rng)


def unpack(archive: Path, target: Path) -> None:
    """Unpack the walks of an archive: the text files in it, by their names alone."""
    data = read_input(archive, _LARGEST_BYTES, "an archive of walks")
    target.mkdir(parents=True, exist_ok=True)
    try:
        with tarfile.open(fileobj=io.BytesIO(data)) as packed:
            for member in packed:
                name = Path(member.name).name
                if not member.isfile() or not name.endswith(".txt"):
                    continue
                inner = packed.extractfile(member)
                if inner is not None and member.size <= _LARGEST_WALK_BYTES:
                    (target / name).write_bytes(inner.read())
    except (tarfile.TarError, EOFError, OSError) as error:
        raise fail(InputError, str(archive), "an archive of walks", error, "cut off") from error


def walkable(folder: Path, crs: str) -> RouteLattice:
    """Return the floor without its shops, as open ground in the frame of the plan."""
    try:
        plan = json_value(read_input(folder / _PLAN, _LARGEST_BYTES, "a floor plan"))
        info = json_value(read_input(folder / _INFO, _LARGEST_BYTES, "a floor's size"))
        size_m = (float(info["map_info"]["width"]), float(info["map_info"]["height"]))
        shapes: list[Any] = [
            shapely.from_geojson(json.dumps(feature["geometry"])) for feature in plan["features"]
        ]
    except (ValueError, KeyError, TypeError, shapely.errors.GEOSException) as error:
        expected = "a floor outline and shops (GeoJSON), and the plan's width and height"
        raise fail(InputError, str(folder / _PLAN), expected, repr(error)) from error
    outline, shops = shapely.make_valid(shapes[0]), shapely.make_valid(np.array(shapes[1:]))
    free = shapely.difference(outline, shapely.union_all(shops))
    west, south, east, north = outline.bounds
    scale = np.array([size_m[0] / (east - west), size_m[1] / (north - south)])
    # The plan's frame begins at the lower left corner of the outline.
    inner = shapely.transform(free, lambda place: (place - [west, south]) * scale)
    lattice = Lattice.covering(crs, (0.0, 0.0, *size_m), _RESOLUTION_M)
    whole = open_ground(lattice)
    east_m, north_m = whole.east_north_m
    inside = shapely.contains_xy(inner, east_m, north_m)
    return replace(
        whole,
        row=whole.row[inside],
        col=whole.col[inside],
        way_id=whole.way_id[inside],
        way_class=whole.way_class[inside],
        distance_to_way_m=whole.distance_to_way_m[inside],
        on_square=whole.on_square[inside],
    )


def with_fixes(log: TrackLog, located: LocatedReports) -> TrackLog:
    """Return a log with the positions of its reports as fixes, and without the reports."""
    known = np.isfinite(located.east_m) & np.isfinite(located.radii_m[:, 1])
    sigma_m = located.radii_m[known, 1] * _SIGMA_OF_RADIUS_67
    fixes = pd.DataFrame(
        {
            "time_s": located.time_s[known],
            "east_m": located.east_m[known],
            "north_m": located.north_m[known],
            "var_east_m2": sigma_m**2,
            "var_north_m2": sigma_m**2,
            "cov_east_north_m2": np.zeros(int(known.sum())),
        }
    )
    return replace(log, gnss=fixes, radio=log.radio.iloc[:0])


def _logs(work: Path) -> dict[str, TrackLog]:
    """Return the walks by name, in the order of time."""
    logs = {path.name: read_log(path) for path in sorted((work / _WALKS).iterdir())}
    return dict(sorted(logs.items(), key=lambda item: item[1].start_utc_s))


def _walks(folder: Path) -> list[Path]:
    files = sorted(folder.glob("*.txt"))
    if len(files) < 2 * PARTS:
        raise fail(InputError, str(folder), f"{2 * PARTS} walks or more", len(files))
    return files


def _first(folder: Path, pattern: str) -> Path:
    files: Sequence[Path] = sorted(folder.glob(pattern))
    if not files:
        raise fail(InputError, str(folder), pattern, "none")
    return files[0]


BENCHMARK = Benchmark(
    "mall",
    "imu-wifi-indoor-mall",
    (_ARCHIVE, _PLAN, _INFO),
    units,
    judge,
    prepare,
    read,
    baseline="mean",
)
