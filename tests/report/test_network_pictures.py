"""Margin and land use: the data shown, whole files, the same bytes; whole networks."""

import numpy as np
import pytest
import shapely
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from mapfilter.database.build import build
from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.report import basemap
from mapfilter.report.basemap import BaseMap, draw_base, largest
from mapfilter.report.canvas import BLUE, ORANGE, new_figure
from mapfilter.report.coverage import plot_landuse, plot_margin
from mapfilter.report.network import plot_best_server, plot_points_per_cell
from mapfilter.report.saving import png_of, save
from mapfilter.roads.landuse import LandUse
from mapfilter.roads.route_points import route_lattice_from_landuse
from mapfilter.roads.ways import Buildings
from mapfilter.workflows.outputs import pictures as network_pictures
from mapfilter.workflows.outputs import served
from mapfilter.workflows.outputs.pictures import draw_network, land_use_of_map
from mapfilter.workflows.outputs.served import best_servers, served_points, thinned_lattice

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385_000.0, 6_672_000.0, 5.0, 40, 50)
BASE = BaseMap(LATTICE.bounds_m, attribution="© OpenStreetMap contributors")


def plan_of(*ids: str) -> CellPlan:
    west, south, _, _ = LATTICE.bounds_m
    return CellPlan(
        CRS,
        tuple(
            Cell(
                cell_id,
                cell_id[:2],
                west + 60.0 + 40 * i,
                south + 90.0,
                30.0,
                90.0 * i,
                55.0,
                1800.0,
            )
            for i, cell_id in enumerate(ids)
        ),
    )


def pixels_near(path, colour: str) -> int:
    image = imread(path)[:, :, :3]
    return int((np.abs(image - to_rgb(colour)).max(axis=2) < 0.02).sum())


def draw_each(folder):
    """Draw each new kind of picture once."""
    rng = np.random.default_rng(1)
    margin_db = rng.uniform(0, 30, (40, 50))
    margin_db[:5], margin_db[5:8] = np.nan, np.inf
    code = np.arange(2000).reshape(40, 50) % 4 - 1
    names = ("margin", "landuse")
    paths = [folder / f"{name}.png" for name in names]
    save(plot_margin(margin_db, LATTICE, plan_of("S1A", "S1B"), BASE), paths[0])
    classes = LandUse(code, ("street", "park", "house"), (True, True, False))
    save(plot_landuse(classes, LATTICE, BASE), paths[1])
    return paths


def test_same_data_give_same_bytes(tmp_path):
    first, second = draw_each(tmp_path / "a"), draw_each(tmp_path / "b")
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
        assert one.read_bytes() == other.read_bytes(), one.name
    # Nothing but whole pictures: no temporary file is left.
    assert len(list(tmp_path.rglob("*.*"))) == len(first) + len(second)


def test_margin_is_dark_where_cells_are_equal(tmp_path):
    path, plan = tmp_path / "m.png", plan_of("S1A")
    margin_db = np.full((40, 50), np.nan)
    margin_db[:, :20], margin_db[:, 20:30] = 0.5, np.inf
    save(plot_margin(margin_db, LATTICE, plan, BASE), path)
    dark, alone = (pixels_near(path, colour) for colour in ("#00224e", "#fff7bc"))
    # Twenty and ten of fifty columns of a map of some 1050 x 840 pixels, less its marks.
    assert np.allclose([dark, alone], [0.4 * 1050 * 840, 0.2 * 1050 * 840], rtol=0.1)
    with pytest.raises(InputError, match="dB >= 0"):
        save(plot_margin(np.full((40, 50), -1.0), LATTICE, plan, BASE), path)
    with pytest.raises(InputError, match="40 x 50 pixels"):
        save(plot_margin(np.zeros((50, 40)), LATTICE, plan, BASE), path)


def test_land_use_shows_classes_and_where_one_can_walk(tmp_path):
    path = tmp_path / "l.png"
    code = np.where(np.arange(50) < 25, 0, 1) * np.ones((40, 1), dtype=int)
    classes = LandUse(code, ("street", "house"), (True, False), (ORANGE, "#8c8c8c"))
    assert classes.walkable.sum() == 1000
    save(plot_landuse(classes, LATTICE, BASE), path)
    # Half of one panel each; a panel is some 780 x 624 pixels.
    halves = [pixels_near(path, colour) for colour in (ORANGE, BLUE, "#8c8c8c")]
    assert np.allclose(halves, 780 * 624 / 2, rtol=0.15)


