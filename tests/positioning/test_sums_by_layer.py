"""Absence over predicted levels: sums of what layers have, whatever layers a report has."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from made_fingerprints import CRS

from mapfilter.positioning.fingerprints.likelihoods import LevelErrors, Likelihoods
from mapfilter.positioning.fingerprints.planned import Planned
from mapfilter.positioning.fingerprints.reports import make_reports

LAYER = np.array([5, 0, 0, 1, 2, 2, 3, 4])
NAMES = tuple(f"c{i}" for i in range(len(LAYER)))
PLACES = 30
ERRORS = LevelErrors(4.0, 3.0, 0.2, -120.0)


def _levels():
    rng = np.random.default_rng(2)
    level = rng.uniform(-120, -60, (PLACES, len(NAMES)))
    level[rng.random(level.shape) < 0.3] = np.nan
    return level


def _likelihoods(level, layer):
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
    if layer is not None:
        unknown = np.full(len(layer), np.nan)
        planned = Planned(np.zeros((len(layer), 2)), unknown, layer, 0.0)
    return Likelihoods.at(replace(reports, predicted=True, planned=planned), ERRORS)


def _expected(level, asked, asked_dbm, layer):
    """Return the loss by the cells that one of both lacks, cell by cell."""
    lost, least_dbm = np.zeros(PLACES), max(asked_dbm.min(), ERRORS.floor_dbm)
    for place, one in np.ndindex(level.shape):
        known_dbm = level[place, one]
        counts = layer is None or layer[one] in layer[asked]
        if one in asked and np.isnan(known_dbm):
            own_dbm = asked_dbm[asked.tolist().index(one)]
            lost[place] -= ERRORS.absence_per_db * (own_dbm - ERRORS.floor_dbm)
        elif one not in asked and counts and known_dbm > least_dbm:
            lost[place] -= ERRORS.absence_per_db * (known_dbm - least_dbm)
    return lost


@pytest.mark.parametrize("layer", [LAYER, None])
def test_every_set_of_layers_has_its_sums_and_none_is_kept_by_itself(layer):
    level, rng = _levels(), np.random.default_rng(3)
    likelihoods = _likelihoods(level, layer)
    for count in range(1, 5):
        for cells in combinations(range(len(NAMES)), count):
            asked = np.array(cells, dtype=np.int32)
            asked_dbm = rng.uniform(-110, -70, count)
            found, _ = likelihoods.of(asked, asked_dbm)
            expected = _expected(level, asked, asked_dbm, layer)
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    # A client that asks for all sets of layers must not fill the memory with them.
    assert len(likelihoods._prepared) <= len(set(LAYER.tolist()))


@pytest.mark.parametrize(
    "asked_dbm", [-75.2, -71.0, -70.8, -70.6, -70.0, -60.5, -60.0, -59.2, -40.0]
)
def test_what_is_weaker_than_a_report_is_no_evidence(asked_dbm):
    """At each fraction of a dB; a and b at one place, b alone at another."""
    reports = make_reports(
        CRS, [0, 0, 1], ["a", "b", "b"], [-60.6, -70.7, -65.0], count=2, places=np.zeros((2, 2))
    )
    found, _ = Likelihoods.at(replace(reports, predicted=True), ERRORS).of(
        np.array([0], dtype=np.int32), np.array([asked_dbm])
    )
    missed_db = [max(dbm - asked_dbm, 0.0) for dbm in (-70.7, -65.0)]
    # Where a itself is missing, it is by its own level above the floor.
    expected = -0.2 * np.array([missed_db[0], missed_db[1] + asked_dbm + 120.0])
    np.testing.assert_allclose(found, expected, atol=1e-9)
