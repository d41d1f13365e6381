"""Threads that write the parts of a database: which one does, and that none outlives its folder."""

import threading
import time

import numpy as np
import pyarrow as pa
import pytest
from small_world import CRS

from mapfilter.database import parts
from mapfilter.database.parquet import point_geometry
from mapfilter.database.parts import PartWriter, write_parts
from mapfilter.database.tiles import TileRows, received_levels
from mapfilter.lattice import Lattice

LATTICE = Lattice(CRS, 1000.0, 2000.0, 5.0, 2, 8)
IDS = tuple(f"C{number}" for number in range(12))


def tile():
    """All cells at two points."""
    row, col = np.array([0, 1]), np.array([3, 3])
    places = pa.table({
        "point": row * 8 + col, "row": row.astype("i4"), "col": col.astype("i4"),
        "geometry": point_geometry(*LATTICE.east_north(row, col)),
    })  # fmt: skip
    return TileRows(places, received_levels(np.full((len(IDS), 2), -70.0), -100.0))


@pytest.mark.parametrize("writers", [1, 2, 3])
def test_one_writer_is_this_thread_and_several_are_others(tmp_path, monkeypatch, writers):
    own, wrote = parts.write_columns, set()

    def noted(table, file, rows):
        wrote.add(threading.get_ident())
        # Long enough for every thread to get a part.
        time.sleep(0.02)
        own(table, file, rows)

    monkeypatch.setattr(parts, "write_columns", noted)
    with PartWriter(tmp_path, CRS, IDS, writers) as writer:
        writer.add(tile())
        writer.finish()
    assert len(wrote) == writers
    assert (threading.get_ident() in wrote) == (writers == 1)
    assert len(writer.parts) == 1 + len(IDS)


def test_after_an_error_no_thread_writes_any_more(tmp_path, monkeypatch):
    """Those that are at work end first, and parts that wait are not begun."""
    own, failed, begun, ended = parts.write_columns, threading.Event(), [], []

    def write(table, file, rows):
        begun.append(file)
        if len(begun) == 1:
            failed.set()
            raise OSError("No space left on device")
        failed.wait(10)
        time.sleep(0.3)
        # The part that fails need not be the first one that is waited for.
        own(table, file, rows)
        ended.append(file)

    monkeypatch.setattr(parts, "write_columns", write)
    with pytest.raises(OSError, match="No space left"):
        write_parts(tmp_path, CRS, IDS, [tile()], 1, writers=2)
    assert len(ended) == len(begun) - 1
    assert len(begun) < len(IDS)
    time.sleep(0.4)
    assert len(ended) == len(begun) - 1