@pytest.mark.parametrize(
    ("fault", "names", "walkable", "colours"),
    [
        ("can_walk", ("a", "b"), (True,), ()),
        ("colours", ("a", "b"), (True, True), ("red",)),
        ("below 1", ("a",), (True,), ()),
    ],
)
def test_land_use_is_checked(fault, names, walkable, colours):
    with pytest.raises(InputError, match=fault):
        LandUse(np.array([[0, 1]]), names, walkable, colours)


def test_points_of_large_areas_are_drawn_as_larger_pixels():
    axes = Figure().subplots()
    corner = np.array([385_000.0, 6_600_000.0])
    # A country: pixel for pixel this would be 40 GB.
    points_m = corner + np.array([[2.5, 2.5], [150_002.5, 2.5], [300_002.5, 400_002.5]])
    west, south = corner
    draw_base(axes, BaseMap((west, south, west + 4e5, south + 4e5), points_m=points_m))
    image = axes.images[0]
    alpha = image.get_array()[..., 3]
    assert alpha.shape == (2401, 1801)
    assert np.argwhere(alpha).tolist() == [[0, 0], [0, 900], [2400, 1800]]
    # In km of the axes, which begin at the corner.
    assert image.get_extent()[0::2] == [0.0, 0.0]
    assert image.get_extent()[1] >= 300.005


def test_the_largest_groups_are_kept():
    assert largest([1, 5, 5, 2], 3) == {1, 2, 3}
    assert largest([], 3) == set()


def test_cells_without_a_point_are_not_in_the_legend():
    points = {f"S{n}A": (np.full(n % 2, 5.0), np.full(n % 2, 5.0)) for n in range(1, 60)}
    axes = plot_points_per_cell(points, plan_of("S1A"), BaseMap(LATTICE.bounds_m))
    shown = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert "S1A: 1" in shown
    assert not any(name.endswith(": 0") for name in shown)
    more = int(next(name for name in shown if "with less" in name).split()[1])
    assert sum(name.endswith(": 1") for name in shown) + more == 30


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    """Three cells on the lattice: A strong in the west, B in the east, C nowhere but in a spot."""
    folder = tmp_path_factory.mktemp("network")
    col = np.arange(50) * np.ones((40, 1))
    levels = {"S1A": -60.0 - col, "S1B": -110.0 + col, "S2A": np.full((40, 50), np.nan)}
    levels["S1B"][:, :10] = np.nan
    levels["S2A"][3:5, 3:5] = -50.0
    levels["S1A"][0] = levels["S1B"][0] = np.nan
    plan = plan_of(*levels)
    items = ((name, level.astype(np.float32)) for name, level in levels.items())
    write_rasters(folder / "rxlev.tif", LATTICE, items, plan.ids)
    walkable = np.zeros((40, 50), dtype=bool)
    walkable[::4] = walkable[:, ::5] = True
    rasters = open_rasters(folder / "rxlev.tif")
    routes = route_lattice_from_landuse(walkable, LATTICE, None)
    database = build(rasters, plan, routes, folder / "database", attribution="nobody's")
    return rasters, database


@pytest.mark.parametrize("uncovered", [0, 500])
def test_shares_of_the_area_add_up(uncovered):
    """Pixels where no cell is received are a part of the area, too."""
    server = np.zeros(2000, dtype=np.int16)
    server[700:] = 1
    server[2000 - uncovered :] = -1
    lattice = Lattice(CRS, 385_000.0, 6_672_000.0, 5.0, 40, 50)
    axes = plot_best_server(
        server.reshape(40, 50),
        ("S1A", "S1B"),
        lattice,
        plan_of("S1A", "S1B"),
        BaseMap(lattice.bounds_m),
    )
    (legend,) = axes.figure.legends
    words = [text.get_text() for text in legend.get_texts() if "%" in text.get_text()]
    assert sum(float(text.split()[-2]) for text in words) == pytest.approx(100.0)
    assert ("no cell: 25.0 %" in words) == bool(uncovered)


