"""A made area of 9 x 7 pixels, whose levels and distances are unlike from pixel to pixel.

Nothing is smooth there: whoever looks a pixel, a band or a neighbour up wrongly finds another
level. Levels are quarters of a dB, which the kernels' tables hold exactly.
"""

import numpy as np

from mapfilter.database.radioroutes import RadioField
from mapfilter.geodesy import Lattice
from mapfilter.models.fingerprint import LevelErrors, ServingWeights
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.radio import EvidenceOptions
from mapfilter.radio.cells import Cell, CellPlan

ROWS, COLS, PIXEL_M = 7, 9, 10.0
WEST_M, SOUTH_M = 500_000.0, 4_500_000.0
WIDTH_M, HEIGHT_M = COLS * PIXEL_M, ROWS * PIXEL_M
LATTICE = Lattice("EPSG:32629", WEST_M, SOUTH_M + HEIGHT_M, PIXEL_M, ROWS, COLS)
FLOOR_DBM, QUIET_DBM = -110.0, -116.0
"""Weaker levels are not in the database; 6 dB less is assumed for them."""
BANDS = {"A": 0, "B": 1, "C": 2, "D": 3}
CARRIERS = {"A": (60, 1), "B": (61, 2), "C": (61, 2), "D": (61, 4), "E": (60, 1)}
"""ARFCN and BSIC; E is in the plan, but heard nowhere in the area."""

_RNG = np.random.default_rng(20)
_HEARD_DBM = np.round(4 * _RNG.uniform(-105.0, -60.0, (ROWS, COLS, 4))) / 4
_BELOW_FLOOR = _RNG.random((ROWS, COLS, 4)) < 0.1
LEVEL_DBM = np.where(_BELOW_FLOOR, QUIET_DBM, _HEARD_DBM)
DISTANCE_M = _RNG.uniform(0.0, 30.0, (ROWS, COLS)).astype(np.float32)
ON_WAY = np.zeros((ROWS, COLS), dtype=bool)
ON_WAY[4, 1:8], ON_WAY[0:5, 3] = True, True
POINTS = [(int(row), int(col)) for row, col in zip(*np.nonzero(ON_WAY), strict=True)]

OPTIONS = EvidenceOptions(
    serving=ServingWeights(hysteresis_db=3.0, sd_db=7.0, weight_per_m=0.04),
    # Together 8 dB, so that bounds lie on the steps of their table.
    levels=LevelErrors(
        sd_db=4.8, measurement_db=6.4, correlation_m=40.0, roughness_db=5.0, common=0.35,
        clip_sd=4.0, weight=0.6,
    ),
    spacing_m=6.0,
    first_m=20.0,
)  # fmt: skip


def make_area():
    cells = tuple(
        Cell(i, i, WEST_M + 10.0 * k, SOUTH_M, 30.0, None, 50.0, 900.0, "omni", arfcn=a, bsic=b)
        for k, (i, (a, b)) in enumerate(CARRIERS.items())
    )
    level = np.where(_BELOW_FLOOR, np.nan, _HEARD_DBM).astype(np.float32)
    way = np.where(ON_WAY, 7, 0).astype(np.int64)
    field = RadioField(LATTICE, tuple(BANDS), level, DISTANCE_M, way, ON_WAY)
    return AreaMap.of_field(field, CellPlan(LATTICE.crs, cells), FLOOR_DBM)
