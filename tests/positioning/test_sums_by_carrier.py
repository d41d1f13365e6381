"""Absence over predicted levels: sums of what carriers have, whatever carriers a report has."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from made_fingerprints import CRS

from mapfilter.positioning.fingerprints.likelihoods import LevelErrors, Likelihoods
from mapfilter.positioning.fingerprints.planned import Planned
from mapfilter.positioning.fingerprints.reports import make_reports

CARRIER = np.array([-1, 0, 0, 1, 2, 2, 3, 4])
NAMES = tuple(f"c{i}" for i in range(len(CARRIER)))
PLACES = 30
ERRORS = LevelErrors(4.0, 3.0, 0.2, -120.0)


def _levels():
    rng = np.random.default_rng(2)
    level = rng.uniform(-120, -60, (PLACES, len(NAMES)))
    level[rng.random(level.shape) < 0.3] = np.nan
    return level


def _likelihoods(level, carrier):
    place, cell = np.nonzero(np.isfinite(level))
    reports = make_reports(
        CRS,
        place,
        np.array(NAMES)[cell],
        level[place, cell],
        count=PLACES,
        places=np.zeros((PLACES, 2)),
    )
    assert reports.cell_ids == NAMES
    planned = None
    if carrier is not None:
        unknown = np.full(len(carrier), np.nan)
        planned = Planned(np.zeros((len(carrier), 2)), unknown, carrier, 0.0)
    return Likelihoods.at(replace(reports, predicted=True, planned=planned), ERRORS)


def _expected(level, asked, asked_dbm, carrier):
    """Return the loss by the cells that one of both lacks, cell by cell."""
    lost, least_dbm = np.zeros(PLACES), max(asked_dbm.min(), ERRORS.floor_dbm)
    for place, one in np.ndindex(level.shape):
        known_dbm = level[place, one]
        counts = carrier is None or carrier[one] < 0 or carrier[one] in carrier[asked]
        if one in asked and np.isnan(known_dbm):
            own_dbm = asked_dbm[asked.tolist().index(one)]
            lost[place] -= ERRORS.absence_per_db * (own_dbm - ERRORS.floor_dbm)
        elif one not in asked and counts and known_dbm > least_dbm:
            lost[place] -= ERRORS.absence_per_db * (known_dbm - least_dbm)
    return lost


@pytest.mark.parametrize("carrier", [CARRIER, None])
def test_every_set_of_carriers_has_its_sums_and_none_is_kept_by_itself(carrier):
    level, rng = _levels(), np.random.default_rng(3)
    likelihoods = _likelihoods(level, carrier)
    for count in range(1, 5):
        for cells in combinations(range(len(NAMES)), count):
            asked = np.array(cells, dtype=np.int32)
            asked_dbm = rng.uniform(-110, -70, count)
            found, _ = likelihoods.of(asked, asked_dbm)
            expected = _expected(level, asked, asked_dbm, carrier)
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    # A client that asks for all sets of carriers must not fill the memory with them.
    assert len(likelihoods._prepared) <= len(set(CARRIER.tolist()))
