"""From tiles, wherever they come from, to the files of a database folder."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mapfilter._io import write_json
from mapfilter._parallel import Progress
from mapfilter.database.manifest import (
    CELLS,
    FORMAT,
    MANIFEST,
    VERSION,
    InputFile,
    describe_part,
)
from mapfilter.database.parts import PartWriter
from mapfilter.database.store import write_cells
from mapfilter.database.tiles import TileRows
from mapfilter.geodesy import Lattice
from mapfilter.radio.cells import CellPlan


@dataclass(frozen=True, slots=True)
class Written:
    """What was written of some tiles.

    Parameters
    ----------
    parts : tuple of mapping
        Entries for the manifest; none when nothing is heard.
    points, heard : int
        Points of the tiles, and how many of them hear a cell.
    """

    parts: tuple[Mapping[str, Any], ...]
    points: int
    heard: int


@dataclass(frozen=True, slots=True)
class Head:
    """What a manifest says besides its parts."""

    lattice: Lattice
    plan: CellPlan
    parameters: Mapping[str, Any]
    attribution: str
    inputs: tuple[InputFile, ...]
    counts: Mapping[str, int | None]

    def write(self, folder: Path, parts: Iterable[Mapping[str, Any]]) -> None:
        """Write cell table and manifest into a folder that holds the parts."""
        write_cells(self.plan, folder / CELLS)
        cells = describe_part(folder, folder / CELLS, len(self.plan.ids))
        write_json(
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
                "parts": [cells, *parts],
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
) -> Written:
    """Write points and levels of tiles, as they come, with bounded memory."""
    points, heard = 0, 0
    with PartWriter(folder, crs, cell_ids, writers) as writer:
        for done, tile in enumerate(tiles, start=1):
            writer.add(tile)
            points += tile.places.num_rows
            heard += int((tile.levels.best >= 0).sum())
            if progress is not None:
                progress(done, total)
        parts = writer.finish() if heard else []
    return Written(tuple(parts), points, heard)
