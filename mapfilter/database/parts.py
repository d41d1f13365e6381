"""Writing a database's Parquet parts tile by tile, with bounded memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from mapfilter._json_files import write_sealed
from mapfilter._parallel import Progress
from mapfilter._types import Floats
from mapfilter.database.manifest import (
    CELLS,
    FORMAT,
    MANIFEST,
    POINTS,
    VERSION,
    InputFile,
    describe_part,
    levels_folders,
)
from mapfilter.database.measured import MeasuredParts
from mapfilter.database.measured_files import write_measured
from mapfilter.database.parquet import (
    dictionary,
    geo_metadata,
    open_writer,
    point_coordinates,
    write_columns,
)
from mapfilter.database.store import write_cells
from mapfilter.database.tiles import TileLevels, TileRows
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan

LevelsRows = dict[str, NDArray[Any]]

_ROWS_IN_A_GROUP = 1 << 16
ROWS_IN_MEMORY = 1 << 22


def points_table(places: pa.Table, levels: TileLevels, cell_ids: tuple[str, ...]) -> pa.Table:
    """Return rows of ``points.parquet``: the places with a level above the floor.

    Without cells these are all places; their best server is an empty text.
    """
    received = levels.best >= 0 if cell_ids else np.ones(levels.best.size, dtype=np.bool_)
    table = places.filter(pa.array(received))
    best = levels.best[received] if cell_ids else np.zeros(levels.best.size, dtype=np.int32)
    columns = {
        "best_server": dictionary(best, cell_ids or ("",)),
        "best_level_dbm": levels.best_level_dbm[received],
        "margin_db": levels.margin_db[received],
    }
    for name, values in columns.items():
        table = table.add_column(table.num_columns - 1, name, pa.array(values))
    return table


def levels_rows(places: pa.Table, levels: TileLevels) -> Iterator[tuple[int, LevelsRows]]:
    """Yield (cell, columns of its ``levels`` part) for every cell with a level at the places."""
    columns: LevelsRows = {
        **{name: places[name].to_numpy()[levels.which] for name in ("point", "row", "col")},
        "level_dbm": levels.level_dbm,
        "below_best_db": levels.below_best_db,
    }
    received, first = np.unique(levels.cell, return_index=True)
    ends = np.append(first, levels.cell.size)[1:]
    for cell, start, end in zip(received.tolist(), first.tolist(), ends.tolist(), strict=True):
        yield cell, {name: values[start:end] for name, values in columns.items()}


def levels_table(cell_id: str, rows: Sequence[LevelsRows]) -> pa.Table:
    """Return the rows of a cell's ``levels`` part, those of some tiles one after the other."""
    table = {name: pa.array(np.concatenate([some[name] for some in rows])) for name in rows[0]}
    cell = dictionary(np.zeros(len(table["point"]), np.int32), (cell_id,))
    return pa.table(table).add_column(3, "cell", cell)


