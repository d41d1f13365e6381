"""Which method locates single reports, with which regions, and what is told of each report."""
# ruff: noqa: ARG001

from dataclasses import replace
from math import nan
from types import SimpleNamespace

import numpy as np
import pytest
from made_fingerprints import CRS

from mapfilter.errors import ConfigError, InputError
from mapfilter.positioning.fingerprints import locating as tested
from mapfilter.positioning.fingerprints.censoring import Bounds
from mapfilter.positioning.fingerprints.locating import (
    ReportLocator,
    fit_locator,
    locate_by,
    locator_for,
    timed_share,
    usual_readings,
)
from mapfilter.positioning.fingerprints.matches import Position
from mapfilter.positioning.fingerprints.options import Centroid, Neighbours, Probabilistic
from mapfilter.positioning.fingerprints.regions import Errors
from mapfilter.positioning.fingerprints.reports import make_reports


def reports(counts, advance=None, **more):
    """Reports with so many readings each, of the cells a, b and so on."""
    report = np.repeat(np.arange(len(counts)), counts)
    names = [chr(ord("a") + k) for count in counts for k in range(count)]
    return make_reports(
        CRS, report, names, np.linspace(-90.0, -60.0, len(names)), count=len(counts),
        timing_advance=advance, **more,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("counts", "usual"),
    [([0, 3, 1, 4, 0], 3), ([1, 2], 1), ([2, 3, 3, 9], 3), ([0, 0], 1), ([], 1), ([1, 0], 1)],
)
def test_usual_reports_have_a_median_number_of_readings(counts, usual):
    assert usual_readings(reports(counts)) == usual


@pytest.mark.parametrize(
    ("counts", "advance", "share"),
    [([1, 2, 0, 1], [3.0, nan, 5.0, nan], 1 / 3), ([0, 0], [1.0, 2.0], 0.0), ([], [], 0.0),
     ([1, 1], [1.0, 0.0], 1.0)],
)  # fmt: skip
def test_reports_with_a_timing_advance_are_a_share_of_those_with_readings(counts, advance, share):
    assert timed_share(reports(counts, advance)) == pytest.approx(share)


def survey(count):
    """Reports at places 10 m apart, of which each receives a, and logs of their own."""
    places = np.column_stack([10.0 * np.arange(count), np.zeros(count)])
    return make_reports(
        CRS, np.arange(count), ["a"] * count, -60.0 - np.arange(count), count=count,
        places=places, block=np.arange(count) % 5,
    )  # fmt: skip


@pytest.mark.parametrize(("count", "enough"), [(20, True), (19, False)])
def test_regions_are_calibrated_by_twenty_reports_or_more(count, enough):
    fitted = fit_locator(survey(count), Neighbours(k=1))
    assert (fitted.regions is not None) is enough
    assert len(fitted.validations) == enough
    assert len(fitted.database) == count
    assert fitted.method == Neighbours(k=1)
    # Reports without a position are left out.
    known = survey(count)
    known.east_m[0] = nan
    assert len(fit_locator(known, "knn").database) == count - 1


def test_the_method_with_the_least_median_error_is_taken(monkeypatch):
    medians = dict(zip(map(str, tested.CANDIDATES), (7.0, 5.0, 9.0), strict=True))

    def errors(database, method, fold, report, most, bounds):
        assert (most, bounds) == (123, Bounds(low_dbm=-100.0))
        report(1, 2)
        report(2, 2)
        middle_m = medians[str(method)]
        # The mean says otherwise.
        error_m = np.array([0.0] * 9 + [middle_m] * 3 + [100.0 / middle_m] * 9)
        return Errors(error_m, error_m, error_m, np.arange(21) % 3)

    monkeypatch.setattr(tested, "cross_validate", errors)
    monkeypatch.setattr(tested, "folds_of", lambda _: (np.array([0, 1, 1]), "logs"))
    done = []
    fitted = fit_locator(
        survey(30), validated=123, bounds=Bounds(low_dbm=-100.0),
        progress=lambda *given: done.append(given),
    )  # fmt: skip
    assert fitted.method == tested.CANDIDATES[1]
    assert [one.error_median_m for one in fitted.validations] == [5.0, 7.0, 9.0]
    assert {one.blocks for one in fitted.validations} == {"logs"}
    # Two folds of each of the three.
    assert done == [(k, 6) for k in range(1, 7)]
    # Two thousand reports are left out where no number is given, over any scale.
    usual = []
    monkeypatch.setattr(tested, "cross_validate", lambda *given: usual.append(given[4:]) or Errors(
        *(np.arange(30.0),) * 3, np.arange(30)))  # fmt: skip
    fit_locator(survey(30), "knn")
    assert usual == [(2000, Bounds())]
    # One that locates nothing is the last.
    medians[str(tested.CANDIDATES[1])] = 1e9
    monkeypatch.setattr(tested, "cross_validate", lambda _, one, *__: Errors(
        *(np.full(0 if one == tested.CANDIDATES[0] else 30, 4.0),) * 3,
        np.arange(0 if one == tested.CANDIDATES[0] else 30)))  # fmt: skip
    assert fit_locator(survey(30)).method == tested.CANDIDATES[1]


