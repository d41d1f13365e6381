"""From one report to weights of a database's reports, and to a position, by hand."""

from math import exp, log, nan

import numpy as np
import pytest
from made_fingerprints import CRS
from scipy.optimize import minimize

from mapfilter.errors import InputError
from mapfilter.positioning.fingerprints import matches as tested
from mapfilter.positioning.fingerprints.matches import Received, locator
from mapfilter.positioning.fingerprints.options import Centroid, Neighbours, Probabilistic
from mapfilter.positioning.fingerprints.reports import make_reports

PLACES = np.array([[0.0, 0.0], [100.0, 0.0], [0.0, 200.0]])


def database(level_dbm, names="abcd", **more):
    """Reports at the places, of the levels that are no NaN."""
    level_dbm = np.array(level_dbm)
    report, cell = np.nonzero(np.isfinite(level_dbm))
    return make_reports(
        CRS, report, np.array(list(names))[cell], level_dbm[report, cell],
        count=len(level_dbm), places=PLACES[: len(level_dbm)], **more,
    )  # fmt: skip


def received(*level_dbm, serving=-1, advance=nan):
    return Received(
        np.arange(len(level_dbm), dtype=np.int32), np.array(level_dbm), serving, advance
    )


def options(**more):
    given = {"level_db": 5.0, "shared_db": 0.0, "outliers": 0.01, "absence_per_db": 0.2}
    return Probabilistic(**(given | more))


def weights(match, count=3):
    found = np.zeros(count)
    found[match.reports] = match.weight
    return found


def test_one_level_weighs_places_by_its_error_or_is_an_outlier():
    """10 dB are two deviations: exp(-2); 20 dB exp(-8), of which an outlier has the most."""
    by = locator(options(), database([[-60.0], [-70.0], [-80.0]]))
    likelihood = [0.99 * exp(-0.5 * off**2) + 0.01 * exp(-0.5) for off in (0.0, 2.0, 4.0)]
    match = by.matcher(received(-60.0))
    np.testing.assert_allclose(weights(match), np.array(likelihood) / sum(likelihood))
    assert match.mismatch == pytest.approx(-log(sum(likelihood)))


@pytest.mark.parametrize(("effective", "share"), [(8.0, 1.0), (4.0, 1.0), (1.0, 0.25)])
def test_more_readings_than_count_are_a_share_of_themselves(effective, share):
    by = locator(options(effective_readings=effective), database([[-60.0] * 4, [-65.0] * 4]))
    match = by.matcher(received(*[-60.0] * 4))
    out = 0.01 * exp(-4 * share / 2)
    likelihood = np.array([0.99 + out, 0.99 * exp(-2.0 * share) + out])
    np.testing.assert_allclose(weights(match, 2), likelihood / likelihood.sum())
    assert match.mismatch == pytest.approx(-log(likelihood.sum()))


def test_a_cell_that_one_report_lacks_counts_by_its_level_above_the_floor():
    """1 dB below the weakest of the database: -81 dBm. b is 11 dB above it, 0.2 nats each."""
    by = locator(options(outliers=0.0), database([[-60.0, -70.0], [-60.0, nan], [-80.0, nan]]))
    match = by.matcher(received(-60.0))
    likelihood = np.array([exp(-2.2), 1.0, exp(-8.0)])
    np.testing.assert_allclose(weights(match), likelihood / likelihood.sum(), rtol=1e-6)
    # An outlier goes by its cells alone.
    match = locator(options(outliers=1.0), database([[-60.0, -70.0], [-60.0, nan]])).matcher(
        received(-60.0)
    )
    likelihood = np.array([exp(-0.2 * 1.0), 1.0])
    np.testing.assert_allclose(weights(match, 2), likelihood / likelihood.sum(), rtol=1e-6)


def test_a_reading_without_a_level_is_received_and_ends_no_scale():
    """The floor is 1 dB below the weakest level that is known: -71 dBm."""
    given = make_reports(
        CRS, [0, 0, 1, 2], ["a", "b", "a", "a"], [-60.0, -70.0, -60.0, nan], count=3,
        places=PLACES,
    )  # fmt: skip
    match = locator(options(outliers=0.0), given).matcher(received(-60.0))
    likelihood = np.array([exp(-0.2), 1.0, 1.0])
    np.testing.assert_allclose(weights(match), likelihood / likelihood.sum())


