"""The filter's first belief, and a single report located by the probabilistic method."""

import numpy as np
import pytest
from made_town import CRS, NAMES, SOUTH_M, WEST_M, Town

from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.fingerprints.locating import fit_locator, locate_by
from mapfilter.positioning.fingerprints.options import Probabilistic
from mapfilter.positioning.fingerprints.reports import make_reports

COUNT, ERROR_DB, SHARED_DB, SHOWN = 150, 6.0, 3.0, 5
TOWN = Town.of(3)


def reports(places_m, level_dbm, strongest=SHOWN, **more):
    """The strongest cells at places in the town's frame."""
    order = np.argsort(-level_dbm, axis=1)[:, :strongest]
    report = np.repeat(np.arange(len(order)), order.shape[1])
    return make_reports(
        CRS, report, np.array(NAMES)[order.ravel()],
        np.take_along_axis(level_dbm, order, 1).ravel(), count=len(order),
        places=np.asarray(places_m) + np.array([WEST_M, SOUTH_M]), **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def first():
    """Errors, radii and positions by both, of the same reports on the streets."""
    rng = np.random.default_rng(8)
    area = TOWN.area()
    points_m = area.points.T.astype(float)
    true_m = points_m[rng.choice(len(points_m), COUNT, replace=False)]
    level_dbm = TOWN.levels_dbm(true_m) + ERROR_DB * rng.standard_normal((COUNT, len(NAMES)))
    level_dbm += SHARED_DB * rng.standard_normal((COUNT, 1))
    known = reports(
        points_m, TOWN.levels_dbm(points_m), len(NAMES),
        sd_db=np.full(len(points_m) * len(NAMES), ERROR_DB),
    )  # fmt: skip
    known = type(known)(**{**vars(known), "predicted": True})
    given = reports(true_m, level_dbm)
    fitted = fit_locator(known, Probabilistic(), rng, strongest=SHOWN, validated=200)
    single = locate_by(fitted, given)
    filter_ = BayesFilter(level_error_db=ERROR_DB, device_error_db=SHARED_DB).over_area(area)
    fixes = []
    for index in range(COUNT):
        cell, dbm = given.readings(index)
        order = np.argsort(-dbm)
        rows = tuple(
            ReportRow("neighbour" if rank else "serving", given.cell_ids[cell[at]], None, None,
                      float(dbm[at]), 0)
            for rank, at in enumerate(order)
        )  # fmt: skip
        state = filter_.begin()
        _, output = filter_.step(state, Epoch(0.0, radio=rows), np.random.default_rng(index))
        fixes.append(output.fix)
    place_m = np.array([[fix.east_m, fix.north_m] for fix in fixes])
    radii_m = np.array([fix.radii_m for fix in fixes])
    error_m = np.hypot(*(place_m - true_m - [WEST_M, SOUTH_M]).T)
    return single, place_m, radii_m, error_m


def test_the_first_belief_is_nearly_as_near_as_a_single_report(first):
    single, _, _, error_m = first
    assert np.isfinite(single.error_m).all()
    # Levels count by an exponent of 0.35, as their errors last; here they are independent.
    assert np.median(error_m) < 1.5 * np.median(single.error_m)
    assert np.quantile(error_m, 0.95) < 1.5 * np.quantile(single.error_m, 0.95)


def test_the_region_of_the_first_belief_is_the_wider_one(first):
    single, _, radii_m, error_m = first
    assert np.median(radii_m[:, 2]) > np.median(single.radii_m[:, 2])
    assert np.mean(error_m <= radii_m[:, 2]) >= 0.95
    assert np.mean(single.error_m <= single.radii_m[:, 2]) > 0.85


def test_the_region_of_the_first_belief_holds_the_single_position(first):
    single, place_m, radii_m, _ = first
    apart_m = np.hypot(single.east_m - place_m[:, 0], single.north_m - place_m[:, 1])
    assert np.mean(apart_m <= radii_m[:, 2]) >= 0.95
    assert np.corrcoef(single.east_m, place_m[:, 0])[0, 1] > 0.8
