"""Surveys on a lattice: what is measured, what is marked, and rasters to calibrate."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import truncnorm
from test_survey_fit import ANTENNA, CRS, LATTICE, law, measured, shadowed, somewhere

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.plan_files import read_cell_plan, write_cell_plan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import check_against_plan
from mapfilter.survey.level_trend import DistanceLoss
from mapfilter.survey.measured_map import fit_survey
from mapfilter.survey.options import SurveyOptions
from mapfilter.survey.survey_rasters import predicted_levels, surveyed_plan, write_survey
from mapfilter.survey.weakest_reported import WeakestReported, mean_below


def along_a_street(count=120, cell_ids=("A",)):
    rng = np.random.default_rng(3)
    west, south, east, _ = LATTICE.bounds_m
    east_m = np.linspace(west + 50, east - 200, count)
    north_m = np.full(count, south + 200.0)
    level = law(east_m, north_m) + rng.normal(0, 2, count)
    return measured(east_m, north_m, level, cell_ids=cell_ids)


def digest(*paths):
    return [hashlib.sha256(path.read_bytes()).hexdigest() for path in paths]


def written(folder, survey, lattice=LATTICE, **kwargs):
    mean, deviation = folder / "rxlev.tif", folder / "rxlev-deviation.tif"
    ids = write_survey(survey, lattice, mean, deviation, **kwargs)
    return ids, open_rasters(mean), open_rasters(deviation)


def centres(lattice):
    row, col = np.mgrid[: lattice.rows, : lattice.cols]
    return lattice.east_north(row, col)


def test_pixels_that_nobody_measured_are_marked(tmp_path):
    rows = along_a_street()
    survey = fit_survey(rows, SurveyOptions(reach_m=60.0))
    ids, mean, deviation = written(tmp_path, survey)
    assert ids == mean.cell_ids == deviation.cell_ids == ("A",)
    assert (mean.quantity, deviation.quantity) == ("level", "deviation")
    east_m, north_m = centres(LATTICE)
    places = np.column_stack([rows.east_m, rows.north_m])
    distance = np.min([np.hypot(east_m - e, north_m - n) for e, n in places], axis=0)  # brute force
    level, off = mean.read()[0], deviation.read()[0]
    np.testing.assert_array_equal(np.isnan(level), distance > 60)
    np.testing.assert_array_equal(np.isnan(off), distance > 60)
    expected = survey.cells["A"].predict(east_m[distance <= 60], north_m[distance <= 60])
    np.testing.assert_allclose(level[distance <= 60], expected[0], atol=0.006)
    np.testing.assert_allclose(off[distance <= 60], expected[1], atol=0.006)
    assert np.nanmin(off) < off[distance <= 60][np.argmax(distance[distance <= 60])]


def test_filled_rasters_keep_the_trend_and_still_mark(tmp_path, monkeypatch):
    monkeypatch.setattr("mapfilter.survey.survey_rasters._FIELD_LENGTHS", 0.0)
    survey = fit_survey(along_a_street(), SurveyOptions(reach_m=60.0))
    _, mean, deviation = written(tmp_path, survey, fill=True)
    level, off = mean.read()[0], deviation.read()[0]
    assert np.isfinite(level).all()
    assert 0.05 < np.isfinite(off).mean() < 0.4
    trend = survey.cells["A"].trend.level_dbm(*(a.ravel() for a in centres(LATTICE)))
    far = (slice(0, 20), slice(0, 20))
    np.testing.assert_allclose(level[far], trend.reshape(level.shape)[far], atol=0.006)


@pytest.mark.parametrize("kind", ["estimated", "LTE and NR", "in the plan", "LTE and UMTS"])
def test_a_cell_is_not_stronger_where_another_one_was_reported_without_it(tmp_path, kind):
    """A is received in the west, its trend rises to the east, and there B alone is reported."""
    lattice = Lattice(CRS, 384_000.0, 6_673_000.0, 20.0, 50, 150)
    east_m = np.r_[np.linspace(384_100.0, 384_900.0, 40), np.linspace(385_700.0, 386_500.0, 40)]
    cell = np.repeat([0, 1], 40)
    mast = Cell("A", "A", 386_000.0, 6_672_450.0, 30.0, None, 50.0, 1800.0, "omni")
    level = DistanceLoss(mast.east_m, mast.north_m)(east_m, np.full(80, 6_672_500.0)) * 3.5 + 20
    level[cell == 1] = -80.0 + np.random.default_rng(1).normal(0, 1, 40)
    rows = measured(east_m, np.full(80, 6_672_500.0), level, cell, cell, ("A", "B"))
    plan = CellPlan(CRS, (mast,)) if kind == "in the plan" else None
    if kind.startswith("LTE and"):
        rows = replace(rows, technologies={"A": kind.split()[-1], "B": "LTE"})
    survey = fit_survey(rows, SurveyOptions(), plan=plan)
    _, mean, _ = written(tmp_path, survey, lattice, fill=True)
    row, col = lattice.row_col(east_m[cell == 1], np.full(40, 6_672_500.0))
    of_a, of_b = mean.read()[:, row, col]
    assert (of_a < of_b).all() == (kind in ("estimated", "LTE and NR"))
    trend = survey.cells["A"].trend.level_dbm(east_m, np.full(80, 6_672_500.0))
    assert (trend[cell == 1] > -80).mean() > 0.5
    # Far from all reports the trend stands.
    corner = lattice.east_north(np.array([0]), np.array([149]))
    told = mean.read()[0, 0, 149]
    assert told == pytest.approx(survey.cells["A"].trend.level_dbm(*corner)[0], abs=0.01)


def test_the_bound_of_what_was_not_reported_is_the_weakest_level_of_the_reports_about():
    at, cell = np.array([0.0, 0.0, 30.0, 500.0]), np.array([0, 1, 0, 0])
    rows = measured(at, np.zeros(4), [-70.0, -90.0, -60.0, -50.0], cell=cell, cell_ids=("A", "B"))
    rows = replace(rows, time_s=np.array([1.0, 1.0, 2.0, np.nan]))
    weakest = WeakestReported.of(rows)
    found = weakest.bound_dbm(np.array([0.0, 400.0, 250.0]), np.zeros(3), 100.0)
    by_hand = (-90 / 20 - 60 / 50) / (1 / 20 + 1 / 50)
    assert found == pytest.approx([by_hand, -50.0, np.inf])
    level, bound = np.array([-60.0, -90.0, -85.0, -90.0]), np.array([-80.0, -80.0, -80.0, np.inf])
    given = np.minimum(level, bound)
    below = truncnorm.mean(-np.inf, (bound - given) / 6.0, given, 6.0)
    np.testing.assert_allclose(mean_below(level, bound, 6.0), below)
    assert mean_below(level, bound, 6.0)[3] == -90.0


@pytest.mark.parametrize("kind", ["few", "one level", "in the plan", "few are enough"])
def test_a_trend_that_does_not_hold_far_away_is_not_filled_in(tmp_path, kind):
    rows = along_a_street(count=120 if kind == "one level" else 8)
    if kind == "one level":
        rows = replace(rows, level_dbm=np.full(len(rows), -51.0))
    plan = CellPlan(CRS, (Cell("A", "A", *ANTENNA, 30.0, None, 50.0, 1800.0, "omni"),))
    options = SurveyOptions(reach_m=60.0, min_points_to_fill=3 if "enough" in kind else 15)
    survey = fit_survey(rows, options, plan=plan if kind == "in the plan" else None)
    _, mean, deviation = written(tmp_path, survey, fill=True)
    level, off = mean.read()[0], deviation.read()[0]
    if kind in ("in the plan", "few are enough"):
        assert np.isfinite(level).all()
    else:
        np.testing.assert_array_equal(np.isnan(level), np.isnan(off))
        assert np.isnan(level).any()


@pytest.mark.parametrize("trend", ["path_loss", "mean"])
@pytest.mark.parametrize("spread_db", [0.0, 6.0])
def test_one_level_everywhere_says_nothing_of_places_far_away(trend, spread_db):
    rows = along_a_street()
    level_dbm = -51.0 - spread_db * (np.arange(len(rows)) % 2)
    rows = replace(rows, level_dbm=level_dbm)
    plan = CellPlan(CRS, (Cell("A", "A", *ANTENNA, 30.0, None, 50.0, 1800.0, "omni"),))
    predicted = {"A": lambda east_m, north_m: -60.0 - 0.01 * np.hypot(east_m, north_m) / 1e3}
    options = SurveyOptions(trend=trend)
    survey = fit_survey(rows, options)
    assert survey.can_fill(survey.cells["A"]) == (spread_db > 0)
    survey = fit_survey(rows, options, predicted=predicted)
    assert survey.can_fill(survey.cells["A"])
    survey = fit_survey(rows, options, plan=plan)
    # A mean uses no antenna.
    assert survey.can_fill(survey.cells["A"]) == (spread_db > 0 or trend == "path_loss")


def test_strips_and_threads_change_no_byte(tmp_path, monkeypatch):
    survey = fit_survey(shadowed(drives=2)[0], SurveyOptions())
    written(tmp_path / "one", survey)
    monkeypatch.setattr("mapfilter.survey.survey_rasters._LARGEST_WINDOW_PX", 1000)
    again = fit_survey(shadowed(drives=2)[0], SurveyOptions())
    written(tmp_path / "two", again)
    names = "rxlev.tif", "rxlev-deviation.tif"
    one, two = (digest(*(tmp_path / name / file for file in names)) for name in ("one", "two"))
    assert one == two


def test_deviations_are_multiplied(tmp_path):
    survey = fit_survey(along_a_street(), SurveyOptions())
    _, mean, off = written(tmp_path / "a", survey)
    _, same, more = written(tmp_path / "b", survey, deviation_factor=1.5)
    np.testing.assert_array_equal(mean.read(), same.read())
    np.testing.assert_allclose(more.read(), 1.5 * off.read(), atol=0.02)


def test_deviations_are_no_levels(tmp_path):
    survey = fit_survey(along_a_street(), SurveyOptions())
    ids, _, deviation = written(tmp_path, survey)
    plan = surveyed_plan(survey, ids, {}, None, height_m=30, eirp_dbm=50, frequency_mhz=1800)
    with pytest.raises(InputError, match="deviations of a survey given for its levels"):
        deviation.read_levels_dbm(plan)


def test_cells_not_measured_on_the_lattice_are_left_out(tmp_path):
    rows = along_a_street(cell_ids=("A", "B"))
    far = replace(rows, east_m=rows.east_m + 1e5, cell=np.ones_like(rows.cell))
    both = replace(
        rows,
        **{
            name: np.concatenate([getattr(rows, name), getattr(far, name)])
            for name in (
                "cell",
                "session",
                "time_s",
                "east_m",
                "north_m",
                "level_dbm",
                "accuracy_m",
            )
        },
    )
    survey = fit_survey(both, SurveyOptions())
    assert list(survey.cells) == ["A", "B"]
    ids, mean, _ = written(tmp_path, survey)
    assert ids == mean.cell_ids == ("A",)
    elsewhere = Lattice(CRS, 600_000.0, 6_673_000.0, 5.0, 20, 20)
    with pytest.raises(InputError, match="measurements: expected some in the area"):
        written(tmp_path / "none", survey, elsewhere)


def test_the_plan_of_a_survey_fits_its_rasters(tmp_path):
    known = CellPlan(CRS, (Cell("A", "Tower", *ANTENNA, 40.0, 90.0, 55.0, 800.0),))
    survey = fit_survey(along_a_street(), SurveyOptions(), plan=known)
    ids, mean, _ = written(tmp_path, survey)
    given = {"height_m": 30.0, "eirp_dbm": 50.0, "frequency_mhz": 1800.0}
    plan = surveyed_plan(survey, ids, {}, known, **given)
    assert plan.cells == known.cells
    check_against_plan(mean, plan)
    blind = fit_survey(along_a_street(), SurveyOptions())
    (cell,) = surveyed_plan(blind, ids, {"A": (302, 720, 1, 2)}, None, **given).cells
    assert (cell.east_m, cell.north_m) == blind.cells["A"].antenna
    assert (cell.mcc, cell.mnc, cell.lac, cell.ci, cell.antenna) == (302, 720, 1, 2, "omni")
    mean_only = fit_survey(along_a_street(), SurveyOptions(trend="mean"))
    (cell,) = surveyed_plan(mean_only, ids, {}, None, **given).cells
    assert abs(cell.east_m - ANTENNA[0]) < 150


@pytest.mark.parametrize(
    ("family", "code", "expected"),
    [
        ("LTE", (6300, 101), ("LTE", 6300, 101)),
        (None, (60, 9), (None, 60, 9)),
        ("GSM", None, ("GSM", None, None)),
        # A plan with these could not be read again.
        ("GSM", (6300, 101), ("GSM", None, None)),
        ("CDMA", (6300, 101), (None, 6300, 101)),
        (None, (60, 65_535), (None, None, None)),
    ],
)
def test_the_plan_of_a_survey_has_carriers_and_codes(tmp_path, family, code, expected):
    survey = fit_survey(along_a_street(), SurveyOptions())
    given = {"height_m": 30.0, "eirp_dbm": 50.0, "frequency_mhz": 1800.0}
    told = {"technologies": {"A": family} if family else {}, "codes": {"A": code} if code else {}}
    plan = surveyed_plan(survey, ("A",), {}, None, **given, **told)
    (cell,) = plan.cells
    assert (cell.technology, cell.arfcn, cell.bsic) == expected
    write_cell_plan(plan, tmp_path / "cells.csv")
    assert read_cell_plan(tmp_path / "cells.csv", CRS).cells[0].arfcn == expected[1]


def test_a_predicted_raster_is_calibrated(tmp_path):
    """Two dB too high and a slope of 0.9; west of the antenna nobody predicted anything."""
    rows, field = shadowed(deviation_db=5.0)
    east_m, north_m = centres(LATTICE)
    truth = law(east_m, north_m) + field
    predicted = (law(east_m, north_m) + 82) / 1.1 - 80
    predicted[:, :40] = np.nan
    path = tmp_path / "predicted.tif"
    write_rasters(path, LATTICE, [("A", predicted)], ("A",))
    levels = predicted_levels(open_rasters(path), None)
    np.testing.assert_array_equal(
        levels["A"](np.array([0.0, 385_002.5]), np.array([0.0, 6_672_997.5])), [np.nan, np.nan]
    )
    survey = fit_survey(rows, SurveyOptions(reach_m=30.0), predicted=levels)
    _, mean, deviation = written(tmp_path, survey, fill=True)
    level, off = mean.read()[0], deviation.read()[0]
    assert np.isnan(level[:, :40]).all()
    assert np.isfinite(level[:, 40:]).all()
    error, before = level - truth, predicted - truth
    near = np.isfinite(off)
    assert np.sqrt(np.mean(error[near] ** 2)) < 0.75 * np.sqrt(np.mean(before[near] ** 2))
    assert abs(np.nanmean(error)) < 1.0


def test_a_number_for_no_data_is_no_prediction_to_calibrate(tmp_path):
    rows, _ = shadowed(deviation_db=5.0)
    predicted = law(*centres(LATTICE))
    predicted[40:44, 90:93] = 0.0
    path = tmp_path / "predicted.tif"
    write_rasters(path, LATTICE, [("A", predicted)], ("A",))
    levels = predicted_levels(open_rasters(path), None)
    with pytest.raises(InputError, match=r"cell A: .*0 in 12 pixels of a tile"):
        fit_survey(rows, SurveyOptions(), predicted=levels)


def test_losses_are_calibrated_with_the_plans_eirp(tmp_path):
    east_m, north_m = somewhere(80)
    plan = CellPlan(CRS, (Cell("A", "A", *ANTENNA, 30.0, None, 50.0, 1800.0, "omni"),))
    path = tmp_path / "loss.tif"
    loss = 50.0 - law(*centres(LATTICE))
    write_rasters(path, LATTICE, [("A", loss)], ("A",), quantity="loss")
    levels = predicted_levels(open_rasters(path), plan)
    np.testing.assert_allclose(levels["A"](east_m, north_m), law(east_m, north_m), atol=2.0)


@pytest.mark.parametrize(
    ("ci", "code", "family"),
    [(10_151, (26, 24), "GSM"), (13_063_179, (26, 24), None), (10_151, (1300, 24), None),
     (10_151, (26, 64), None)],
)  # fmt: skip
def test_cells_are_of_gsm_where_all_have_what_gsm_has(ci, code, family):
    survey = fit_survey(along_a_street(), SurveyOptions())
    given = {"height_m": 30.0, "eirp_dbm": 50.0, "frequency_mhz": 900.0}
    identities = {"A": (262, 2, 3100, 7), "B": (262, 2, 3100, ci)}
    codes = {"A": (60, 9), "B": code, "C": (300_000, 500)}
    plan = surveyed_plan(survey, ("A",), identities, None, **given, codes=codes)
    assert plan.cells[0].technology == family
    stated = {"A": "UMTS"}
    plan = surveyed_plan(
        survey, ("A",), identities, None, **given, codes=codes, technologies=stated
    )
    assert plan.cells[0].technology == "UMTS"
