"""A build draws its database, unless nothing is to be drawn; a land-use raster, too."""

from pathlib import Path

import numpy as np
import pytest
import rasterio
from command_line import assert_done, assert_refused, mapfilter, settings
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from mapfilter.rasters.opening import open_rasters

EVERY = ["coverage", "best-server", "margin", "points-per-cell", "points-of-one-site", "land-use"]
TABLE = """class,walkable,r,g,b
street,1,230,159,0
park,1,0,158,115
houses,0,140,140,140
water,0,86,180,233
desert,0,1,2,3
"""


@pytest.fixture(scope="module")
def landuse(world, tmp_path_factory):
    """Land use as a user has it: colours on 2.5 m, streets every 50 m, a park, a river."""
    folder = tmp_path_factory.mktemp("landuse")
    lattice = open_rasters(world.rasters).lattice
    classes = np.full((2 * lattice.rows, 2 * lattice.cols), 2)
    classes[60:110, 40:120] = 1
    classes[125:140] = 3
    for first in range(4):
        classes[first::20] = classes[:, first::20] = 0
    colours = np.array([[int(x) for x in row.split(",")[2:]] for row in TABLE.split()[1:]])
    (folder / "classes.csv").write_text(TABLE)
    transform = rasterio.Affine(2.5, 0, lattice.west_m, 0, -2.5, lattice.north_m)
    with rasterio.open(
        folder / "landuse.tif", "w", driver="GTiff", height=classes.shape[0],
        width=classes.shape[1], count=3, dtype="uint8", crs=lattice.crs, transform=transform,
    ) as target:  # fmt: skip
        target.write(np.moveaxis(colours[classes], -1, 0).astype(np.uint8))
    return folder


def build(world, out, *more):
    given = settings(rasters__path=world.rasters, area__map="helsinki")
    return mapfilter("build", "-c", world.toml, "--out", out, *given, *more, "--json")


def test_a_build_draws_its_database(world, tmp_path, drawn_small):
    with drawn_small():
        built = assert_done(build(world, tmp_path, "--set=output.pictures=first")).json
    folder = tmp_path / "pictures"
    assert built["pictures"] == [str(folder / f"{name}.png") for name in EVERY]
    assert sorted(path.stem for path in folder.iterdir()) == sorted(EVERY)
    (folder / "mine.png").write_text("")
    # A new database that nobody wants drawn: pictures of the older one would be wrong.
    assert assert_done(build(world, tmp_path)).json["pictures"] == []
    assert [path.name for path in folder.iterdir()] == ["mine.png"]


def test_nothing_is_drawn_of_an_estimate(world, tmp_path):
    assert_done(build(world, tmp_path, "--dry-run", "--set=output.pictures=all"))
    assert not tmp_path.exists() or not list(tmp_path.iterdir())


def test_where_no_picture_can_be_written(world, tmp_path):
    (tmp_path / "pictures").write_text("a file")
    assert_refused(build(world, tmp_path, "--set=output.pictures=all"), tmp_path / "pictures")


def test_a_land_use_raster_is_drawn_in_its_own_colours(world, landuse, tmp_path):
    given = settings(
        roads__landuse=landuse / "landuse.tif", roads__landuse_table=landuse / "classes.csv",
        output__pictures="first",
    )  # fmt: skip
    built = assert_done(build(world, tmp_path, *given)).json
    assert built["pictures"][-1] == str(tmp_path / "pictures" / "land-use.png")
    image = imread(built["pictures"][-1])[:, :, :3]
    shares = {
        row.split(",")[0]: np.mean(
            np.abs(image - np.array(row.split(",")[2:], float) / 255).max(axis=2) < 0.01
        )
        for row in TABLE.split()[1:]
    }
    # One of two panels, with room about them; a class that is nowhere is not in the legend.
    assert shares.pop("desert") == 0
    assert min(shares.values()) > 0.01
    assert shares["street"] > shares["park"]
    walkable = np.mean(np.abs(image - to_rgb("#0072b2")).max(axis=2) < 0.01)
    assert walkable == pytest.approx(shares["street"] + shares["park"], rel=0.1)


def test_an_area_smaller_than_the_rasters_is_drawn_alone(world, landuse, tmp_path):
    given = settings(
        roads__landuse=landuse / "landuse.tif", roads__landuse_table=landuse / "classes.csv",
        area__bbox="24.9430,60.1667,24.9480,60.1690", output__pictures="first",
    )  # fmt: skip
    built = assert_done(build(world, tmp_path, *given)).json
    assert [Path(picture).stem for picture in built["pictures"]] == EVERY
    streets = imread(built["pictures"][0])[:, :, :3]
    # Levels fill the map: there is nothing of the rasters beside the area.
    assert np.ptp(streets.reshape(-1, 3), axis=1).astype(bool).mean() > 0.5
