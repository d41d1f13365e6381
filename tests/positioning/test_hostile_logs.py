"""Logs that the door lets in and that nobody sends: each filter locates them, or refuses."""

import numpy as np
import pandas as pd
import pytest
from cross_world import CRS, walk_tables

from mapfilter.api.located import locate
from mapfilter.errors import MapfilterError
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.tracks.log import make_log

SMALL = BayesFilter(max_particles=600, min_search_particles=300, min_particles=200)
STRANGE = {
    "step_m": (0.0, -1.0, 1e-9, 1e3, 1e6, -1e6, np.nan),
    "heading_rad": (np.nan, 6.28, -6.28, 0.0),
    "level_dbm": (-200.0, 0.0, np.nan, -70.0),
    "cell": ("W", "NW", "nobody", None, "W "),
    "role": ("serving", "neighbour"),
    "east_m": (531000.0, 1e8, 0.0),
    "north_m": (0.0, -1e8, 4555850.0),
    "var_east_m2": (0.0, 1e-12, 1e16, np.nan),
    "var_north_m2": (0.0, 1e-12, 1e16, np.nan),
    "difference_m": (2e5, -2e5, 0.0, np.nan),
    "sigma_m": (1e-3, 1e5, np.nan),
    "timing_advance": (0, 63, 3846),
}
FACTORS, SHIFTS_S = (1e-6, 0.1, 60.0, 1e4, 1e7), (-1e6, -30.0, 0.5, 1e3, 1e9)


def tables(rng):
    """A walk of some rows, with some further tables."""
    rows = int(rng.choice([1, 2, 5, 40, 90]))
    made = walk_tables()
    truth = made["truth"].iloc[: rows + 1]
    radio = made["radio"].iloc[:rows].assign(level_dbm=-70.0)
    other = radio.assign(role="neighbour", cell="E", level_dbm=-85.0)
    found = {"motion": made["motion"].iloc[:rows], "radio": pd.concat([radio, other])}
    if rng.random() < 0.4:
        variances = {"var_east_m2": 25.0, "var_north_m2": 25.0, "cov_east_north_m2": 0.0}
        found["gnss"] = truth.assign(**variances).iloc[:: int(rng.integers(1, 9))]
    if rng.random() < 0.3:
        rest = {"cell": "W", "reference": "E", "difference_m": 30.0, "sigma_m": 30.0}
        found["tdoa"] = truth[["time_s"]].assign(**rest, reference_sigma_m=20.0).iloc[::3]
    if rng.random() < 0.4:
        found["radio"] = found["radio"].assign(timing_advance=1)
    return {name: table.reset_index(drop=True) for name, table in found.items()}


def strange(rng):
    """The same with one to four changes, each of a table."""
    found = tables(rng)
    for _ in range(int(rng.integers(1, 5))):
        name = str(rng.choice(list(found)))
        found[name] = changed(found[name], rng)
    return found


def changed(table, rng):
    kind = int(rng.integers(9))
    if kind < 5 and len(table):
        column = str(rng.choice([c for c in table if c in STRANGE]))
        value = STRANGE[column][rng.integers(len(STRANGE[column]))]
        rows = rng.random(len(table)) < rng.choice([0.05, 0.5, 1.1])
        return table.assign(**{column: table[column].astype(object).mask(rows, value)})
    if kind == 5:
        return table.iloc[: int(rng.integers(len(table) + 1))]
    if kind == 6:
        return pd.concat([table, table])
    if kind == 7:
        return table.assign(time_s=table["time_s"] * rng.choice(FACTORS))
    return table.assign(time_s=table["time_s"] + rng.choice(SHIFTS_S))


def check(estimate):
    """Numbers of an estimate are those of positions, radii and shares."""
    assert (np.diff(estimate.time_s) > 0).all()
    located = np.isfinite(estimate.east_m)
    np.testing.assert_array_equal(located, np.isfinite(estimate.north_m))
    # A filter of candidates has a mean alone at times, but then no covariance at all.
    covariance_m2 = estimate.covariance_m2[located]
    none = np.isnan(covariance_m2).all(axis=(1, 2))
    covariance_m2, radii_m = covariance_m2[~none], estimate.radii_m[located]
    assert np.isfinite(covariance_m2).all()
    least_m2, most_m2 = np.linalg.eigvalsh(covariance_m2).reshape(-1, 2).T
    assert (least_m2 >= -1e-6 * most_m2).all()
    known = np.isfinite(radii_m).all(axis=1)
    assert (radii_m[known] >= 0).all()
    assert (np.diff(radii_m[known], axis=1) >= -1e-6).all()
    mass = estimate.mass_50m[~np.isnan(estimate.mass_50m)]
    assert ((mass > -1e-6) & (mass < 1 + 1e-6)).all()


@pytest.mark.parametrize(
    ("name", "seed", "count"),
    [("bayes", 0, 10), ("bayes", 1, 10), ("bayes", 2, 10), ("grid", 1, 4), ("candidate", 0, 10),
     ("candidate", 2, 10), ("ekf", 0, 5), ("ekf", 1, 5)],
)  # fmt: skip
def test_strange_logs_are_located_or_refused(name, seed, count, database):
    located = 0
    for number in range(count):
        try:
            given = strange(np.random.default_rng((seed, number)))
            log = make_log(CRS, start_utc_s=1.7e9, **given)
            found = locate(log, database, SMALL if name == "bayes" else name)
        except MapfilterError as error:
            assert str(error)  # noqa: PT017
            continue
        check(found.estimate)
        located += 1
    assert located
