"""Distances and likelihoods against sklearn and dense formulas that share no code with them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_fingerprints import CRS, reports_at
from scipy.stats import multivariate_normal
from sklearn.metrics import pairwise_distances
from sklearn.neighbors import NearestNeighbors

from mapfilter.positioning.fingerprints.likelihoods import LevelErrors, Likelihoods, _Excess
from mapfilter.positioning.fingerprints.matches import Received, located_once, locator
from mapfilter.positioning.fingerprints.matching import Distances, Scale
from mapfilter.positioning.fingerprints.options import Centroid, Neighbours, Probabilistic
from mapfilter.positioning.fingerprints.reports import make_reports

SKLEARN = {"sorensen": "braycurtis", "euclidean": "euclidean", "manhattan": "manhattan"}


def made(seed, count=25, cells=8, missing=0.5):
    rng = np.random.default_rng(seed)
    level = np.round(rng.uniform(-95, -40, (count, cells)))
    level[rng.random(level.shape) < missing] = np.nan
    level[np.isnan(level).all(axis=1), 0] = -80.0
    names = tuple(f"c{i}" for i in range(cells))
    return rng.uniform(0, 100, (count, 2)), level, names


def dense(level_dbm, representation, floor_dbm, exponent):
    """As the formulas of Torres-Sospedra et al. (2015) state them, for whole tables."""
    positive = np.where(np.isnan(level_dbm), 0.0, level_dbm - floor_dbm)
    if representation == "exponential":
        return np.exp(positive / 24) / np.exp(-floor_dbm / 24)
    power = exponent if representation == "powed" else 1.0
    return positive**power / (-floor_dbm) ** power


@pytest.mark.parametrize("metric", SKLEARN)
@pytest.mark.parametrize("representation", ["positive", "exponential", "powed"])
@settings(max_examples=20)
@given(seed=st.integers(0, 10_000))
def test_distances_are_those_of_sklearn(metric, representation, seed):
    places, level, names = made(seed)
    reports = reports_at(places, level, names=names).compact()
    used = [names.index(name) for name in reports.cell_ids]
    floor_dbm = np.nanmin(level) - 1
    scale = Scale(representation, floor_dbm, 1.7)
    found = Distances.to(reports, metric, scale)
    own = np.array([found.of(*reports.readings(i)) for i in range(len(reports))])
    table = dense(level[:, used], representation, floor_dbm, 1.7)
    expected = pairwise_distances(table, metric=SKLEARN[metric])
    np.testing.assert_allclose(own, expected, atol=2e-7)


def test_what_is_weaker_than_the_database_is_received_by_half_a_db():
    """Of 100 dB between the floor and 0 dBm."""
    weak_dbm = np.array([-130.0, -100.0, -99.8, -99.5, -99.0, 0.0])
    above = np.array([0.005, 0.005, 0.005, 0.005, 0.01, 1.0])
    np.testing.assert_allclose(Scale("positive", -100.0, 1.7)(weak_dbm), above)
    np.testing.assert_allclose(Scale("powed", -100.0, 1.7)(weak_dbm), above**1.7)
    exponential = Scale("exponential", -100.0, 1.7)
    expected = np.exp((100 * above - 100) / 24) - np.exp(-100 / 24)
    np.testing.assert_allclose(exponential(weak_dbm), expected)
    assert exponential.absent == pytest.approx(np.exp(-100 / 24))
    # A floor above 0 dBm has a span of 1 dB.
    np.testing.assert_allclose(Scale("positive", 5.0, 1.0)(np.array([7.0])), [2.0])


@pytest.mark.parametrize("k", [1, 4, 25, 99])
def test_a_position_is_the_weighted_mean_of_sklearns_neighbours(k):
    places, level, names = made(3)
    reports = reports_at(places, level, names=names).placed()
    _, queries, _ = made(4, count=10)
    asked = reports_at(places[:10], queries, names=names).named_as(reports.cell_ids)[0]
    method = Neighbours(k=k, metric="manhattan", representation="positive", weight_power=2.0)
    by = locator(method, reports)
    floor_dbm = np.nanmin(level) - 1
    columns = [names.index(name) for name in reports.cell_ids]
    table = dense(level[:, columns], "positive", floor_dbm, 1)
    received = queries[:, columns]
    weaker = np.where(received <= floor_dbm, floor_dbm + 0.5, received)
    asked_table = dense(weaker, "positive", floor_dbm, 1)
    search = NearestNeighbors(metric="manhattan", algorithm="brute").fit(table)
    distance, index = search.kneighbors(asked_table, n_neighbors=min(k, len(table)))
    for i in range(10):
        cell, level_dbm = asked.readings(i)
        found = by(Received(cell, level_dbm, -1, np.nan))
        weight = 1 / (distance[i] + 1e-6) ** 2
        mean = weight @ places[index[i]] / weight.sum()
        np.testing.assert_allclose((found.east_m, found.north_m), mean, rtol=1e-9)


def brute_force_log_likelihood(known, asked, errors, sd_db, least_db):
    """Return the two parts by dictionaries and a multivariate normal distribution."""
    floor = errors.floor_dbm
    alone = set(known) ^ set(asked)
    lost = -sum(
        errors.absence_per_db * max((known | asked)[name] - floor, 0.0) for name in sorted(alone)
    )
    both = sorted(set(known) & set(asked))
    apart = np.array([asked[name] - known[name] for name in both])
    if not both:
        return lost, 0.0
    variance = errors.level_db**2 + np.array([sd_db[name] ** 2 for name in both])
    covariance = np.diag(variance) + errors.shared_db**2
    normal = multivariate_normal(np.zeros(len(both)), covariance).logpdf(apart)
    return lost, normal + len(both) * np.log(np.sqrt(2 * np.pi) * least_db)


@settings(max_examples=20)
@given(
    seed=st.integers(0, 10_000),
    level_db=st.floats(0.5, 12),
    shared_db=st.floats(0, 12),
    absence=st.floats(0.01, 1),
)
def test_likelihoods_are_those_of_a_multivariate_normal(seed, level_db, shared_db, absence):
    places, level, names = made(seed, count=6, cells=5)
    rng = np.random.default_rng(seed)
    sd_db = rng.uniform(0, 6, level.shape)
    report, cell = np.nonzero(np.isfinite(level))
    reports = reports_at(places, level, names=names, sd_db=sd_db[report, cell])
    errors = LevelErrors(level_db, shared_db, absence, float(np.nanmin(level)) - 1)
    least_db = np.hypot(level_db, sd_db[report, cell].min())
    likelihoods = Likelihoods.at(reports, errors)
    asked, dbm = reports.readings(0)
    query = {reports.cell_ids[c]: value for c, value in zip(asked, dbm, strict=True)}
    lost, normal = likelihoods.of(asked, dbm)
    for i in range(len(reports)):
        own, values = reports.readings(i)
        known = {reports.cell_ids[c]: v for c, v in zip(own, values, strict=True)}
        sd = {name: sd_db[i, names.index(name)] for name in known}
        expected = brute_force_log_likelihood(known, query, errors, sd, least_db)
        np.testing.assert_allclose((lost[i], normal[i]), expected, rtol=1e-7, atol=1e-7)


def test_an_offset_that_all_levels_share_costs_less_than_independent_errors():
    places = np.array([[0.0, 0.0], [50.0, 0.0]])
    level = np.array([[-60.0, -70.0, -80.0], [-60.0, -70.0, -80.0]])
    level[1] += [9.0, -9.0, 9.0]
    reports = reports_at(places, level, names=("a", "b", "c"))
    errors = LevelErrors(4.0, 8.0, 0.2, -95.0)
    _, found = Likelihoods.at(reports, errors).of(np.arange(3, dtype=np.int32), level[0] + 9.0)
    assert found[0] > found[1] + 3


def test_a_missing_level_counts_as_received():
    places, level = np.array([[0.0, 0.0], [50.0, 0.0]]), np.array([[-60.0, -70], [-60, np.nan]])
    reports = reports_at(places, level, names=("a", "b"))
    errors = LevelErrors(4.0, 3.0, 0.2, -95.0)
    likelihoods = Likelihoods.at(reports, errors)
    both = np.arange(2, dtype=np.int32)
    lost, _ = likelihoods.of(both, np.array([-60.0, np.nan]))
    assert lost[0] == 0
    # As strong as the cell usually is.
    assert lost[1] == pytest.approx(-0.2 * 25)
    _, levels = likelihoods.of(both, np.array([-60.0, np.nan]))
    assert levels[0] == levels[1]


@pytest.mark.parametrize("method", [Neighbours(k=3), Probabilistic(), Centroid()])
@settings(max_examples=20)
@given(seed=st.integers(0, 1000))
def test_the_order_of_readings_does_not_matter(method, seed):
    places, level, names = made(seed)
    reports = reports_at(places, level, names=names).placed()
    by = locator(method, reports)
    cell, dbm = reports.readings(seed % len(reports))
    first = by(Received(cell, dbm, -1, np.nan))
    again = by(Received(cell[::-1], dbm[::-1], -1, np.nan))
    np.testing.assert_allclose(first, again, rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("method", [Neighbours(k=3), Probabilistic(), Centroid()])
@settings(max_examples=20)
@given(seed=st.integers(0, 1000))
def test_a_position_lies_among_the_places_of_the_database(method, seed):
    places, level, names = made(seed)
    reports = reports_at(places, level, names=names).placed()
    found = locator(method, reports)(Received(*reports.readings(0), -1, np.nan))
    at = np.array([found.east_m, found.north_m])
    assert (at >= places.min(axis=0) - 1e-6).all()
    assert (at <= places.max(axis=0) + 1e-6).all()
    assert found.spread_m >= 0


def test_the_timing_advance_counts_for_the_same_serving_cell_only():
    places = np.array([[0.0, 0.0], [100.0, 0.0], [200.0, 0.0]])
    level = np.array([[-80.0, np.nan], [-80.0, np.nan], [np.nan, -80.0]])
    reports = reports_at(
        places, level, names=("a", "b"), serving=["a", "a", "b"], timing_advance=[1, 4, 1]
    )
    by = locator(Probabilistic(), reports)
    cell, dbm = np.array([0], dtype=np.int32), np.array([-80.0])
    assert by(Received(cell, dbm, 0, 4.0)).east_m == pytest.approx(100, abs=2)
    assert by(Received(cell, dbm, 0, 1.0)).east_m == pytest.approx(0, abs=2)
    unknown = by(Received(cell, dbm, 0, np.nan))
    assert unknown.spread_m > 40


def test_a_mismatch_grows_with_strange_levels():
    places, level, names = made(1, missing=0.0)
    reports = reports_at(places, level, names=names).placed()
    cell, dbm = reports.readings(0)
    strange = np.where(np.arange(len(dbm)) % 2, -40.0, -95.0)
    for method in (Neighbours(k=1), Probabilistic()):
        by = locator(method, reports)
        usual = by(Received(cell, dbm, -1, np.nan)).mismatch
        assert by(Received(cell, strange, -1, np.nan)).mismatch > usual


@given(
    st.lists(
        st.tuples(
            st.integers(0, 6),
            st.one_of(st.integers(-110, -40), st.floats(-110, -40, allow_nan=False)),
        ),
        min_size=1,
        max_size=60,
    ),
    st.one_of(st.integers(-115, -35), st.floats(-115, -35, allow_nan=False)),
)
def test_sums_above_a_threshold_are_those_of_all_levels(readings, threshold_dbm):
    report, level_dbm = (np.array(column) for column in zip(*readings, strict=True))
    found = _Excess.of(7, report, level_dbm.astype(float)).above(threshold_dbm)
    expected = [
        sum(max(level - threshold_dbm, 0.0) for at, level in readings if at == one)
        for one in range(7)
    ]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("censored", "off_db"), [(1, -12.0), (-1, 12.0)])
def test_a_bound_is_no_evidence_where_it_is_kept_and_counts_where_it_is_not(censored, off_db):
    """Places beyond the bound are alike; one before it loses by what it is off."""
    dbm = -70.0
    reports = make_reports(
        CRS, [0, 1, 2], ["a"] * 3, [dbm - off_db, dbm - 3 * off_db, dbm + off_db], count=3
    )
    by = Likelihoods.at(reports, LevelErrors(4.0, 0.0, 0.0, -120.0))
    _, levels = by.of(np.array([0]), np.array([dbm]), np.array([censored], np.int8))
    assert levels[0] == levels[1] == 0.0
    assert levels[2] == pytest.approx(-0.5 * (off_db / 4.0) ** 2)


def test_equal_reports_are_located_once():
    places, level, names = made(4)
    reports = reports_at(places, level, names=names).placed()
    plain, asked = locator(Probabilistic(), reports), []

    def counted(received):
        asked.append(received)
        return plain(received)

    once = located_once(counted)
    cell, dbm = reports.readings(0)
    unknown = np.where(np.arange(len(dbm)) == 0, np.nan, dbm)
    different = [
        Received(cell, dbm, -1, np.nan),
        Received(cell, dbm, int(cell[0]), np.nan),
        Received(cell, dbm, int(cell[0]), 1.0),
        Received(cell, dbm + 1.0, -1, np.nan),
        Received(cell, unknown, -1, np.nan),
        Received(*reports.readings(1), -1, np.nan),
        Received(cell, dbm, -1, np.nan, np.ones(len(cell), np.int8)),
        Received(cell, dbm, -1, np.nan, -np.ones(len(cell), np.int8)),
    ]
    for _ in range(2):
        for one in different:
            copy = one._replace(cell=one.cell.copy(), level_dbm=one.level_dbm.copy())
            assert once(copy) == plain(one)
    assert len(asked) == len(different)


@pytest.mark.parametrize("seed", range(4))
def test_weights_are_those_of_all_places_above_a_ten_thousandth_of_the_largest(seed):
    """Places that cannot have so much are not looked at more closely."""
    method = Probabilistic()
    places, level_dbm, names = made(seed, count=300)
    database = reports_at(places, level_dbm, names=names)
    received = Received(np.array([0, 2, 4], np.int32), np.array([-71.0, -64.0, -90.0]), -1, np.nan)
    floor_dbm = float(np.nanmin(database.level_dbm)) - 1.0
    errors = LevelErrors(method.level_db, method.shared_db, method.absence_per_db, floor_dbm)
    cells, levels = Likelihoods.at(database, errors).of(received.cell, received.level_dbm)
    effective = min(3, method.effective_readings)
    share, inlier = effective / 3, np.log(1 - method.outliers)
    outlier = np.log(method.outliers) - effective / 2
    log_weight = share * cells + np.logaddexp(inlier + share * levels, outlier)
    expected = np.exp(log_weight - log_weight.max())
    kept = expected > 1e-4
    assert 1 < kept.sum() < 300
    found = locator(method, database).matcher(received)
    assert found.reports.tolist() == np.flatnonzero(kept).tolist()
    assert found.weight == pytest.approx(expected[kept] / expected[kept].sum(), rel=1e-12)
    total = float(log_weight.max() + np.log(expected[kept].sum()))
    assert found.mismatch == pytest.approx(-total, rel=1e-12)
