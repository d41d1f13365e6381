"""Parts of the map's bounds worked by hand: its tables, its starts, the limits of its options."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import rasterio
from radio_maps import FLOOR_DBM, made_map

from mapfilter.errors import ConfigError, InputError
from mapfilter.evaluation.first_fix import FirstFix, FirstFixOptions, first_fix, starts
from mapfilter.evaluation.map_bound import BANDS, MapBound, on_lattice, write_bound
from mapfilter.evaluation.radio_map import ErrorModel, radio_map, received_cells
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan


def fake_database():
    """A database of two cells on three pixels of a row of four."""
    on_way = np.array([[True, False, True, True], [False, False, False, False]])
    level = np.full((2, 4, 2), np.nan, dtype=np.float32)
    level[0, :, 0], level[0, 2:, 1] = -80.0, -70.0
    field = SimpleNamespace(
        level_dbm=level, on_way=on_way, cell_ids=("A", "B"), way_id=np.arange(8).reshape(2, 4)
    )
    cells = {"A": "north", "B": "east"}
    plan = CellPlan(
        "EPSG:32631",
        tuple(
            Cell(name, site, 0.0, 0.0, 30.0, None, 30.0, 900.0, "omni")
            for name, site in cells.items()
        ),
    )
    return SimpleNamespace(
        lattice=Lattice("EPSG:32631", 500_000.0, 10.0, 5.0, 2, 4), cell_ids=("A", "B"),
        field=lambda: field, plan=plan, floor_dbm=FLOOR_DBM, margin_db=6.0, path="db",
    )  # fmt: skip


def test_a_database_of_roads_alone_has_no_bound():
    with pytest.raises(InputError, match=r"db: expected cells, found none.*roads alone"):
        radio_map(SimpleNamespace(cell_ids=(), path="db"))


def test_a_database_in_memory():
    radio = radio_map(fake_database())
    assert (radio.row.tolist(), radio.col.tolist()) == ([0, 0, 0], [0, 2, 3])
    assert radio.way_id.tolist() == [0, 2, 3]
    assert radio.server.tolist() == [0, 1, 1]
    # Sites are numbered by name; what is not heard is at the floor.
    assert radio.site.tolist() == [1, 0]
    assert radio.layer.tolist() == [0, 0]
    assert radio.level_dbm[0, 0].tolist() == [-80.0, FLOOR_DBM]
    # Beside a point means by one pixel, not across a corner.
    assert radio.near_way.tolist() == [[True, True, True, True], [True, False, True, True]]


@pytest.mark.parametrize("floor_dbm", [-80.0, -80.1, -104.1])
def test_cells_are_received_from_the_floor_on(floor_dbm):
    database = fake_database()
    held = SimpleNamespace(**vars(database) | {"floor_dbm": floor_dbm})
    radio = radio_map(held)
    found, part = np.empty(7, dtype=np.int64), np.empty(7)
    kernel = radio.floor_dbm, radio.site, radio.layer, 0.5, found, part
    # Where a cell alone is received, be it at the floor, and where there are two.
    counts = [received_cells(radio.level_dbm[0, col], *kernel) for col in (0, 2)]
    assert counts == [1, 2]
    assert radio.level_dbm[0, 0, 0] == pytest.approx(-80.0, abs=1e-4)
    first, point = radio.points_by_cell()
    assert (first.tolist(), point.tolist()) == ([0, 1, 3], [0, 1, 2])


@pytest.mark.parametrize(
    ("changes", "faults"),
    [
        ({"deviation_db": 0.0}, 1), ({"correlation_m": 0.0}, 1), ({"site_share": -0.01}, 1),
        ({"site_share": 1.0}, 1), ({"site_share": 0.0}, 0), ({"site_share": 0.99}, 0),
        ({"deviation_db": np.inf}, 1), ({"deviation_db": 0.5, "correlation_m": 0.5}, 0),
    ],
)  # fmt: skip
def test_limits_of_the_error_model(changes, faults):
    if not faults:
        ErrorModel(**changes)
        return
    with pytest.raises(ConfigError) as caught:
        ErrorModel(**changes)
    assert len(caught.value.faults) == faults


@pytest.mark.parametrize(
    ("changes", "faults"),
    [
        ({"spacing_m": 0.0}, 1), ({"spacing_m": 0.5}, 0), ({"path_m": np.nan}, 1),
        ({"apart_m": -1.0}, 1), ({"journeys": 0}, 1), ({"journeys": 1}, 0),
        ({"journeys": 1000}, 0), ({"journeys": 1001}, 1), ({"mass": 0.49}, 1),
        ({"mass": 0.5}, 0), ({"mass": 1.0}, 1), ({"mass": 0.999}, 0),
        ({"most_m": 100_000.0}, 0), ({"most_m": 100_001.0}, 1),
    ],
)  # fmt: skip
def test_limits_of_the_options(changes, faults):
    if not faults:
        FirstFixOptions(**changes)
        return
    with pytest.raises(ConfigError) as caught:
        FirstFixOptions(**changes)
    assert len(caught.value.faults) == faults


def test_starts_lie_in_different_squares_and_no_square_with_points_lacks_one():
    on_way = np.zeros((30, 50), dtype=bool)
    on_way[2:4], on_way[:, 31] = True, True
    radio = made_map(np.full((30, 50, 1), -60.0), on_way, [0])
    start = starts(radio, 35.0)
    squares = [(r // 7, c // 7) for r, c in zip(radio.row, radio.col, strict=True)]
    chosen = [squares[i] for i in start]
    assert len(set(chosen)) == len(chosen)
    assert set(chosen) == set(squares)
    assert (np.diff(start) > 0).all()
    # Not always the first of a square, nor always the last.
    ends = {square: (squares.index(square), i) for i, square in enumerate(squares)}
    inner = [i for i, square in zip(start, chosen, strict=True) if i not in ends[square]]
    assert len(inner) > len(chosen) / 3
    # A spacing below a pixel is that of the pixels; 2.4 pixels are two.
    assert starts(radio, 1.0).size == len(radio)
    two = {(r // 2, c // 2) for r, c in zip(radio.row, radio.col, strict=True)}
    assert starts(radio, 12.0).size == len(two)


def test_first_fixes_do_not_depend_on_how_many_are_tried_at_a_time(monkeypatch):
    rng = np.random.default_rng(0)
    radio = made_map(rng.normal(-75, 10, (20, 20, 3)), np.ones((20, 20), dtype=bool), [0, 1, 2])
    options = FirstFixOptions(spacing_m=25.0, journeys=3, most_m=60.0, path_m=30.0)
    done = []
    whole = first_fix(radio, ErrorModel(), options, np.random.default_rng(1))
    monkeypatch.setattr("mapfilter.evaluation.first_fix._AT_A_TIME", 7)
    parts = first_fix(
        radio, ErrorModel(), options, np.random.default_rng(1), lambda *at: done.append(at)
    )
    assert done == [(7, 16), (14, 16), (16, 16)]
    for name in FirstFix.__slots__:
        assert getattr(whole, name).shape[0] == 16
        np.testing.assert_array_equal(getattr(whole, name), getattr(parts, name))
    assert set(np.unique(whole.right)) <= {False, True}
    assert (whole.right <= np.isfinite(whole.levels_m)).all()
    # 1.5 bits at least are known of three cells' names where the journey begins.
    assert whole.cells_bits.min() >= 0


def table_of_bounds():
    """Five points on two ways, starts at the first, third and last of them."""
    on_way = np.ones((1, 5), dtype=bool)
    way_id = np.array([[7, 7, 9, 9, 8]])
    radio = made_map(np.full((1, 5, 1), -60.0), on_way, [0], way_id=way_id)
    fix = FirstFix(
        np.array([0, 2, 4]),
        np.array([[100.0, np.inf], [40.0, 60.0], [0.0, 10.0]]),
        np.array([[10.0, 30.0], [np.inf, np.inf], [5.0, 5.0]]),
        np.array([[True, True], [False, False], [True, True]]),
        np.array([[1.0, 2.0], [3.0, 3.0], [0.0, 0.0]]),
        np.array([[4.0, 6.0], [8.0, 8.0], [0.0, 0.0]]),
        np.array([[4, 2], [-1, 0], [1, 0]]),
        np.array([[0.1, 0.4], [0.0, 0.29], [0.5, 0.3]]),
    )
    position = SimpleNamespace(
        plane_m=np.array([1.0, 3.0, np.inf, np.inf, 5.0]),
        along_m=np.array([1.0, 2.0, 3.0, 4.0, np.inf]),
    )
    distinct = SimpleNamespace(cell_bits=np.arange(5.0), level_bits=np.arange(5.0) * 2)
    options = FirstFixOptions(most_m=200.0, path_m=50.0)
    return MapBound(radio, options, position, distinct, fix)


def test_the_table_of_ways_by_hand():
    table = table_of_bounds().by_way().set_index("way_id")
    assert table.index.tolist() == [7, 8, 9]
    assert table["points"].tolist() == [2, 1, 2]
    assert table["starts"].tolist() == [1, 1, 1]
    np.testing.assert_array_equal(table["plane_bound_m"], [2.0, 5.0, np.nan])
    np.testing.assert_array_equal(table["along_bound_m"], [1.5, np.nan, 3.5])
    assert table["cell_bits"].tolist() == [0.5, 4.0, 2.5]
    assert table["level_bits"].tolist() == [1.0, 8.0, 5.0]
    # Journeys that never became clear count as the longest: (100 + 200) / 2.
    assert table["cells_to_fix_m"].tolist() == [150.0, 5.0, 50.0]
    assert table["levels_to_fix_m"].tolist() == [20.0, 5.0, 200.0]
    assert table["cells_bits_per_m"].tolist() == [0.03, 0.0, 0.06]
    assert table["levels_bits_per_m"].tolist() == [0.1, 0.0, 0.16]
    assert table["twins"].tolist() == [0.5, 1.0, 0.0]
    assert table["twin_error"].tolist() == pytest.approx([0.25, 0.4, 0.145])


def test_the_table_of_twins_by_hand():
    # Of each start its worst twin, the worst first; 0.29 is no twin, nor is a place that is none.
    twins = table_of_bounds().twins()
    assert twins["twin_error"].tolist() == [0.5, 0.4]
    assert twins["east_m"].tolist() == [500_022.5, 500_002.5]
    assert twins["twin_east_m"].tolist() == [500_007.5, 500_012.5]
    assert twins["north_m"].tolist() == twins["twin_north_m"].tolist() == [2.5, 2.5]
    assert twins["way_id"].tolist() == [8, 7]
    assert twins["twin_way_id"].tolist() == [7, 9]
    assert twins["apart_m"].tolist() == [15.0, 10.0]


def test_columns_at_the_points_are_those_of_the_nearest_start():
    bound = table_of_bounds()
    # The fourth point is as far from the third as from the fifth: either.
    columns = bound.at_points()
    assert columns["cells_to_fix_m"][[0, 2, 4]].tolist() == [150.0, 50.0, 5.0]
    assert columns["levels_to_fix_m"][[0, 2, 4]].tolist() == [20.0, 200.0, 5.0]
    assert columns["twin_error"][[0, 2, 4]].tolist() == pytest.approx([0.25, 0.145, 0.4])
    np.testing.assert_array_equal(columns["plane_bound_m"], [1.0, 3.0, np.nan, np.nan, 5.0])
    np.testing.assert_array_equal(columns["along_bound_m"], [1.0, 2.0, 3.0, 4.0, np.nan])
    moved = replace(bound, fix=replace(bound.fix, start=np.array([1, 2, 4])))
    assert moved.at_points()["cells_to_fix_m"][:2].tolist() == [150.0, 150.0]


def test_the_raster_holds_the_columns_at_their_points(tmp_path):
    bound = table_of_bounds()
    rasters = {name: on_lattice(bound.radio, v) for name, v in bound.at_points().items()}
    assert rasters["cell_bits"].tolist() == [[0.0, 1.0, 2.0, 3.0, 4.0]]
    path = tmp_path / "bound.tif"
    write_bound(rasters, bound.radio.lattice, path, "whose map it is")
    with rasterio.open(path) as source:
        assert source.transform.to_gdal() == bound.radio.lattice.gdal_transform
        assert source.crs.to_epsg() == 32631
        assert list(zip(source.descriptions, source.units, strict=True)) == [
            (name, unit or None) for name, unit in BANDS
        ]
        assert source.tags()["TIFFTAG_COPYRIGHT"] == "whose map it is"
        assert np.isnan(source.nodata)
        for number, (name, _) in enumerate(BANDS, start=1):
            np.testing.assert_array_equal(source.read(number), rasters[name])
