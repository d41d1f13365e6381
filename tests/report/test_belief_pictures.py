"""Pictures of beliefs with probabilities: the same each time, showing the data."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from mapfilter.errors import InputError
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate, TrackEvidence
from mapfilter.positioning.positioned_track import Snapshot
from mapfilter.positioning.step_output import Fix
from mapfilter.report.basemap import BaseMap
from mapfilter.report.canvas import BLUE
from mapfilter.report.errors import plot_error_over_distance
from mapfilter.report.evidence import plot_evidence
from mapfilter.report.saving import save
from mapfilter.report.snapshots import plot_belief, story_bounds_m
from mapfilter.workflows.outputs.track_pictures import choose_snapshots

STREET = np.array([[0.0, 100.0], [400.0, 100.0]])
BASE = BaseMap((0.0, 0.0, 400.0, 300.0), (STREET,))
COUNT = 200
TRUTH = Truth(np.arange(float(COUNT)), np.arange(float(COUNT)), np.full(COUNT, 100.0))


def snapshot(width_m: float, time_s: float = 0.0, status: Status = Status.SEARCHING) -> Snapshot:
    """Return 2000 equal hypotheses along the street, so far to both sides of its middle."""
    east_m = 200.0 + np.linspace(-width_m, width_m, 2000)
    weight = np.full(2000, 1 / 2000)
    return Snapshot(time_s, time_s, east_m, np.full(2000, 100.0), weight, 200.0, 100.0, status)


def blue_pixels(path) -> int:
    return int((np.abs(imread(path)[..., :3] - to_rgb(BLUE)).max(axis=2) < 0.01).sum())


def estimate() -> TrackEstimate:
    status = [Status.SEARCHING] * 50 + [Status.CONVERGED] + [Status.TRACKING] * 149
    off_m = np.r_[np.full(50, 150.0), np.full(150, 2.0)]
    fixes = [
        Fix(
            t, t + off_m[t], 100.0, np.eye(2), off_m[t] * np.array([0.5, 0.8, 1.5]), status[t],
            9, 0.5, 0, np.nan, Reason.USED,
        )
        for t in range(COUNT)
    ]  # fmt: skip
    half = np.linspace(0.0, 0.5, COUNT)
    nowhere = np.full(COUNT, np.nan)
    evidence = TrackEvidence(nowhere, nowhere, half, 9 - 18 * half, -half)
    return TrackEstimate.of_fixes("EPSG:32635", "bayes", fixes, evidence=evidence)


def test_a_belief_fades_as_it_narrows(tmp_path):
    blue = []
    for width_m in (150.0, 60.0, 20.0):
        save(plot_belief([snapshot(width_m)], TRUTH, BASE), tmp_path / "belief.png")
        blue.append(blue_pixels(tmp_path / "belief.png"))
    assert blue[0] > 1.5 * blue[1] > 2 * blue[2] > 0


def test_the_same_belief_gives_the_same_bytes(tmp_path):
    shown = [snapshot(150.0), snapshot(10.0, 60.0, Status.CONVERGED)]
    for name in ("a.png", "b.png"):
        save(plot_belief(shown, None, BASE), tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_belief_is_shown_where_the_story_happens():
    whole_m = (-2000.0, -2000.0, 3000.0, 3000.0)
    west, south, east, north = story_bounds_m([snapshot(150.0), snapshot(5.0)], None, whole_m)
    # 95 % of the first belief lies within 142.5 m of 200 m, and there is a margin of 30 m.
    assert (west, east) == pytest.approx((27.5, 372.5), abs=1.5)
    assert south < 100.0 < north
    assert north - south < 0.75 * (east - west)
    figure = plot_belief([snapshot(150.0)], None, BASE.zoomed(whole_m))
    assert figure.axes[0].get_xlim()[1] < 500.0
    assert plot_belief([snapshot(9.0)], None, BASE, zoom=False).axes[0].get_xlim() == (0.0, 400.0)


def test_the_story_stays_on_the_map_and_keeps_the_truth_in_sight():
    whole_m = (0.0, 0.0, 250.0, 150.0)
    west, south, east, north = story_bounds_m([snapshot(180.0)], None, whole_m)
    assert 0.0 <= west < east <= 250.0
    assert 0.0 <= south < north <= 150.0
    far = Truth(np.array([0.0, 1.0]), np.array([900.0, 901.0]), np.array([100.0, 100.0]))
    assert story_bounds_m([snapshot(10.0)], far, (0.0, -900.0, 2000.0, 900.0))[2] > 900.0
    assert story_bounds_m([], None, whole_m) == whole_m


@pytest.mark.parametrize("count", [0, 7])
def test_one_to_six_moments(tmp_path, count):
    with pytest.raises(InputError, match="1 to 6"):
        save(plot_belief([snapshot(10.0)] * count, TRUTH, BASE), tmp_path / "belief.png")


@pytest.mark.parametrize("truth", [TRUTH, None])
def test_evidence_with_and_without_truth(tmp_path, truth):
    save(plot_evidence(estimate(), truth), tmp_path / "evidence.png")
    assert blue_pixels(tmp_path / "evidence.png") > 300


def test_evidence_is_over_time_where_the_truth_is_of_a_part():
    part = Truth(TRUTH.time_s[50:90], TRUTH.east_m[50:90], TRUTH.north_m[50:90])
    names = [plot_evidence(estimate(), truth).axes[1].get_xlabel() for truth in (TRUTH, part)]
    assert names == ["distance travelled / m", "time / s"]


def test_entropy_does_not_rise_where_a_belief_crosses_squares():
    """A narrow belief on the way lies in one square of 25 m, in two, in one again."""
    found = estimate()
    entropy_bits = (TRUTH.east_m % 25.0 < 8.0).astype(float)
    crossing = replace(found, evidence=replace(found.evidence, entropy_bits=entropy_bits))
    (line,) = plot_evidence(crossing, TRUTH).axes[0].get_lines()
    middle = line.get_ydata()[30:-30]
    assert np.ptp(entropy_bits) == 1.0
    assert np.ptp(middle) < 0.1


def test_no_evidence_no_picture(tmp_path):
    with pytest.raises(InputError, match="probabilities"):
        save(plot_evidence(replace(estimate(), evidence=None), TRUTH), tmp_path / "evidence.png")


def test_small_errors_after_large_ones_are_seen(tmp_path):
    save(plot_error_over_distance(estimate(), TRUTH), tmp_path / "error.png")
    rows, _ = np.nonzero(
        np.abs(imread(tmp_path / "error.png")[:-250, ..., :3] - to_rgb(BLUE)).max(axis=2) < 0.01
    )
    # Two metres are well above the lower end of an axis that also shows 150 m.
    assert 0.15 * 720 < rows.max() < 0.6 * 720


def test_chosen_moments_follow_the_spread():
    seen = [snapshot(width_m, time_s) for time_s, width_m in enumerate(np.geomspace(150, 3, 30))]
    chosen = choose_snapshots(seen, lambda s: float(np.ptp(s.hypothesis_east_m)))
    assert [s.time_s for s in chosen] == pytest.approx([0, 5.8, 11.6, 17.4, 23.2, 29], abs=1)
