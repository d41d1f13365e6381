"""The survey's mathematics against plain linear algebra, and made worlds whose truth is known."""

import numpy as np
import pytest
from scipy.spatial.distance import pdist, squareform
from sklearn.gaussian_process import GaussianProcessRegressor

from mapfilter.errors import ConfigError, InputError
from mapfilter.lattice import Lattice
from mapfilter.propagation.shadowing import correlated_field
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.survey.leave_out import leave_out
from mapfilter.survey.level_trend import DistanceLoss, Prior, fit_trend
from mapfilter.survey.measured_map import fit_survey
from mapfilter.survey.measured_points import Points, points_by_cell
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.options import SurveyOptions
from mapfilter.survey.residual_field import (
    GaussianField,
    Shadowing,
    learn_shadowing,
    log_likelihood,
)

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385_000.0, 6_673_000.0, 5.0, 160, 160)
ANTENNA = np.array([385_310.0, 6_672_580.0])
OFFSET_DBM, EXPONENT = -28.0, 3.1


def measured(east_m, north_m, level_dbm, session=None, cell=None, cell_ids=("A",)):
    count = len(level_dbm)
    session = np.zeros(count, np.int32) if session is None else session.astype(np.int32)
    return Measurements(
        CRS,
        cell_ids,
        {},
        tuple(f"drive {i}" for i in range(int(session.max()) + 1)),
        np.zeros(count, np.int32) if cell is None else cell.astype(np.int32),
        session,
        np.arange(count, dtype=float),
        np.asarray(east_m, float),
        np.asarray(north_m, float),
        np.asarray(level_dbm, float),
        np.full(count, 5.0),
    )


def law(east_m, north_m):
    return OFFSET_DBM + EXPONENT * DistanceLoss(*ANTENNA)(east_m, north_m)


def somewhere(count, seed=0):
    rng = np.random.default_rng(seed)
    west, south, east, north = LATTICE.bounds_m
    return rng.uniform(west, east, count), rng.uniform(south, north, count)


def shadowed(drives=4, per_drive=150, deviation_db=6.0, noise_db=2.0, seed=1):
    """Drives through one shadowing field, each with its own noise."""
    rng = np.random.default_rng(seed)
    field = correlated_field(LATTICE, deviation_db, 60.0, rng)
    east_m, north_m = somewhere(drives * per_drive, seed)
    row, col = LATTICE.row_col(east_m, north_m)
    level = law(east_m, north_m) + field[row, col] + rng.normal(0, noise_db, len(east_m))
    session = np.repeat(np.arange(drives), per_drive)
    return measured(east_m, north_m, level, session), field


def points_of(east_m, north_m, level_dbm):
    places = np.column_stack([east_m, north_m])
    return Points("A", east_m, north_m, level_dbm, np.zeros(len(east_m), np.int64), places)


def test_the_trend_is_the_posterior_of_generalised_least_squares():
    east_m, north_m = somewhere(30)
    level = law(east_m, north_m) + np.random.default_rng(2).normal(0, 4, 30)
    points, shadowing, prior = points_of(east_m, north_m, level), Shadowing(), Prior(-80.0)
    covariance = shadowing.covariance_db2(points)
    distance = np.hypot(east_m[:, None] - east_m, north_m[:, None] - north_m)
    by_hand = 25 * np.exp(-distance / 60) + 16 * np.eye(30)
    np.testing.assert_allclose(covariance, by_hand, rtol=1e-9)
    loss = DistanceLoss(*ANTENNA)
    trend = fit_trend(loss, points, covariance, prior)
    values = loss(east_m, north_m)
    design = np.column_stack([np.ones(30), values - values.mean()])
    inverse = np.linalg.inv(by_hand)
    weight = np.diag([1 / 12.0**2, 1 / 0.7**2])
    spread = np.linalg.inv(design.T @ inverse @ design + weight)
    mean = spread @ (design.T @ inverse @ level + weight @ [-80.0, 3.5])
    np.testing.assert_allclose([trend.offset_dbm, trend.slope], mean, rtol=1e-10)
    np.testing.assert_allclose(trend.covariance, spread, rtol=1e-10)
    # The marginal likelihood of the levels with offset and slope integrated out.
    total = by_hand + design @ np.diag([144.0, 0.49]) @ design.T
    left = level - design @ [-80.0, 3.5]
    minus_two_log = left @ np.linalg.solve(total, left) + np.linalg.slogdet(total)[1]
    other = Prior(-75.0, 3.0)
    again = fit_trend(loss, points, covariance, other)
    left = level - design @ [-75.0, 3.0]
    expected = left @ np.linalg.solve(total, left) + np.linalg.slogdet(total)[1]
    assert again.cost - trend.cost == pytest.approx(expected - minus_two_log, rel=1e-9)


