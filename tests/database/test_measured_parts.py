"""What a survey adds to a database: readings and deviations as files, by pixel, and of several."""

import hashlib
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from small_world import CRS

from mapfilter.database import measured
from mapfilter.database.manifest import DEVIATIONS, POINTS, READINGS
from mapfilter.database.measured import (
    Deviations,
    MeasuredParts,
    Readings,
    deviations_at_points,
    merged_parts,
)
from mapfilter.database.measured_files import (
    read_checked_readings,
    read_measured,
    read_readings,
    readings_parquet,
    write_measured,
    write_readings,
)
from mapfilter.database.parquet import write_columns
from mapfilter.errors import InputError, StoreError
from mapfilter.lattice import Lattice
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters

LATTICE = Lattice(CRS, 1000.0, 2000.0, 10.0, 5, 7)
NAMES = ("report", "session", "east_m", "north_m", "level_dbm", "timing_advance", "serving")


def readings(cell_ids=("A", "B", "C"), count=6, seed=1):
    rng = np.random.default_rng(seed)
    return Readings(
        cell_ids,
        rng.integers(len(cell_ids), size=count).astype(np.int32),
        np.sort(rng.integers(4, size=count)).astype(np.int32),
        np.sort(rng.integers(2, size=count)).astype(np.int32),
        1000.0 + 70 * rng.random(count),
        1950.0 + 50 * rng.random(count),
        np.round(rng.uniform(-100, -60, count), 1),
        np.where(rng.random(count) < 0.5, np.nan, rng.integers(9, size=count)),
        rng.random(count) < 0.5,
    )


def deviations(cell_ids, *rows):
    """Rows of cell, row, column and deviation."""
    cell, row, col, value = zip(*rows, strict=True) if rows else ((), (), (), ())
    whole = (np.array(one, dtype=np.int32) for one in (cell, row, col))
    return Deviations(cell_ids, *whole, np.array(value, dtype=np.float32))


def named(found):
    """Return deviations by cell and place."""
    rows = zip(found.cell.tolist(), found.row.tolist(), found.col.tolist(),
               found.deviation_db.tolist(), strict=True)  # fmt: skip
    return {(found.cell_ids[cell], row, col): value for cell, row, col, value in rows}


def assert_same(found, given):
    assert len(found) == len(given)
    for name in NAMES:
        one, other = getattr(found, name), getattr(given, name)
        assert one.dtype == other.dtype, name
        np.testing.assert_array_equal(one, other, err_msg=name)
    own = [found.cell_ids[n] for n in found.cell]
    assert own == [given.cell_ids[n] for n in given.cell]


def test_some_readings_keep_their_columns():
    given = readings(count=9)
    kept = np.arange(9) % 2 == 1
    found = given.some(kept)
    assert (len(given), len(found)) == (9, 4)
    assert found.cell_ids == given.cell_ids
    for name in ("cell", *NAMES):
        np.testing.assert_array_equal(getattr(found, name), getattr(given, name)[kept])


@pytest.mark.parametrize("count", [0, 1, 40])
def test_readings_come_back_from_their_file(tmp_path, count):
    given, path = readings(count=count), tmp_path / "readings.parquet"
    write_readings(given, path)
    assert path.read_bytes() == readings_parquet(given)
    assert_same(read_readings(path), given)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert_same(read_checked_readings(path, digest), given)
    for other in (None, digest[::-1]):
        with pytest.raises(StoreError, match="the readings of the survey's rasters") as caught:
            read_checked_readings(path, other)
        assert caught.value.faults[0].where == str(path)


def test_readings_without_any_cell_can_be_written(tmp_path):
    write_readings(readings(count=0), tmp_path / "a.parquet")
    none = replace(readings(count=0), cell_ids=())
    write_readings(none, tmp_path / "b.parquet")
    for name in ("a", "b"):
        assert len(read_readings(tmp_path / f"{name}.parquet")) == 0


def test_a_reading_without_a_cell_is_damage(tmp_path):
    path = tmp_path / "readings.parquet"
    write_readings(readings(), path)
    table = pq.read_table(path)
    cells = table["cell"].cast(pa.string()).to_pylist()
    cells[2] = None
    write_columns(table.set_column(0, "cell", pa.array(cells)), path)
    with pytest.raises(StoreError, match="a cell in each row, found none"):
        read_readings(path)


def on_ways():
    points = np.zeros((5, 7), dtype=bool)
    points[1, 1:6] = True
    points[4, 0] = True
    return points


