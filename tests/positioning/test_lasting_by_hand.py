"""Sums over pairs of errors, and the lasting part that is found in them, by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_fingerprints import reports_at

from mapfilter.positioning.fingerprints.lasting import _lag_sums, fit_lasting, lasting_error
from mapfilter.positioning.fingerprints.options import Neighbours

TIMES_S = np.geomspace(2.0, 200.0, 60)


def test_products_of_errors_stand_in_bins_of_two_seconds():
    """Of pairs of one log up to a minute apart: half of the east's and the north's products."""
    log = np.array([7, 7, 3, 7, 7, 7, 7])
    time_s = np.array([4.0, 0.0, 1.0, 1.5, 4.0, 61.5, 63.9])
    off_m = np.array([[3.0, 1.0], [2.0, 0.0], [99.0, 99.0], [4.0, -2.0], [5.0, 7.0], [1.0, 1.0],
                      [-8.0, 2.0]])  # fmt: skip
    found = _lag_sums(log, time_s, off_m)
    products, counts, lags = np.zeros(30), np.zeros(30, int), np.zeros(30)
    for lag_s, product in (
        (1.5, 2 * 4), (4.0, 2 * 3), (4.0, 2 * 5), (2.5, 4 * 3 - 2), (2.5, 4 * 5 - 14),
        (57.5, 3 + 1), (57.5, 5 + 7), (59.9, -8 * 3 + 2), (59.9, -8 * 5 + 14), (2.4, -8 + 2),
    ):  # fmt: skip
        at = int(lag_s // 2)
        products[at] += product / 2
        counts[at] += 1
        lags[at] += lag_s
    # Two errors of one time tell nothing, and what is a minute apart is no longer compared.
    np.testing.assert_allclose(found.products, products)
    np.testing.assert_array_equal(found.counts, counts)
    np.testing.assert_allclose(found.lags, lags)


def pairs(lags_s, products, counts):
    """Logs of two errors each, so many with each lag, whose products are as given."""
    lag_s, product = np.repeat(lags_s, counts), np.repeat(products, counts)
    size = len(lag_s)
    time_s = np.column_stack([np.full(size, 5.0), 5.0 + lag_s]).ravel()
    off_m = np.ones((2 * size, 2))
    off_m[1::2] = product[:, None]
    return np.repeat(np.arange(size), 2), time_s, off_m


LAGS_S = np.array([1.0, 3.5, 6.0, 9.0, 21.0])


@pytest.mark.parametrize("k", [0, 1, 30, 59])
def test_an_exponential_is_found_exactly(k):
    """Its time may be each of sixty from 2 to 200 s."""
    given = pairs(LAGS_S, 7.0**2 * np.exp(-LAGS_S / TIMES_S[k]), 40)
    assert fit_lasting(*given) == pytest.approx((7.0, TIMES_S[k]))


def test_many_pairs_count_more_than_few():
    """Against least squares for each of the times, by weights."""
    products, counts = np.array([30.0, 17.0, 25.0, 8.0, 6.0]), np.array([31, 90, 40, 300, 60])
    least = []
    for time_s in TIMES_S:
        shape, root = np.exp(-LAGS_S / time_s), np.sqrt(counts)
        (square,), misfit, *_ = np.linalg.lstsq((root * shape)[:, None], root * products)
        least.append((float(misfit[0]), float(np.sqrt(square)), time_s))
    found = fit_lasting(*pairs(LAGS_S, products, counts))
    assert found == pytest.approx(min(least)[1:])
    assert 2.0 < found.memory_s < 200.0


def test_a_bin_needs_thirty_pairs_and_a_fit_four_bins():
    products = 9.0 * np.exp(-LAGS_S / TIMES_S[20])
    few = pairs(LAGS_S, products, [30, 30, 30, 29, 30])
    assert fit_lasting(*few) == pytest.approx((3.0, TIMES_S[20]))
    assert fit_lasting(*pairs(LAGS_S, products, [30, 30, 30, 29, 29])) is None
    # What is left out tells nothing, whatever it says.
    products[3] = 500.0
    assert fit_lasting(*pairs(LAGS_S, products, [30, 30, 30, 29, 30])) == pytest.approx(
        (3.0, TIMES_S[20])
    )


def test_errors_to_changing_sides_do_not_last():
    assert fit_lasting(*pairs(LAGS_S, np.full(5, -4.0), 40)).sd_m == 0.0


def survey(log, off_m=3.0, count=60):
    """A way of a log, with levels that tell its places; a second log says that it is 3 m east."""
    along_m = np.arange(float(count))
    level_dbm = np.stack([-40.0 - along_m, -100.0 + along_m, -60.0 - 0.3 * along_m], axis=1)
    places = np.column_stack([off_m * log + 0.0 * along_m, along_m])
    return places, level_dbm, np.full(count, log), along_m


def database(logs=(0, 1)):
    places, level_dbm, block, time_s = (
        np.concatenate(parts) for parts in zip(*(survey(log) for log in logs), strict=True)
    )
    return reports_at(places, level_dbm, names=("a", "b", "c"), block=block, time_s=time_s)


def found_in(reports):
    return lasting_error(SimpleNamespace(database=reports, method=Neighbours(k=1)))


def test_errors_that_stay_last_for_the_longest_time():
    """3 m to the east, or to the west, and none to the north: 4.5 m² along an axis."""
    found = found_in(database())
    assert found.memory_s == TIMES_S[-1]
    assert found.sd_m == pytest.approx(4.5**0.5, rel=0.1)


def test_without_two_logs_of_measured_reports_nothing_is_found():
    assert found_in(database((0,))) is None
    assert found_in(replace(database(), predicted=True)) is None


def test_logs_that_hear_nothing_of_one_another_tell_nothing():
    """No report of either is located by the other."""
    places, level_dbm, block, time_s = (
        np.concatenate(parts) for parts in zip(survey(0), survey(1), strict=True)
    )
    heard = np.full((120, 6), np.nan)
    heard[:60, :3], heard[60:, 3:] = level_dbm[:60], level_dbm[60:]
    assert (
        found_in(reports_at(places, heard, names=tuple("abcdef"), block=block, time_s=time_s))
        is None
    )