def test_the_gaussian_field_is_one_gaussian_process_with_an_uncertain_trend():
    east_m, north_m = somewhere(25)
    level = law(east_m, north_m) + np.random.default_rng(3).normal(0, 4, 25)
    points, shadowing, prior = points_of(east_m, north_m, level), Shadowing(), Prior(-80.0)
    covariance = shadowing.covariance_db2(points)
    trend = fit_trend(DistanceLoss(*ANTENNA), points, covariance, prior)
    at = somewhere(9, seed=4)
    mean, deviation = GaussianField(points, trend, shadowing).predict(*at)
    everywhere = np.column_stack([np.r_[east_m, at[0]], np.r_[north_m, at[1]]])
    distance = np.hypot(*(everywhere[:, None] - everywhere).transpose(2, 0, 1))
    design = trend.design(everywhere[:, 0], everywhere[:, 1])
    joint = 25 * np.exp(-distance / 60) + 16 * np.eye(34)
    joint += design @ np.diag([144.0, 0.49]) @ design.T
    gain = np.linalg.solve(joint[:25, :25], joint[:25, 25:]).T
    expected = design[25:] @ [-80.0, 3.5] + gain @ (level - design[:25] @ [-80.0, 3.5])
    variance = np.diag(joint[25:, 25:] - gain @ joint[:25, 25:])
    np.testing.assert_allclose(mean, expected, atol=1e-8)
    np.testing.assert_allclose(deviation, np.sqrt(variance), atol=1e-8)


def test_an_antenna_is_located_where_it_is():
    east_m, north_m = somewhere(120)
    noise = np.random.default_rng(5).normal(0, 1.0, 120)
    survey = fit_survey(measured(east_m, north_m, law(east_m, north_m) + noise), SurveyOptions())
    cell = survey.cells["A"]
    assert cell.estimated
    assert np.hypot(*(np.array(cell.antenna) - ANTENNA)) < 25
    assert cell.trend.slope == pytest.approx(EXPONENT, abs=0.25)
    assert survey.notes == ("1 antenna located from their levels",)


def test_an_antenna_of_the_plan_stays_where_it_is():
    plan = CellPlan(CRS, (Cell("A", "A", *ANTENNA, 26.5, None, 50.0, 1800.0, "omni"),))
    east_m, north_m = somewhere(60)
    rows = measured(east_m, north_m, law(east_m, north_m))
    survey = fit_survey(rows, SurveyOptions(), plan=plan)
    cell = survey.cells["A"]
    assert not cell.estimated
    assert cell.antenna == tuple(ANTENNA)
    assert cell.trend.slope == pytest.approx(EXPONENT, abs=0.05)
    mean, _ = cell.predict(east_m, north_m)
    np.testing.assert_allclose(mean, rows.level_dbm, atol=0.3)


def test_shadowing_is_learnt_from_all_cells_together():
    found = []
    for seed in range(6):
        rows, _ = shadowed(seed=10 + seed)
        found.append(fit_survey(rows, SurveyOptions(square_m=1.0)).shadowing)
    assert 20 < np.mean([s.variance_db2 for s in found]) < 50
    assert 35 < np.mean([s.correlation_m for s in found]) < 95
    assert 2 < np.mean([s.noise_db2 for s in found]) < 7


