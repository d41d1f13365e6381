"""Whole runs on a made floor: better than a centroid, radii that hold, truth not used."""

from dataclasses import replace

import numpy as np
import pytest
from made_fingerprints import CRS, NAMES, levels_at, reports_at, survey

import mapfilter as mf
from mapfilter.errors import ConfigError, InputError
from mapfilter.positioning.fingerprints.censoring import Bounds, bounded, bounds_of
from mapfilter.positioning.fingerprints.cross_validation import cross_validate, folds_of
from mapfilter.positioning.fingerprints.located import NOTHING, UNKNOWN, figures_of
from mapfilter.positioning.fingerprints.locating import fit_locator, locate_by
from mapfilter.positioning.fingerprints.matches import Received, locator
from mapfilter.positioning.fingerprints.options import METHODS, Neighbours, Probabilistic
from mapfilter.positioning.fingerprints.reports import make_reports


@pytest.fixture(scope="module")
def floor():
    return survey(np.random.default_rng(1))


@pytest.mark.parametrize("method", ["knn", "probabilistic", "gp"])
def test_every_method_beats_the_centroid(floor, method):
    known, asked = floor
    plain = mf.locate_reports(asked, known, "centroid").error_m
    found = mf.locate_reports(asked, known, method)
    assert found.error_m.mean() < 0.6 * plain.mean()
    assert found.error_m.mean() < 6.0
    shares = np.mean(found.error_m[:, None] <= found.radii_m, axis=0)
    assert 0.8 < shares[2] <= 1.0
    assert 0.3 < shares[0] < 0.75


def test_auto_takes_the_best_in_cross_validation(floor):
    fitted = fit_locator(floor[0])
    medians = [one.error_median_m for one in fitted.validations]
    assert medians == sorted(medians)
    assert len(medians) == 3
    assert fitted.validations[0].within_95 == pytest.approx(0.95, abs=0.03)


def test_positions_do_not_depend_on_their_truth_or_on_other_reports(floor):
    known, asked = floor
    found = mf.locate_reports(asked, known, "knn")
    blind = replace(asked, east_m=np.full(len(asked), np.nan), north_m=np.full(len(asked), np.nan))
    again = mf.locate_reports(blind, known, "knn")
    np.testing.assert_array_equal(found.east_m, again.east_m)
    np.testing.assert_array_equal(found.radii_m, again.radii_m)
    assert np.isnan(again.error_m).all()
    some = mf.locate_reports(asked.some(np.array([7, 3])), known, "knn")
    np.testing.assert_array_equal(some.north_m, found.north_m[[7, 3]])


def test_transmitters_that_the_database_lacks_change_nothing(floor):
    known, asked = floor
    places = asked.places
    level = levels_at(places, np.random.default_rng(3))
    plain = reports_at(places, level)
    more = np.column_stack([level, np.full(len(level), -30.0)])
    stranger = reports_at(places, more, names=(*NAMES, "new"))
    for method in ("knn", "probabilistic", "centroid"):
        one = mf.locate_reports(plain, known, method)
        other = mf.locate_reports(stranger, known, method)
        np.testing.assert_array_equal(one.east_m, other.east_m)
        assert (other.unknown == 1).all()


def test_a_report_without_evidence_has_a_reason_and_no_position(floor):
    asked = make_reports(CRS, [1, 2], ["elsewhere", NAMES[0]], [-50.0, -60.0], count=3)
    found = mf.locate_reports(asked, floor[0], "knn")
    assert found.reason == (NOTHING, UNKNOWN, "")
    assert np.isnan(found.east_m[:2]).all()
    assert np.isfinite(found.radii_m[2]).all()
    figures = figures_of(found)
    assert figures["not_located"] == {UNKNOWN: 1, NOTHING: 1}
    assert "error_mean_m" not in figures


def test_figures_tell_how_often_radii_hold_the_true_position(floor):
    found = mf.locate_reports(floor[1], floor[0], "knn")
    error_m = np.linspace(0.0, 8.0, len(found))
    radii_m = np.tile([1.0, 2.0, 6.0], (len(found), 1))
    figures = figures_of(replace(found, error_m=error_m, radii_m=radii_m))
    shares = [float(np.mean(error_m <= radius_m)) for radius_m in (1.0, 2.0, 6.0)]
    assert [figures[f"within_{level}"] for level in (50, 67, 95)] == pytest.approx(shares)
    assert 0 < shares[0] < shares[1] < shares[2] < 1
    radii_m[3] = np.nan
    unknown = figures_of(replace(found, error_m=error_m, radii_m=radii_m))
    assert np.isnan([unknown[f"within_{level}"] for level in (50, 67, 95)]).all()


def test_cross_validation_is_leaving_out_by_hand(floor):
    known = floor[0].placed()
    fold, _ = folds_of(known)
    errors = cross_validate(known, Neighbours(), fold)
    one = int(fold[0])
    others = known.some(fold != one).compact()
    by = locator(Neighbours(), others)
    left_out = known.some(fold == one)
    named, _ = left_out.named_as(others.cell_ids)
    expected = []
    for i in range(len(named)):
        at = by(Received(*named.readings(i), -1, np.nan))
        expected.append(np.hypot(at.east_m - left_out.east_m[i], at.north_m - left_out.north_m[i]))
    np.testing.assert_allclose(errors.error_m[errors.block == one], expected)
    assert len(errors) == len(known)


