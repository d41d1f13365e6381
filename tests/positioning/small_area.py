"""A made area of 9 x 7 pixels, whose levels and distances are unlike from pixel to pixel.

Nothing is smooth there: whoever looks a pixel, a band or a neighbour up wrongly finds another
level. Levels are quarters of a dB, which the kernels' tables hold exactly.
"""

import numpy as np

from mapfilter.database.field import RadioField
from mapfilter.lattice import Lattice
from mapfilter.models.fingerprint import ServingWeights
from mapfilter.models.level_errors import LevelErrors
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.sources.evidence_options import EvidenceOptions
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
SITE = (0, 1, 2, 2)
"""C and D stand at one place."""

_RNG = np.random.default_rng(20)
_HEARD_DBM = np.round(4 * _RNG.uniform(-105.0, -60.0, (ROWS, COLS, 4))) / 4
_BELOW_FLOOR = _RNG.random((ROWS, COLS, 4)) < 0.1
LEVEL_DBM = np.where(_BELOW_FLOOR, QUIET_DBM, _HEARD_DBM)
_TO_MIDDLE_M = _RNG.uniform(0.0, 35.0, (ROWS, COLS)).astype(np.float32)
_HALF_WIDTH_M = _RNG.choice([0.0, 2.5, 7.0, 10.0], (ROWS, COLS)).astype(np.float32)
DISTANCE_M = np.where(_TO_MIDDLE_M > _HALF_WIDTH_M, _TO_MIDDLE_M - _HALF_WIDTH_M, 0).astype("f4")
"""To the edge of the nearest way."""
ON_WAY = np.zeros((ROWS, COLS), dtype=bool)
ON_WAY[4, 1:8], ON_WAY[0:5, 3] = True, True
POINTS = [(int(row), int(col)) for row, col in zip(*np.nonzero(ON_WAY), strict=True)]

OPTIONS = EvidenceOptions(
    serving=ServingWeights(hysteresis_db=3.0, sd_db=7.0, weight_per_m=0.04),
    # Slow, fast and white errors together 8 dB, so that bounds lie on the steps of their table; no
    # faults, and what is said of them is forgotten at once.
    levels=LevelErrors(
        slow_db=6.0, slow_m=70.0, fast_db=4.0, fast_m=15.0, white_db=12**0.5, device_db=3.0,
        site_share=0.5, common_share=0.3, roughness=0.0, fault_probability=1e-300, fault_m=1e-3,
        absent_db=2.5, weight=0.6,
    ),
    spacing_m=6.0,
    first_m=20.0,
    full_list=3,
    bound_weight=0.4,
    beside_db=5.0,
    beside_m=40.0,
)  # fmt: skip


def make_area():
    places = zip(CARRIERS.items(), (0, 1, 2, 2, 4), strict=True)
    cells = tuple(
        Cell(i, i, WEST_M + 10.0 * k, SOUTH_M, 30.0, None, 50.0, 900.0, "omni", arfcn=a, bsic=b)
        for (i, (a, b)), k in places
    )
    level = np.where(_BELOW_FLOOR, np.nan, _HEARD_DBM).astype(np.float32)
    way = np.where(ON_WAY, 7, 0).astype(np.int64)
    ways = _TO_MIDDLE_M, _HALF_WIDTH_M, way, ON_WAY
    field = RadioField(LATTICE, tuple(BANDS), level, *ways)
    return AreaMap.of_field(field, CellPlan(LATTICE.crs, cells), FLOOR_DBM)