class PartWriter:
    """Collects rows, and writes them into a folder whenever enough of them are in memory.

    With several ``writers`` as many threads write these parts while rows of the next ones are
    collected, and no longer than that: twice as many rows are in memory. The parts do not depend on
    it. ``points`` counts those added, ``received`` those of them with a level above the floor and
    ``below_floor`` those with weaker ones only; ``parts`` are the manifest's entries at the end.
    """

    def __init__(self, folder: Path, crs: str, cell_ids: tuple[str, ...], writers: int) -> None:
        self._folder, self._crs, self._cell_ids = folder, crs, cell_ids
        self._pool = ThreadPoolExecutor(writers) if writers > 1 else None
        self._writing: list[Future[None]] = []
        self._folders = levels_folders(cell_ids)
        self._points: list[pa.Table] = []
        self._levels: dict[int, list[LevelsRows]] = {}
        self._waiting = 0
        self._points_file: pq.ParquetWriter | None = None
        self._bounds: tuple[Floats, Floats] = (np.full(2, np.inf), np.full(2, -np.inf))
        self._written: dict[int, list[dict[str, Any]]] = {}
        self.points, self.received, self.below_floor = 0, 0, 0
        self.parts: list[dict[str, Any]] = []

    def __enter__(self) -> PartWriter:
        return self

    def __exit__(self, *_: object) -> None:
        if self._pool is not None:
            # Nobody writes into the folder when it is left, which may be removed.
            self._pool.shutdown(cancel_futures=True)
        if self._points_file is not None:
            self._points_file.close()

    def add(self, tile: TileRows) -> None:
        """Take the rows of one tile."""
        places, levels = tile.places, tile.levels
        points = points_table(places, levels, self._cell_ids)
        self.points += places.num_rows
        self.received += points.num_rows
        weak = (levels.best < 0) & np.isfinite(levels.best_level_dbm)
        self.below_floor += int(np.count_nonzero(weak))
        if points.num_rows:
            self._points.append(points)
        for cell, rows in levels_rows(places, levels):
            self._levels.setdefault(cell, []).append(rows)
        self._waiting += levels.cell.size if self._cell_ids else places.num_rows
        if self._waiting >= ROWS_IN_MEMORY:
            self._flush()

    def finish(self) -> None:
        """Write what is left, and list the parts: points first, then cell by cell."""
        self._flush()
        self._wait()
        if self._points_file is None:
            return
        geo = geo_metadata(self._crs, np.concatenate(self._bounds).tolist())
        self._points_file.add_key_value_metadata({"geo": geo.decode()})
        self._points_file.close()
        points = describe_part(self._folder, self._folder / POINTS, self.received)
        every = (self._written[cell] for cell in sorted(self._written))
        self.parts = [points, *(part for parts in every for part in parts)]

    def _flush(self) -> None:
        points, levels = self._points, self._levels
        self._points, self._levels, self._waiting = [], {}, 0
        # The parts of a cell are numbered, and the points follow each other.
        self._wait()
        parts: list[Callable[[], None]] = [partial(self._write_points, points)] if points else []
        parts += [partial(self._write_levels, cell, levels[cell]) for cell in sorted(levels)]
        if self._pool is not None:
            self._writing = [self._pool.submit(write) for write in parts]
        else:
            for write in parts:
                write()

    def _wait(self) -> None:
        writing, self._writing = self._writing, []
        for written in writing:
            written.result()

    def _write_points(self, tables: list[pa.Table]) -> None:
        table = pa.concat_tables(tables).unify_dictionaries().replace_schema_metadata(None)
        if self._points_file is None:
            self._points_file = open_writer(table.schema, self._folder / POINTS)
        self._points_file.write_table(table, row_group_size=_ROWS_IN_A_GROUP)
        for chunk in table["geometry"].chunks:
            places = point_coordinates(chunk)
            low, high = self._bounds
            self._bounds = np.minimum(low, places.min(axis=0)), np.maximum(high, places.max(axis=0))

    def _write_levels(self, cell: int, rows: Sequence[LevelsRows]) -> None:
        cell_id = self._cell_ids[cell]
        table = levels_table(cell_id, rows)
        written = self._written.setdefault(cell, [])
        file = self._folder / self._folders[cell_id] / f"part-{len(written)}.parquet"
        file.parent.mkdir(parents=True, exist_ok=True)
        write_columns(table, file, _ROWS_IN_A_GROUP)
        written.append(describe_part(self._folder, file, table.num_rows, cell_id))


@dataclass(frozen=True, slots=True)
class Head:
    """Contents of a manifest without its parts."""

    lattice: Lattice
    plan: CellPlan
    parameters: Mapping[str, Any]
    attribution: str
    inputs: tuple[InputFile, ...]
    counts: Mapping[str, int | None]
    measured: MeasuredParts | None = None

    def write(self, folder: Path, parts: Iterable[Mapping[str, Any]]) -> None:
        """Write cell table and manifest into a folder that holds the parts."""
        write_cells(self.plan, folder / CELLS)
        cells = describe_part(folder, folder / CELLS, len(self.plan.ids))
        surveyed = [] if self.measured is None else write_measured(folder, self.measured)
        write_sealed(
            folder / MANIFEST,
            {
                "format": FORMAT,
                "version": VERSION,
                "software": f"mapfilter {version('mapfilter')}",
                "crs": self.lattice.crs,
                "lattice": asdict(self.lattice),
                "cells": list(self.plan.ids),
                "parameters": dict(self.parameters),
                "attribution": self.attribution,
                "inputs": [asdict(file) for file in self.inputs],
                "counts": dict(self.counts),
                "parts": [cells, *parts, *surveyed],
            },
        )


def write_parts(
    folder: Path,
    crs: str,
    cell_ids: tuple[str, ...],
    tiles: Iterable[TileRows],
    total: int,
    writers: int = 1,
    progress: Progress | None = None,
) -> PartWriter:
    """Write points and levels of tiles, as they come, with bounded memory; return the writer."""
    with PartWriter(folder, crs, cell_ids, writers) as writer:
        for done, tile in enumerate(tiles, start=1):
            writer.add(tile)
            if progress is not None:
                progress(done, total)
        writer.finish()
    return writer
