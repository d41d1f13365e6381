"""What an estimate holds of a filter's evidence: as a table, and in its file."""

from dataclasses import fields

import numpy as np
import pytest

from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate, TrackEvidence
from mapfilter.positioning.estimate_store import read_estimate, write_estimate
from mapfilter.positioning.step_output import Fix

NAMES = [one.name for one in fields(TrackEvidence)]


def estimate(evidence):
    covariance, radii_m = np.array([[4.0, 1.5], [1.5, 9.0]]), np.array([1.0, 2.0, 3.0])
    fixes = [
        Fix(float(k), 500_010.0 + k, 4_500_000.0, covariance, radii_m, Status.TRACKING, 7, 0.9, 3,
            0.8, Reason.USED, 5.0, 6.0)
        for k in range(4)
    ]  # fmt: skip
    return TrackEstimate.of_fixes("EPSG:32635", "bayes", fixes, evidence=evidence)


@pytest.fixture
def evidence():
    columns = np.random.default_rng(1).normal(size=(len(NAMES), 4))
    columns[0, 2] = np.nan
    return TrackEvidence(*columns)


def test_the_table_has_a_column_for_each_number_of_the_evidence(evidence):
    table, plain = estimate(evidence).to_dataframe(), estimate(None).to_dataframe()
    assert list(table) == [*plain, *NAMES]
    for name in NAMES:
        np.testing.assert_array_equal(table[name], getattr(evidence, name))
    assert table["cov_east_north_m2"].tolist() == [1.5] * 4
    assert (table["var_east_m2"][0], table["var_north_m2"][0]) == (4.0, 9.0)
    assert list(estimate(evidence).to_geodataframe())[:-1] == list(table)


def test_the_evidence_comes_back_from_its_file(evidence, tmp_path):
    write_estimate(estimate(evidence), tmp_path / "a.parquet")
    found = read_estimate(tmp_path / "a.parquet").evidence
    for name in NAMES:
        np.testing.assert_array_equal(getattr(found, name), getattr(evidence, name))
    write_estimate(estimate(None), tmp_path / "b.parquet")
    assert read_estimate(tmp_path / "b.parquet").evidence is None
