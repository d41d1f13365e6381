"""An area built region by region from the same rasters, and put together."""

import pandas as pd
from command_line import assert_done, mapfilter, settings

from mapfilter.database.store import open_database

WEST = "24.9420,60.1655,24.9460,60.1702"
EAST = "24.9455,60.1655,24.9495,60.1702"


def table(database, name):
    found = pd.concat(pd.read_parquet(part) for part in sorted(database.glob(name)))
    columns = [column for column in found.columns if column not in ("point", "geometry")]
    return found[columns].astype({"cell": str} if "cell" in columns else {})


def test_regions_of_the_same_rasters_merge_to_the_whole(world, tmp_path):
    built = {}
    for name, box in (("west", WEST), ("east", EAST)):
        given = settings(area__bbox=box, rasters__path=world.rasters)
        assert_done(mapfilter("build", "-c", world.toml, *given, "--out", tmp_path / name))
        built[name] = tmp_path / name / "database"
    whole = open_database(world.database)
    for path in built.values():
        assert open_database(path).lattice.cols < whole.lattice.cols

    merged = tmp_path / "merged"
    assert_done(mapfilter("merge", built["west"], built["east"], "--out", merged))
    points = [len(open_database(path).points()) for path in (*built.values(), merged)]
    assert points[2] > max(points[:2])
    assert points[2] == len(whole.points())
    order = ["row", "col", "cell"]
    levels = [
        table(path, "levels/*/*.parquet").sort_values(order, ignore_index=True)
        for path in (world.database, merged)
    ]
    pd.testing.assert_frame_equal(*levels)


def test_a_region_is_as_large_as_it_was_asked_for(world, tmp_path):
    given = settings(area__bbox=WEST, rasters__path=world.rasters)
    assert_done(mapfilter("build", "-c", world.toml, *given, "--out", tmp_path))
    told = assert_done(mapfilter("info", tmp_path / "database", "--json")).json
    whole = assert_done(mapfilter("info", world.database, "--json")).json
    assert told["bounds_m"][0] == whole["bounds_m"][0]
    assert told["bounds_m"][2] < whole["bounds_m"][2] - 100
