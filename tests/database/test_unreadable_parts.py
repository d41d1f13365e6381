"""Parts that cannot be read, or whose text is none: the error names the part and the reason."""

import hashlib
import io
import json
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from small_world import CRS, make_plan

from mapfilter._json_files import sealed
from mapfilter.database import store
from mapfilter.database.checked import BLOCK_BYTES, Part, _CheckedFile, generation_of
from mapfilter.database.manifest import READINGS, describe_part, read_manifest
from mapfilter.database.measured_files import read_checked_readings
from mapfilter.database.parquet import (
    WindowReader,
    damaged,
    open_writer,
    read_columns,
    text_codes,
    write_columns,
)
from mapfilter.database.store import open_database, read_cells, write_cells
from mapfilter.errors import StoreError
from mapfilter.lattice import Lattice


def only(caught):
    (fault,) = caught.value.faults
    return fault


def test_a_block_is_a_quarter_of_a_mebibyte():
    """Databases on disk list a checksum for each."""
    assert BLOCK_BYTES == 262_144


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (ValueError("first\nsecond"), "first"),
        (MemoryError(), "MemoryError"),
        (OSError(5, "Input/output error"), "[Errno 5] Input/output error"),
    ],
)
def test_the_reason_is_the_first_line_of_what_the_library_says(error, reason):
    fault = damaged("db/points.parquet", error).faults[0]
    assert (fault.where, fault.expected, fault.got, fault.hint) == (
        "db/points.parquet", "a whole Parquet file", reason, "damaged",
    )  # fmt: skip
    gone = damaged("db/points.parquet", FileNotFoundError(2, "No such file")).faults[0]
    assert (gone.expected, gone.got) == ("a part of the database", "no such file")


@pytest.mark.parametrize(
    ("error", "got"),
    [(OSError(5, "Input/output error"), "Input/output error"), (OSError("odd"), "odd")],
)
def test_a_disk_that_fails_while_a_block_is_read(tmp_path, error, got):
    class Failing(io.BytesIO):
        def read(self, _=-1):
            raise error

    (tmp_path / "part.bin").write_bytes(b"1234")
    part = Part.of(tmp_path, describe_part(tmp_path, tmp_path / "part.bin", 1), "")
    with pytest.raises(StoreError) as caught:
        _CheckedFile(Failing(), part).read_block(0)
    fault = only(caught)
    assert (fault.where, fault.expected) == (str(tmp_path / "part.bin"), "a readable file")
    assert fault.got == got


def test_a_folder_in_place_of_a_part(copy):
    database = open_database(copy)
    (copy / "points.parquet").unlink()
    (copy / "points.parquet").mkdir()
    with pytest.raises(StoreError) as caught:
        database.points()
    fault = only(caught)
    assert fault.expected == "a part of the database"
    assert fault.got == "Is a directory"


def not_unicode(count):
    """Return a column of text whose bytes are not UTF-8."""
    offsets = pa.py_buffer(np.arange(count + 1, dtype=np.int32).tobytes())
    return pa.Array.from_buffers(pa.string(), count, [None, offsets, pa.py_buffer(b"\xff" * count)])


def test_text_that_is_none_is_damage(tmp_path):
    """Also where checksums are right: whoever wrote it, nothing goes on with it."""
    row, col = np.zeros(3, np.int32), np.arange(3, dtype=np.int32)
    table = pa.table({
        "point": col.astype(np.int64), "row": row, "col": col, "way_class": not_unicode(3),
    })  # fmt: skip
    write_columns(table, tmp_path / "a.parquet")
    with pytest.raises(StoreError, match="a whole Parquet file"):
        read_columns(tmp_path / "a.parquet", ["way_class"])
    assert read_columns(tmp_path / "a.parquet", ["col"]).num_rows == 3
    lattice = Lattice(CRS, 0.0, 5.0, 5.0, 1, 3)
    reader = WindowReader([tmp_path / "a.parquet"], ("row", "col", "way_class"), lattice)
    with pytest.raises(StoreError, match="a whole Parquet file"):
        reader.read((0, 0, 1, 3))


def test_a_database_that_is_replaced_without_pause_is_given_up(copy, monkeypatch):
    number = iter(range(10**6))
    monkeypatch.setattr(store, "generation_of", lambda _: str(next(number)))

    def unlike(*_):
        raise StoreError(())

    monkeypatch.setattr(store, "_open", unlike)
    with pytest.raises(StoreError, match="a database that stays, found ever another"):
        open_database(copy)


