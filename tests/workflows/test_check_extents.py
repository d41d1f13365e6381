"""One raster file of a folder that lies elsewhere than the others is found by ``check``."""

from dataclasses import replace

import pytest
from check_world import LATTICE, make_plan, make_world, write_tiff
from command_line import assert_refused, mapfilter


@pytest.fixture
def world(tmp_path, levels):
    made = make_world(tmp_path, levels)
    made.write()
    text = made.toml.read_text(encoding="utf-8").replace("rxlev.tif", "rasters")
    made.toml.write_text(text, encoding="utf-8")
    made.rasters.unlink()
    (tmp_path / "rasters").mkdir()
    return made


def whole(_cell, values):
    """The extent that all cells share."""
    return LATTICE, values


def about_the_site(cell, values):
    """An extent of up to 1.2 km about the site."""
    row, col = (int(one) for one in LATTICE.row_col(cell.east_m, cell.north_m))
    top, left = max(row - 60, 0), max(col - 60, 0)
    values = values[top : row + 60, left : col + 60]
    west_m, north_m = LATTICE.west_m + 10 * left, LATTICE.north_m - 10 * top
    rows, cols = values.shape
    return replace(LATTICE, west_m=west_m, north_m=north_m, rows=rows, cols=cols), values


def write(world, cut, moved=None, east_m=0.0, north_m=0.0):
    plan = make_plan()
    for name, values in world.levels.items():
        lattice, part = cut(plan[name], values)
        if name == moved:
            lattice = replace(
                lattice, west_m=lattice.west_m + east_m, north_m=lattice.north_m + north_m
            )
        write_tiff(world.folder / "rasters" / f"{name}.tif", lattice, {name: part}, "level")


def check(world):
    outcome = mapfilter("check", "-c", world.toml, "--json")
    assert outcome.err == ""
    return outcome.json["findings"]


@pytest.mark.parametrize("cut", [whole, about_the_site])
def test_files_in_their_place_are_no_finding(world, cut):
    write(world, cut)
    assert check(world) == []


@pytest.mark.parametrize("cut", [whole, about_the_site])
@pytest.mark.parametrize("moved", ["S1A", "S3C", "I1"])
@pytest.mark.parametrize(
    ("east_m", "north_m", "words"),
    [(1000.0, 0.0, "1.0 km east"), (0.0, -100_000.0, "100.0 km south")],
)
def test_one_file_elsewhere_is_named(world, cut, moved, east_m, north_m, words):
    write(world, cut, moved, east_m, north_m)
    (found,) = check(world)
    assert (found["code"], found["severity"]) == ("raster-displaced", "error")
    assert found["where"].endswith(f"rasters, {moved}.tif")
    assert "1 of 10 rasters lie elsewhere than the others" in found["evidence"]
    if cut is whole:
        assert f"is {words} of their extent" in found["evidence"]


def test_files_of_one_site_beside_another_are_in_their_place(world, levels):
    """Most files are of one site, and have its window; that of the other is of the same size."""
    world.levels = {name: levels[name] for name in ("S1A", "S1B", "S1C", "S2A")}
    world.rows = [row for row in world.rows if row["cell"] in world.levels]
    kept = world.toml.read_text(encoding="utf-8")
    world.write()
    world.toml.write_text(kept, encoding="utf-8")
    world.rasters.unlink()

    def window(cell, values):
        left, top = (70, 60) if cell.site == "S2" else (0, 0)
        lattice = replace(LATTICE, rows=90, cols=120, west_m=LATTICE.west_m + 10 * left,
                          north_m=LATTICE.north_m - 10 * top)  # fmt: skip
        return lattice, values[top : top + 90, left : left + 120]

    write(world, window)
    assert check(world) == []


def test_a_file_too_far_away_to_be_read_with_the_others_is_named(world):
    far_m = 10_000_000.0
    write(world, whole, "S2C", far_m, -far_m)
    outcome = mapfilter("check", "-c", world.toml)
    assert outcome.code == 2
    assert "rasters, with S2C.tif: Expected rasters that 4e+10 pixels can cover" in outcome.out
    build = mapfilter("build", "-c", world.toml, f"--set=output.dir={world.folder / 'out'}")
    assert_refused(build, "with S2C.tif")
