"""A made floor with access points, surveyed on one day and visited on another."""

import numpy as np

from mapfilter.positioning.fingerprints.reports import make_reports

CRS = "EPSG:32635"
NAMES = tuple(f"02:00:00:00:00:{i:02x}" for i in range(12))
SIZE_M = 40.0
_WEAKEST_DBM = -95.0


def levels_at(places, rng, *, shared_db=0.0, noise_db=3.0):
    """Return levels (R, C) by a distance law, NaN below -95 dBm."""
    points = np.random.default_rng(5).uniform(0, SIZE_M, (len(NAMES), 2))
    distance = np.hypot(*(places[:, None] - points).transpose(2, 0, 1)) + 1
    level = -35 - 33 * np.log10(distance) + rng.normal(0, noise_db, distance.shape)
    level = level + shared_db * rng.standard_normal((len(places), 1))
    return np.where(level < _WEAKEST_DBM, np.nan, np.round(level))


def reports_at(places, level_dbm, *, names=NAMES, block=None, **more):
    """Return reports with those levels that are not NaN."""
    report, cell = np.nonzero(np.isfinite(level_dbm))
    ids = np.array(names)
    return make_reports(
        CRS,
        report,
        ids[cell],
        level_dbm[report, cell],
        count=len(level_dbm),
        places=places,
        block=block,
        **more,
    )


def survey(rng, count=300):
    """Return a database and the reports of another day."""
    known, true = rng.uniform(0, SIZE_M, (count, 2)), rng.uniform(0, SIZE_M, (80, 2))
    return (
        reports_at(known, levels_at(known, rng)),
        reports_at(true, levels_at(true, rng, shared_db=2.0)),
    )