def test_a_timing_advance_counts_where_the_same_cell_serves():
    given = database(
        [[-60.0], [-60.0], [-60.0]], serving=["a", "a", ""], timing_advance=[3.0, nan, 3.0]
    )
    by = locator(options(timing_sd_steps=0.5, outliers=0.0), given)
    for advance, likelihood in (
        (3.0, [1.0, exp(-2.0), 1.0]),
        (4.0, [exp(-2.0), exp(-2.0), 1.0]),
        (2.5, [exp(-0.5), exp(-2.0), 1.0]),
        (nan, [1.0, 1.0, 1.0]),
    ):
        match = by.matcher(received(-60.0, serving=0, advance=advance))
        np.testing.assert_allclose(weights(match), np.array(likelihood) / sum(likelihood))
    match = by.matcher(received(-60.0, serving=-1, advance=4.0))
    np.testing.assert_allclose(weights(match), [1 / 3] * 3)
    # It is no reading among others, whose likelihoods count by a share.
    by = locator(options(effective_readings=0.5, timing_sd_steps=0.5, outliers=0.0), given)
    match = by.matcher(received(-60.0, serving=0, advance=4.0))
    np.testing.assert_allclose(weights(match), np.array([1, 1, exp(2)]) / (2 + exp(2)))


@pytest.mark.parametrize(("off_db", "kept"), [(21.0, True), (22.0, False)])
def test_places_of_less_than_a_ten_thousandth_are_left_out(off_db, kept):
    """4.2 deviations are 1.5e-4, 4.4 of them 6.2e-5."""
    by = locator(options(outliers=0.0), database([[-60.0], [-60.0 - off_db]]))
    assert (len(by.matcher(received(-60.0)).reports) == 2) is kept


@pytest.mark.parametrize(("most", "kept"), [(1, [0]), (2, [0, 2]), (3, [0, 1, 2]), (4, [0, 1, 2])])
def test_the_most_probable_places_are_kept(monkeypatch, most, kept):
    monkeypatch.setattr(tested, "_MOST", most)
    by = locator(options(outliers=0.0), database([[-60.0], [-70.0], [-65.0]]))
    match = by.matcher(received(-60.0))
    assert sorted(match.reports.tolist()) == kept
    likelihood = np.exp([-0.0, -2.0, -0.5])[kept]
    np.testing.assert_allclose(weights(match)[kept], likelihood / likelihood.sum())
    assert match.mismatch == pytest.approx(-log(likelihood.sum()))


def test_the_position_of_a_posterior_is_its_geometric_median():
    by = locator(options(), database([[-60.0], [-61.0], [-62.0]]))
    weight = weights(by.matcher(received(-61.0)))

    def cost(at):
        return weight @ np.sqrt(np.sum((PLACES - at) ** 2, axis=1) + 1.0)

    best = minimize(cost, weight @ PLACES, method="Nelder-Mead", options={"xatol": 1e-6}).x
    found = by(received(-61.0))
    assert (found.east_m, found.north_m) == pytest.approx(tuple(best), abs=0.3)
    away_m = np.hypot(*(PLACES - [found.east_m, found.north_m]).T)
    assert found.spread_m == pytest.approx((weight @ away_m**2) ** 0.5)
    assert np.hypot(*(best - weight @ PLACES)) > 3


