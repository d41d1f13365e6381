"""Margin, land use and surveys: the data shown, whole files, the same bytes; whole networks."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from mapfilter.database.build import build
from mapfilter.errors import InputError, OutputError
from mapfilter.geodesy import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.measurements import Measurements
from mapfilter.radio.rasters import open_rasters, write_rasters
from mapfilter.radio.survey import SurveyOptions, fit_survey
from mapfilter.radio.survey_rasters import write_survey
from mapfilter.radio.survey_validation import cross_validate
from mapfilter.report.basemap import BaseMap, draw_base
from mapfilter.report.canvas import BLUE, ORANGE
from mapfilter.report.landuse import LandUseClasses, plot_landuse
from mapfilter.report.layers import largest
from mapfilter.report.margin import plot_margin
from mapfilter.report.survey import SurveyedLevels, plot_left_out, plot_surveyed_levels
from mapfilter.roads.routable import route_lattice_from_landuse
from mapfilter.workflows import pictures
from mapfilter.workflows.pictures import best_servers, classes_of_map, draw_network
from mapfilter.workflows.survey_pictures import SurveyEvidence, draw_survey, left_out_levels

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385_000.0, 6_672_000.0, 5.0, 40, 50)
BASE = BaseMap(LATTICE.bounds_m, attribution="© OpenStreetMap contributors")


def plan_of(*ids: str) -> CellPlan:
    west, south, _, _ = LATTICE.bounds_m
    return CellPlan(
        CRS,
        tuple(
            Cell(cell_id, cell_id[:2], west + 60.0 + 40 * i, south + 90.0, 30.0, 90.0 * i, 55.0,
                 1800.0)
            for i, cell_id in enumerate(ids)
        ),
    )  # fmt: skip


def pixels_near(path, colour: str) -> int:
    image = imread(path)[:, :, :3]
    return int((np.abs(image - to_rgb(colour)).max(axis=2) < 0.02).sum())


def surveyed(cell_id: str = "A") -> SurveyedLevels:
    row, col = np.mgrid[:40, :50]
    level_dbm = -70.0 - 0.5 * col
    deviation_db = np.where(row > 20, 4.0, np.nan)
    places = np.array([25, 30, 35])
    east_m, north_m = LATTICE.east_north(places, places)
    return SurveyedLevels(
        cell_id, np.where(row > 20, level_dbm, np.nan), deviation_db, east_m, north_m,
        -70.0 - 0.5 * places,
    )  # fmt: skip


def draw_each(folder):
    """Draw each new kind of picture once."""
    rng = np.random.default_rng(1)
    margin_db = rng.uniform(0, 30, (40, 50))
    margin_db[:5], margin_db[5:8] = np.nan, np.inf
    code = np.arange(2000).reshape(40, 50) % 4 - 1
    measured_dbm = rng.uniform(-110, -60, 300)
    names = ("margin", "landuse", "levels", "left-out")
    paths = [folder / f"{name}.png" for name in names]
    plot_margin(margin_db, LATTICE, plan_of("S1A", "S1B"), BASE, paths[0])
    classes = LandUseClasses(code, ("street", "park", "house"), (True, True, False))
    plot_landuse(classes, LATTICE, BASE, paths[1])
    plot_surveyed_levels([surveyed("A"), surveyed("B")], LATTICE, BASE, paths[2])
    plot_left_out(
        measured_dbm, measured_dbm + rng.normal(0, 4, 300), paths[3],
        trend_dbm=measured_dbm + 6.0, attribution="somebody's",
    )  # fmt: skip
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
    plot_margin(margin_db, LATTICE, plan, BASE, path)
    dark, alone = (pixels_near(path, colour) for colour in ("#00224e", "#fff7bc"))
    # Twenty and ten of fifty columns of a map of some 1050 x 840 pixels, less its marks.
    assert np.allclose([dark, alone], [0.4 * 1050 * 840, 0.2 * 1050 * 840], rtol=0.1)
    with pytest.raises(InputError, match="dB >= 0"):
        plot_margin(np.full((40, 50), -1.0), LATTICE, plan, BASE, path)
    with pytest.raises(InputError, match="40 x 50 pixels"):
        plot_margin(np.zeros((50, 40)), LATTICE, plan, BASE, path)


def test_land_use_shows_classes_and_where_one_can_walk(tmp_path):
    path = tmp_path / "l.png"
    code = np.where(np.arange(50) < 25, 0, 1) * np.ones((40, 1), dtype=int)
    classes = LandUseClasses(code, ("street", "house"), (True, False), (ORANGE, "#8c8c8c"))
    assert classes.can_walk.sum() == 1000
    plot_landuse(classes, LATTICE, BASE, path)
    # Half of one panel each; a panel is some 780 x 624 pixels.
    halves = [pixels_near(path, colour) for colour in (ORANGE, BLUE, "#8c8c8c")]
    assert np.allclose(halves, 780 * 624 / 2, rtol=0.15)


@pytest.mark.parametrize(
    ("fault", "names", "walkable", "colours"),
    [
        ("walkable", ("a", "b"), (True,), ()),
        ("colours", ("a", "b"), (True, True), ("red",)),
        ("below 1", ("a",), (True,), ()),
    ],
)
def test_land_use_is_checked(fault, names, walkable, colours):
    with pytest.raises(InputError, match=fault):
        LandUseClasses(np.array([[0, 1]]), names, walkable, colours)


def test_survey_pictures_are_checked(tmp_path):
    path = tmp_path / "s.png"
    for cells in ([], [surveyed()] * 5):
        with pytest.raises(InputError, match="1 to 4"):
            plot_surveyed_levels(cells, LATTICE, BASE, path)
    small = Lattice(CRS, 0.0, 0.0, 5.0, 4, 5)
    with pytest.raises(InputError, match="4 x 5 pixels"):
        plot_surveyed_levels([surveyed()], small, BASE, path)
    with pytest.raises(InputError, match="3 of them"):
        plot_left_out(np.zeros(3), np.zeros(2), path)
    for bad in (np.empty(0), np.array([np.nan])):
        with pytest.raises(InputError, match="finite levels"):
            plot_left_out(bad, bad, path)
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        plot_left_out(np.zeros(3), np.zeros(3), tmp_path / "file" / "s.png")
    assert not path.exists()


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


def test_large_areas_are_thinned_and_read_in_strips(network, monkeypatch):
    whole = best_servers(*network)
    monkeypatch.setattr(pictures, "_MOST_PX", 20)
    monkeypatch.setattr(pictures, "_STRIP_PX", 1)
    thinned = best_servers(*network)
    assert (thinned.lattice.rows, thinned.lattice.cols) == (14, 17)
    assert thinned.lattice.resolution_m == 15.0
    np.testing.assert_array_equal(thinned.server, whole.server[::3, ::3])
    np.testing.assert_array_equal(thinned.margin_db, whole.margin_db[::3, ::3])


def test_rasters_of_another_place_are_told(network, tmp_path):
    _, database = network
    far = Lattice(CRS, 500_000.0, 6_000_000.0, 5.0, 4, 4)
    write_rasters(tmp_path / "far.tif", far, [("S1A", np.full((4, 4), -70.0, np.float32))], ["S1A"])
    with pytest.raises(InputError, match="area and CRS"):
        draw_network(open_rasters(tmp_path / "far.tif"), database, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_network_gets_its_pictures(network, tmp_path):
    rasters, database = network
    heights_m = np.zeros((40, 50))
    heights_m[1:3, 1:3] = 12.0
    classes = classes_of_map(database, heights_m)
    assert np.bincount(classes.code.ravel())[2] == 4
    assert classes.can_walk.sum() == len(database.points())
    drawn = draw_network(rasters, database, tmp_path, landuse=classes)
    assert [path.stem for path in drawn] == [
        "coverage", "best-server", "margin", "points-per-cell", "points-of-one-site", "land-use",
    ]  # fmt: skip
    assert all(path.is_file() for path in drawn)


def walks(sessions: int) -> Measurements:
    """Two cells heard along a line, with a fixed disturbance per reading."""
    rng = np.random.default_rng(5)
    count = 120
    row, col = np.full(count, 20), rng.integers(2, 48, count)
    east_m, north_m = LATTICE.east_north(row, col)
    cell = (np.arange(count) % 2).astype(np.int32)
    level_dbm = -60.0 - 0.3 * col - 10.0 * cell + rng.normal(0, 3, count)
    session = (np.arange(count) * sessions // count).astype(np.int32)
    return Measurements(
        CRS, ("A", "B"), {}, tuple(str(i) for i in range(sessions)), cell, session,
        np.arange(count, dtype=float), east_m, north_m, level_dbm, np.full(count, 5.0),
    )  # fmt: skip


@pytest.mark.parametrize("sessions", [1, 3])
def test_left_out_levels_are_those_of_the_validation(sessions, tmp_path):
    measured, options = walks(sessions), SurveyOptions(method="knn", trend="mean")
    survey = fit_survey(measured, options)
    paths = tmp_path / "mean.tif", tmp_path / "deviation.tif"
    write_survey(survey, LATTICE, *paths)
    evidence = SurveyEvidence(measured, options, *(open_rasters(path) for path in paths))
    found, folds = left_out_levels(evidence)
    told = cross_validate(measured, options)
    assert (len(found), folds) == (told.predicted, told.folds)
    assert np.sqrt(np.mean((found[:, 0] - found[:, 1]) ** 2)) == pytest.approx(told.rmse_db)
    assert np.sqrt(np.mean((found[:, 0] - found[:, 2]) ** 2)) == pytest.approx(told.trend_rmse_db)
    if sessions == 3:
        drawn = draw_survey(evidence, tmp_path / "out")
        assert [path.name for path in drawn] == ["survey-levels.png", "survey-left-out.png"]


def test_a_survey_of_other_cells_is_told(network, tmp_path):
    rasters, _ = network
    evidence = SurveyEvidence(walks(2), SurveyOptions(), rasters, rasters)
    with pytest.raises(InputError, match="measurements of cells"):
        draw_survey(evidence, tmp_path)