@pytest.mark.parametrize("shadowing", [Shadowing(), Shadowing(3.0, 400.0, 0.7)])
def test_the_likelihood_of_shadowing_is_that_of_scikit_learns_process(shadowing):
    places_m = np.column_stack(somewhere(40, seed=6))
    residual_db = np.random.default_rng(7).normal(0, 5, 40)
    process = GaussianProcessRegressor(Shadowing().kernel, optimizer=None, alpha=0.0)
    process.fit(places_m, residual_db)
    theta = np.log([shadowing.variance_db2, shadowing.correlation_m, shadowing.noise_db2])
    expected = process.log_marginal_likelihood(theta, eval_gradient=True)
    found = log_likelihood(theta, squareform(pdist(places_m)), residual_db)
    for own, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(own, other, rtol=1e-10)


def test_nothing_is_learnt_from_single_points():
    points = points_of(*(np.array([v]) for v in (385_000.0, 6_672_500.0, -80.0)))
    trend = fit_trend(None, points, np.eye(1), Prior(-80))
    assert learn_shadowing([points], [trend], Shadowing()) == Shadowing()


@pytest.mark.parametrize("method", ["gp", "knn"])
def test_residuals_tell_more_than_the_trend_and_their_deviations_are_true(method):
    rows, _ = shadowed()
    found = leave_out(rows, SurveyOptions(method=method)).validation
    assert (found.folds, found.by_session, found.measurements) == (4, True, 600)
    assert found.predicted > 590
    assert found.rmse_db < 0.85 * found.trend_rmse_db
    assert found.trend_rmse_db < found.mean_rmse_db
    assert abs(found.bias_db) < 0.5
    assert found.within_1_deviation == pytest.approx(0.68, abs=0.06)
    assert found.within_2_deviations == pytest.approx(0.95, abs=0.03)
    assert found.deviation_factor == pytest.approx(1.0, abs=0.1)


def test_the_trend_alone_is_told_as_the_trend():
    rows, _ = shadowed()
    found = leave_out(rows, SurveyOptions(method="trend")).validation
    assert found.rmse_db == pytest.approx(found.trend_rmse_db, rel=1e-12)
    assert found.within_1_deviation == pytest.approx(0.68, abs=0.06)


def test_left_out_sessions_leave_no_trace():
    """A session that no other tells anything about cannot be told."""
    east_m, north_m = somewhere(40)
    session = np.repeat([0, 1], 20)
    rows = measured(east_m, north_m, law(east_m, north_m), session, session, ("A", "B"))
    found = leave_out(rows, SurveyOptions()).validation
    assert found.predicted == 0
    assert np.isnan(found.rmse_db)
    assert found.deviation_factor == 1.0


def test_maps_of_some_cells_are_those_of_the_whole_survey():
    rows, _ = shadowed(per_drive=60)
    cell = np.arange(len(rows)) % 3
    east_m, north_m = somewhere(20, seed=5)
    ids = ("A", "B", "C")
    rows = measured(rows.east_m, rows.north_m, rows.level_dbm - 5.0 * cell, rows.session, cell, ids)
    whole = fit_survey(rows, SurveyOptions())
    some = fit_survey(rows, SurveyOptions(), only={"B", "D"})
    assert (list(whole.cells), list(some.cells)) == (["A", "B", "C"], ["B"])
    assert some.shadowing == whole.shadowing
    for one, other in zip(
        some.cells["B"].predict(east_m, north_m), whole.cells["B"].predict(east_m, north_m),
        strict=True,
    ):  # fmt: skip
        np.testing.assert_array_equal(one, other)
    assert fit_survey(rows, SurveyOptions(), only=()).cells == {}


def test_one_session_is_left_out_part_by_part():
    rows, _ = shadowed(drives=1, per_drive=200)
    found = leave_out(rows, SurveyOptions()).validation
    assert (found.folds, found.by_session) == (5, False)
    assert found.predicted > 150


def test_more_than_twenty_sessions_are_left_out_together():
    rows, _ = shadowed(drives=25, per_drive=8)
    assert leave_out(rows, SurveyOptions(trend="mean", method="knn")).validation.folds == 20


