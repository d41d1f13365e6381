"""Pictures of a track that has no epoch for a while."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_area import CRS, drawn_area, estimate

from mapfilter.positioning.estimate import TrackEstimate, TrackEvidence
from mapfilter.report.errors import (
    plot_error_over_distance,
    plot_errors_apart,
    plot_errors_over_time,
)
from mapfilter.report.evidence import plot_evidence

BEGIN_S, END_S = 95.0, 225.0


@pytest.fixture
def area():
    return drawn_area()


@pytest.fixture
def silent(area):
    """Epochs of every 5 s, but none between two times."""
    whole = estimate(area, 0.0)
    fixes = [replace(whole.fix(i), radii_m=np.full(3, 25.0), protection_m=60.0)
             for i, t in enumerate(whole.time_s) if not BEGIN_S < t < END_S]  # fmt: skip
    return TrackEstimate.of_fixes(CRS, "bayes", fixes)


def _bridging(axes, begin, end):
    """Return the names of lines that go on from before a stretch of the axis to after it."""
    names = []
    for line in axes.lines:
        x, y = (np.asarray(one, dtype=float) for one in line.get_data())
        ends = np.isfinite(x) & np.isfinite(y)
        if len(x) > 10 and (ends[:-1] & ends[1:] & (x[:-1] <= begin) & (x[1:] >= end)).any():
            names.append(line.get_label())
    return names


def test_errors_and_radii_are_not_drawn_where_there_is_no_epoch(area, silent):
    axes = plot_error_over_distance(silent, area.truth)
    assert {"error", "protection level"} < {line.get_label() for line in axes.lines}
    begin_m, end_m = area.truth.distance_at(np.array([BEGIN_S, END_S]))
    assert not _bridging(axes, begin_m + 1, end_m - 1)
    bands = [path.vertices for one in axes.collections for path in one.get_paths()]
    assert len(bands) == 6  # three radii, before and after


def test_errors_over_time_are_not_drawn_there_either(area, silent):
    both = {"silent": silent, "all": estimate(area, 0.0)}
    over = plot_errors_over_time(both, area.truth)
    apart = plot_errors_apart(both, area.truth).axes
    for axes in (over, *apart):
        assert len(axes.lines) >= 2
        assert not _bridging(axes, BEGIN_S + 1, END_S - 1)


def test_evidence_is_not_drawn_there_either(silent):
    ones = np.ones(len(silent))
    evidence = TrackEvidence(*[ones] * 5)
    figure = plot_evidence(replace(silent, mass_50m=ones, evidence=evidence), None)
    for axes in figure.axes[:2]:
        assert axes.lines
        assert not _bridging(axes, BEGIN_S + 1, END_S - 1)