def test_pixels_beside_the_points_have_the_deviation_of_the_nearest():
    """Of each cell, in the order asked for; NaN where the nearest point was not measured."""
    given = deviations(
        ("A", "B", "C"), (2, 1, 2, 7.0), (0, 1, 1, 1.0), (0, 1, 5, 2.0), (2, 4, 0, 8.0),
        (0, 1, 2, 3.0),
    )  # fmt: skip
    asked = ("C", "X", "B", "A")
    found = given.spread(asked, on_ways()).reshape(4, 5, 7)
    assert found.dtype == np.float32
    points = np.argwhere(on_ways())
    values = named(given)
    for band, cell in enumerate(asked):
        for row in range(5):
            for col in range(7):
                away = ((points - (row, col)) ** 2).sum(axis=1)
                near = {
                    values.get((cell, *one), np.nan) for one in points[away == away.min()].tolist()
                }
                assert np.any(np.isclose(found[band, row, col], list(near), equal_nan=True))
    assert np.isnan(found[1:3]).all()
    assert found[3, 1, 1:6].tolist()[:2] == [1.0, 3.0]
    assert given.spread((), on_ways()).shape == (0, 35)


def parts_of(cell_ids, *rows, count=5, seed=1):
    return MeasuredParts(readings(cell_ids, count, seed), deviations(cell_ids, *rows))


def test_parts_of_several_surveys_have_the_rows_of_all():
    one = parts_of(("A", "B"), (0, 0, 0, 1.0), (1, 2, 3, 2.0), seed=1)
    other = parts_of(("B", "Z", "A"), (0, 1, 1, 3.0), (1, 0, 0, 4.0), (2, 0, 2, 5.0), seed=2)
    cells = ("A", "B")
    found = merged_parts([one, other], [(0, 0), (2, 4)], cells, ("Z",))
    # Z is no cell of the result.
    assert named(found.deviations) == {
        ("A", 0, 0): 1.0, ("B", 2, 3): 2.0, ("B", 3, 5): 3.0, ("A", 2, 6): 5.0,
    }  # fmt: skip
    assert found.deviations.cell_ids == found.readings.cell_ids == cells
    kept = np.array([other.readings.cell_ids[n] != "Z" for n in other.readings.cell])
    assert 0 < kept.sum() < 5
    assert len(found.readings) == 5 + kept.sum()
    for name in NAMES[2:]:
        expected = [*getattr(one.readings, name), *getattr(other.readings, name)[kept]]
        np.testing.assert_array_equal(getattr(found.readings, name), expected)
    names = [cells[n] for n in found.readings.cell]
    assert names == [
        *(one.readings.cell_ids[n] for n in one.readings.cell),
        *(other.readings.cell_ids[n] for n in other.readings.cell[kept]),
    ]
    for name in ("cell", "report", "session"):
        assert getattr(found.readings, name).dtype == np.int32


def test_numbers_of_reports_and_sessions_of_different_surveys_differ():
    """Those of the second follow on the first's, and those of the third on the second's."""
    surveys = [parts_of(("A",), seed=seed) for seed in (1, 2, 3)]
    empty = parts_of(("A",), count=0)
    found = merged_parts([*surveys[:2], empty, surveys[2]], [(0, 0)] * 4, ("A",)).readings
    for name in ("report", "session"):
        expected, begin = [], 0
        for one in surveys:
            own = getattr(one.readings, name)
            expected += (begin + own).tolist()
            begin += int(own.max()) + 1
        assert getattr(found, name).tolist() == expected


def test_of_deviations_given_twice_the_last_counts():
    one = parts_of(("A", "B"), (0, 3, 3, 1.0), (1, 3, 3, 2.0), (0, 1, 1, 9.0), count=0)
    other = parts_of(("A",), (0, 1, 2, 6.0), count=0)
    found = merged_parts([one, other], [(0, 0), (2, 1)], ("A", "B")).deviations
    assert named(found) == {("A", 3, 3): 6.0, ("B", 3, 3): 2.0, ("A", 1, 1): 9.0}
    found = merged_parts([other, one], [(2, 1), (0, 0)], ("A", "B")).deviations
    assert named(found) == {("A", 3, 3): 1.0, ("B", 3, 3): 2.0, ("A", 1, 1): 9.0}
    assert len(found) == 3
    nothing = parts_of(("A",), count=0)
    assert len(merged_parts([nothing], [(0, 0)], ("A",)).deviations) == 0


def points_in(folder, *places):
    folder.mkdir()
    row, col = np.array(places, dtype=np.int32).reshape(-1, 2).T
    write_columns(pa.table({"row": row, "col": col}), folder / POINTS)
    return folder


