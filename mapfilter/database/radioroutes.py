"""The radio-route database: accessible points, and the levels of each cell there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from mapfilter._html import html_table, shortened
from mapfilter._types import Floats32, Ints32
from mapfilter.database.checked import Part, part_named
from mapfilter.database.field import RadioField, fill_field
from mapfilter.database.manifest import DEVIATIONS, POINTS, READINGS
from mapfilter.database.measured import MeasuredParts
from mapfilter.database.measured_files import read_measured
from mapfilter.database.parquet import WindowReader, check_places, read_columns
from mapfilter.database.points import Points, read_points, way_columns
from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice, checked_bounds
from mapfilter.radio.cells import CellPlan

if TYPE_CHECKING:
    from mapfilter.roads.ways import Bounds

Rows = Ints32


@dataclass(frozen=True, repr=False, eq=False)
class RadioRouteDatabase:
    """A database folder, read on demand and only as far as needed.

    It is a snapshot: what is read is compared with the checksums of the manifest that was opened.
    When the folder was replaced since, reading raises a StoreError that says so.

    Open one with :func:`mapfilter.database.store.open_database`.

    Parameters
    ----------
    path : Path
        The folder.
    lattice : Lattice
        Where the points lie.
    plan : CellPlan
        The cells, in the lattice's CRS; none in a database of roads alone.
    margin_db : float
        A point belongs to the best server of each layer and to cells at most this much weaker.
    floor_dbm : float
        Weakest level that is kept.
    manifest : mapping
        Everything that ``manifest.json`` holds: inputs, parameters, parts, counts, versions.
    generation : str
        SHA-256 of ``manifest.json``: equal for databases whose contents are.
    """

    path: Path
    lattice: Lattice
    plan: CellPlan
    margin_db: float
    floor_dbm: float
    manifest: Mapping[str, Any]
    generation: str

    def __repr__(self) -> str:
        points = self.manifest.get("counts", {}).get("points", "unknown number of")
        return (
            f"RadioRouteDatabase({str(self.path)!r}, {len(self.plan)} cells, {points} points;\n"
            f"  {self.lattice}; margin {self.margin_db:g} dB, floor {self.floor_dbm:g} dBm)"
        )

    def _repr_html_(self) -> str:
        """Return a table, as notebooks show it."""
        counts = self.manifest.get("counts", {})
        rows: dict[str, object] = {
            "folder": self.path,
            "points": counts.get("points", "unknown"),
            "cells": f"{len(self.plan)}: {shortened(self.plan.ids)}" if len(self.plan) else "none",
            "lattice": self.lattice,
            "margin": f"{self.margin_db:g} dB",
            "floor": f"{self.floor_dbm:g} dBm",
        }
        if self.attribution:
            rows["map"] = self.attribution
        return html_table("Radio-route database", rows)

    @property
    def crs(self) -> str:
        """CRS of the points, and of positions that are located."""
        return self.lattice.crs

    @property
    def cell_ids(self) -> tuple[str, ...]:
        """Ids of all cells, also of those without a level at any point."""
        return self.plan.ids

    @property
    def attribution(self) -> str:
        """Attribution of the map that the roads come from; to be shown with every picture of it."""
        return str(self.manifest.get("attribution", ""))

    @cached_property
    def level_parts(self) -> Mapping[str, tuple[Part, ...]]:
        """The parts with each cell's levels; cells without a level have none."""
        parts: dict[str, tuple[Part, ...]] = {}
        for entry in self.manifest["parts"]:
            if entry.get("cell") is not None:
                cell, part = str(entry["cell"]), Part.of(self.path, entry, self.generation)
                parts[cell] = (*parts.get(cell, ()), part)
        return MappingProxyType(parts)

    @property
    def points_part(self) -> Part:
        """The part with the points."""
        return part_named(POINTS, self.path, self.manifest, self.generation)

    @cached_property
    def _points(self) -> Points:
        return read_points(self.points_part, self.lattice, self.plan)

    def measured(self) -> MeasuredParts | None:
        """Return what its survey measured; None where levels were predicted.

        Raises
        ------
        StoreError
            A part is damaged, or the database was replaced since it was opened.
        """
        parts = {part["path"] for part in self.manifest["parts"]}
        if DEVIATIONS not in parts or not self.cell_ids:
            return None
        readings, deviations = (
            part_named(name, self.path, self.manifest, self.generation)
            for name in (READINGS, DEVIATIONS)
        )
        return read_measured(readings, deviations, self.lattice, self.cell_ids)

    def without_cells(self) -> RadioRouteDatabase:
        """Return the same points as a database of roads alone."""
        return replace(self, plan=CellPlan(self.plan.crs, ()))

    def __getstate__(self) -> dict[str, Any]:
        # What was read is not sent to other processes; they read it themselves.
        return {name: self.__dict__[name] for name in self.__dataclass_fields__}

    def points(self) -> Points:
        """Return all points in row-major order; read at the first call and kept."""
        return self._points

    def cell_points(
        self, cell_id: str, margin_db: float | None = None
    ) -> tuple[Rows, Rows, Floats32]:
        """Return the points that belong to a cell, reading only that cell's partition.

        Parameters
        ----------
        margin_db : float or None
            A point belongs to the cell when the cell is at most this much weaker than the best
            server of its layer there; infinity gives all points above the floor, None takes the
            database's own.

        Returns
        -------
        row, col, level_dbm : numpy.ndarray, shape (N,)
            In row-major order.

        Raises
        ------
        InputError
            The database has no such cell, or the margin is negative or NaN.
        """
        margin = self.margin_db if margin_db is None else margin_db
        if not margin >= 0:
            raise fail(InputError, "margin_db", "dB >= 0", margin)
        if cell_id not in self.plan:
            hint = "log and database of different networks or dates"
            raise fail(InputError, str(self.path), "a cell of the database", repr(cell_id), hint)
        columns = {
            "point": "i8",
            "row": "i4",
            "col": "i4",
            "level_dbm": "f4",
            "below_best_db": "f4",
        }
        tables = []
        for part in self.level_parts.get(cell_id, ()):
            tables.append(read_columns(part, tuple(columns)))
            check_places(part, tables[-1], self.lattice)
        point, row, col, level, below = (
            np.concatenate([np.empty(0, kind), *(table[name].to_numpy() for table in tables)])
            for name, kind in columns.items()
        )
        # In single precision on both sides, so that 2.4 dB is within 2.4 dB.
        kept = np.flatnonzero(below <= np.float32(margin))
        kept = kept[np.argsort(point[kept])]
        return row[kept], col[kept], level[kept]

    def field(self, bounds_m: Bounds | None = None) -> RadioField:
        """Return the levels of all cells over an area, also off the ways.

        Only what lies in the area is read, save for rows stored together with it.

        Parameters
        ----------
        bounds_m : tuple of float, optional
            West, south, east, north; the whole lattice when left out.

        Raises
        ------
        InputError
            The database has no point there.
        """
        top, left, window = self._window(bounds_m)
        area = (top, left, window.rows, window.cols)
        columns = ("row", "col", "way_id", "way_class", "on_square", "distance_to_way_m")
        points = WindowReader([self.points_part], columns, self.lattice).read(area)
        if not points or not points["row"].size:
            where = "whole lattice" if bounds_m is None else f"area {bounds_m}"
            raise fail(InputError, where, "points of the database", "none", "another area or CRS")
        order = np.lexsort((points["col"], points["row"]))
        half_width_m, on_way_m = way_columns(points)
        del points["way_class"]
        on_way_m = on_way_m[order]
        points = {name: values[order] for name, values in points.items()}
        received: list[tuple[str, Rows, Rows, Floats32]] = []
        for cell_id in self.cell_ids:
            parts = self.level_parts.get(cell_id, ())
            found = WindowReader(parts, ("row", "col", "level_dbm"), self.lattice).read(area)
            if found and found["row"].size:
                row, col = found["row"] - top, found["col"] - left
                received.append((cell_id, row, col, found["level_dbm"]))
        pixels = points["row"] - top, points["col"] - left
        return fill_field(window, pixels, points["way_id"], on_way_m, half_width_m[order], received)

    def _window(self, bounds_m: Bounds | None) -> tuple[int, int, Lattice]:
        if bounds_m is None:
            return 0, 0, self.lattice
        west, south, east, north = checked_bounds(bounds_m, "area")
        top, left = self.lattice.row_col(west, north)
        bottom, right = self.lattice.row_col(east, south)
        top, left = max(top, 0), max(left, 0)
        rows = min(bottom, self.lattice.rows - 1) - top + 1
        cols = min(right, self.lattice.cols - 1) - left + 1
        if rows < 1 or cols < 1:
            covered = ", ".join(f"{value:.0f}" for value in self.lattice.bounds_m)
            hint = "degrees given for metres, or another CRS"
            raise fail(InputError, "area", f"an area within {covered}", bounds_m, hint)
        return top, left, self.lattice.window(top, left, rows, cols)
