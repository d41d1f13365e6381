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


def expected_absent(predicted: Prediction, pixel: Ints32, report: LevelReport) -> LevelReport:
    """Return a report with those absent cells that hypotheses expect, most expected first."""
    if not report.absent.size:
        return report
    stride = sample_stride(pixel)
    share = shares_above(pixel, stride, predicted, report.absent, report.limit_dbm)
    return most_expected(report, share)


def most_expected(report: LevelReport, share: Floats) -> LevelReport:
    """Return a report with the absent cells that enough hypotheses expect.

    They come by the share (J,) that does, largest first.
    """
    expected = [k for k, part in enumerate(share.tolist()) if part > _LEAST_EXPECTED]
    expected.sort(key=lambda k: -share[k])
    return report.with_absent(expected)


def sample_stride(pixel: Ints32) -> int:
    """Return the stride that takes the sample out of all hypotheses."""
    return max(pixel.size // _SAMPLE, 1)
