"""What is no axes is refused before anything is drawn, with what to give instead."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from mapfilter.errors import ConfigError
from mapfilter.evaluation.truth import Truth
from mapfilter.lattice import Lattice
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.radio.cells import CellPlan
from mapfilter.report.basemap import BaseMap
from mapfilter.report.coverage import plot_point_values
from mapfilter.report.run_distributions import plot_run_distribution
from mapfilter.report.track import plot_track

LATTICE = Lattice("EPSG:32632", 0.0, 50.0, 10.0, 5, 5)


def track(ax):
    truth = Truth(np.arange(3.0), np.arange(3.0), np.arange(3.0))
    return plot_track(TrackEstimate.of_fixes(LATTICE.crs, "made", []), truth, None, ax=ax)


def values(ax):
    base, plan = BaseMap(LATTICE.bounds_m), CellPlan(LATTICE.crs, ())
    return plot_point_values(np.ones((5, 5)), LATTICE, plan, base, ax, title="t", label="l")


def runs(ax):
    rows = pd.DataFrame({"success": [True], "error_mean_m": [3.0], "error_at_switch_m": [3.0]})
    return plot_run_distribution([("made", rows)], "error_mean_m", ax, title="t")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (Figure(), r"found Figure \(likely: a figure; give ax=figure.subplots\(\)\)$"),
        (Figure().subplots(1, 2), r"found ndarray \(likely: several axes of plt.subplots; give"),
        ("here", r"found 'here'$"),
        (3, r"found 3$"),
    ],
)
@pytest.mark.parametrize("draw", [track, values, runs])
def test_what_is_no_axes_is_refused(draw, given, message):
    with pytest.raises(
        ConfigError, match=rf"^plot, ax: expected matplotlib axes, or None, {message}"
    ):
        draw(given)


@pytest.mark.parametrize("draw", [track, values, runs])
def test_axes_are_drawn_on(draw):
    axes = Figure().subplots()
    assert draw(axes) is axes
    assert draw(None) is not axes
