"""Drift of dead reckoning on real recordings: python benchmarks/dead_reckoning.py ../shared/data.

Walks of the indoor-location competition before 13:20 of 25 November 2019 chose the parameters of
``mapfilter.tracks.pdr``; the later ones judge them. Nothing was chosen on the drives but the error
of a bias that standing does not show.
"""

import sys
import tarfile
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter.geodesy import grid_convergence_rad, project, utm_crs
from mapfilter.tracks.deadreckoning import dead_reckon
from mapfilter.tracks.joining.moved import (
    motion_from_course,
    motion_from_odometry,
    rotation_matrices,
)
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.pdr.vehicle import reckon_odometry
from mapfilter.tracks.pdr.walk import reckon_walk
from mapfilter.tracks.readers.formats import read_recording

FIRST_JUDGED_S = 1574659200.0
DECLINATION_DEG = -5.4
"""Of Hangzhou at the end of 2019, west."""
HAND_COUNTS = {
    "5ddb653c9191710006b575a3": (105, 114),
    "5ddb65749191710006b575cf": (77, 88),
    "5ddb6f04c5b77e0006b1794d": (82, 86),
    "5ddb6f0f9191710006b575fb": (106, 111),
    "5ddb6f149191710006b57601": (30, 32),
    "5ddba2b99191710006b576da": (68, 76),
    "5de8efca1ba5a200068722b9": (62, 68),
}
"""Steps counted by eye in plots of the acceleration: clear ones, and with half steps at stops."""
LEAST_M = 20.0
BEFORE_M = 30.0


@dataclass(frozen=True, eq=False)
class Walk:
    """Sensors of a walk and its surveyed waypoints."""

    name: str
    sensors: dict[str, pd.DataFrame]
    truth: pd.DataFrame

    @property
    def judged(self) -> bool:
        """Whether it is later than the walks that chose the parameters."""
        return bool(self.truth["time_s"].iloc[0] > FIRST_JUDGED_S)


def read_walks(data: Path) -> list[Walk]:
    """Read the walks of the mall, in the order of time."""
    walks = []
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(data / "imu-wifi-indoor-mall/site1_F4_paths.tar.xz") as archive:
            archive.extractall(folder, filter="data")
        for path in sorted(Path(folder).rglob("*.txt")):
            tables = dict(read_recording(path).tables)
            walks.append(Walk(path.stem, tables, tables.pop("true_places")))
    return sorted(walks, key=lambda walk: walk.truth["time_s"].iloc[0])


def plain(walk: Walk) -> pd.DataFrame:
    """Return the plain baseline: threshold, 0.7 m a step, the compass of the moment."""
    return _plain(walk, _compass_heading(walk))


def plain_fused(walk: Walk) -> pd.DataFrame:
    """Return the baseline with headings of the phone's own fused rotation vector."""
    rows = walk.sensors["orientation"]
    forward = rotation_matrices(rows[["qx", "qy", "qz", "qw"]].to_numpy())[:, :2, 1]
    return _plain(walk, (rows["time_s"].to_numpy(), forward))


def _plain(walk: Walk, forward: tuple[np.ndarray, np.ndarray]) -> pd.DataFrame:
    rows = walk.sensors["accelerometer"]
    time_s = rows["time_s"].to_numpy()
    over = np.linalg.norm(rows.iloc[:, 1:4].to_numpy(), axis=1) > 9.81 + 1.0
    found = [time_s[0]]
    for k in np.flatnonzero(over[1:] & ~over[:-1]) + 1:
        if time_s[k] - found[-1] > 0.3:
            found.append(time_s[k])
    at = np.array(found)
    east, north = (np.interp(at, forward[0], part) for part in forward[1].T)
    heading = np.arctan2(north, east) - np.radians(DECLINATION_DEG)
    step = np.where(np.arange(len(at)) > 0, 0.7, 0.0)
    return pd.DataFrame({"time_s": at, "step_m": step, "heading_rad": heading})


def _compass_heading(walk: Walk) -> tuple[np.ndarray, np.ndarray]:
    """Return where the top edge points, by half a second of gravity and the field."""
    rows = walk.sensors["accelerometer"]
    time_s = rows["time_s"].to_numpy()
    up = rows.iloc[:, 1:4].rolling(25, center=True, min_periods=1).mean().to_numpy()
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    field = walk.sensors["magnetometer"]
    seen = [np.interp(time_s, field["time_s"], field.iloc[:, k]) for k in (1, 2, 3)]
    east = np.cross(np.stack(seen, axis=1), up)
    east /= np.linalg.norm(east, axis=1, keepdims=True)
    north = np.cross(up, east)
    return time_s, np.stack([east[:, 1], north[:, 1]], axis=1)


