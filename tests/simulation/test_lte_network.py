"""The hexagonal network by hand: distances, sectors, interference."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.propagation.tr38901 import hidden_loss_db, seen_loss_db
from mapfilter.simulation.lte_network import (
    LteRadio,
    hexagonal_sites,
    sector_levels_dbm,
    site_sinr_db,
    sites_along,
    turned,
)


@pytest.mark.parametrize(("rings", "count"), [(0, 1), (1, 7), (2, 19), (3, 37)])
def test_sites_stand_on_hexagons(rings, count):
    sites = hexagonal_sites(1500.0, rings)
    assert len(sites) == count
    away = np.hypot(*(sites[:, None] - sites).transpose(2, 0, 1))
    np.fill_diagonal(away, np.inf)
    if rings:
        np.testing.assert_allclose(away.min(axis=1), 1500.0)
        assert (away[0] < 1501).sum() == 6
        # Three sites meet at the middle of a triangle.
        corner = 1500 / np.sqrt(3) * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
        nearest = np.sort(np.hypot(*(sites - corner).T))
        np.testing.assert_allclose(nearest[:3], 1500 / np.sqrt(3))


def test_turning_keeps_distances():
    sites = hexagonal_sites(500.0, 1)
    moved = turned(sites, 17.0)
    np.testing.assert_allclose(np.hypot(*moved.T), np.hypot(*sites.T))
    angle = np.degrees(np.arctan2(moved[4, 1], moved[4, 0]) - np.arctan2(sites[4, 1], sites[4, 0]))
    assert angle % 360 == pytest.approx(17.0)


def test_levels_by_hand():
    radio = LteRadio()
    place, site = np.array([[500.0, 0.0]]), np.zeros((1, 2))
    args = (np.array([500.0]), 2000.0, 30.0, 1.5)
    for seen, loss in ((True, seen_loss_db("uma", *args)), (False, hidden_loss_db("uma", *args))):
        level = sector_levels_dbm(radio, site, [0.0, 120.0, 240.0], place, np.array([[seen]]), 2.5)
        assert level[0, 0, 0] == pytest.approx(43 + 14 - loss[0] + 2.5)
        np.testing.assert_allclose(level[0, 0, 1:], level[0, 0, 0] - 20.0)


def test_interference_of_all_others():
    # Three sites heard alike by their best sectors, the others 20 dB lower: -3 dB and a bit less.
    levels = np.full((1, 3, 3), -100.0)
    levels[..., 0] = -80.0
    sinr = site_sinr_db(levels, -200.0)
    np.testing.assert_allclose(sinr, -10 * np.log10(2 + 6 * 0.01))
    # One site without interference has the noise alone, and its own other sectors.
    alone = site_sinr_db(np.array([[[-80.0, -np.inf, -np.inf]]]), -90.0)
    assert alone[0, 0] == pytest.approx(10.0)


def test_near_a_station_others_are_hardly_heard():
    radio, sites = LteRadio(), hexagonal_sites(1500.0, 2)
    places = np.array([[200.0, 0.0], [650.0, 375.0], [750.0, 433.0]])
    level = sector_levels_dbm(
        radio, sites, [30.0, 150.0, 270.0], places, np.zeros((3, len(sites)), dtype=bool)
    )
    second = np.sort(site_sinr_db(level, radio.noise_dbm), axis=1)[:, -2]
    assert second[0] < -20 < second[1] < second[2] < 0
    assert radio.noise_dbm == pytest.approx(-94.0, abs=0.1)


def test_sites_share_what_is_near_the_receiver():
    along = np.arange(0.0, 60_000.0, 5.0)
    drawn = sites_along(along, 3, 20.0, 0.5, np.random.default_rng(14))
    found = np.corrcoef(drawn.T)
    np.testing.assert_allclose(found, np.where(np.eye(3), 1.0, 0.5), atol=0.06)
    np.testing.assert_allclose(drawn.std(axis=0), 1.0, atol=0.06)
    lag = np.mean(drawn[4:] * drawn[:-4])
    assert lag == pytest.approx(np.exp(-1.0), abs=0.05)


def test_what_is_no_network():
    for bad in ((0.0, 1), (np.nan, 1), (100.0, -1)):
        with pytest.raises(InputError, match="hexagonal"):
            hexagonal_sites(*bad)
    with pytest.raises(InputError, match="shared"):
        sites_along([0.0, 1.0], 2, 10.0, 1.5, np.random.default_rng(0))
    with pytest.raises(InputError, match="NaN"):
        site_sinr_db(np.full((1, 1, 3), np.nan), -90.0)
