"""Radio maps of made levels."""

import numpy as np

from mapfilter.evaluation.radio_map import RadioMap
from mapfilter.lattice import Lattice

FLOOR_DBM = -110.0


def made_map(
    level_dbm, on_way, site=None, margin_db=6.0, way_id=None, resolution_m=5.0, layer=None
):
    """A map of levels, shape (rows, cols, cells), heard at some pixels."""
    row, col = np.nonzero(on_way)
    level = np.asarray(level_dbm, dtype=np.float32)
    rows, cols, cells = level.shape
    ids = np.ones(row.size, dtype=np.int64) if way_id is None else way_id[row, col]
    return RadioMap(
        Lattice("EPSG:32631", 500_000.0, rows * resolution_m, resolution_m, rows, cols),
        tuple(f"C{i}" for i in range(cells)),
        np.arange(cells) if site is None else np.asarray(site),
        np.zeros(cells, dtype=np.int64) if layer is None else np.asarray(layer),
        level, FLOOR_DBM, margin_db, on_way, on_way,
        row.astype(np.int64), col.astype(np.int64), ids,
        np.argmax(level[row, col], axis=1).astype(np.int64),
    )  # fmt: skip
