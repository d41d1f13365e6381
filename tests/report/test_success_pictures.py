"""Pictures of sweeps: they are drawn of few cells and of many, and of runs that never switched."""

from dataclasses import replace

import matplotlib.image
import numpy as np
import pandas as pd
import pytest

from mapfilter.evaluation.success_cells import SuccessCell
from mapfilter.report.claimed_radii import (
    plot_claimed_radii,
    plot_coverage_curves,
    plot_radius_curves,
)
from mapfilter.report.run_distributions import plot_run_distributions
from mapfilter.report.saving import save
from mapfilter.report.success import (
    curve_axis,
    plot_success_curves,
    plot_success_map,
    success_curves,
)

CLAIMS = ((3.0, 0.8), (6.0, 0.65))


def cell(sigma_deg, sigma_m, success):
    place = dict.fromkeys(SuccessCell.__dataclass_fields__, 0.0)
    place |= {"sigma_orient_deg": sigma_deg, "sigma_trans_m": sigma_m, "success": success}
    place |= {"low": max(success - 0.1, 0.0), "high": min(success + 0.1, 1.0)}
    return SuccessCell(**place | {"varied": {}})


def grid(orient=6, trans=3):
    return [cell(3.0 * i, 0.2 * j, 1 - i / 6) for i in range(orient) for j in range(trans)]


def runs(count, switched=True):
    rng = np.random.default_rng(1)
    error_m = rng.gamma(2, 20, count) if switched else np.full(count, np.nan)
    return pd.DataFrame(
        {
            "success": error_m <= 50,
            "error_at_switch_m": error_m,
            "error_mean_m": error_m / 2,
            "switch_distance_m": 10 * error_m,
        }
    )


def inked(path):
    picture = matplotlib.image.imread(path)[:, :, :3]
    return float((picture.min(axis=2) < 0.9).mean())


@pytest.mark.parametrize(("curves", "claims"), [(1, ()), (1, CLAIMS), (11, CLAIMS), (0, CLAIMS)])
def test_curves(tmp_path, curves, claims):
    path = tmp_path / "curves.png"
    drawn = [(f"reading {n}", grid(6, 1)) for n in range(curves)]
    save(plot_success_curves(drawn, title="a town", claims=claims, claimant="paper"), path)
    assert inked(path) > 0.005


def test_a_legend_of_long_names_stays_within_the_picture(tmp_path):
    path = tmp_path / "curves.png"
    names = [f"set, 1 Hz, projected along the last heading, {n}" for n in range(11)]
    save(
        plot_success_curves([(name, grid(6, 1)) for name in names], title="a town", claims=CLAIMS),
        path,
    )
    assert (matplotlib.image.imread(path)[:, [0, 1, -2, -1], :3] == 1.0).all()


def test_cells_of_one_curve_differ_in_the_noise_of_headings_alone():
    steps = [cell(3.0 * i, 0.2 * j, 0.5) for i in range(3) for j in range(2)]
    named = [replace(one, reading=name) for name in ("set", "list") for one in steps]
    curves = dict(success_curves(named))
    assert list(curves) == [
        "set, step 0 m",
        "set, step 0.2 m",
        "list, step 0 m",
        "list, step 0.2 m",
    ]
    for cells in curves.values():
        assert [one.sigma_orient_deg for one in cells] == [0.0, 3.0, 6.0]
        assert len({(one.reading, one.sigma_trans_m) for one in cells}) == 1


def test_an_error_and_what_a_filter_assumes_of_it_are_two_coordinates():
    """Options of filters have the names of the errors."""
    key = "filter.bayes.bias_sd_deg"
    first = replace(cell(6.0, 0.2, 0.5), reading="set")
    cells = [
        replace(first, bias_sd_deg=bias, varied={key: assumed})
        for bias in (3.0, 4.0)
        for assumed in (2.0, 8.0)
    ]
    axis = curve_axis(cells)
    curves = dict(success_curves(cells, axis))
    assert axis == "bias_sd_deg"
    assert list(curves) == [f"set, {key} 2", f"set, {key} 8"]
    assert all([one.bias_sd_deg for one in some] == [3.0, 4.0] for some in curves.values())


def test_what_belongs_to_a_filter_is_not_in_the_name_of_its_curve():
    cells = [replace(cell(3.0 * i, 0.2, 0.5), varied={}) for i in range(2)]
    both = [*(replace(one, reading="a", update_length_m=5.0) for one in cells)]
    both += [replace(one, reading="b", update_length_m=22.0) for one in cells]
    assert [name for name, _ in success_curves(both)] == ["a", "b"]
    varied = [replace(one, varied={"filter.bayes.scale": at}) for at in (0.1, 0.2) for one in both]
    assert [name for name, _ in success_curves(varied)] == [
        f"{name}, filter.bayes.scale {at}" for at in (0.1, 0.2) for name in ("a", "b")
    ]
    assert success_curves([]) == []


