"""A raster's own place explains it best; another explains it worse."""

import numpy as np
import pytest
from test_radio_lobes import LATTICE, SITE, sector

from mapfilter.check.place_fits import MeanLevels, in_squares, place_fits, places_to_try
from mapfilter.check.samples import RasterSample


def test_squares_are_means_at_their_middles():
    values = np.full((80, 100), -80, np.float32)
    values[:3, :3] = np.arange(9).reshape(3, 3)
    values[77:, :] = np.nan
    squares = in_squares(RasterSample("A", LATTICE, values, ""))
    assert squares is not None
    assert squares.side_m == 60.0
    assert squares.level_db[0] == 4.0
    assert (squares.east_m[0], squares.north_m[0]) == (499_030.0, 6_669_970.0)
    # 26 x 33 whole squares; the last of them keep one row of data.
    assert squares.level_db.size == 26 * 33


def test_too_little_to_judge_by():
    assert in_squares(RasterSample("A", LATTICE, np.full((80, 100), -80, np.float32), "")) is None
    few = np.full((80, 100), np.nan, np.float32)
    few[:20, :20] = sector(20).values[:20, :20]
    assert in_squares(RasterSample("A", LATTICE, few, "")) is None


@pytest.mark.parametrize("azimuth_deg", [None, 0, 100, 230])
def test_the_own_place_explains_best(azimuth_deg):
    sample = sector(azimuth_deg)
    squares = in_squares(sample)
    assert squares is not None
    own, beside = place_fits(squares, np.array([SITE, (SITE[0] + 500, SITE[1] - 400)]))
    assert own > 0.95
    assert beside < own - 0.1
    tried = places_to_try(sample)
    fits = place_fits(squares, tried)
    place = tried[fits.argmax()]
    assert fits.max() <= own + 0.01
    assert np.hypot(place[0] - SITE[0], place[1] - SITE[1]) < 150


def test_levels_that_grow_with_distance_are_not_explained_by_it():
    sample = sector(None, noise_db=0.0)
    turned = RasterSample("A", LATTICE, -sample.values, "")
    squares = in_squares(turned)
    assert squares is not None
    assert place_fits(squares, np.array([SITE]))[0] < 0.5


def least_squares(squares, place):
    """The definition for one place, without products of causes."""
    east, north = squares.east_m - place[0], squares.north_m - place[1]
    distance_m, direction = np.hypot(east, north), np.arctan2(north, east)
    near = np.minimum(distance_m / squares.side_m, 1.0)
    columns = [np.log10(np.maximum(distance_m, squares.side_m / 2))]
    for order in (1, 2):
        columns += [near * np.cos(order * direction), near * np.sin(order * direction)]
    causes = np.column_stack(columns)
    causes -= causes.mean(axis=0)
    level = squares.level_db - squares.level_db.mean()
    factors = np.linalg.lstsq(causes, level, rcond=None)[0]
    if factors[0] > 0:
        causes = causes[:, 1:]
        factors = np.linalg.lstsq(causes, level, rcond=None)[0]
    return np.linalg.norm(causes @ factors) / np.linalg.norm(level)


@pytest.mark.parametrize("sign", [1, -1])
def test_many_places_fit_as_each_by_least_squares(sign):
    rng = np.random.default_rng(3)
    row, col = np.divmod(rng.permutation(1600)[:900], 40)
    east, north = 20.0 * col, 20.0 * row
    away = np.hypot(east - 300, north - 500)
    level = -60 - sign * 30 * np.log10(away + 5) + 0.01 * east + rng.normal(0, 6, 900)
    squares = MeanLevels(east, north, level, 20.0)
    # More places than are fitted at once; one in the middle of a square.
    places = np.vstack([rng.uniform(-200, 1000, (600, 2)), [east[0], north[0]]])
    expected = [least_squares(squares, place) for place in places]
    np.testing.assert_allclose(place_fits(squares, places), expected, atol=1e-9)


def test_squares_in_a_row_do_not_tell_all_causes_apart():
    along = 10.0 * np.arange(80)
    level = -60 - 20 * np.log10(along + 30) + 0.3 * np.random.default_rng(1).standard_normal(80)
    squares = MeanLevels(along, np.zeros(80), level, 10.0)
    places = np.array([[-30.0, 0.0], [400.0, 0.0]])
    expected = [least_squares(squares, place) for place in places]
    np.testing.assert_allclose(place_fits(squares, places), expected, atol=1e-6)