def test_points_of_other_cells(database):
    other = replace(database, plan=make_plan(("X", "Y", "S1.A")))
    with pytest.raises(
        StoreError, match=r"best servers among the cells, found .*mixed up"
    ) as caught:
        other.points()
    assert only(caught).where == str(database.path / "points.parquet")


def test_a_cell_table_with_a_wrong_value(tmp_path):
    """And columns that one cell alone states are kept for all."""
    plan = make_plan()
    write_cells(plan, tmp_path / "cells.parquet")
    table = pq.read_table(tmp_path / "cells.parquet")
    wrong = table.set_column(
        table.column_names.index("frequency_mhz"), "frequency_mhz", pa.array([1800.0, -5.0, 1800.0])
    )
    write_columns(wrong, tmp_path / "wrong.parquet")
    with pytest.raises(StoreError, match=r"a cell table, found .*frequency_mhz.*damaged"):
        read_cells(tmp_path / "wrong.parquet", CRS)
    odd = make_plan(technology="GSM")
    mixed = type(plan)(CRS, (*plan.cells[:2], odd.cells[2]))
    write_cells(mixed, tmp_path / "mixed.parquet")
    assert read_cells(tmp_path / "mixed.parquet", CRS) == mixed
    columns = [pq.read_table(tmp_path / f"{name}.parquet").column_names for name in
               ("cells", "mixed")]  # fmt: skip
    assert set(columns[1]) - set(columns[0]) == {"technology"}


def test_parts_of_a_survey_come_in_pairs(copy):
    whole = json.loads((copy / "manifest.json").read_text())
    entry = {"rows": 0, "bytes": 0, "sha256": hashlib.sha256(b"").hexdigest()}
    names = "readings.parquet", "deviations.parquet"
    for name in names:
        parts = [*whole["parts"], {"path": name, **entry}]
        (copy / "manifest.json").write_text(json.dumps(sealed({**whole, "parts": parts})))
        with pytest.raises(StoreError) as caught:
            read_manifest(copy)
        fault = only(caught)
        assert fault.expected == "parts readings.parquet and deviations.parquet"
        assert fault.got == f"{name} alone"
    parts = [*whole["parts"], *({"path": name, **entry} for name in names)]
    (copy / "manifest.json").write_text(json.dumps(sealed({**whole, "parts": parts})))
    assert len(read_manifest(copy)[0]["parts"]) == len(parts)


@pytest.mark.parametrize("path", ["a\0b", "levels/../../x", "..", "/x"])
def test_paths_that_lead_out_of_the_folder(copy, path):
    whole = json.loads((copy / "manifest.json").read_text())
    whole["parts"][0]["path"] = path
    (copy / "manifest.json").write_text(json.dumps(sealed(whole)))
    with pytest.raises(StoreError, match=r"parts\.0\.path: expected a path within the folder"):
        open_database(copy)


@pytest.mark.parametrize(
    ("name", "gib", "read"),
    [
        ("manifest.json", 1, read_manifest),
        ("readings.parquet", 2, lambda folder: read_checked_readings(folder / READINGS, "")),
    ],
)
def test_files_that_are_too_large_are_not_read(tmp_path, name, gib, read):
    """A sparse file, of which there is nothing on the disk."""
    with (tmp_path / name).open("wb") as file:
        file.truncate((gib << 30) + 1)
    with pytest.raises(StoreError, match=f"at most {1024 * gib} MiB, found a larger file"):
        read(tmp_path)


def test_no_rows_of_text_have_no_codes():
    codes, names = text_codes(pa.chunked_array([pa.array([], pa.string())]).dictionary_encode())
    assert (codes.size, names) == (0, ())


def test_what_a_writer_was_given_is_there_once_it_is_closed(tmp_path):
    table = pa.table({"point": np.arange(3), "level_dbm": np.float32([-1, -2, -3])})
    with open_writer(table.schema, tmp_path / "a.parquet") as writer:
        writer.write_table(table)
    assert read_columns(tmp_path / "a.parquet", ["level_dbm", "point"]).num_rows == 3
    assert generation_of(tmp_path) == ""
