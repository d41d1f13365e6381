"""What came of a session that was left out, on disk, so that what was stopped can go on."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._io import read_json, write_json
from mapfilter._types import Floats
from mapfilter.errors import StoreError, fail
from mapfilter.experiments.benchmarks.ottawa import FoundSession


@dataclass(frozen=True, eq=False)
class LeftOut:
    """One session, found several times.

    Parameters
    ----------
    session : str
    centroid_m : ndarray
        Errors of the centroids of its serving cells.
    found : tuple of FoundSession
    """

    session: str
    centroid_m: Floats
    found: tuple[FoundSession, ...]


def write_left_out(left_out: LeftOut, file: Path) -> None:
    """Write what came of a session.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    rows = [
        {one.name: _plain(getattr(found, one.name)) for one in fields(FoundSession)}
        for found in left_out.found
    ]
    centroid_m = left_out.centroid_m.tolist()
    write_json(file, {"session": left_out.session, "centroid_m": centroid_m, "found": rows})


def read_left_out(file: Path) -> LeftOut:
    """Read what came of a session.

    Raises
    ------
    StoreError
        The file is missing or damaged.
    """
    told = read_json(file)
    try:
        found = tuple(
            FoundSession(**{name: _read(name, value) for name, value in row.items()})
            for row in told["found"]
        )
        return LeftOut(told["session"], np.array(told["centroid_m"], dtype=np.float64), found)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise fail(StoreError, str(file), "what came of a session", error, "cut off") from error


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return None if isinstance(value, float) and not isfinite(value) else value


def _read(name: str, value: Any) -> Any:
    if isinstance(value, list):
        return np.array(value, dtype=np.bool_ if name == "covered" else np.float64)
    return nan if value is None else value
