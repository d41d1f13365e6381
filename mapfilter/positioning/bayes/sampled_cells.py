"""What a sample of the hypotheses tells of cells before all of them are weighed by a report."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats, Ints32
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.level_kernels import Prediction, rough_squares, shares_above

_SAMPLE = 256
"""At least so many hypotheses, and fewer than twice as many, stand for all of them."""
_LEAST_EXPECTED = 0.02


def mean_rough_db2(predicted: Prediction, pixel: Ints32, cell: Ints32) -> Floats:
    """Return the mean variance that the roughness of the prediction adds, for each cell."""
    squares = rough_squares(pixel, sample_stride(pixel), predicted, cell)
    return np.asarray(predicted.share * (squares.sum(axis=1) / squares.shape[1]))


def expected_absent(predicted: Prediction, pixel: Ints32, report: LevelReport) -> Ints32:
    """Return absent cells that hypotheses expect to be in the report, most expected first."""
    absent = report.absent
    if not absent.size:
        return absent
    share = shares_above(pixel, sample_stride(pixel), predicted, absent, report.limit_dbm)
    return most_expected(absent, share)


def most_expected(absent: Ints32, share: Floats) -> Ints32:
    """Return the cells that enough hypotheses expect, by the share that does, largest first."""
    expected = [k for k, part in enumerate(share.tolist()) if part > _LEAST_EXPECTED]
    expected.sort(key=lambda k: -share[k])
    found: Ints32 = absent[expected]
    return found


def sample_stride(pixel: Ints32) -> int:
    """Return the stride that takes the sample out of all hypotheses."""
    return max(pixel.size // _SAMPLE, 1)
