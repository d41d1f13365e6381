"""Distributions, thresholds and the sky between houses: equal bytes, data where they are."""

import numpy as np
import pytest
import shapely
from matplotlib.figure import Figure

from mapfilter.evaluation.track_percentiles import Percentile
from mapfilter.report.canvas import BLUE, ORANGE
from mapfilter.report.cumulative import Distribution, axis_end_m, plot_cumulative
from mapfilter.report.curves import (
    Curve,
    OverThreshold,
    Panel,
    SeenMap,
    plot_error_panels,
    plot_over_threshold,
    plot_seen_satellites,
)
from mapfilter.report.saving import save

CURVES = [
    Distribution("some fail", np.array([[1.0, np.nan], [3.0, 2.0]]), BLUE, claim_m=2.5),
    Distribution("none at all", np.full(4, np.nan), ORANGE, "--"),
]
MADE = Percentile(10.0, 8.0, 12.0, 100)


@pytest.mark.parametrize(
    "draw",
    [
        lambda path: save(plot_cumulative(CURVES, title="errors", most_m=5.0), path),
        lambda path: save(
            plot_over_threshold(
                [OverThreshold("edge", (-20.0, -17.0), [MADE, MADE], MADE, "three", BLUE)],
                title="thresholds",
                chosen_db=-17.0,
                bound=("satellites", 15.0),
            ),
            path,
        ),
        lambda path: save(
            plot_seen_satellites(
                [SeenMap("GPS", np.array([[1.0, np.nan], [3.0, 0.0]]), (0.0, 20.0, 0.0, 20.0))],
                [shapely.box(10, 10, 20, 20)],
                [np.array([[1.0, 1.0], [1.0, 9.0]])],
                title="sky",
            ),
            path,
        ),
        lambda path: save(
            plot_error_panels(
                [Panel("", "error / m", [Curve("EKF", np.arange(5.0), BLUE)])],
                title="shaded",
                shaded=("few", np.array([True, False, True, True, False])),
            ),
            path,
        ),
    ],
    ids=["cumulative", "thresholds", "sky", "shaded"],
)
def test_equal_data_give_equal_bytes(draw, tmp_path):
    first, again = tmp_path / "a.png", tmp_path / "b.png"
    draw(first)
    draw(again)
    assert first.read_bytes() == again.read_bytes()
    assert first.read_bytes().startswith(b"\x89PNG")


def test_epochs_without_a_position_keep_curves_below_all():
    axes = Figure().subplots()
    assert plot_cumulative(CURVES, axes, title="errors", most_m=5.0) is axes
    some, none, *_ = axes.lines
    np.testing.assert_allclose(some.get_xdata(), [0.0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(some.get_ydata(), [0.0, 25.0, 50.0, 75.0])
    assert none.get_xdata().tolist() == [0.0]


@pytest.mark.parametrize(
    ("errors_m", "end_m"),
    [(np.arange(100.0), 99.0), (np.append(np.arange(100.0), 140.0), 140.0), (np.zeros(3), 1.0),
     (np.append(np.arange(100.0), 900.0), 98.0)],
)  # fmt: skip
def test_an_axis_of_errors_ends_at_the_largest_unless_it_is_far(errors_m, end_m):
    """It ended where the last 2 % of a curve began."""
    near = Distribution("near", np.ones(50) / 2, BLUE)
    assert axis_end_m([near, Distribution("wide", errors_m, ORANGE)]) == end_m


def test_errors_of_reports_are_no_epochs():
    axes = plot_cumulative(CURVES, title="errors", most_m=5.0, share=0.95, of="reports")
    assert axes.get_ylabel() == "share of reports / %"
    assert any(line.get_label() == "95 % of the reports" for line in axes.lines)


def test_the_line_at_a_share_is_named():
    axes = plot_cumulative(CURVES, title="errors", most_m=5.0, share=0.95)
    (name,) = (line for line in axes.lines if line.get_label() == "95 % of the epochs")
    assert list(name.get_ydata()) == [95.0, 95.0]