def test_best_servers_are_those_of_the_points(network):
    rasters, database = network
    best, points = best_servers(rasters, database), database.points()
    assert best.lattice == LATTICE
    at = points.row, points.col
    np.testing.assert_array_equal(best.server[at], points.best_server)
    np.testing.assert_array_equal(best.level_dbm[at], points.best_level_dbm)
    margin_db = np.where(np.isnan(points.margin_db), np.inf, points.margin_db)
    np.testing.assert_array_equal(best.margin_db[at], margin_db)
    assert (best.server[0] == -1).all()
    assert np.isnan(best.margin_db[0]).all()
    # Both cells at 25: the tie goes to the first.
    assert best.server[10, [2, 24, 25, 26, 49]].tolist() == [0, 0, 0, 1, 1]


def test_large_areas_are_thinned_and_read_block_by_block(network, monkeypatch):
    whole = best_servers(*network)
    monkeypatch.setattr(served, "MOST_PX", 20)
    monkeypatch.setattr(served, "_BLOCK_PX", 7)
    monkeypatch.setattr(served, "_READ_PX", 50)
    thinned = best_servers(*network)
    assert (thinned.lattice.rows, thinned.lattice.cols) == (14, 17)
    assert thinned.lattice.resolution_m == 15.0
    # The pixel in the middle of three by three; beyond the rasters' edge there is none.
    np.testing.assert_array_equal(thinned.server[:13], whole.server[1::3, 1::3])
    np.testing.assert_array_equal(thinned.margin_db[:13], whole.margin_db[1::3, 1::3])