def test_predicted_levels_are_calibrated_by_reports_that_are_drawn(monkeypatch):
    given = []

    def drawn(placed, count, strongest, shared_db, rng, timed):
        given.append((count, strongest, shared_db, rng.random(), timed))
        return placed.some(np.arange(25))

    def errors(placed, method, some):
        given.append((some.level_dbm.min(), some.censored.min()))
        off_m = np.linspace(1.0, 30.0, len(some))
        return Errors(off_m, off_m, off_m, np.arange(len(some)) % 10)

    monkeypatch.setattr(tested, "simulated_reports", drawn)
    monkeypatch.setattr(tested, "drawn_errors", errors)
    known = replace(survey(30), predicted=True)
    fitted = fit_locator(
        known, Probabilistic(shared_db=9.0), strongest=5, validated=77, timed=0.25,
        bounds=Bounds(low_dbm=-70.0),
    )  # fmt: skip
    assert given[0] == (77, 5, 3.0, np.random.default_rng(0).random(), 0.25)
    # -84 dBm at the weakest, shown as the end of the scale.
    assert given[1] == (-70.0, -1)
    assert fitted.validations[0].blocks == "reports drawn with the stated errors"
    fit_locator(known, Probabilistic(), np.random.default_rng(5))
    assert given[2][3:] == (np.random.default_rng(5).random(), 0.0)
    with pytest.raises(ConfigError, match="gp"):
        fit_locator(known, "gp")
    with pytest.raises(ConfigError, match="knn, probabilistic, gp"):
        fit_locator(known, 3)


def test_a_locator_is_calibrated_for_the_reports_that_are_to_be_located(monkeypatch):
    found = {}
    monkeypatch.setattr(
        tested, "fit_locator", lambda *given, **more: found.update(more, given=given)
    )
    ends = [(-85.0, -1), *[(-70.0, 0)] * 6]
    asked = make_reports(
        CRS, [0, 0, 1, 1, 1, 2, 2], list("ababcab"), [dbm for dbm, _ in ends], count=4,
        censored=[end for _, end in ends], timing_advance=[nan, 1.0, 2.0, 3.0],
    )  # fmt: skip
    locator_for(asked, "database", "knn", "rng", progress="progress")
    assert found == {
        "given": ("database", "knn", "rng"), "strongest": 2, "bounds": Bounds(low_dbm=-85.0),
        "timed": pytest.approx(2 / 3), "progress": "progress",
    }  # fmt: skip


def test_each_report_has_its_position_and_its_radii_or_a_reason():
    database = survey(20)

    def locator(received):
        # By the level, so that each report has its own.
        return Position(float(received.level_dbm[0]), 5.0, 2.0, 3.0)

    regions = SimpleNamespace(radii_m=lambda spread, mismatch: np.outer(spread, [1, 2, 3]) +
                              mismatch[:, None])  # fmt: skip
    fitted = ReportLocator(Centroid(), database, locator, regions, ("validation",))
    asked = make_reports(
        CRS, [0, 0, 2, 3, 3], ["a", "z", "z", "a", "y"], [-60.0, -50.0, -40.0, -63.0, -1.0],
        count=4, places=[(-57.0, 9.0), (0.0, 0.0), (0.0, 0.0), (nan, nan)],
        time_s=[5.0, 6.0, 7.0, 8.0], notes=("a note",),
    )  # fmt: skip
    found = locate_by(fitted, asked)
    np.testing.assert_array_equal(found.east_m, [-60.0, nan, nan, -63.0])
    np.testing.assert_array_equal(found.north_m, [5.0, nan, nan, 5.0])
    np.testing.assert_array_equal(found.radii_m[:, 0], [5.0, nan, nan, 5.0])
    np.testing.assert_array_equal(found.radii_m[3], [5.0, 7.0, 9.0])
    # 3 m west and 4 m south of the true place.
    np.testing.assert_allclose(found.error_m, [5.0, nan, nan, nan])
    assert found.known.tolist() == [1, 0, 0, 1]
    assert found.unknown.tolist() == [1, 0, 1, 1]
    unknown, nothing = "no transmitter of the database", "nothing received"
    assert found.reason == ("", nothing, unknown, "")
    assert found.time_s.tolist() == [5.0, 6.0, 7.0, 8.0]
    assert found.notes == ("a note",)
    with pytest.raises(InputError, match="EPSG:32636"):
        locate_by(fitted, replace(asked, crs="EPSG:32636"))
    bare = locate_by(replace(fitted, regions=None), asked)
    assert np.isnan(bare.radii_m).all()
    assert bare.radii_m.shape == (4, 3)