def test_logs_are_left_out_whole():
    rng = np.random.default_rng(0)
    places = rng.uniform(0, 40, (60, 2))
    known = reports_at(places, levels_at(places, rng), block=np.repeat(np.arange(4), 15))
    fold, blocks = folds_of(known)
    assert blocks == "logs"
    assert fold.tolist() == np.repeat(np.arange(4), 15).tolist()


def test_neighbouring_places_are_left_out_together():
    places = np.repeat(np.random.default_rng(0).uniform(0, 40, (50, 2)), 3, axis=0)
    known = reports_at(places, levels_at(places, np.random.default_rng(1)))
    fold, blocks = folds_of(known)
    assert blocks.startswith("squares of")
    assert (fold.reshape(50, 3) == fold[::3, None]).all()
    assert len(np.unique(fold)) > 5


def test_few_reports_give_positions_without_radii():
    places = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]])
    known = reports_at(places, np.array([[-50.0, -70], [-60, -60], [-70, -50]]), names=("a", "b"))
    found = mf.locate_reports(known, known, Neighbours(k=1))
    np.testing.assert_allclose(found.error_m, 0, atol=1e-9)
    assert np.isnan(found.radii_m).all()
    assert found.to_dataframe()["radius_95_m"].isna().all()


def test_reports_of_another_zone_are_refused(floor):
    asked = replace(floor[1], crs="EPSG:32636")
    with pytest.raises(InputError, match="another area or zone"):
        mf.locate_reports(asked, floor[0], "knn")


def test_reports_in_the_metres_of_the_database_are_located(floor):
    asked = replace(floor[1], crs="EPSG:25835")
    found = mf.locate_reports(asked, floor[0], "centroid")
    assert found.crs == CRS
    plain = mf.locate_reports(floor[1], floor[0], "centroid")
    np.testing.assert_array_equal(found.east_m, plain.east_m)


@pytest.mark.parametrize("method", ["nearest", 3, None])
def test_an_unknown_method_is_refused(floor, method):
    with pytest.raises(ConfigError, match=", ".join(METHODS)):
        mf.locate_reports(floor[1], floor[0], method)


def test_a_database_without_positions_is_refused(floor):
    known = replace(floor[0], east_m=np.full(len(floor[0]), np.nan))
    with pytest.raises(InputError, match="reports with positions"):
        mf.locate_reports(floor[1], known, "knn")


def test_a_fitted_locator_is_used_again(floor):
    fitted = fit_locator(floor[0], Probabilistic(level_db=4.0))
    one, other = locate_by(fitted, floor[1]), locate_by(fitted, floor[1])
    np.testing.assert_array_equal(one.radii_m, other.radii_m)
    assert "level_db 4.0" in repr(one)


@pytest.mark.parametrize("method", ["auto", *METHODS])
def test_degenerate_databases_and_logs(method):
    same = make_reports(
        CRS,
        np.arange(60),
        ["a"] * 60,
        [-60.0] * 60,
        count=60,
        places=np.tile([[1.0, 2.0]], (60, 1)),
    )
    single = make_reports(CRS, [0, 0], ["a", "b"], [-60.0, np.nan], count=1, places=[[1.0, 2.0]])
    asked = make_reports(CRS, [0, 1], ["a", "c"], [np.nan, -50.0], count=3)
    nothing = make_reports(CRS, [], [], [], count=0)
    for known in (same, single):
        found = mf.locate_reports(asked, known, method)
        assert found.reason == ("", UNKNOWN, NOTHING)
        assert (found.east_m[0], found.north_m[0]) == pytest.approx((1, 2))
        assert len(mf.locate_reports(nothing, known, method)) == 0


@pytest.mark.parametrize("method", ["auto", *METHODS])
def test_serving_cells_without_levels_are_enough(method):
    rng = np.random.default_rng(0)
    east = rng.uniform(0, 100, 80)
    cell = np.where(east < 50, "west", "east")
    places = np.column_stack([east, rng.uniform(0, 10, 80)])
    known = make_reports(
        CRS, np.arange(80), cell, np.full(80, np.nan), count=80, places=places, serving=cell
    )
    asked = make_reports(CRS, [0, 1], ["west", "east"], [np.nan] * 2, count=2)
    found = mf.locate_reports(asked, known, method)
    west, east_m = found.east_m
    assert west < 50 < east_m


@pytest.mark.parametrize("method", ["knn", "probabilistic", "auto"])
def test_levels_that_end_at_a_full_scale_are_bounds(floor, method):
    """A phone with bars shows all that is strong alike; taken as levels, they point elsewhere."""
    known, asked = floor
    full = Bounds(high_dbm=float(np.quantile(asked.level_dbm, 0.3)))
    shown = bounded(asked, full)
    assert bounds_of(shown) == full
    taken_as_levels = replace(shown, censored=np.zeros_like(shown.censored))
    found, naive = (mf.locate_reports(one, known, method) for one in (shown, taken_as_levels))
    within = np.mean(found.error_m <= found.radii_m[:, 2])
    assert within > 0.88
    assert within > np.mean(naive.error_m <= naive.radii_m[:, 2])
    assert found.error_m.mean() < naive.error_m.mean()
