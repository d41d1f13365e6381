"""Pictures of tracks: what is claimed, lost and true, with and without a map."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_area import CRS, NORTH_M, WEST_M, Area, drawn_area, estimate, pixels_near, png_size
from matplotlib.collections import PathCollection
from matplotlib.colors import to_hex

from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix
from mapfilter.report.canvas import BLUE, ORANGE, SKY, VERMILLION
from mapfilter.report.errors import plot_error_over_distance
from mapfilter.report.saving import png_of, save
from mapfilter.report.track import plot_track


@pytest.fixture(scope="session")
def area() -> Area:
    return drawn_area()


def test_never_switched(area, tmp_path):
    save(plot_error_over_distance(estimate(area, None), area.truth), tmp_path / "e.png")
    save(plot_track(estimate(area, None), area.truth, area.base), tmp_path / "t.png")
    save(plot_error_over_distance(estimate(area, 100.0), area.truth), tmp_path / "e2.png")
    star = pixels_near(tmp_path / "e2.png", VERMILLION) - pixels_near(
        tmp_path / "e.png", VERMILLION
    )
    assert star > 100


def test_track_without_epochs(area, tmp_path):
    nothing = TrackEstimate.of_fixes(CRS, "candidate", [])
    save(plot_error_over_distance(nothing, area.truth), tmp_path / "e.png")
    save(plot_track(nothing, area.truth, area.base), tmp_path / "t.png")
    save(plot_track(nothing, None, area.base), tmp_path / "u.png")
    for name in ("e", "t", "u"):
        assert min(png_size(tmp_path / f"{name}.png")) > 300


def test_track_tells_near_from_far(area, tmp_path):
    save(
        plot_track(estimate(area, 100.0, error_m=10.0), area.truth, area.base),
        tmp_path / "near.png",
    )
    save(
        plot_track(estimate(area, 100.0, error_m=60.0), area.truth, area.base), tmp_path / "far.png"
    )
    assert pixels_near(tmp_path / "near.png", ORANGE) == 0
    assert pixels_near(tmp_path / "near.png", BLUE) > 0
    assert pixels_near(tmp_path / "far.png", ORANGE) > 0
    assert pixels_near(tmp_path / "far.png", BLUE) == 0


@pytest.mark.parametrize(
    ("status", "name"),
    [
        (Status.SEARCHING, "while searching"),
        (Status.UNCERTAIN, "while searching or uncertain"),
        (Status.LOST, "while searching or lost"),
    ],
)
def test_estimates_that_are_not_claimed_are_pale_and_small(area, status, name):
    # 70 m off: marked as such where it is tracked, and only there.
    tracked = estimate(area, 0.0, error_m=70.0)
    half = len(tracked) // 2
    part = replace(tracked, status=(*[status] * half, *tracked.status[half:]))
    sizes = {}
    for key, one in (("all", tracked), ("part", part)):
        axes = plot_track(one, area.truth, area.base)
        marks = [m for m in axes.collections if isinstance(m, PathCollection)]
        sizes[key] = {
            to_hex(m.get_facecolors()[0]): (len(m.get_offsets()), m.get_sizes()[0]) for m in marks
        }
        _, names = axes.get_legend_handles_labels()
        assert (name in names) is (key == "part")
        assert "more than 50 m off" in names
    assert SKY not in sizes["all"]
    assert sizes["part"][SKY][0] == half
    assert sizes["part"][ORANGE][0] == sizes["all"][ORANGE][0] - half
    assert sizes["part"][SKY][1] < sizes["part"][ORANGE][1] / 2


def test_tracks_of_one_walk_are_drawn_in_one_frame(area):
    for error_m in (10.0, 90.0):
        axes = plot_track(estimate(area, 100.0, error_m), area.truth, area.base)
        (start,) = (drawn for drawn in axes.texts if drawn.get_text() == "start")
        assert start.xy == pytest.approx((20.0, 100.0))


@pytest.mark.parametrize("with_truth", [True, False])
def test_a_track_shows_where_it_got_lost(area, with_truth):
    found = estimate(area, 0.0)
    status = tuple(
        Status.LOST if 30 <= i < 40 or i >= 50 else s for i, s in enumerate(found.status)
    )
    axes = plot_track(replace(found, status=status), area.truth if with_truth else None, area.base)
    (lost,) = (one for one in axes.collections if one.get_label() == "got lost here")
    x, y = lost.get_offsets().T
    # The last positions before, by the estimate: the truth lies 10 m south.
    assert list(x) == pytest.approx([20.0 + 1.4 * 145, 20.0 + 1.4 * 245])
    assert set(y) == {110.0}
    axes = plot_track(found, area.truth, area.base)
    assert all(one.get_label() != "got lost here" for one in axes.collections)


def test_a_track_that_is_lost_before_it_has_a_position_has_its_cross_on_the_truth(area):
    found = estimate(area, 0.0)
    east_m = np.where(np.arange(len(found)) < 5, np.nan, found.east_m)
    status = tuple(Status.LOST if i == 3 else one for i, one in enumerate(found.status))
    axes = plot_track(replace(found, status=status, east_m=east_m), area.truth, area.base)
    (lost,) = (one for one in axes.collections if one.get_label() == "got lost here")
    assert lost.get_offsets().tolist() == [pytest.approx([20.0 + 1.4 * 15, 100.0])]


def _names(axes):
    return {text.get_text(): text for text in axes.texts if text.get_text() in ("start", "end")}


@pytest.mark.parametrize("turned", range(8))
def test_names_of_the_ends_stand_beside_the_path(area, turned):
    """Whichever way the path leaves its start and reaches its end, also in a round trip."""
    out = np.exp(1j * np.pi / 4 * turned) * np.arange(0, 200.0, 2.0)
    for way in (out, np.concatenate([out, out[::-1]]) + np.linspace(0, 4, 200)):
        east_m, north_m = WEST_M + 250 + way.real, NORTH_M - 200 + way.imag
        time_s = np.arange(float(len(way)))
        base = replace(area.base, bounds_m=(WEST_M, NORTH_M - 450, WEST_M + 500, NORTH_M + 50))
        axes = plot_track(estimate(area, None), Truth(time_s, east_m, north_m), base, zoom=False)
        png_of(axes)
        path = next(line for line in axes.lines if line.get_label() == "truth")
        at = axes.transData.transform(np.column_stack(path.get_data()))
        for name in _names(axes).values():
            box = name.get_window_extent()
            inside = [box.x0 < x < box.x1 and box.y0 < y < box.y1 for x, y in at]
            assert not any(inside), (turned, name.get_text())
        boxes = [name.get_window_extent() for name in _names(axes).values()]
        assert not boxes[0].overlaps(boxes[1])


@pytest.mark.parametrize("jumps", [True, False])
def test_a_lone_first_position_does_not_stretch_the_map(jumps):
    """A walk to there after a long rest does."""
    rest, away = np.zeros(995), np.full(5, 30_000.0) if jumps else np.zeros(5)
    moved = np.concatenate([away, np.arange(995) % 200.0]) if jumps else rest
    if not jumps:
        moved = np.concatenate([rest, np.arange(1.0, 11.0) * 10])
    found = _walked(WEST_M + moved, NORTH_M + 0 * moved)
    axes = plot_track(found, None, None)
    left, right = axes.get_xlim()
    told = [text.get_text() for text in axes.texts]
    assert right - left < 1000
    assert ("5 estimates outside of the picture" in told) == jumps
    if not jumps:
        assert right > 100


def _walked(east_m, north_m):
    places = zip(east_m, north_m, strict=True)
    return TrackEstimate.of_fixes(
        CRS,
        "ekf",
        [
            Fix(
                float(i), east, north, np.full((2, 2), np.nan), np.full(3, np.nan),
                Status.TRACKING, 1, np.nan, 0, np.nan, Reason.USED,
            )
            for i, (east, north) in enumerate(places)
        ],
    )  # fmt: skip


@pytest.mark.parametrize("switch_s", [0.0, None])
def test_a_track_without_a_map_shows_its_ends_and_the_fixes(area, switch_s):
    """Where nothing was located, the fixes give the extent."""
    fixes_m = np.array([[WEST_M + 20.0, NORTH_M - 300.0], [WEST_M + 90.0, NORTH_M - 280.0]])
    axes = plot_track(estimate(area, switch_s), None, None, fixes_m=fixes_m)
    (drawn,) = (one for one in axes.collections if one.get_label() == "positions of the log")
    (x, y) = np.asarray(drawn.get_offsets()).T
    assert (np.ptp(x), np.ptp(y)) == pytest.approx((70.0, 20.0))
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    assert switch_s == 0.0 or (left < x.min() < x.max() < right and low < y.min() < y.max() < high)
    ends = {"start", "end"} if switch_s == 0.0 else set()
    assert {"start", "end"} & {one.get_text() for one in axes.texts} == ends
    assert axes.get_xlabel() == "east of local origin / m"


def test_a_track_without_a_map_or_a_position_is_an_empty_square(area, tmp_path):
    axes = plot_track(estimate(area, None), None, None)
    save(axes, tmp_path / "t.png")
    assert axes.get_title() == "candidate filter: did not converge"
