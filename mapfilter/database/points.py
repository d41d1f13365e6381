"""The points of a database as columns: their places, their ways and their best servers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapfilter._types import Bools, Floats32, Ints, Ints32
from mapfilter.database.checked import Part
from mapfilter.database.parquet import check_places, read_columns, text_codes
from mapfilter.errors import InputError, StoreError, fail
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.roads.widths import half_width_of


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Points:
    """All points of a database in row-major order, as columns of length N.

    Parameters
    ----------
    point : numpy.ndarray of int64
        ``row * lattice.cols + col``: the same in every rebuild on the same lattice.
    way_id : numpy.ndarray of int64
        0 where the point belongs to no way.
    way_class : tuple of (numpy.ndarray of int32, tuple of str)
        Codes and the names that they stand for.
    best_server : numpy.ndarray of int32
        Index into the database's ``cell_ids``; -1 where it has none.
    margin_db : numpy.ndarray of float32
        Best level above the second best, NaN where only one cell is predicted.
    """

    point: Ints
    row: Ints32
    col: Ints32
    way_id: Ints
    way_class: tuple[Ints32, tuple[str, ...]]
    on_square: Bools
    distance_to_way_m: Floats32
    best_server: Ints32
    best_level_dbm: Floats32
    margin_db: Floats32

    def __len__(self) -> int:
        return int(self.point.size)

    def __repr__(self) -> str:
        return f"Points({len(self)} of {', '.join(self.__dataclass_fields__)})"


def read_points(part: Part, lattice: Lattice, plan: CellPlan) -> Points:
    """Read all points of a database.

    Raises
    ------
    StoreError
        The part is damaged, or of other cells or another lattice.
    """
    table = read_columns(part, tuple(Points.__dataclass_fields__))
    check_places(part, table, lattice)
    order = np.argsort(table["point"].to_numpy())
    server, names = text_codes(table["best_server"])
    try:
        known = [plan.index(name) if plan.cells else -1 for name in names]
        rank = np.array(known, dtype=np.int32)
    except InputError as error:
        expected = "best servers among the cells"
        raise fail(StoreError, str(part), expected, names, "parts mixed up") from error
    way_class, classes = text_codes(table["way_class"])
    plain = table.drop_columns(["best_server", "way_class"])
    return Points(
        **{name: plain[name].to_numpy()[order] for name in plain.column_names},
        best_server=rank[server[order]],
        way_class=(way_class[order], classes),
    )


def way_columns(points: Mapping[str, Any]) -> tuple[Floats32, Floats32]:
    """Return half the usual width of each point's way (0 without one), and the distance to it.

    ``points`` has the columns way_id, way_class, on_square and distance_to_way_m; distances are 0
    in squares.
    """
    code, classes = text_codes(points["way_class"])
    by_class_m = np.array([half_width_of(name) for name in classes], dtype=np.float32)[code]
    half_width_m = np.where(points["way_id"] == 0, np.float32(0), by_class_m)
    return half_width_m, np.where(points["on_square"], np.float32(0), points["distance_to_way_m"])
