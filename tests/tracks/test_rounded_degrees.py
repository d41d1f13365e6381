"""Positions whose degrees have few decimals, by hand."""

from math import hypot, nan

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.checks.rounded_degrees import rounded_notes, rounding_m, with_rounding

STEP_M = 111.195
"""A thousandth of a degree of latitude."""
RADIUS_M = 1.515 * STEP_M / 12**0.5
"""Holds 68 % of a Gaussian as wide as rounding is."""


def rows(count=10, decimals=3, **more):
    degrees = 60 + np.arange(count) / 10**decimals
    return pd.DataFrame({"lat_deg": degrees, "lon_deg": 25.0, **more})


@pytest.mark.parametrize(
    ("decimals", "step_m"), [(0, 1000 * STEP_M), (1, 100 * STEP_M), (3, STEP_M), (4, 0.0)]
)
def test_the_step_of_positions(decimals, step_m):
    assert rounding_m(rows(decimals=decimals)) == pytest.approx(step_m, rel=1e-4)
    # Of either axis.
    turned = rows(decimals=decimals).rename(columns={"lat_deg": "lon_deg", "lon_deg": "lat_deg"})
    assert rounding_m(turned) == pytest.approx(step_m, rel=1e-4)


def test_ten_positions_that_differ_show_it():
    assert rounding_m(rows(9)) == 0.0
    assert rounding_m(rows().assign(lat_deg=60.123)) == 0.0
    assert rounding_m(pd.DataFrame({"east_m": np.arange(10.0), "north_m": 5.0})) == 0.0
    assert rounding_m(rows().assign(lon_deg=25.0 + 1.5e-9)) == 0.0
    assert rounding_m(rows().assign(lon_deg=25.0 + 5e-10)) > 0.0


@pytest.mark.parametrize("stated", [True, False])
def test_the_accuracy_holds_the_error_of_rounding(stated):
    given = [nan, 30.0, *[0.0] * 8] if stated else [0.0] * 10
    before = rows(accuracy_m=given) if stated else rows()
    found, note = with_rounding(before, "log.csv")
    expected = [hypot(0 if one != one else one, RADIUS_M) for one in given]
    assert found["accuracy_m"].tolist() == pytest.approx(expected, rel=1e-6)
    assert note == "log.csv: degrees of 3 decimals, in steps of 111 m: errors of ± 32 m"
    same, note = with_rounding(rows(decimals=4))
    assert (list(same), note) == (["lat_deg", "lon_deg"], "")


def test_notes_on_them_are_found_again():
    _, note = with_rounding(rows(decimals=1))
    assert note.startswith("positions: degrees of 1 decimal, in steps of 11120 m")
    others = ("a.csv: degrees of 3 kinds", "errors of ± 5 m")
    assert rounded_notes([others[0], note, others[1]]) == (note,)
