"""Likelihoods of reports at the places of others, against a normal law of many dimensions."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from mapfilter.positioning.fingerprints.likelihoods import LevelErrors, Likelihoods, _Excess
from mapfilter.positioning.fingerprints.reports import make_reports

ERRORS = LevelErrors(level_db=4.0, shared_db=3.0, absence_per_db=0.2, floor_dbm=-100.0)
LEVELS_DBM = {
    0: {"a": (-60.0, 0.0), "b": (-71.0, 2.0), "c": (-83.0, 5.0)},
    1: {"a": (-66.0, 1.0), "c": (-90.0, 0.0), "d": (-75.0, 3.0)},
    2: {"d": (-105.0, 0.0)},
}
"""Of each report the level of each cell, and its own deviation."""


def database():
    rows = [(report, cell, *two) for report, own in LEVELS_DBM.items() for cell, two in own.items()]
    report, cell, level_dbm, sd_db = zip(*rows, strict=True)
    return make_reports("EPSG:32635", report, cell, level_dbm, count=3, sd_db=sd_db)


CELLS = np.array([0, 1, 2], dtype=np.int32)
GIVEN_DBM = np.array([-64.0, -70.0, -88.0])
"""Of a, b and c."""


@pytest.mark.parametrize("shared_db", [0.0, 3.0, 7.0])
@pytest.mark.parametrize("censored", [None, np.zeros(3, dtype=np.int8)])
def test_levels_are_normal_with_an_error_that_all_share(shared_db, censored):
    """Relative to the density of as many levels of the least deviation, without a difference."""
    errors = LevelErrors(4.0, shared_db, 0.2, -100.0)
    _, found = Likelihoods.at(database(), errors).of(CELLS, GIVEN_DBM, censored)
    for report, own in LEVELS_DBM.items():
        both = [k for k, name in enumerate("abc") if name in own]
        if not both:
            assert found[report] == 0.0
            continue
        level_dbm, sd_db = np.array([own["abc"[k]] for k in both]).T
        covariance = np.diag(16.0 + sd_db**2) + shared_db**2
        law = multivariate_normal(level_dbm, covariance)
        usual = -0.5 * len(both) * np.log(2 * np.pi * 16.0)
        assert found[report] == pytest.approx(law.logpdf(GIVEN_DBM[both]) - usual)


def test_cells_that_only_one_of_both_has_count_by_their_level_above_the_floor():
    received, _ = Likelihoods.at(database(), ERRORS).of(CELLS, GIVEN_DBM)
    # The second lacks b, of -70 dBm, and has d, of -75; that of the third is below the floor.
    expected = -0.2 * np.array([0.0, 30.0 + 25.0, 36.0 + 30.0 + 12.0])
    np.testing.assert_allclose(received, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("end", "level_dbm", "counts"),
    [(-1, -65.0, True), (-1, -55.0, False), (1, -55.0, True), (1, -65.0, False), (-1, -60.0, False),
     (1, -60.0, False), (1, -59.5, True), (0, -60.0, True), (0, -55.0, True)],
)  # fmt: skip
def test_a_bound_counts_where_the_level_is_on_its_other_side(end, level_dbm, counts):
    """At -60 dBm in the first report: below -65 it is 5 dB off, below -55 it agrees."""
    errors = LevelErrors(4.0, 3.0, 0.2, -100.0)
    cell, bound = np.array([0], dtype=np.int32), np.array([end], dtype=np.int8)
    _, found = Likelihoods.at(database(), errors).of(cell, np.array([level_dbm]), bound)
    variance_db2 = 16.0 + 9.0
    expected = -0.5 * ((level_dbm + 60.0) ** 2 / variance_db2 + np.log(variance_db2 / 16.0))
    assert found[0] == pytest.approx(expected if counts else 0.0)


def test_what_levels_have_above_any_threshold():
    """Also within the strongest and the weakest whole dBm, and beyond both."""
    level_dbm = np.array([-50.3, -50.9, -57.0, -63.2, -63.9, -64.0, -51.6])
    report = np.array([0, 1, 1, 0, 2, 2, 1])
    excess = _Excess.of(4, report, level_dbm)
    for threshold_dbm in (-70.5, -64.0, -63.95, -63.0, -57.2, -57.0, -51.0, -50.8, -50.2, -50.0,
                          -49.5, 0.0):  # fmt: skip
        expected = np.bincount(report, np.maximum(level_dbm - threshold_dbm, 0.0), minlength=4)
        np.testing.assert_allclose(excess.above(threshold_dbm), expected, atol=1e-9)


def test_of_no_levels_nothing_is_above_a_threshold():
    excess = _Excess.of(3, np.zeros(0, dtype=np.int64), np.zeros(0))
    for threshold_dbm in (-70.5, 0.0, 5.0):
        np.testing.assert_array_equal(excess.above(threshold_dbm), np.zeros(3))
