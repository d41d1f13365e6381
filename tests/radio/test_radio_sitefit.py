"""A raster's own place explains it best; another explains it worse."""

import numpy as np
import pytest
from test_radio_lobes import LATTICE, SITE, sector

from mapfilter.check.raster_checks import RasterSample
from mapfilter.check.site_checks import best_place, in_squares, place_fit


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
    own = place_fit(squares, *SITE)
    assert own > 0.95
    assert place_fit(squares, SITE[0] + 500, SITE[1] - 400) < own - 0.1
    best, place = best_place(squares, sample)
    assert best <= own + 0.01
    assert np.hypot(place[0] - SITE[0], place[1] - SITE[1]) < 150


def test_levels_that_grow_with_distance_are_not_explained_by_it():
    sample = sector(None, noise_db=0.0)
    turned = RasterSample("A", LATTICE, -sample.values, "")
    squares = in_squares(turned)
    assert squares is not None
    assert place_fit(squares, *SITE) < 0.5
