"""Distances between reports by the sums of Torres-Sospedra et al. (2015), over whole tables."""

import numpy as np
import pytest

from mapfilter.positioning.fingerprints.matching import Distances, Scale, usual_levels
from mapfilter.positioning.fingerprints.reports import make_reports

LEVELS_DBM = np.array([[-50.0, -70.0, np.nan], [-61.0, np.nan, -75.0], [np.nan, -88.0, -79.0]])
FLOOR_DBM, EXPONENT = -89.0, 1.7


def database():
    report, cell = np.nonzero(np.isfinite(LEVELS_DBM))
    names = np.array(list("abc"))[cell]
    return make_reports("EPSG:32635", report, names, LEVELS_DBM[report, cell], count=3)


def represented(level_dbm, representation, floor_dbm=FLOOR_DBM):
    above = np.where(np.isnan(level_dbm), 0.0, level_dbm - floor_dbm)
    if representation == "exponential":
        return np.exp((above + floor_dbm) / 24.0)
    return (above / -floor_dbm) ** (EXPONENT if representation == "powed" else 1.0)


@pytest.mark.parametrize("representation", ["positive", "exponential", "powed"])
@pytest.mark.parametrize("metric", ["sorensen", "euclidean", "manhattan"])
def test_distances_of_a_report_to_those_of_a_database(metric, representation):
    own_dbm = np.array([-55.0, -72.0, np.nan])
    known, own = (represented(one, representation) for one in (LEVELS_DBM, own_dbm))
    expected = {
        "euclidean": np.sqrt(np.sum((known - own) ** 2, axis=1)),
        "manhattan": np.sum(np.abs(known - own), axis=1),
        "sorensen": np.sum(np.abs(known - own), axis=1) / np.sum(known + own, axis=1),
    }[metric]
    found = Distances.to(database(), metric, Scale(representation, FLOOR_DBM, EXPONENT))
    cells = np.array([0, 1], dtype=np.int32)
    np.testing.assert_allclose(found.of(cells, own_dbm[:2]), expected, rtol=1e-9)
    # No report is away from itself.
    same = found.of(np.array([1, 2], dtype=np.int32), LEVELS_DBM[2, 1:])
    assert same[2] == pytest.approx(0.0, abs=1e-7)
    assert same[0] > 0.01


@pytest.mark.parametrize("representation", ["positive", "exponential", "powed"])
def test_what_is_weaker_than_the_floor_is_received_by_half_a_db(representation):
    scale = Scale(representation, FLOOR_DBM, EXPONENT)
    absent = represented(np.array([np.nan]), representation)
    for level_dbm, counts_as in ((-120.0, -88.5), (-88.7, -88.5), (-88.2, -88.2), (0.0, 0.0)):
        expected = represented(np.array([counts_as]), representation) - absent
        np.testing.assert_allclose(scale(np.array([level_dbm])), expected)
    assert scale.absent == pytest.approx(absent[0])


def test_a_floor_near_0_dbm_has_a_span_of_one_db():
    for floor_dbm in (-0.4, 3.0):
        scale = Scale("positive", floor_dbm, EXPONENT)
        assert scale(np.array([floor_dbm + 2.0])).tolist() == [2.0]
    assert Scale("exponential", 0.0, EXPONENT).absent == pytest.approx(np.exp(-1 / 24))


def test_reports_of_hardly_anything_are_alike():
    """Sums below 1e-12 count as that: nothing is divided by nothing."""
    empty = make_reports("EPSG:32635", [0], ["a"], [-99.0], count=2)
    found = Distances.to(empty, "sorensen", Scale("powed", -100.0, 10.0))
    tiny = Distances.to(empty, "sorensen", Scale("powed", -100.0, 6.0))
    # (0.01)^10 is 1e-20, and of (0.01)^6, which is 1e-12, all of the sum is apart.
    none = np.zeros(0, dtype=np.int32), np.zeros(0)
    np.testing.assert_allclose(found.of(*none), [1e-8, 0.0])
    np.testing.assert_allclose(tiny.of(*none), [1.0, 0.0])


def test_usual_levels_are_means_and_of_cells_without_a_level_that_of_all():
    report, cell = [0, 0, 1, 1, 2], ["a", "b", "a", "c", "b"]
    level_dbm = [-50.0, np.nan, -60.0, -70.0, np.nan]
    given = make_reports("EPSG:32635", report, cell, level_dbm, count=3)
    np.testing.assert_allclose(usual_levels(given), [-55.0, -60.0, -70.0])
    none = make_reports("EPSG:32635", [0], ["a"], [np.nan], count=1)
    assert usual_levels(none).tolist() == [0.0]