def test_points_are_thinned_and_read_block_by_block(network, monkeypatch):
    _, database = network
    points = database.points()
    whole = served_points(database)
    assert whole.best.lattice == LATTICE
    np.testing.assert_array_equal(whole.best.server[points.row, points.col], points.best_server)
    np.testing.assert_array_equal(whole.counts, np.bincount(points.best_server, minlength=3))
    east_m, north_m = whole.places()
    expected = LATTICE.east_north(points.row, points.col)
    np.testing.assert_array_equal([east_m, north_m], expected)
    assert len(whole.places(2)[0]) == np.count_nonzero(points.best_server == 2)
    monkeypatch.setattr(served, "MOST_PX", 20)
    monkeypatch.setattr(served, "_BLOCK_PX", 7)
    thinned = served_points(database)
    np.testing.assert_array_equal(thinned.counts, whole.counts)
    there = np.zeros((14, 17), dtype=bool)
    there[points.row // 3, points.col // 3] = True
    np.testing.assert_array_equal(thinned.best.server >= 0, there)
    part = served_points(database, (10, 20, 6, 9))
    inside = (points.row >= 10) & (points.row < 16)
    inside &= (points.col >= 20) & (points.col < 29)
    assert part.counts.sum() == inside.sum()
    assert part.best.lattice == LATTICE.window(10, 20, 6, 9)


def test_of_a_country_only_points_are_drawn(network, tmp_path, monkeypatch):
    """Rasters of such a size are not read, and the largest site is shown by itself."""
    country = Lattice(CRS, 0.0, 0.0, 5.0, 100_000, 70_000)
    assert thinned_lattice(country)[0].rows == 1191
    rasters, database = network
    monkeypatch.setattr(network_pictures, "MOST_READ_PX", 10)
    monkeypatch.setattr(network_pictures, "best_servers", None)
    monkeypatch.setattr(served, "MOST_PX", 20)
    landuse = LandUse(np.zeros((40, 50), np.int16), ("way",), (True,))
    drawn = draw_network(rasters, database, tmp_path, landuse=landuse)
    assert len(drawn) == 6


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """A town of 60 x 60 pixels at a corner of a large area, and one long drive out of it."""
    folder = tmp_path_factory.mktemp("drive")
    lattice = Lattice(CRS, 385_000.0, 6_672_000.0, 5.0, 400, 500)
    plan = plan_of("S1A", "S1B")
    level_dbm = np.broadcast_to(-60.0 - 0.05 * np.arange(500), (400, 500))
    levels = {"S1A": level_dbm.astype(np.float32), "S1B": level_dbm[:, ::-1].astype(np.float32)}
    write_rasters(folder / "rxlev.tif", lattice, levels.items(), plan.ids)
    walkable = np.zeros((400, 500), dtype=bool)
    walkable[20:80, 30:90] = True
    walkable[80:110, 60] = walkable[390, 490] = True
    rasters = open_rasters(folder / "rxlev.tif")
    routes = route_lattice_from_landuse(walkable, lattice, None)
    return rasters, build(rasters, plan, routes, folder / "database")


@pytest.mark.parametrize("most_px", [1200, 50])
def test_pictures_show_where_nearly_all_points_lie(drive, most_px, tmp_path, monkeypatch):
    monkeypatch.setattr(served, "MOST_PX", most_px)
    rasters, database = drive
    whole = served_points(database)
    assert whole.number.sum() == 3631
    top, left, rows, cols = whole.crowded_window()
    # Two hundredths of the points may lie outside; some room is about the others.
    assert 0 <= top <= 20
    assert 0 <= left <= 30
    assert 80 <= top + rows < 300
    assert 90 <= left + cols < 300
    points = served_points(database, (top, left, rows, cols))
    assert points.counts.sum() >= 0.96 * 3631
    titles = []
    monkeypatch.setattr(
        network_pictures, "plot_level", lambda *_, title, **__: titles.append(title) or Figure()
    )
    landuse = LandUse(np.zeros((400, 500), np.int16), ("town",), (True,))
    assert len(draw_network(rasters, database, tmp_path, landuse=landuse)) == 6
    assert titles == ["Level of the best server, where 99 % of the points lie"]


def test_an_area_full_of_points_is_shown_whole(network):
    points = served_points(network[1])
    assert points.crowded_window() == (0, 0, 40, 50)


def test_rasters_of_another_place_are_told(network, tmp_path):
    _, database = network
    far = Lattice(CRS, 500_000.0, 6_000_000.0, 5.0, 4, 4)
    write_rasters(tmp_path / "far.tif", far, [("S1A", np.full((4, 4), -70.0, np.float32))], ["S1A"])
    with pytest.raises(InputError, match="area and CRS"):
        draw_network(open_rasters(tmp_path / "far.tif"), database, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_network_gets_its_pictures(network, tmp_path):
    rasters, database = network
    houses = np.array([shapely.box(385_005.0, 6_671_985.0, 385_015.0, 6_671_995.0)])
    buildings = Buildings(CRS, houses, np.array([12.0]), 1, 0, 0)
    classes = land_use_of_map(served_points(database), buildings)
    assert np.bincount(classes.code.ravel())[2] == 4
    assert classes.walkable.sum() == len(database.points())
    (tmp_path / "land-use.png").write_text("of an older database")
    drawn = draw_network(rasters, database, tmp_path, buildings=buildings)
    assert [path.stem for path in drawn] == [
        "coverage",
        "best-server",
        "margin",
        "points-per-cell",
        "points-of-one-site",
        "land-use",
    ]
    assert all(path.is_file() for path in drawn)
    assert len(draw_network(rasters, database, tmp_path)) == 5
    assert not (tmp_path / "land-use.png").exists()


def test_a_map_draws_the_points_of_its_extent_and_the_same_picture(monkeypatch):
    """Of a large area a picture shows a small part; the rest is not prepared for drawing."""
    row, col = np.divmod(np.arange(400 * 400), 400)
    points_m = np.column_stack([col * 5.0 + 2.5, row * 5.0 + 2.5])[(row % 9 == 0) | (col % 7 == 0)]
    base = BaseMap((503.3, 701.7, 903.3, 1001.7), points_m=points_m)

    def drawn():
        axes = new_figure(5.0, 4.0).subplots()
        draw_base(axes, base)
        return axes.images[0].get_array().shape, png_of(axes)

    size, png = drawn()
    assert size == (77, 97, 4)
    monkeypatch.setattr(basemap, "_BEYOND_PX", 10_000)
    assert drawn() == ((400, 400, 4), png)
    monkeypatch.undo()
    axes = new_figure(5.0, 4.0).subplots()
    draw_base(axes, base.zoomed((9_000.0, 9_000.0, 9_100.0, 9_100.0)))
    assert not axes.images
