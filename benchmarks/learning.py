"""What journeys tell of planted faults: python benchmarks/learning.py MAP BBOX SEED OUT [COUNT].

MAP is an OpenStreetMap file, BBOX is west,south,east,north in degrees, OUT an empty folder. COUNT
journeys (40) without truth are walked in the case faults-together of the harsh world, whose network
and map have two sectors swapped, a site rotated, a cell off, a tenth of the cells 10 dB off, and a
tenth of the ways missing. The findings are compared with what was planted; new journeys are located
over the clean, the faulty and the repaired database.
"""

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import KDTree

from mapfilter.config.load import load_config
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.evaluation.accuracy import accuracy
from mapfilter.evaluation.claims import score_claims
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.benchmarks.foreign import (
    VARIANTS,
    ForeignWorld,
    RouteRuns,
    database_name,
)
from mapfilter.experiments.benchmarks.world_cases import HARSH
from mapfilter.learning.patch import Change, read_patch
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.loop import locate
from mapfilter.simulation.worlds.faults import TURNED_DEG, GivenInputs
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.log_folders import list_logs
from mapfilter.tracks.store import read_log
from mapfilter.workflows.evaluations.foreign import load_foreign, prepare, write_journeys
from mapfilter.workflows.inputs.world import World
from mapfilter.workflows.learn import run_accept, run_learn

CASE = "faults-together"
NEW_JOURNEYS, FIRST_NEW = 20, 1000
LEAST_JOURNEYS = 3
OFF_M, WALKED_M, NEAR_M, STEP_M = 9.0, 30.0, 12.0, 2.0
"""Points of a missing way count beyond that distance to the ways that are left; a journey walked
one where it did so for that long; a proposed line is on one where it is that near."""
TURN_SLACK_DEG, OFFSET_SLACK_DB = 35.0, 5.0

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MissingWays:
    """Points of the ways that a database lacks, away from all that it has.

    Parameters
    ----------
    way_id : (N,) array
    places_m : (N, 2) array
    """

    way_id: NDArray[np.int64]
    places_m: Values

    @classmethod
    def between(cls, clean: RadioRouteDatabase, faulty: RadioRouteDatabase) -> "MissingWays":
        """Return what the clean database has and the faulty one has not."""
        (way_id, whole), (_, left) = points_of(clean), points_of(faulty)
        away_m, _ = KDTree(left).query(whole)
        return cls(way_id[away_m > OFF_M], whole[away_m > OFF_M])

    def walked(self, logs: list[TrackLog]) -> set[int]:
        """Return the ways that enough journeys walked."""
        times: dict[int, int] = {}
        for log in logs:
            along = sampled(log.truth[["east_m", "north_m"]].to_numpy())
            away_m, nearest = KDTree(self.places_m).query(along)
            ways, steps = np.unique(self.way_id[nearest[away_m <= OFF_M]], return_counts=True)
            for way in ways[steps * STEP_M >= WALKED_M].tolist():
                times[way] = times.get(way, 0) + 1
        return {way for way, journeys in times.items() if journeys >= LEAST_JOURNEYS}

    def on(self, change: Change) -> tuple[float, set[int]]:
        """Return the share of a proposed line that is on missing ways, and the ways."""
        away_m, nearest = KDTree(self.places_m).query(sampled(np.array(change.line_m)))
        near = away_m <= NEAR_M
        ways, steps = np.unique(self.way_id[nearest[near]], return_counts=True)
        return float(near.mean()), set(ways[steps * STEP_M >= WALKED_M / 2].tolist())


def points_of(database: RadioRouteDatabase) -> tuple[NDArray[np.int64], Values]:
    """Return way and place of each point of a database."""
    field = database.field()
    row, col = np.nonzero(field.on_way)
    return field.way_id[row, col], np.column_stack(field.lattice.east_north(row, col))


def sampled(line_m: Values) -> Values:
    """Return a line's places, evenly spaced."""
    line = shapely.LineString(line_m)
    at_m = np.arange(0.0, line.length + STEP_M, STEP_M)
    return np.asarray(shapely.get_coordinates(shapely.line_interpolate_point(line, at_m)))


def planted(given: GivenInputs) -> list[tuple[str, tuple[str, ...]]]:
    """Return each fault of the network, with its cells."""
    found = []
    for name, cells in given.by_fault.items():
        if name in ("sectors-swapped", "site-rotated"):
            found.append((name, cells))
        else:
            found += [(name, (cell,)) for cell in cells]
    return found


