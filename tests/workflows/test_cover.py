"""Cells far off, and maps, rasters and land use that cover but a part of the area."""

import json

import numpy as np
import pytest
import rasterio
from command_line import assert_done, assert_refused, contents, mapfilter

from mapfilter.lattice import Lattice, outside_m
from mapfilter.rasters.opening import open_rasters

BEYOND = "--set=area.bbox=24.9420,60.1660,24.9645,60.1697"
"""The world's box, three times as wide."""


def test_how_far_outside_a_lattice_positions_lie():
    lattice = Lattice("EPSG:32635", 1000.0, 2000.0, 5.0, rows=100, cols=200)
    east_m = np.array([1000.0, 1500.0, 997.0, 2005.0])
    north_m = np.array([1500.0, 2007.0, 1496.0, 1488.0])
    assert outside_m(east_m, north_m, lattice).tolist() == [0.0, 7.0, 5.0, 13.0]


@pytest.mark.parametrize(
    ("move", "hint"),
    [
        (lambda lon, lat: (lon + 6, lat), "another zone"),
        (lambda lon, lat: (lon, lat + 0.6), "another zone"),
    ],
)
@pytest.mark.parametrize("command", ["predict", "build", "simulate"])
def test_cells_far_off_are_refused(command, move, hint, own_world):
    lines = own_world.plan.read_text().splitlines()
    for index, line in enumerate(lines[1:], start=1):
        fields = line.split(",")
        lon, lat = move(float(fields[3]), float(fields[2]))
        fields[2:4] = [str(lat), str(lon)]
        lines[index] = ",".join(fields)
    own_world.plan.write_text("\n".join(lines) + "\n")
    before = contents(own_world.folder)
    outcome = mapfilter(command, "-c", own_world.toml)
    told = f"{own_world.plan}: expected cells within 50 km of the area, found 3 of 3 up to"
    assert_refused(outcome, told, "(A, B, C)", hint)
    assert len(outcome.err.splitlines()) == 1
    assert contents(own_world.folder) == before


def test_cells_outside_the_area_but_not_far_are_used(own_world):
    plan = own_world.plan.read_text().replace("60.16890", "60.46890")
    own_world.plan.write_text(plan)
    assert_done(mapfilter("predict", "-c", own_world.toml))


def share_of(what, notes):
    """Return the percentage in the one note on what covers a part of the area."""
    (note,) = [note for note in notes if note.startswith(f"{what} ") and "covers" in note]
    return float(note.split("covers ")[1].split("%")[0])


def test_a_part_of_the_map_and_of_the_rasters(own_world):
    database = f"--set=database.path={own_world.folder / 'db'}"
    whole = assert_done(mapfilter("build", "-c", own_world.toml, database, "--json")).json
    assert not any("covers" in note for note in whole["notes"])
    part = assert_done(mapfilter("build", "-c", own_world.toml, BEYOND, database, "--json")).json
    assert 30 < share_of("the set of rasters", part["notes"]) < 36
    north = "--set=area.bbox=24.9420,60.1660,24.9495,60.1990"
    given = ("-c", own_world.toml, north, f"--set=output.dir={own_world.folder / 'north'}")
    found = assert_done(mapfilter("predict", *given, "--json")).json
    # The map ends at 60.1791, or a little beyond where its own header says so.
    assert 35 < share_of("the map helsinki", found["notes"]) < 45


def test_a_header_that_tells_too_little_is_no_reason_for_a_note(own_world, monkeypatch):
    """The ways reach all over the box that the header says to be covered by a third."""
    third = (24.9420, 60.1660, 24.9445, 60.1697)
    monkeypatch.setattr("mapfilter.workflows.inputs.world.map_bounds_deg", lambda _: third)
    given = ("-c", own_world.toml, f"--set=output.dir={own_world.folder / 'again'}")
    found = assert_done(mapfilter("predict", *given, "--json")).json
    assert not any("covers" in note for note in found["notes"])


def test_levels_of_own_cells_get_no_random_clutter_unless_asked_for(own_world):
    text = own_world.toml.read_text().replace("shadowing_db = 8.0\n", "")
    own_world.toml.write_text(text)

    def levels(seed, *given):
        out = own_world.folder / f"seed-{seed}-{len(given)}"
        settings = (f"--set=output.dir={out}", f"--set=prediction.seed={seed}", *given)
        assert_done(mapfilter("predict", "-c", own_world.toml, *settings))
        return open_rasters(out / "rxlev.tif").read()

    np.testing.assert_array_equal(levels(1), levels(2))
    asked = "--set=prediction.shadowing_db=6"
    # Two draws of 6 dB differ by 6 dB times the root of two, here within a factor of two.
    assert 4.2 < (levels(1, asked) - levels(2, asked)).std() < 17.0


def test_a_part_of_the_land_use(own_world):
    lattice = open_rasters(own_world.rasters).lattice
    east = Lattice(
        lattice.crs, lattice.west_m, lattice.north_m, lattice.resolution_m,
        rows=lattice.rows, cols=lattice.cols // 4,
    )  # fmt: skip
    raster, table = own_world.folder / "landuse.tif", own_world.folder / "landuse.csv"
    with rasterio.open(
        raster, "w", driver="GTiff", count=1, dtype="uint8", height=east.rows, width=east.cols,
        crs=east.crs, transform=rasterio.Affine.from_gdal(*east.gdal_transform),
    ) as target:  # fmt: skip
        target.write(np.ones((1, east.rows, east.cols), dtype=np.uint8))
    table.write_text("value,class,walkable\n1,park,1\n")
    given = [f"--set=roads.landuse={raster}", f"--set=roads.landuse_table={table}"]
    database = f"--set=database.path={own_world.folder / 'db'}"
    found = assert_done(mapfilter("build", "-c", own_world.toml, *given, database, "--json")).json
    assert 23 < share_of(f"{raster}:", found["notes"]) < 27


@pytest.mark.parametrize("command", ["build", "simulate"])
def test_commands_before_predict(command, own_world):
    own_world.rasters.unlink()
    told = (
        "rxlev.tif: expected rasters, found No such file or directory",
        "run mapfilter predict first",
    )
    assert_refused(mapfilter(command, "-c", own_world.toml), *told)


def test_simulating_without_ground_truth(own_world):
    (own_world.out / "rxlev-ground-truth.tif").unlink(missing_ok=True)
    outcome = mapfilter("simulate", "-c", own_world.toml, "--set=journeys.radio=ground_truth")
    told = "rxlev-ground-truth.tif: expected rasters of the ground truth, found no such file"
    assert_refused(outcome, told, "prediction.ground_truth.write = true", 'radio = "as_predicted"')


def test_info_of_a_part_of_a_log(log):
    assert_refused(mapfilter("info", log / "log.json"), "a part of a log; name the folder")
    assert json.loads((log / "log.json").read_text())


def test_info_prints_metres_as_metres(world):
    west_m = open_rasters(world.rasters).lattice.west_m
    assert f"bounds_m:\n  {west_m:.1f}\n" in assert_done(mapfilter("info", world.rasters)).out