def test_neighbours_weigh_by_powers_of_their_distances():
    """Levels above -81 dBm over 81 dB: 21, 11 and 1 of them, less 20 of the report."""
    method = Neighbours(k=2, metric="manhattan", representation="positive", weight_power=2.0)
    by = locator(method, database([[-60.0], [-70.0], [-80.0]]))
    match = by.matcher(received(-61.0))
    distance = np.array([1 / 81, 9 / 81])
    weight = (distance + 1e-6) ** -2
    np.testing.assert_allclose(weights(match), [*weight / weight.sum(), 0.0])
    assert match.mismatch == pytest.approx(5 / 81)
    found = by(received(-61.0))
    assert (found.east_m, found.north_m) == pytest.approx((100 * match.weight.min(), 0.0))
    few = locator(Neighbours(k=7, weight_power=0.0), database([[-60.0], [-70.0]]))
    assert weights(few.matcher(received(-60.0)), 2).tolist() == [0.5, 0.5]
    # The nearest ones, in whatever order they are.
    far = make_reports(
        CRS, range(5), ["a"] * 5, [-72.0, -71.0, -70.0, -64.0, -62.0], count=5,
        places=np.zeros((5, 2)),
    )  # fmt: skip
    match = locator(method, far).matcher(received(-61.0))
    assert sorted(match.reports.tolist()) == [3, 4]
    # Equal reports: one part in a million of the scale is the least distance.
    near = locator(method, database([[-60.0], [-80.0]])).matcher(received(-60.0))
    assert near.weight.min() == pytest.approx((1e-6 / (20 / 81)) ** 2, rel=1e-3)


def test_the_highest_power_of_the_least_and_a_large_distance():
    """1e-6 to the power of -50 is 1e300: relative to it what is far away weighs nothing."""
    method = Neighbours(k=2, metric="manhattan", representation="positive", weight_power=50.0)
    strong, weak = [-60.0] * 8, [-120.0] * 8
    match = locator(method, database([strong, weak], "abcdefgh")).matcher(received(*strong))
    # 60 of 121 dB, eight times.
    assert match.mismatch == pytest.approx(0.5 * 8 * 60 / 121)
    assert weights(match, 2).tolist() == [1.0, 0.0]


def test_the_centroid_is_that_of_the_serving_cell_or_of_the_strongest():
    given = database([[-60.0, nan, -90.0], [nan, -70.0, nan], [-80.0, nan, nan]], serving=["d"] * 3)
    by = locator(Centroid(), given)
    # Cells by index: a at the first and the third place, b at the second, d nowhere.
    for levels, serving, at in (
        ((-60.0, -50.0), -1, (100.0, 0.0)),
        ((-50.0, -60.0), -1, (0.0, 100.0)),
        ((-50.0, -60.0), 1, (100.0, 0.0)),
        ((-60.0, -50.0), 0, (0.0, 100.0)),
        ((-60.0, -50.0), 3, (100.0, 0.0)),
        ((-50.0, -50.0), -1, (0.0, 100.0)),
    ):
        found = by(received(*levels, serving=serving))
        assert (found.east_m, found.north_m) == pytest.approx(at)
        assert found.mismatch == 0.0
    assert by(received(-50.0, -60.0)).spread_m == pytest.approx(100.0)
    # The mean of all places, not the one with the least distances.
    found = locator(Centroid(), database([[-60.0], [-70.0], [-80.0]]))(received(-50.0))
    assert (found.east_m, found.north_m) == pytest.approx((100 / 3, 200 / 3))


def test_a_database_without_reports_is_refused():
    with pytest.raises(InputError, match="database"):
        locator(Centroid(), database(np.empty((0, 2))))


def test_without_levels_all_cells_count_alike():
    given = make_reports(CRS, [0, 1], ["a", "b"], [nan, nan], count=2, places=PLACES[:2])
    by = locator(options(outliers=0.0, absence_per_db=0.05), given)
    # A level of 0 dBm is assumed of each, 30 dB above the floor: 1.5 nats for a, and 1.5 for b.
    likelihood = np.array([1.0, exp(-3.0)])
    match = by.matcher(received(nan))
    np.testing.assert_allclose(weights(match, 2), likelihood / likelihood.sum())


@pytest.mark.parametrize(("count", "kept"), [(4000, 4000), (4001, 4000)])
def test_no_more_than_four_thousand_places_are_kept(count, kept):
    given = make_reports(
        CRS, np.arange(count), ["a"] * count, np.full(count, -60.0), count=count,
        places=np.zeros((count, 2)),
    )  # fmt: skip
    assert len(locator(options(), given).matcher(received(-60.0)).reports) == kept