def names(change: Change, fault: tuple[str, tuple[str, ...]], given: GivenInputs) -> bool:
    """Return whether a change is the remedy of a fault."""
    name, cells = fault
    if set(change.cells) != set(cells):
        return False
    if name == "site-rotated":
        off_deg = (change.turn_deg + TURNED_DEG + 180) % 360 - 180
        return change.kind == "rotated" and abs(off_deg) <= TURN_SLACK_DEG
    if name == "cells-biased-10":
        off_db = change.offset_db + given.offset_db[cells[0]]
        return change.kind == "offset" and abs(off_db) <= OFFSET_SLACK_DB
    return change.kind == {"sectors-swapped": "swapped", "cells-off": "dead"}[name]


def new_journeys(world: ForeignWorld) -> list[TrackLog]:
    """Return journeys that nothing was learned from."""
    case = HARSH[CASE]
    runs = range(FIRST_NEW, FIRST_NEW + NEW_JOURNEYS)
    return [RouteRuns(world, number * VARIANTS).run(case)[1] for number in runs]


def located(database: RadioRouteDatabase, logs: list[TrackLog]) -> dict[str, float]:
    """Locate journeys over a database and score them."""
    choice = replace(BayesFilter(), **HARSH[CASE].data_sheet).over(database)
    found = []
    for number, log in enumerate(logs):
        truth = Truth.of_table(log.truth)
        if truth is None:
            raise ValueError("a simulated journey has ground truth")
        estimate = locate(log, choice, np.random.default_rng(number)).estimate
        found.append((accuracy(estimate, truth), score_claims(estimate, truth)))
    right = [one for one, _ in found if one.success]
    claimed = sum(claims.claimed for _, claims in found)
    return {
        "journeys": len(found),
        "right": len(right),
        "wrong": sum(one.switched and not one.success for one, _ in found),
        "to_converged_m": float(np.mean([one.switch_distance_m for one in right] or [np.nan])),
        "error_mean_m": float(np.mean([one.error_mean_m for one in right] or [np.nan])),
        "error_median_m": float(np.median([one.error_mean_m for one in right] or [np.nan])),
        "off_50m": 1 - sum(one.within_50m for _, one in found) / claimed if claimed else np.nan,
    }


def main(map_file: str, bbox: str, seed: int, out: Path, count: int = 40) -> None:
    """Print one JSON object."""
    settings = [f"area.map={map_file!r}", f"area.bbox={bbox}", "output.pictures=none"]
    config, _ = load_foreign(None, settings, out=out)
    world, _ = prepare(World.of(config), "harsh", out / "world", seed, [CASE], 1)
    given = write_journeys(world, CASE, count, out / "journeys")
    clean = open_database(world.folder / database_name(None, 0))
    faulty = open_database(world.folder / database_name(CASE, 0))
    logs = [read_log(path) for path in list_logs(out / "journeys")]
    learn_settings = [
        *settings,
        f"database.path={str(faulty.path)!r}",
        f"track.path={str(out / 'journeys')!r}",
        "filter.name=bayes",
        *(f"filter.bayes.{name}={value}" for name, value in HARSH[CASE].data_sheet.items()),
    ]
    learned = load_config(None, learn_settings, out=out)
    result = run_learn(learned, out / "learned", use_truth=False)
    changes = read_patch(result.patch).changes if result.patch is not None else ()
    faults, ways = planted(given), MissingWays.between(clean, faulty)
    of_cells = [change for change in changes if change.kind != "way"]
    lines = [(change, *ways.on(change)) for change in changes if change.kind == "way"]
    walked = ways.walked(logs)
    found = {
        "map": Path(map_file).name,
        "seed": seed,
        "journeys": count,
        "used": result.used,
        "planted": [f"{name} {' '.join(cells)}" for name, cells in faults],
        "named": [
            f"{name} {' '.join(cells)}"
            for name, cells in faults
            if any(names(change, (name, cells), given) for change in of_cells)
        ],
        "named_wrong": [
            f"{change.kind} {' '.join(change.cells)}"
            for change in of_cells
            if not any(names(change, fault, given) for fault in faults)
        ],
        "ways_walked": len(walked),
        "ways_found": len(walked & set().union(*(on for _, _, on in lines))),
        "ways_proposed": len(lines),
        "ways_proposed_right": sum(share >= 0.5 for _, share, _ in lines),
        "seconds": result.seconds,
    }
    again = new_journeys(world)
    databases = {"clean": clean, "faulty": faulty}
    if result.patch is not None:
        run_accept(faulty.path, result.patch, out / "repaired")
        databases["repaired"] = open_database(out / "repaired")
    found |= {name: located(database, again) for name, database in databases.items()}
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), Path(sys.argv[4]), *map(int, sys.argv[5:6]))
