"""Cells of a prediction that nobody measured are corrected as the other cells let expect."""

import itertools

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from test_survey_fit import ANTENNA, CRS, LATTICE, law, measured, somewhere

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.survey.expected_offsets import (
    MeasuredOffset,
    expected_offsets,
    measured_offset,
)
from mapfilter.survey.measured_map import fit_survey
from mapfilter.survey.options import SurveyOptions
from mapfilter.survey.survey_rasters import predicted_levels, surveyed_plan, write_survey

DEVIATIONS_DB = np.geomspace(0.5, 12.0, 9)


def conditioned(sites, offset_db, variance_db2, of, without=None):
    """The same by a covariance matrix of all cells, and conditioning on those measured."""
    kept = np.array([i for i in range(len(offset_db)) if i != without])
    everyone = [*sites[: len(offset_db)], of]
    same = np.array([[a == b for b in everyone] for a in everyone], float)
    weights, means, squares = [], [], []
    for site_db, cell_db in itertools.product(DEVIATIONS_DB, DEVIATIONS_DB):
        whole = 12.0**2 + site_db**2 * same + cell_db**2 * np.eye(len(everyone))
        noisy = whole[:-1, :-1] + np.diag(variance_db2)
        log = multivariate_normal(cov=noisy).logpdf(offset_db)
        weights.append(log - (site_db**2 + cell_db**2) / (2 * 5.0**2))
        cross = whole[-1, kept]
        gain = np.linalg.solve(noisy[np.ix_(kept, kept)], cross)
        means.append(gain @ offset_db[kept])
        squares.append(whole[-1, -1] - gain @ cross + means[-1] ** 2)
    share = np.exp(np.array(weights) - max(weights))
    share /= share.sum()
    mean_db = share @ means
    return mean_db, 1.6 * np.sqrt(share @ squares - mean_db**2)


def test_offsets_are_those_of_a_normal_distribution_of_all_cells():
    rng = np.random.default_rng(0)
    sites = list("aabbccdde")
    offset_db, variance_db2 = rng.normal(-6, 4, 9), rng.uniform(0.2, 3, 9)
    given = [MeasuredOffset(*one) for one in zip(sites, offset_db, variance_db2, strict=True)]
    found = expected_offsets(given, ["a", "x", "e"])
    for i, one in enumerate(found[:9]):
        expected = conditioned(sites, offset_db, variance_db2, sites[i], without=i)
        assert (one.offset_db, one.deviation_db) == pytest.approx(expected, rel=1e-9)
    for one, site in zip(found[9:], "axe", strict=True):
        expected = conditioned(sites, offset_db, variance_db2, site)
        assert (one.offset_db, one.deviation_db) == pytest.approx(expected, rel=1e-9)


def test_nothing_is_expected_where_nothing_was_measured():
    (one,) = expected_offsets([MeasuredOffset("a", 40.0, 1.0)], [])
    assert one.offset_db == 0.0
    assert one.deviation_db > 12.0


def test_a_measured_offset_is_the_mean_that_errs_least():
    covariance_db2 = np.array([[4.0, 3.5, 0.0], [3.5, 4.0, 0.0], [0.0, 0.0, 4.0]])
    found = measured_offset("a", np.array([1.0, 1.0, 4.0]), covariance_db2)
    weights = np.linalg.inv(covariance_db2).sum(axis=0)
    assert found.offset_db == pytest.approx(weights @ [1, 1, 4] / weights.sum())
    assert found.variance_db2 == pytest.approx(1 / weights.sum())


