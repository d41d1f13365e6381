"""Reports in an area with more cells than errors are estimated of at a time."""

import numpy as np
import pytest
import scalar_oracle as oracle

from mapfilter.filters.belief_models import Cloud
from mapfilter.lattice import Lattice
from mapfilter.models.level_errors import LevelErrors, LevelReport
from mapfilter.models.level_memory import SLOTS
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.bayes.sources.evidence_options import EvidenceOptions

SIDE, PIXEL_M, CELLS = 6, 10.0, 30
LATTICE = Lattice("EPSG:32629", 500_000.0, 4_500_060.0, PIXEL_M, SIDE, SIDE)
RNG = np.random.default_rng(4)
LEVEL_DBM = (np.round(4 * RNG.uniform(-105.0, -65.0, (SIDE, SIDE, CELLS))) / 4).astype("f4")
# Each cell by itself: what is forgotten of one says nothing of the others.
ERRORS = LevelErrors(
    slow_db=6.0, slow_m=80.0, fast_db=3.0, fast_m=12.0, white_db=3.0, device_db=0.0,
    site_share=0.0, common_share=0.0, roughness=0.0, fault_probability=1e-300, fault_m=1e-3,
    weight=1.0,
)  # fmt: skip
NONE = np.zeros(0, dtype=np.int32)
COUNT = 12


@pytest.fixture(scope="module")
def model():
    top = np.sort(LEVEL_DBM, axis=-1)[..., [-1, -2]]
    flat = np.zeros((SIDE, SIDE), dtype=np.float32)
    area = AreaMap(
        LATTICE, tuple(f"C{k}" for k in range(CELLS)), frozenset(),
        np.concatenate([LEVEL_DBM, top], axis=-1), flat, flat.astype(int), flat == 0, {}, -120.0,
    )  # fmt: skip
    return BayesModel(area, evidence=EvidenceOptions(levels=ERRORS))


def hypotheses(rng, count=COUNT):
    """States, and their rows and columns."""
    row, col = rng.integers(SIDE, size=(2, count))
    state = np.zeros((STATES, count), dtype=np.float32)
    state[0], state[1] = PIXEL_M * (col + 0.4), PIXEL_M * (SIDE - row - 0.4)
    return state, row, col


def report(cells, level_dbm, absent=NONE, limit_dbm=-120.0):
    given = np.asarray(cells, np.int32), np.asarray(level_dbm, np.float32)
    limit_dbm = np.full(len(absent), limit_dbm, dtype=np.float32)
    return LevelReport(*given, np.asarray(absent, np.int32), limit_dbm, 0.0)


def test_reports_count_exactly_while_cells_come_and_go(model):
    rng, cloud, at_m = np.random.default_rng(1), None, 0.0
    paths, total = [[] for _ in range(COUNT)], np.zeros(COUNT)
    for first in range(0, 26, 2):
        state, row, col = hypotheses(rng)
        cells, length_m = np.arange(first, first + 5), float(rng.uniform(4, 30))
        level = np.round(4 * rng.uniform(-100, -70, 5)) / 4
        length_m = length_m if cloud is not None else 0.0
        at_m += length_m
        before = Cloud(state, np.empty((0, COUNT), "f4")) if cloud is None else cloud
        reading = RadioReading(levels=report(cells, level), length_m=length_m)
        cloud, _ = model.weigh(before._replace(state=state), total, reading)
        for path, r, c in zip(paths, row, col, strict=True):
            path += [(int(cell), at_m, level[k] - float(LEVEL_DBM[r, c, cell]), 9.0)
                     for k, cell in enumerate(cells)]  # fmt: skip
        expected = [oracle.levels_log_density(ERRORS, range(CELLS), path) for path in paths]
        np.testing.assert_allclose(total, expected, rtol=3e-4, atol=5e-3)
    assert cloud.shared.slots == SLOTS
    assert set(cloud.shared.slot_of) == set(range(5, 29))


def test_of_a_report_of_too_many_cells_the_first_count(model):
    state, row, col = hypotheses(np.random.default_rng(2))
    cells = np.random.default_rng(3).permutation(CELLS)
    level = np.round(4 * np.random.default_rng(3).uniform(-100, -70, CELLS)) / 4
    found = np.zeros(COUNT)
    reading = RadioReading(levels=report(cells, level))
    cloud, _ = model.weigh(Cloud(state, np.empty((0, COUNT), "f4")), found, reading)
    assert set(cloud.shared.slot_of) == set(cells[:SLOTS].tolist())
    for value, r, c in zip(found, row, col, strict=True):
        levels = [(int(cell), 0.0, level[k] - float(LEVEL_DBM[r, c, cell]), 9.0)
                  for k, cell in enumerate(cells[:SLOTS])]  # fmt: skip
        expected = oracle.levels_log_density(ERRORS, range(CELLS), levels)
        assert value == pytest.approx(expected, rel=3e-4)


def test_absent_cells_that_are_expected_most_count_first(model):
    """Of those that more than a fiftieth of the hypotheses expect, as many as there is room for."""
    rng = np.random.default_rng(5)
    state, row, col = hypotheses(rng, 200)
    heard = np.array([3, 8, 21])
    absent = np.setdiff1d(np.arange(CELLS), heard)

    def held(limit_dbm):
        given = report(heard, [-75.0, -80.0, -71.5], absent, limit_dbm)
        cloud = Cloud(state, np.empty((0, 200), "f4"))
        cloud, _ = model.weigh(cloud, np.zeros(200), RadioReading(levels=given))
        share = (LEVEL_DBM[row, col][:, absent] > limit_dbm).mean(axis=0)
        return set(cloud.shared.slot_of) - set(heard.tolist()), share

    found, share = held(-70.0)
    assert (share > 0.02).sum() > SLOTS - 3
    order = sorted(zip(share, -absent, strict=True), reverse=True)
    assert found == {-int(cell) for _, cell in order[: SLOTS - 3]}
    found, share = held(-66.0)
    assert 0 < (share > 0.02).sum() < SLOTS - 3
    assert ((share > 0) & (share <= 0.02)).any()
    assert found == set(absent[share > 0.02].tolist())
    # Where all predict less, none is looked at.
    assert held(-60.0)[0] == set()


def test_levels_of_faulty_and_absent_cells_make_the_null_hypothesis_of_a_report(model):
    """Its log-likelihood: each level by itself about -90 dBm, 0.7 for each absence, weighted."""
    errors = LevelErrors(weight=0.4, roughness=0.0)
    weighted = BayesModel(model.area, evidence=EvidenceOptions(levels=errors))
    rng = np.random.default_rng(6)
    state, _, _ = hypotheses(rng)
    absent = [4, 5] if SLOTS < CELLS else []
    given = report([1, 2], [-70.0, -95.0], absent, -110.0)
    reading = RadioReading(levels=given)
    cloud, _ = weighted.weigh(Cloud(state, np.empty((0, COUNT), "f4")), np.zeros(COUNT), reading)
    alone = sum(oracle.other_log_density([(0.0, level)], errors) for level in (-70.0, -95.0))
    expected = alone + 2 * np.log(0.7)
    assert cloud.shared.other_log_likelihood == pytest.approx(0.4 * expected, rel=1e-5)