def test_calibration_finds_offset_and_slope_of_a_prediction():
    east_m, north_m = somewhere(200)
    truth = law(east_m, north_m)
    rows = measured(east_m, north_m, truth)
    wrong = {"A": lambda e, n: np.where(n > 6_672_300, (law(e, n) + 80) / 1.1 - 85, np.nan)}
    survey = fit_survey(rows, SurveyOptions(), predicted=wrong)
    trend = survey.cells["A"].trend
    assert trend.slope == pytest.approx(1.1, abs=0.01)
    assert trend.level_dbm(*ANTENNA[:, None]) == pytest.approx(law(*ANTENNA[:, None]), abs=0.3)
    assert survey.cells["A"].antenna is None
    assert len(survey.cells["A"].points) < 200


def test_cells_that_were_not_predicted_are_told():
    rows, _ = shadowed(drives=1)
    told = r"cells of the prediction, such as B, found none in 1 cell, such as A \(likely: other"
    with pytest.raises(InputError, match=told):
        fit_survey(rows, SurveyOptions(), predicted={"B": lambda e, _: e})
    with pytest.raises(InputError, match="names that differ in upper and lower case only"):
        fit_survey(rows, SurveyOptions(), predicted={"a": lambda e, _: e})
    cell = np.arange(len(rows)) % 2
    two = measured(
        rows.east_m, rows.north_m, rows.level_dbm, cell=cell, cell_ids=("A", "Helsinki_1")
    )
    notes = fit_survey(two, SurveyOptions(), predicted={"A": law}).notes
    assert notes[0] == (
        "1 cell left out: not in the prediction, which has such as A: Helsinki_1 "
        "(likely: other names or identities, or another network)"
    )


def test_who_stands_still_does_not_count_more():
    east_m, north_m = np.array([385_003.0] * 50 + [385_103.0]), np.full(51, 6_672_502.0)
    rows = measured(east_m, north_m, np.r_[np.full(50, -90.0), -60.0], np.r_[np.zeros(50), 0])
    (points,) = points_by_cell(rows, 10.0, 100).values()
    np.testing.assert_array_equal(np.sort(points.level_dbm), [-90, -60])
    assert len(points.measured_at) == 51


def test_many_points_take_larger_squares():
    rows, _ = shadowed(drives=2, per_drive=400)
    (points,) = points_by_cell(rows, 5.0, 100).values()
    assert 30 < len(points) <= 100


def test_few_points_are_left_out_or_take_the_mean():
    east_m, north_m = somewhere(7)
    cell = np.array([0, 0, 1, 1, 1, 1, 1])
    rows = measured(east_m, north_m, law(east_m, north_m), cell=cell, cell_ids=("A", "B"))
    survey = fit_survey(rows, SurveyOptions())
    assert list(survey.cells) == ["B"]
    assert survey.cells["B"].antenna is None
    assert survey.notes[0] == "1 cell left out: received in fewer than 3 squares"
    assert "1 antenna not located (fewer than 15 squares)" in survey.notes[1]
    with pytest.raises(InputError, match="received in at least 9 squares, found 2 cells, none"):
        fit_survey(rows, SurveyOptions(min_points=9))


def test_fits_do_not_depend_on_the_order_of_rows_or_on_the_hour():
    rows, _ = shadowed(drives=2, per_drive=60)
    one, two = (fit_survey(rows, SurveyOptions()) for _ in range(2))
    at = somewhere(20, seed=8)
    np.testing.assert_array_equal(one.cells["A"].predict(*at), two.cells["A"].predict(*at))
    mixed = rows.where(np.random.default_rng(0).permutation(len(rows)))
    three = fit_survey(mixed, SurveyOptions())
    np.testing.assert_allclose(
        one.cells["A"].predict(*at), three.cells["A"].predict(*at), atol=1e-4
    )


def test_options_out_of_range_are_told_together():
    with pytest.raises(ConfigError) as error:
        SurveyOptions(method="svm", trend="none", reach_m=0.0, min_points=0, square_m=np.nan)  # type: ignore[arg-type]
    for name in ("method", "trend", "reach_m", "min_points", "square_m"):
        assert f"SurveyOptions, {name}" in str(error.value)
