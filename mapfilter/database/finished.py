"""Finished tiles of a build on disk, so that a build cut short goes on where it stopped."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import zlib
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pyarrow as pa

from mapfilter._io import ensure_writable_folder
from mapfilter.database.tiles import TileRows
from mapfilter.errors import InputError, OutputError, fail
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.rasters import RxLevRasters

_CHECKSUM_BYTES = 4


def work_key(
    rasters_sha256: str,
    rasters: RxLevRasters,
    plan: CellPlan,
    routes_digest: str,
    parameters: Mapping[str, Any],
) -> str:
    """Return a checksum of all that the tiles of a build depend on."""
    read_as = (rasters.cell_ids, asdict(rasters.lattice), rasters.quantity, rasters.factor)
    parts = (
        version("mapfilter"), pa.__version__, rasters_sha256, read_as, rasters.resampling,
        [asdict(cell) for cell in plan.cells], routes_digest,
        {name: value for name, value in parameters.items() if name != "margin_db"},
    )  # fmt: skip
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


class FinishedTiles:
    """A hidden folder beside a database, with one file per finished tile.

    It is left when the build is killed or interrupted or a worker dies, and removed when the build
    is done, its inputs are wrong, or it cannot be written.

    Parameters
    ----------
    database : Path
        The folder that is being built.
    key : callable
        Gives a checksum of the inputs, when it is first needed: tiles of others are never taken.
    keep : bool
        Take tiles that are there already.
    """

    def __init__(self, database: Path, key: Callable[[], str], *, keep: bool = False) -> None:
        self._database, self._key = database, key
        self.keep = keep

    @cached_property
    def folder(self) -> Path:
        """Where the tiles lie; emptied at first, unless they are kept."""
        folder = self._database.parent / f".{self._database.name}.tiles-{self._key()[:16]}"
        if not self.keep:
            shutil.rmtree(folder, ignore_errors=True)
        return folder

    def __enter__(self) -> FinishedTiles:
        ensure_writable_folder(self._database.parent)
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        # Where nobody asked for the folder there is none, and its name may take long to be known.
        asked = "folder" in vars(self)
        if asked and (kind is None or issubclass(kind, InputError | OutputError)):
            shutil.rmtree(self.folder, ignore_errors=True)

    def missing(self, total: int) -> list[int]:
        """Return the tiles, of so many, that are still to be made."""
        return [n for n in range(total) if not self.keep or self.load(n) is None]

    def load(self, number: int) -> TileRows | None:
        """Return a finished tile, or None when there is none or its file is damaged."""
        try:
            data = self._file(number).read_bytes()
        except OSError:
            return None
        checksum, rows = data[:_CHECKSUM_BYTES], data[_CHECKSUM_BYTES:]
        if zlib.crc32(rows).to_bytes(_CHECKSUM_BYTES, "big") != checksum:
            return None
        return TileRows.from_bytes(rows)

    def save(self, number: int, rows: bytes) -> None:
        """Put a finished tile on disk.

        Raises
        ------
        OutputError
            It cannot be written.
        """
        file = self._file(number)
        temporary = file.with_name(f"{file.name}.{os.getpid()}")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            temporary.write_bytes(zlib.crc32(rows).to_bytes(_CHECKSUM_BYTES, "big") + rows)
            temporary.replace(file)
        except OSError as error:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            got = error.strerror or error
            raise fail(OutputError, str(file), "a place that can be written", got) from error

    def _file(self, number: int) -> Path:
        return self.folder / f"tile-{number}.arrow"
