"""Places that have no UTM zone are refused with the likely mistake."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.geodesy import unproject, utm_crs


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ((60.17, 124.94), r"found 124.94, 60.17 \(likely: longitude and latitude swapped\)$"),
        ((385000.0, 6672000.0), r"found 6.672e\+06, 385000 \(likely: metres given for degrees\)$"),
        ((np.nan, 60.0), r"found 60, nan$"),
        ((24.9, float("nan")), r"found nan, 24.9$"),
        (("24.9", 60.2), r"expected two numbers in degrees, found 60.2, '24.9'$"),
        (([24.9], 60.2), r"expected two numbers in degrees, found 60.2, \[24.9\]$"),
        ((np.array([24.9]), 60.2), r"expected two numbers in degrees, found 60.2, array"),
    ],
)
def test_what_is_no_place_in_degrees(place, message):
    with pytest.raises(InputError, match=rf"^latitude, longitude: .*{message}"):
        utm_crs(*place)


def test_numbers_of_numpy_are_places():
    assert utm_crs(np.float32(24.9), np.int64(60)) == "EPSG:32635"
    assert utm_crs(*unproject("EPSG:32635", 500_000.0, 6_700_000.0)) == "EPSG:32635"
