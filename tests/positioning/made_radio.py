"""Radio reports over the made area of 9 x 7 pixels, read as a source of evidence reads them."""

from math import nan

import numpy as np
from small_area import BANDS, COLS, OPTIONS, PIXEL_M, ROWS, make_area

from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import Reason
from mapfilter.models.street_motion import EAST, NORTH, STATES
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.sources.radio import RadioSource
from mapfilter.positioning.bayes.state import DeadReckoning
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.step_output import UnusedReading

AREA = make_area()
A, B, C, D = BANDS.values()
SPACING_M = 3.0


def serving(cell, level_dbm=nan, censored=0, timing_advance=nan):
    return ReportRow("serving", cell, None, None, level_dbm, censored, timing_advance)


def named(cell, level_dbm, censored=0):
    return ReportRow("neighbour", cell, None, None, level_dbm, censored)


def carrier(arfcn, bsic, level_dbm, censored=0):
    return ReportRow("neighbour", None, arfcn, bsic, level_dbm, censored)


START = DeadReckoning()


def read(*rows, used=None, moved=START, options=OPTIONS, area=AREA):
    """Read a report after the last one that was used, and as many metres as were moved."""
    source = RadioSource(area, options)
    update = source.read(used, moved, Epoch(0.0, radio=rows), SPACING_M)
    return update.state, update.radio, update.reason, update.unused


def unknown_cells(*rows, why=Reason.UNKNOWN_CELL):
    return [UnusedReading(0.0, row.role, row.name, why) for row in rows]


def inside(reading):
    """Band and level of the levels within the scale."""
    return dict(zip(reading.levels.cell.tolist(), reading.levels.level_dbm.tolist(), strict=True))


def absent(reading):
    """Bands of absent cells, and what they are weaker than."""
    limit_dbm = set(reading.levels.limit_dbm.tolist())
    return reading.levels.absent.tolist(), limit_dbm.pop() if len(limit_dbm) == 1 else limit_dbm


def others(reading):
    return [(b.cells.tolist(), b.level_dbm, b.censored) for b in reading.bounds]


def hypotheses(count=500, seed=21):
    """Places within the area, a little inside their pixels."""
    rng = np.random.default_rng(seed)
    state = np.zeros((STATES, count), dtype=np.float32)
    col, row = rng.integers(COLS, size=count), rng.integers(ROWS, size=count)
    state[0] = PIXEL_M * (col + rng.uniform(0.01, 0.99, count))
    state[1] = PIXEL_M * (row + rng.uniform(0.01, 0.99, count))
    return state


MODEL = BayesModel(AREA, evidence=OPTIONS)


def cloud_of(state):
    return Cloud(state, np.empty((0, state.shape[1]), dtype=np.float32))


def gain_of(reading, state=None, model=MODEL, before=-2.0):
    """What a reading adds to weights, and the hypotheses afterwards."""
    state = hypotheses(60) if state is None else state
    log_weight = np.full(state.shape[1], before)
    cloud, reason = model.weigh(cloud_of(state), log_weight, reading)
    return log_weight - before, cloud, reason


def at_places(*places_m):
    state = np.zeros((STATES, len(places_m)), dtype=np.float32)
    state[EAST], state[NORTH] = np.transpose(places_m)
    return state
