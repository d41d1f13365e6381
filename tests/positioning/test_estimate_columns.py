"""Outputs that are added one by one come out as the fixes that they were."""

import numpy as np

from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate_columns import EstimateColumns
from mapfilter.positioning.step_output import Fix, StepOutput, UnusedReading

CRS = "EPSG:32629"


def output_of(number, *, evidence=True):
    fix = Fix(
        float(number), 10.0 + number, 20.0, np.array([[4.0, 0.5], [0.5, 9.0]]),
        np.array([1.0, 2.0, 3.0]), Status.TRACKING, 3000 + number, 0.9, 7, 0.8, Reason.USED, 6.0,
        np.inf,
    )  # fmt: skip
    unused = (UnusedReading(float(number), "neighbour", "A", Reason.UNKNOWN_CELL),)
    values = (1.0, 2.0, 0.1, 3.0, -40.0 - number)
    return StepOutput(fix, values if evidence else None, unused)


def test_epochs_come_out_as_they_were_added():
    columns = EstimateColumns()
    for number in range(3):
        columns.add(output_of(number))
    before = UnusedReading(1.5, "tdoa", "", Reason.NOT_USED_BY_FILTER, 4)
    estimate = columns.estimate(CRS, "bayes", 5.0, (before,))
    for number in range(3):
        found, expected = estimate.fix(number), output_of(number).fix
        for name in Fix.__slots__:
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    assert (estimate.crs, estimate.filter, estimate.start_utc_s) == (CRS, "bayes", 5.0)
    assert [reading.time_s for reading in estimate.unused] == [0.0, 1.0, 1.5, 2.0]
    assert estimate.evidence.log_evidence.tolist() == [-40.0, -41.0, -42.0]
    assert estimate.evidence.runner_up_mass.tolist() == [0.1] * 3
    assert estimate.way_id.dtype == estimate.hypotheses.dtype == np.int64


def test_a_filter_without_probabilities_has_no_evidence():
    columns = EstimateColumns()
    columns.add(output_of(0, evidence=False))
    assert columns.estimate(CRS, "candidate").evidence is None


def test_no_epochs_make_arrays_of_their_shapes():
    estimate = EstimateColumns().estimate(CRS, "bayes")
    assert (len(estimate), estimate.covariance_m2.shape, estimate.radii_m.shape) == (
        0, (0, 2, 2), (0, 3),
    )  # fmt: skip
    assert estimate.evidence is None


def test_an_estimate_stays_as_it_is_when_epochs_are_added():
    columns = EstimateColumns()
    columns.add(output_of(0))
    first = columns.estimate(CRS, "bayes")
    columns.add(output_of(1))
    assert (len(first), len(columns.estimate(CRS, "bayes"))) == (1, 2)
    assert first.east_m.tolist() == [10.0]
