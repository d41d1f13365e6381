"""Where else a cell may stand, by each place's visits one by one."""

import numpy as np
import pytest
from test_calibration import visits_of

from mapfilter.learning.cell_evidence import CellEvidence, Scene
from mapfilter.learning.likelihood import LevelNoise, log_likelihoods, marginal
from mapfilter.learning.patterns import Patterns, bearing_places
from mapfilter.radio.cells import Cell, CellPlan

PLAN = CellPlan("EPSG:32635", (Cell("a", "a", 0.0, 0.0, 30.0, 0.0, 50.0, 1800.0),))
OFFSETS_DB = np.arange(-24.0, 24.5, 4.0)


def test_places_are_compared_by_levels_that_a_phone_measures_too_high():
    rng = np.random.default_rng(5)
    east_m, north_m = rng.uniform(-600.0, 600.0, (2, 400))
    predicted_dbm = -55.0 - 35.0 * np.log10(np.maximum(np.hypot(east_m, north_m), 30.0) / 100.0)
    patterns = Patterns(PLAN, east_m, north_m, predicted_dbm[:, np.newaxis], -110.0)
    shift_db, weight = rng.choice([-9.0, 6.0], 400), rng.uniform(0.1, 1.0, 400)
    heard_dbm = predicted_dbm + shift_db + 5.0 * rng.standard_normal(400)
    visits = visits_of(heard_dbm, rng.random(400) < 0.8)
    noise, order = LevelNoise(), np.arange(400)
    cell = CellEvidence(Scene(visits, patterns, order, weight, shift_db, noise, 400), 0)
    places = bearing_places(patterns, 75.0, 600.0, 0)[::9]
    expected = []
    for place in places.tolist():
        level_dbm = patterns.elsewhere(0, *place) + shift_db
        each = log_likelihoods(visits, level_dbm, -110.0, noise.sd_db, OFFSETS_DB)
        expected.append(marginal(weight @ each, noise.fault_sd_db / 2, OFFSETS_DB))
    assert np.ptp(expected) > 30.0
    assert list(cell._coarse(places)) == pytest.approx(expected, abs=1e-3)