def ours(walk: Walk, pose: str = "auto") -> pd.DataFrame:
    """Return the motion of mapfilter; no row where no steps were found."""
    options = WalkOptions(declination_deg=DECLINATION_DEG, pose=pose)
    found, _ = reckon_walk(walk.sensors, options)
    return plain(walk).iloc[:1] if found is None else found.motion


def drift(walk: Walk, motion: pd.DataFrame) -> tuple[float, list[float]]:
    """Return the drift in metres per 100 m at the last waypoint, and of each 20 m between some."""
    truth = walk.truth
    time_s = truth["time_s"].to_numpy()
    true = truth[["east_m", "north_m"]].to_numpy()
    east, north = dead_reckon(0.0, 0.0, motion["step_m"].fillna(0.0), motion["heading_rad"])
    found = np.stack([np.interp(time_s, motion["time_s"], part) for part in (east, north)], axis=1)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(true, axis=0).T))])
    error = found - true
    parts = []
    for i in range(len(length)):
        after = np.flatnonzero(length - length[i] >= LEAST_M)
        if after.size:
            away_m = float(np.hypot(*(error[after[0]] - error[i])))
            parts.append(100 * away_m / float(length[after[0]] - length[i]))
    if length[-1] < LEAST_M:
        return float("nan"), parts
    return 100 * float(np.hypot(*(error[-1] - error[0]))) / float(length[-1]), parts


METHODS = {
    "plain: threshold, 0.7 m, compass": plain,
    "plain, the phone's rotation vector": plain_fused,
    "mapfilter, pose any": lambda walk: ours(walk, "any"),
    "mapfilter": ours,
}


def walk_table(walks: list[Walk], methods: dict[str, Callable[[Walk], pd.DataFrame]]):
    """Return drift by method: at the end of walks of 20 m or more, and over stretches of 20 m."""
    rows = []
    for judged in (False, True):
        chosen = [walk for walk in walks if walk.judged == judged]
        if not chosen:
            continue
        for name, method in methods.items():
            found = [drift(walk, method(walk)) for walk in chosen]
            ends = np.array([end for end, _ in found])
            ends = ends[np.isfinite(ends)]
            parts = [part for _, several in found for part in several]
            figures = [len(ends), *np.percentile(ends, [50, 90])]
            figures += [len(parts), *np.percentile(parts, [50, 90])]
            rows.append(["judging" if judged else "choosing", name, *figures])
    columns = ["walks", "method", "n", "end 50 %", "end 90 %", "20 m", "20 m 50 %", "20 m 90 %"]
    return pd.DataFrame(rows, columns=columns)


def step_table(walks: list[Walk]) -> pd.DataFrame:
    """Return counts of steps beside those by hand."""
    rows = []
    for walk in walks:
        if walk.name in HAND_COUNTS:
            low, high = HAND_COUNTS[walk.name]
            found = int((ours(walk)["step_m"] > 0).sum())
            simple = int((plain(walk)["step_m"] > 0).sum())
            use = "judging" if walk.judged else "choosing"
            rows.append([use, walk.name, low, high, found, simple])
    columns = ["walks", "walk", "by hand", "with half steps", "mapfilter", "plain"]
    return pd.DataFrame(rows, columns=columns)


def length_errors(walks: list[Walk], *, judged: bool) -> np.ndarray:
    """Return the logarithm of found by true length for each walk of 20 m or more."""
    errors = []
    for walk in walks:
        true = walk.truth[["east_m", "north_m"]].diff()
        length_m = float(np.hypot(true["east_m"], true["north_m"]).sum())
        if walk.judged == judged and length_m >= LEAST_M:
            motion = ours(walk)
            first, last = walk.truth["time_s"].iloc[[0, -1]]
            inside = motion["time_s"].between(first, last)
            errors.append(np.log(motion.loc[inside, "step_m"].sum() / length_m))
    return np.array(errors)


