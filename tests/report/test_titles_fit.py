"""Titles fit into pictures of any shape, and do not run into each other."""

from io import BytesIO
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread

from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.positioned_track import Snapshot
from mapfilter.positioning.step_output import Fix
from mapfilter.report.basemap import BaseMap
from mapfilter.report.saving import png_of
from mapfilter.report.snapshots import plot_belief, plot_candidates
from mapfilter.report.track import plot_track

SHAPES = [(400.0, 400.0), (60.0, 900.0), (900.0, 60.0)]


def base(size_m):
    return BaseMap((0.0, 0.0, *size_m))


def extents(figure):
    """Return the boxes of all titles in pixels, and that of the figure."""
    renderer = figure.canvas.get_renderer()
    figure.draw(renderer)
    return [axes.title.get_window_extent(renderer) for axes in figure.axes], figure.bbox


def estimate(size_m):
    statuses = [Status.SEARCHING, Status.CONVERGED, *[Status.TRACKING] * 7, Status.LOST]
    fixes = [
        Fix(
            1234.0 * k, size_m[0] * k / 10, size_m[1] * k / 10, np.full((2, 2), np.nan),
            np.full(3, np.nan), one, 1, np.nan, 0, np.nan, Reason.USED,
        )
        for k, one in enumerate(statuses)
    ]  # fmt: skip
    return TrackEstimate.of_fixes("EPSG:32635", "my_package.filters:CarefulFilter", fixes)


def truth(size_m):
    time_s = np.arange(0.0, 12_001.0, 20.0)
    return Truth(time_s, size_m[0] * time_s / 12_000, np.full(len(time_s), -20_000.0))


@pytest.mark.parametrize("size_m", SHAPES)
@pytest.mark.parametrize("width_in", [None, 3.5])
def test_the_title_of_a_track_is_whole(size_m, width_in):
    axes = None
    if width_in is not None:
        figure = Figure(figsize=(width_in, 5.0), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots()
    drawn = plot_track(estimate(size_m), truth(size_m), base(size_m), axes, zoom=False)
    (title,), whole = extents(drawn.figure)
    assert title.x0 >= whole.x0
    assert title.x1 <= whole.x1
    assert title.y1 <= whole.y1
    words = " ".join(drawn.get_title().split())
    assert words.startswith("my_package.filters:CarefulFilter filter: converged after 1234 s, ")
    assert words.endswith("lost at the end")


def corner(size_m, count=100):
    """A way to the east and then to the north."""
    share = np.linspace(0, 2, count)
    east_m, north_m = np.minimum(share, 1) * size_m[0], np.maximum(share - 1, 0) * size_m[1]
    fixes = [
        Fix(
            float(k), *place, np.full((2, 2), np.nan), np.full(3, np.nan),
            Status.TRACKING if k else Status.CONVERGED, 1, np.nan, 0, np.nan, Reason.USED,
        )
        for k, place in enumerate(zip(east_m, north_m, strict=True))
    ]  # fmt: skip
    return TrackEstimate.of_fixes("EPSG:32635", "ekf", fixes)


@pytest.mark.parametrize("height_m", [200.0, 300.0, 380.0])
def test_the_title_over_a_square_map_is_not_cut_off(height_m):
    """With a legend of two rows, as the layout first leaves room over axes of another shape."""
    found = corner((400.0, height_m))
    true = Truth(found.time_s, found.east_m + 4.0, found.north_m)
    fixes_m = np.column_stack([found.east_m, found.north_m])[::3]
    drawn = plot_track(found, true, None, fixes_m=fixes_m, title="A title")
    inked = (imread(BytesIO(png_of(drawn)))[:, :, :3] < 0.8).any(axis=2)
    frame = int(np.argmax(inked.mean(axis=1) > 0.8))
    rows = np.flatnonzero(inked[:frame].any(axis=1))
    assert rows[0] >= 3
    # Letters of 14 points, at 150 pixels an inch.
    assert np.ptp(rows) > 15


def snapshots(size_m, count):
    at = np.linspace(0.4, 0.6, 50)
    statuses = [*[Status.SEARCHING] * (count - 1), Status.CONVERGED]
    return [
        Snapshot(
            100.0 * k, 12_345.0 * k, size_m[0] * at, size_m[1] * at, np.full(50, 0.02),
            size_m[0] / 2, size_m[1] / 2, one,
        )
        for k, one in enumerate(statuses)
    ]  # fmt: skip


@pytest.mark.parametrize("size_m", SHAPES)
@pytest.mark.parametrize("count", [1, 2, 3, 6])
@pytest.mark.parametrize("plot", [plot_belief, plot_candidates])
def test_titles_of_panels_stand_beside_each_other(size_m, count, plot):
    figure = plot(snapshots(size_m, count), None, base(size_m))
    titles, whole = extents(figure)
    columns = count if count <= 3 else 3
    for first in range(0, count, columns):
        row = titles[first : first + columns]
        assert row[0].x0 >= whole.x0
        assert row[-1].x1 <= whole.x1
        assert all(left.x1 < right.x0 for left, right in pairwise(row))
    if plot is plot_belief:
        assert figure.axes[count - 1].get_title().endswith("within 50 m: converged")