@pytest.mark.parametrize("at_once", [1 << 25, 35, 80, 1])
def test_deviations_at_points_are_those_of_the_rasters(tmp_path, monkeypatch, at_once):
    """However many cells are read together; not those that no raster has, or that lie between."""
    monkeypatch.setattr(measured, "_LARGEST_READ_PX", at_once)
    rng, known = np.random.default_rng(3), ("D", "B", "A")
    values = np.round(rng.uniform(1, 9, (3, 5, 7)), 2).astype(np.float32)
    values[1, 1, 1] = np.nan
    bands = zip(known, values, strict=True)
    write_rasters(tmp_path / "sd.tif", LATTICE, bands, known, {}, quantity="deviation")
    folder = points_in(tmp_path / "db", (0, 0), (1, 1), (4, 6))
    found = deviations_at_points(folder, open_rasters(tmp_path / "sd.tif"), ("A", "B", "C", "D"))
    assert found.cell_ids == ("A", "B", "C", "D")
    expected = {
        (cell, row, col): pytest.approx(float(values[known.index(cell), row, col]))
        for cell in "ABD" for row, col in ((0, 0), (1, 1), (4, 6))
        if (cell, row, col) != ("B", 1, 1)
    }  # fmt: skip
    assert named(found) == expected
    assert len(found) == 8


def test_deviations_of_another_lattice_are_refused(tmp_path):
    values = np.full((1, 5, 7), 3.0, dtype=np.float32)
    write_rasters(tmp_path / "sd.tif", LATTICE, zip("A", values, strict=True), ("A",), {},
                  quantity="deviation")  # fmt: skip
    rasters = open_rasters(tmp_path / "sd.tif")
    for number, place in enumerate(((5, 0), (0, 7), (-1, 0))):
        folder = points_in(tmp_path / f"db{number}", (0, 0), place)
        with pytest.raises(InputError, match="the lattice of the levels, found another"):
            deviations_at_points(folder, rasters, ("A",))
    folder = points_in(tmp_path / "none")
    assert len(deviations_at_points(folder, rasters, ("A",))) == 0


def test_both_parts_come_back_from_a_folder(tmp_path):
    given = MeasuredParts(
        readings(), deviations(("A", "B", "C"), (0, 4, 6, 2.5), (2, 0, 0, 1.25), (2, 3, 1, 4.0))
    )
    entries = write_measured(tmp_path, given)
    assert [(one["path"], one["rows"]) for one in entries] == [(READINGS, 6), (DEVIATIONS, 3)]
    for one in entries:
        data = (tmp_path / one["path"]).read_bytes()
        assert one["bytes"] == len(data)
        assert one["sha256"] == hashlib.sha256(data).hexdigest()
    files = tmp_path / READINGS, tmp_path / DEVIATIONS
    found = read_measured(*files, LATTICE, ("A", "B", "C"))
    assert_same(found.readings, given.readings)
    assert named(found.deviations) == named(given.deviations)
    kinds = [one.dtype for one in (found.deviations.row, found.deviations.deviation_db)]
    assert kinds == [np.int32, np.float32]
    write_measured(tmp_path, MeasuredParts(readings((), 0), deviations(())))
    nothing = read_measured(*files, LATTICE, ("A",))
    assert (len(nothing.readings), len(nothing.deviations)) == (0, 0)


@pytest.mark.parametrize(
    ("parts", "name"),
    [
        # Readings of none of the cells; deviations of one that is none of them, or off the lattice.
        (MeasuredParts(readings(("X", "Y")), deviations(("A",), (0, 0, 0, 1.0))), READINGS),
        (MeasuredParts(readings(("X",), 1), deviations(("A",), (0, 0, 0, 1.0))), READINGS),
        (MeasuredParts(readings(("A",)), deviations(("A", "X"), (1, 0, 0, 1.0))), DEVIATIONS),
        (
            MeasuredParts(readings(("A",)), deviations(("A",), (0, 1, 1, 2.0), (0, 5, 0, 1.0))),
            DEVIATIONS,
        ),
        (MeasuredParts(readings(("A",)), deviations(("A",), (0, 0, 7, 1.0))), DEVIATIONS),
    ],
)
def test_parts_of_another_database_are_refused(tmp_path, parts, name):
    write_measured(tmp_path, parts)
    with pytest.raises(StoreError, match="found others") as caught:
        read_measured(tmp_path / READINGS, tmp_path / DEVIATIONS, LATTICE, ("A", "B"))
    assert caught.value.faults[0].where == str(tmp_path / name)


def test_readings_may_have_cells_without_a_map(tmp_path):
    """One that is known is enough; nothing at all is of every database."""
    write_measured(
        tmp_path, MeasuredParts(readings(("X", "B")), deviations(("B",), (0, 0, 0, 1.0)))
    )
    files = tmp_path / READINGS, tmp_path / DEVIATIONS
    assert len(read_measured(*files, LATTICE, ("A", "B")).readings) == 6