def drive_drift(motion: pd.DataFrame, truth: pd.DataFrame, over_m: float) -> np.ndarray:
    """Return drift in metres per 100 m of stretches.

    Without headings each stretch begins with the true direction of the 30 m before it. Those with
    an unknown step are left out.
    """
    time_s = motion["time_s"].to_numpy()
    true = np.stack([np.interp(time_s, truth["time_s"], truth[c]) for c in ("east", "north")])
    turn = motion["turn_rad"].fillna(0.0).to_numpy()
    heading = motion["heading_rad"].ffill().bfill().to_numpy()
    turns_only = bool(np.isnan(heading).all())
    if turns_only:
        heading = np.cumsum(turn) - turn / 2
    found = np.stack(dead_reckon(0.0, 0.0, motion["step_m"].fillna(0.0), heading))
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(true)))])
    drifts = []
    for i in range(0, len(time_s), 5):
        j, k = np.searchsorted(length, [length[i] - BEFORE_M, length[i] + over_m])
        if k >= len(time_s):
            break
        if length[i] < BEFORE_M or motion["step_m"].iloc[j + 1 : k + 1].isna().any():
            continue
        known, seen = (part[:, i] - part[:, j] for part in (true, found))
        turned = np.arctan2(known[1], known[0]) - np.arctan2(seen[1], seen[0])
        turned = turned if turns_only else 0.0
        rotation = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
        apart = rotation @ (found[:, k] - found[:, i]) - (true[:, k] - true[:, i])
        drifts.append(100 * float(np.hypot(*apart)) / float(length[k] - length[i]))
    return np.array(drifts)


def _truth(path: Path, table: str) -> pd.DataFrame:
    rows = read_recording(path).tables[table]
    crs = utm_crs(float(rows["lon_deg"].median()), float(rows["lat_deg"].median()))
    east, north = project(crs, rows["lon_deg"], rows["lat_deg"])
    return pd.DataFrame({"time_s": rows["time_s"], "east": east, "north": north})


def drive_table(data: Path) -> pd.DataFrame:
    """Return drift of wheel odometry in Berlin, and of a receiver's speed and course."""
    folder = data / "gnss-odometry-smartloc"
    odometry = read_recording(folder / "Berlin_Potsdamer_Platz_Input.txt.gz").tables["odometry"]
    truth = _truth(folder / "Berlin_Potsdamer_Platz_GT.txt.gz", "truth")
    drives = [
        ("smartLoc", "plain: speed and yaw rate", motion_from_odometry(odometry), truth),
        ("smartLoc", "mapfilter", reckon_odometry(odometry)[0], truth),
    ]
    folder = data / "gnss-android-vehicle"
    fixes = read_recording(folder / "MTV.Local1.ublox-F9K.20200206-181434.nmea.gz").tables
    truth = _truth(folder / "MTV.Local1.SPAN.20200206-181434.gga.gz", "positions")
    convergence_rad = grid_convergence_rad("EPSG:32610", -122.08, 37.4)
    course = motion_from_course(fixes["positions"], convergence_rad)
    drives.append(("Mountain View", "mapfilter, speed and course", course, truth))
    folder = data / "kitti-osm"
    true = pd.read_csv(folder / "truth/00.csv").rename(
        columns={"east_m": "east", "north_m": "north"}
    )
    for name, file in (("ORB-SLAM", "orb-slam-00"), ("S-PTAM", "s-ptam-00")):
        motion = read_recording(folder / f"odometry/{file}.csv").tables["motion"]
        drives.append(("KITTI 00", f"{name}, as it is", motion, true))
    rows = []
    for name, method, motion, known in drives:
        for over_m in (100.0, 500.0):
            found = drive_drift(motion, known, over_m)
            rows.append([name, method, over_m, len(found), *np.percentile(found, [50, 90])])
    columns = ["drive", "method", "over, m", "n", "drift 50 %", "drift 90 %"]
    return pd.DataFrame(rows, columns=columns)


def main(data: Path) -> None:
    """Print all tables."""
    walks = read_walks(data)
    print("Walks: drift in m per 100 m, absolute headings, start at the first waypoint")
    print(walk_table(walks, METHODS).round(1).to_string(index=False))
    print("\nSteps")
    print(step_table(walks).to_string(index=False))
    for judged in (False, True):
        errors = length_errors(walks, judged=judged)
        use = "judging" if judged else "choosing"
        print(f"length of walks, {use}: {np.mean(errors):+.1%} ± {np.std(errors):.1%}")
    print("\nDrives: drift in m per 100 m, start with the true position and, by turns, direction")
    print(drive_table(data).round(2).to_string(index=False))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "../shared/data"))
