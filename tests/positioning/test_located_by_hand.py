"""Tables and figures of located reports."""

from dataclasses import replace
from math import isnan, nan

import numpy as np
import pytest

from mapfilter.geodesy import unproject
from mapfilter.positioning.fingerprints.located import LocatedReports, figures_of
from mapfilter.positioning.fingerprints.options import Neighbours, method_name

CRS = "EPSG:32635"
EAST_M, NORTH_M = (
    np.array([500_000.0, nan, 400_000.0, nan, 500_100.0]),
    6_672_000.0 + np.arange(5.0),
)
ERROR_M = np.array([1.0, nan, 4.0, nan, 10.0])
RADII_M = np.array([[1.0, 2.0, 3.0], [nan] * 3, [3.0, 4.0, 5.0], [nan] * 3, [7.0, 8.0, 9.0]])
FOUND = LocatedReports(
    CRS, Neighbours(), np.arange(5.0), EAST_M, np.where(np.isnan(EAST_M), nan, NORTH_M), RADII_M,
    np.array([3, 0, 2, 0, 1]), np.array([0, 2, 1, 0, 4]), ("", "none", "", "far", ""), ERROR_M,
    validations=("one",),
)  # fmt: skip
"""Three of five have a position; radii are exceeded by the last one only."""


def test_a_row_for_each_report():
    table = FOUND.to_dataframe()
    assert table["time_s"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    for name, expected in (
        ("east_m", EAST_M), ("north_m", FOUND.north_m), ("radius_50_m", RADII_M[:, 0]),
        ("radius_67_m", RADII_M[:, 1]), ("radius_95_m", RADII_M[:, 2]), ("error_m", ERROR_M),
        ("known", FOUND.known), ("unknown", FOUND.unknown),
    ):  # fmt: skip
        np.testing.assert_array_equal(table[name], expected)
    assert table["reason"].tolist() == ["", "none", "", "far", ""]
    for k in (0, 2, 4):
        lon, lat = unproject(CRS, float(EAST_M[k]), float(NORTH_M[k]))
        assert (table["lon_deg"][k], table["lat_deg"][k]) == (
            pytest.approx(lon),
            pytest.approx(lat),
        )
    # The zone's meridian is at 27 degrees, and a tenth of a million metres are 1.8 there.
    assert table["lon_deg"][0] == pytest.approx(27.0)
    assert table["lon_deg"][2] == pytest.approx(25.2, abs=0.05)
    assert table.loc[[1, 3], ["lon_deg", "lat_deg"]].isna().all(axis=None)


def test_figures_are_those_of_reports_whose_error_is_known():
    found = figures_of(FOUND)
    name = method_name(Neighbours())
    assert list(found.items())[:5] == [
        ("method", name), ("reports", 5), ("located", 3), ("not_located", {"far": 1, "none": 1}),
        ("unknown_transmitters", 7),
    ]  # fmt: skip
    assert (found["scored"], found["error_mean_m"], found["error_median_m"]) == (3, 5.0, 4.0)
    # Of three, two thirds lie 1.34 errors from the first one, 95 in a hundred 1.9.
    assert found["error_67_m"] == pytest.approx(4.0 + 0.34 * 6.0)
    assert found["error_95_m"] == pytest.approx(4.0 + 0.9 * 6.0)
    # The first and the third are within radii of 1 and 4 m; 3 m are less than the third's 4.
    shares = [found[f"within_{level}"] for level in (50, 67, 95)]
    assert shares == pytest.approx([1 / 3, 2 / 3, 2 / 3])
    assert found["validations"] == ("one",)
    assert repr(FOUND) == (f"LocatedReports by {name}: 3 of 5, 5.0 m off on average, median 4.0 m")


@pytest.mark.parametrize("missing", [0, slice(None)])
def test_radii_that_are_not_calibrated_have_no_shares(missing):
    radii_m = RADII_M.copy()
    radii_m[missing, 1] = nan
    found = figures_of(replace(FOUND, radii_m=radii_m))
    assert all(isnan(found[f"within_{level}"]) for level in (50, 67, 95))
    assert found["scored"] == 3


def test_without_true_positions_there_is_no_score():
    unknown = replace(FOUND, error_m=np.full(5, nan))
    found = figures_of(unknown)
    assert list(found) == [
        "method", "reports", "located", "not_located", "unknown_transmitters", "validations",
    ]  # fmt: skip
    assert repr(unknown).endswith(": 3 of 5")