@pytest.fixture
def network(tmp_path):
    """Eight cells at four sites, 9 dB weaker than predicted; G and H were not measured."""
    rng = np.random.default_rng(4)
    names = "ABCDEFGH"
    antennas = ANTENNA + rng.uniform(-200, 200, (4, 2)).repeat(2, axis=0)
    plan = CellPlan(
        CRS,
        tuple(
            Cell(name, f"site {i // 2}", *antennas[i], 30.0, None, 50.0, 1800.0, "omni")
            for i, name in enumerate(names)
        ),
    )
    row, col = np.mgrid[: LATTICE.rows, : LATTICE.cols]
    centres = LATTICE.east_north(row, col)
    levels = [law(*(xy - (at - ANTENNA)[i] for i, xy in enumerate(centres))) for at in antennas]
    levels[7] = np.full_like(levels[7], np.nan)
    path = tmp_path / "predicted.tif"
    write_rasters(path, LATTICE, zip(names, levels, strict=True), tuple(names))
    cell = np.repeat(np.arange(6), 40)
    east_m, north_m = somewhere(len(cell), 7)
    at_row, at_col = LATTICE.row_col(east_m, north_m)
    level_dbm = np.array(levels)[cell, at_row, at_col] - 9 + rng.normal(0, 2, len(cell))
    rows = measured(east_m, north_m, level_dbm, cell=cell, cell_ids=tuple(names[:6]))
    return rows, plan, predicted_levels(open_rasters(path), plan), levels


def written(folder, survey, **options):
    mean, deviation = folder / "rxlev.tif", folder / "rxlev-deviation.tif"
    ids = write_survey(survey, LATTICE, mean, deviation, **options)
    return ids, open_rasters(mean).read(), open_rasters(deviation).read()


def test_cells_that_nobody_measured_are_kept_where_places_are_filled(network, tmp_path):
    """They were left out of the calibrated prediction."""
    rows, plan, predicted, levels = network
    survey = fit_survey(rows, SurveyOptions(), plan=plan, predicted=predicted)
    assert set(survey.expected) == {"G", "H"}
    offset = survey.expected["G"]
    assert offset.offset_db == pytest.approx(-9, abs=1)
    assert 0.5 < offset.deviation_db < 4
    ids, mean, deviation = written(tmp_path, survey, predicted=predicted, fill=True)
    assert ids == tuple("ABCDEFG")
    np.testing.assert_allclose(mean[6], levels[6] + offset.offset_db, atol=0.02)
    assert np.isnan(deviation[6]).all()
    assert np.isfinite(deviation[5]).any()
    made = {"height_m": 30.0, "eirp_dbm": 50.0, "frequency_mhz": 1800.0}
    assert surveyed_plan(survey, ids, {}, plan, **made)["G"] == plan["G"]
    assert written(tmp_path, survey, predicted=predicted)[0] == tuple("ABCDEF")


def test_without_a_plan_no_other_cells_are_kept(network, tmp_path):
    rows, _, predicted, _ = network
    survey = fit_survey(rows, SurveyOptions(), predicted=predicted)
    assert not survey.expected
    assert written(tmp_path, survey, predicted=predicted, fill=True)[0] == tuple("ABCDEF")


def test_a_cell_of_few_measurements_is_drawn_towards_the_others(network):
    """It was drawn towards the mean level of all cells, which is no offset from a prediction."""
    rows, plan, predicted, _ = network
    kept = (rows.cell != 0) | (np.cumsum(rows.cell == 0) <= 3)
    few = rows.where(kept)
    survey = fit_survey(few, SurveyOptions(), plan=plan, predicted=predicted)
    weaker = predicted | {"A": lambda east_m, north_m: predicted["A"](east_m, north_m) - 40}
    lower = few.level_dbm - 40 * (few.cell == 0)
    other = measured(few.east_m, few.north_m, lower, cell=few.cell, cell_ids=few.cell_ids)
    far = fit_survey(other, SurveyOptions(), plan=plan, predicted=weaker)
    points = survey.cells["A"].points
    places = points.east_m, points.north_m
    error_db = survey.cells["A"].trend.level_dbm(*places) - predicted["A"](*places)
    assert error_db == pytest.approx(np.full(3, -9), abs=1.5)
    shifted = far.cells["A"].trend.level_dbm(*places) + 40
    assert shifted == pytest.approx(survey.cells["A"].trend.level_dbm(*places), abs=0.05)