@pytest.mark.parametrize(
    ("changes", "axis", "names"),
    [
        ({"sigma_orient_deg": 3.0}, "sigma_orient_deg", ["set"]),
        ({"sigma_trans_m": 0.4}, "sigma_trans_m", ["set"]),
        ({"varied": {"filter.bayes.scale": 0.2}}, "filter.bayes.scale", ["set"]),
        ({"scale": 0.1, "sigma_trans_m": 0.4}, "sigma_trans_m", ["set, scale 0", "set, scale 0.1"]),
        ({"reading": "list", "update_length_m": 5.0}, "reading", ["set", "list"]),
        ({"prediction_error_db": np.nan, "scale": 0.1}, "scale",
         ["set, prediction error 0 dB", "set"]),
        ({}, "sigma_orient_deg", ["set"]),
    ],
)  # fmt: skip
def test_curves_are_drawn_over_what_differs(changes, axis, names):
    known = {"filter.bayes.scale": 0.1} if "varied" in changes else {}
    first = replace(cell(0.0, 0.2, 0.5), reading="set", varied=known)
    cells = [first, replace(first, **changes)] if changes else [first]
    assert curve_axis(cells) == axis
    curves = success_curves(cells, axis)
    assert [name for name, _ in curves] == names
    axes = plot_success_curves(curves, title="a town", axis=axis)
    found = {float(x) for line in axes.lines for x in line.get_xdata()}
    wanted = {0.0, 1.0} if axis == "reading" else {one.place[axis] for one in cells}
    assert len(found) >= len(wanted)
    for at in found:
        assert min(abs(at - place) for place in wanted) < 0.02


def test_equal_curves_give_equal_bytes(tmp_path):
    for name in ("a.png", "b.png"):
        save(plot_success_curves([("set", grid())], title="a town", claims=CLAIMS), tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(("orient", "trans"), [(1, 1), (6, 6), (12, 2)])
def test_map_of_numbers(tmp_path, orient, trans):
    path = tmp_path / "map.png"
    save(plot_success_map(grid(orient, trans), title="a town"), path)
    assert inked(path) > 0.2


def test_map_with_a_hole(tmp_path):
    path = tmp_path / "map.png"
    save(plot_success_map(grid()[:-1], title="a town"), path)
    assert path.is_file()


@pytest.mark.parametrize("groups", [[], [("heading 3°", 40)], [(f"{n}°", 7) for n in range(8)]])
def test_distributions(tmp_path, groups):
    path = tmp_path / "cdf.png"
    save(plot_run_distributions([(name, runs(n)) for name, n in groups], title="a town"), path)
    assert inked(path) > 0.005


def test_distributions_of_runs_that_never_switched(tmp_path):
    path = tmp_path / "cdf.png"
    groups = [("never", runs(9, switched=False)), ("some", runs(9))]
    save(plot_run_distributions(groups, title="a town"), path)
    assert path.is_file()


def test_an_empty_distribution_says_why():
    """Axes of hundredths of a metre look like a result."""
    some, none = [("some", runs(9))], [("never", runs(9, switched=False))]
    for groups, told in ((some, [[], [], []]), (some + none, [[], [], []])):
        panels = plot_run_distributions(groups, title="a town").axes
        assert [said(axes) for axes in panels] == told
    panels = plot_run_distributions(none, title="a town").axes
    assert [said(axes) for axes in panels] == [
        ["no run switched"],
        ["no run succeeded"],
        ["no run switched"],
    ]
    assert [len(axes.get_xticks()) for axes in panels[1:]] == [0, 0]


def said(axes):
    return [text.get_text() for text in axes.texts if "run" in text.get_text()]


def with_radii(coverage, radius_m, **place):
    low, high = max(coverage - 0.1, 0.0), min(coverage + 0.05, 1.0)
    ends = {"coverage_95": coverage, "coverage_95_low": low, "coverage_95_high": high}
    place = {"reading": "b", **place}
    return replace(cell(3.0, 0.2, 0.5), **ends, radius_95_median_m=radius_m, **place)


def drawn_heights(axes):
    """Heights of the markers of each curve; the line at 95 % has none."""
    curves = [line for line in axes.lines if line.get_marker() == "o"]
    return [list(map(float, line.get_ydata())) for line in curves]


def test_coverage_and_radius_are_those_of_the_cells():
    cells = [with_radii(0.9, 30.0, scale=0.0), with_radii(0.8, 41.0, scale=0.1)]
    axis, curves = curve_axis(cells), success_curves(cells, curve_axis(cells))
    covered = plot_coverage_curves(curves, title="a town", axis=axis)
    assert drawn_heights(covered) == [pytest.approx([90.0, 80.0])]
    assert 95.0 in {float(line.get_ydata()[0]) for line in covered.lines}
    bars = covered.collections[0].get_segments()
    assert [sorted(end[:, 1]) for end in bars] == [
        pytest.approx([80.0, 95.0]),
        pytest.approx([70.0, 85.0]),
    ]
    wide = plot_radius_curves(curves, title="a town", axis=axis)
    assert drawn_heights(wide) == [[30.0, 41.0]]
    assert wide.get_ylim()[1] > 41.0
    both = plot_claimed_radii(curves, title="a town", axis=axis)
    assert [drawn_heights(axes)[0][1] for axes in both.axes] == pytest.approx([80.0, 41.0])


def test_a_filter_without_radii_is_named_as_such(tmp_path):
    filters = [with_radii(0.9, 30.0, reading="b"), with_radii(np.nan, np.nan, reading="c")]
    curves = success_curves(filters, "reading")
    axes = plot_coverage_curves(curves, title="a town", axis="reading")
    assert axes.get_legend_handles_labels()[1] == ["b", "c: no radius"]
    for name, radius in (("some", curves), ("none", curves[1:])):
        save(plot_claimed_radii(radius, title="a town", axis="reading"), tmp_path / f"{name}.png")
        assert inked(tmp_path / f"{name}.png") > 0.005


def test_a_group_without_a_curve_says_why_in_the_legend():
    """Its name stood beside a line that is nowhere drawn."""
    groups = [("good", runs(20)), ("bad", runs(20).assign(success=False))]
    panels = plot_run_distributions(groups, title="a town").axes
    names = [axes.get_legend_handles_labels()[1] for axes in panels]
    assert names == [["good", "bad"], ["good", "bad: no run succeeded"], ["good", "bad"]]
