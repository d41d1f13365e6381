"""What the tracks that ``mapfilter learn`` keeps depend on, as a checksum."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import fields

import numpy as np
import pandas as pd

from mapfilter._io import program_version
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.positioning.filter import FilterOptions
from mapfilter.tracks.log import TrackLog


def study_key(
    database: RadioRouteDatabase,
    names: Sequence[str],
    logs: Sequence[TrackLog],
    choice: FilterOptions,
    seed: int,
    use_truth: bool,
) -> str:
    """Return a checksum of everything that the tracks depend on.

    It is of the logs as they were opened, so it depends on whatever changes them: files, columns,
    units, the time zone, how steps are counted.
    """
    parts = [program_version(), database.generation, repr(choice), seed, use_truth, list(names)]
    digest = hashlib.sha256(repr(parts).encode())
    for log in logs:
        # Notes name files, and change no track.
        for field in (one for one in fields(log) if one.name != "notes"):
            value = getattr(log, field.name)
            digest.update(field.name.encode())
            digest.update(_of_table(value) if isinstance(value, pd.DataFrame) else _of(value))
    return digest.hexdigest()


def _of(value: object) -> bytes:
    return repr(value).encode()


def _of_table(table: pd.DataFrame) -> bytes:
    columns = [(name, str(kind)) for name, kind in table.dtypes.items()]
    rows = np.asarray(pd.util.hash_pandas_object(table, index=False))
    return _of(columns) + rows.tobytes()
