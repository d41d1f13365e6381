"""The error that is assumed of fixes that state none is noted."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf

CRS = "EPSG:32635"
SECONDS = 60


def log_with(variance_m2):
    time_s = np.arange(float(SECONDS))
    east_m = 385_000 + 1.4 * time_s
    fixes = pd.DataFrame({"time_s": time_s, "east_m": east_m, "north_m": 6_672_000.0})
    columns = {"var_east_m2": variance_m2, "var_north_m2": variance_m2, "cov_east_north_m2": 0.0}
    return mf.make_log(CRS, gnss=fixes.assign(**columns))


def said(log, filter_):
    return [note for note in mf.locate(log, filter=filter_).log.notes if "is assumed" in note]


@pytest.mark.parametrize(
    ("variance_m2", "count"),
    [
        (np.nan, "60 fixes"),
        (np.where(np.arange(SECONDS), 25.0, np.nan), "1 fix"),
        (np.where(np.arange(SECONDS) < 9, 0.0, 25.0), "9 fixes"),
    ],
)
def test_fixes_without_an_error_are_noted_with_what_is_assumed(variance_m2, count):
    (note,) = said(log_with(variance_m2), mf.KalmanFilter(fix_sd_m=7.0))
    assert note.startswith(f"gnss: {count} without an error: a standard deviation of 7 m east and")
    assert "(fix_sd_m of KalmanFilter;" in note


def test_what_is_assumed_is_what_the_filter_takes():
    """The radius of a first fix is that of a fix that states as much."""
    radii_m = [
        mf.locate(log_with(variance_m2), filter="ekf").estimate.radii_m[0]
        for variance_m2 in (np.nan, 10.0**2)
    ]
    assert "of 10 m" in said(log_with(np.nan), "ekf")[0]
    np.testing.assert_allclose(*radii_m)


def test_stated_errors_need_no_note():
    assert said(log_with(25.0), "ekf") == []
