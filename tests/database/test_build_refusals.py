"""What a build refuses, before it writes anything, and how each refusal is worded."""

import numpy as np
import pytest
import shapely
from small_world import CRS, LATTICE, make_routes

from mapfilter.database.build import build, build_roads
from mapfilter.database.estimate import dry_run
from mapfilter.database.sources import LayerRoutes
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, InputError, OutputError
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.roads.route_points import RouteSource
from mapfilter.roads.ways import Ways


def between_the_centres():
    """Return a way 0.5 m wide that runs along the edge between two rows of pixels."""
    west, _, east, north = LATTICE.bounds_m
    line = shapely.LineString([(west, north - 50.0), (east, north - 50.0)])
    ways = Ways(
        CRS, np.array([1]), np.array([0], np.int16), ("path",), np.array([line]),
        np.array([False]), np.array([0], np.int8),
    )  # fmt: skip
    return LayerRoutes(RouteSource.of(ways, half_width_m=0.25), LATTICE)


def only(error):
    (fault,) = error.value.faults
    return fault.where, fault.expected, fault.got, fault.hint


def test_arguments_of_other_types_are_named_together(world, tmp_path):
    given = {"margin_db": "6", "tile_px": 16.0, "in_flight": 0, "writers": 0, "resume": 1}
    with pytest.raises(ConfigError) as caught:
        build(str(world.rasters.path), world.plan, world.routes, tmp_path / "db", **given)
    named = " ".join(fault.where for fault in caught.value.faults)
    assert all(name in named for name in ("rasters", *given))
    assert len(caught.value.faults) == 6
    build(world.rasters, world.plan, world.routes, tmp_path / "db", in_flight=1, writers=1)
    with pytest.raises(ConfigError):
        open_database(tmp_path / "db", verify="some")


def test_roads_without_a_point_differ_from_levels_below_the_floor(world, tmp_path):
    out = tmp_path / "db"
    with pytest.raises(InputError) as caught:
        build(world.rasters, world.plan, between_the_centres(), out)
    assert only(caught) == (
        str(world.rasters.path), "a level of at least -104 dBm at a point",
        "no point of the roads on the rasters",
        "roads beside the rasters, or narrower than their pixels",
    )  # fmt: skip
    with pytest.raises(InputError) as caught:
        build(world.rasters, world.plan, world.routes, out, floor_dbm=-12.5)
    assert only(caught) == (
        str(world.rasters.path), "a level of at least -12.5 dBm at a point", "none",
        "floor too high, or rasters hold no data along the roads",
    )  # fmt: skip
    assert list(tmp_path.iterdir()) == []


def test_roads_alone_need_a_point(tmp_path):
    with pytest.raises(InputError) as caught:
        build_roads(between_the_centres(), tmp_path / "db")
    assert only(caught) == (
        "roads", "a point near a way or in a square", "none",
        "roads beside the area, or narrower than its pixels",
    )  # fmt: skip
    with pytest.raises(InputError, match="tile_px: expected pixels >= 1, found 0"):
        build_roads(make_routes(), tmp_path / "db", tile_px=0)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OutputError):
        build_roads(make_routes(), tmp_path / "file" / "db")


def test_what_roads_alone_record(tmp_path):
    seen = []
    built = build_roads(
        make_routes(), tmp_path / "new" / "db", tile_px=16, progress=lambda *at: seen.append(at)
    )
    assert built.manifest["counts"] == {
        "points": len(make_routes()), "points_below_floor": 0, "points_off_rasters": 0,
    }  # fmt: skip
    assert built.manifest["parameters"] == {"margin_db": 6.0, "floor_dbm": -104.0, "tile_px": 16}
    assert built.manifest["inputs"] == []
    # As many as have a point of the roads, of twelve in all.
    tiles = {(row // 16, col // 16) for row, col in np.argwhere(make_routes().mask())}
    assert seen == [(number, len(tiles)) for number in range(1, len(tiles) + 1)]
    assert len(tiles) < 12


def test_rasters_that_cannot_be_read_again_end_the_build(world, tmp_path, monkeypatch):
    """Their checksum is taken beside the tiles; its failure is that of the build."""

    def unreadable(_):
        raise OSError("the disk is gone")

    monkeypatch.setattr(RxLevRasters, "sha256", unreadable)
    with pytest.raises(OSError, match="the disk is gone"):
        build(world.rasters, world.plan, world.routes, tmp_path / "db")
    assert list(tmp_path.iterdir()) == []


def test_an_estimate_refuses_what_the_build_refuses(world):
    inputs = world.rasters, world.plan, world.routes
    with pytest.raises(InputError) as caught:
        dry_run(*inputs, margin_db=-1.0, floor_dbm=104.0, tile_px=0)
    assert [fault.where for fault in caught.value.faults] == ["margin_db", "floor_dbm", "tile_px"]
