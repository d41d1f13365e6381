"""Every picture on a small made area: written whole, the same each time, showing the data."""

from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from drawn_area import CRS, NORTH_M, WEST_M, Area, drawn_area, estimate, pixels_near, png_size
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from mapfilter.errors import InputError, OutputError
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Status
from mapfilter.geodesy import grid_convergence_rad, unproject
from mapfilter.positioning.positioned_track import Snapshot
from mapfilter.radio.cells import CellPlan
from mapfilter.report.basemap import BaseMap, draw_base, local_frame
from mapfilter.report.canvas import BLUE, DPI, ORANGE
from mapfilter.report.coverage import plot_level
from mapfilter.report.errors import plot_error_over_distance
from mapfilter.report.network import draw_cells, plot_best_server, plot_points_per_cell
from mapfilter.report.saving import save
from mapfilter.report.snapshots import plot_candidates
from mapfilter.report.track import plot_track


@pytest.fixture(scope="session")
def area() -> Area:
    return drawn_area()


def snapshot(area: Area, count: int, travelled_m: float = 0.0, located: bool = False) -> Snapshot:
    west, south, _, _ = area.lattice.bounds_m
    east_m = west + 20.0 + 440.0 * (np.arange(count) + 0.5) / max(count, 1)
    here = (east_m[0], south + 110.0) if located else (np.nan, np.nan)
    return Snapshot(
        travelled_m / 1.4, travelled_m, east_m, np.full(count, south + 100.0),
        np.full(count, 1 / max(count, 1)), *here,
        Status.TRACKING if located else Status.SEARCHING,
    )  # fmt: skip


def draw_all(area: Area, folder: Path) -> list[Path]:
    """Draw every kind of picture once."""
    west, south, east, _ = area.lattice.bounds_m
    points = (np.linspace(west, east, 50), np.full(50, south + 100.0))
    groups = {
        "S1A": points,
        "S1$B$": (points[0][:9], points[1][:9] + 50.0),
        "I1": (points[0][:0],) * 2,
    }
    level_dbm = np.linspace(-110, -60, area.lattice.rows * area.lattice.cols)
    level_dbm = level_dbm.reshape(area.lattice.rows, area.lattice.cols).astype(np.float32)
    level_dbm[:10] = np.nan
    best = np.where(np.isnan(level_dbm), -1, np.arange(area.lattice.cols) // 50)
    names = ("candidates", "points", "best", "level", "error", "track")
    paths = [folder / f"{name}.png" for name in names]
    snapshots = [snapshot(area, n, 20.0 * n, located=n == 1) for n in (60, 30, 9, 1)]
    save(plot_candidates(snapshots, area.truth, area.base), paths[0])
    save(plot_points_per_cell(groups, area.plan, area.base, title="Points"), paths[1])
    save(plot_best_server(best, ("S1A", "S1$B$"), area.lattice, area.plan, area.base), paths[2])
    save(plot_level(level_dbm, area.lattice, area.plan, area.base), paths[3])
    save(plot_error_over_distance(estimate(area, 100.0), area.truth), paths[4])
    save(plot_track(estimate(area, 100.0), area.truth, area.base), paths[5])
    return paths


def test_same_data_give_same_bytes(area, tmp_path):
    first, second = draw_all(area, tmp_path / "a"), draw_all(area, tmp_path / "b")
    for one, other in zip(first, second, strict=True):
        assert png_size(one) == png_size(other)
        assert one.read_bytes() == other.read_bytes(), one.name
    assert sorted(tmp_path.rglob("*")) == sorted([*first, *second, tmp_path / "a", tmp_path / "b"])


def test_sizes_follow_the_extent(area, tmp_path):
    path = tmp_path / "new" / "folder" / "points.png"
    save(plot_points_per_cell({}, area.plan, area.base), path)
    width, height = png_size(path)
    assert width == pytest.approx((7.0 + 2.7) * DPI, abs=1)
    # The area is 500 m by 400 m.
    assert height == pytest.approx((7.0 * 0.8 + 0.85) * DPI, abs=1)


def test_drawing_leaves_no_settings_behind(area, tmp_path):
    before = dict(matplotlib.rcParams)
    save(plot_error_over_distance(estimate(area, None), area.truth), tmp_path / "e.png")
    with pytest.raises(InputError):
        save(plot_candidates([], area.truth, area.base), tmp_path / "c.png")
    assert dict(matplotlib.rcParams) == before


def test_more_candidates_more_blue(area, tmp_path):
    blue = []
    for count in (0, 3, 200):
        save(plot_candidates([snapshot(area, count)], None, area.base), tmp_path / "c.png")
        blue.append(pixels_near(tmp_path / "c.png", BLUE))
    assert blue[0] < blue[1] < blue[2]


def test_candidates_fade_with_their_weight(area, tmp_path):
    path = tmp_path / "c.png"
    even = snapshot(area, 40)
    save(plot_candidates([even], None, area.base), path)
    full = pixels_near(path, BLUE)
    save(
        plot_candidates([replace(even, weight=np.array([1.0] + [0.0] * 39))], None, area.base), path
    )
    assert pixels_near(path, BLUE) < full / 4


@pytest.mark.parametrize("count", [0, 7])
def test_number_of_panels(area, tmp_path, count):
    path = tmp_path / "c.png"
    with pytest.raises(InputError, match="1 to 6"):
        save(plot_candidates([snapshot(area, 5)] * count, area.truth, area.base), path)
    assert not path.exists()


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 6])
def test_each_number_of_panels_fits(area, tmp_path, count):
    path = tmp_path / "c.png"
    save(plot_candidates([snapshot(area, 5)] * count, area.truth, area.base), path)
    columns = count if count <= 3 else (count + 1) // 2
    assert png_size(path)[0] == pytest.approx((columns * 4.1 + 0.6) * DPI, abs=1)


def test_error_plot_shows_lost_and_radius(area, tmp_path):
    good = estimate(area, 100.0)
    status = tuple(Status.LOST if 30 <= i < 40 else s for i, s in enumerate(good.status))
    told = replace(good, status=status, radii_m=np.full((len(good), 3), 25.0))
    save(plot_error_over_distance(told, area.truth), tmp_path / "e.png")
    assert pixels_near(tmp_path / "e.png", ORANGE) > 100
    assert pixels_near(tmp_path / "e.png", "#f7d9c9") > 1000


def test_every_status_without_a_claim_has_a_shade_of_its_own_and_a_name(area, tmp_path):
    good = estimate(area, 100.0)
    shaded = (Status.SEARCHING, Status.UNCERTAIN, Status.LOST, Status.OUTSIDE)
    told = replace(good, status=tuple(shaded[4 * i // len(good)] for i in range(len(good))))
    axes = plot_error_over_distance(told, area.truth)
    handles, names = axes.get_legend_handles_labels()
    found = {name: to_hex(one.get_facecolor()) for one, name in zip(handles, names, strict=True)
             if name in [status.lower() for status in shaded]}  # fmt: skip
    assert set(found) == {"searching", "uncertain", "lost", "outside"}
    assert len(set(found.values())) == 4
    save(axes, tmp_path / "e.png")
    assert pixels_near(tmp_path / "e.png", found["outside"]) > 1000


def test_errors_are_drawn_where_the_truth_is_known(area):
    """Radii and statuses of the rest do not pile up at its ends."""
    good = replace(estimate(area, 100.0), radii_m=np.full((61, 3), 25.0))
    for first, last, switch in ((0, 150, "10 m off"), (150, 251, "the truth is not known")):
        known = slice(first, last)
        truth = Truth(area.truth.time_s[known], area.truth.east_m[known], area.truth.north_m[known])
        axes = plot_error_over_distance(good, truth)
        lines = {line.get_label(): line.get_xdata() for line in axes.lines}
        drawn_m = lines["95 % radius; darker: 67, 50 %"]
        assert np.isfinite(drawn_m).sum() == np.ptp(truth.time_s) // 5 + 1
        _, names = axes.get_legend_handles_labels()
        assert ("searching" in names) is (first == 0)
        (star,) = (name for name in names if name.startswith("switch: "))
        assert switch in star
        of_s = f"{np.ptp(truth.time_s):.0f} of 300 s with a truth"
        assert axes.get_xlabel() == f"distance travelled / m, in the {of_s}"


def test_an_error_that_is_nowhere_known_is_not_in_the_legend(area):
    good = estimate(area, 100.0)
    nowhere = np.full(len(good), np.nan)
    unknown = replace(good, east_m=nowhere, north_m=nowhere)
    for one, drawn in ((good, True), (unknown, False)):
        _, names = plot_error_over_distance(one, area.truth).get_legend_handles_labels()
        assert ("error" in names) is drawn


def test_points_without_streets(area, tmp_path):
    bare = BaseMap(area.base.bounds_m, points_m=np.array([[WEST_M + 100.0, NORTH_M - 100.0]] * 3))
    save(plot_candidates([snapshot(area, 3)], area.truth, bare), tmp_path / "c.png")
    empty = BaseMap(area.base.bounds_m, points_m=np.empty((0, 2)))
    save(plot_candidates([snapshot(area, 3)], area.truth, empty), tmp_path / "c.png")


def test_rasters_are_checked(area, tmp_path):
    path = tmp_path / "r.png"
    with pytest.raises(InputError, match="80 x 100 pixels"):
        save(plot_level(np.zeros((100, 80)), area.lattice, area.plan, area.base), path)
    with pytest.raises(InputError, match="indices below 1"):
        save(
            plot_best_server(
                np.ones((80, 100), dtype=int), ("S1A",), area.lattice, area.plan, area.base
            ),
            path,
        )
    assert not path.exists()


def test_no_cell_heard_anywhere(area, tmp_path):
    nothing = np.full((80, 100), -1)
    save(plot_best_server(nothing, (), area.lattice, area.plan, area.base), tmp_path / "b.png")
    dark = np.full((80, 100), np.nan)
    save(plot_level(dark, area.lattice, area.plan, area.base), tmp_path / "l.png")


@pytest.mark.parametrize(
    "bounds", [(0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, np.nan, 1)]
)
def test_bad_extent(bounds):
    with pytest.raises(InputError, match="map extent"):
        BaseMap(bounds)


def test_folder_that_cannot_be_written(area, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        save(
            plot_error_over_distance(estimate(area, None), area.truth), tmp_path / "file" / "e.png"
        )


def test_sector_arrow_points_along_its_azimuth(area):
    """At 90° the arrow points to true east, turned from grid east by the grid convergence."""
    axes = Figure().subplots()
    frame = draw_base(axes, area.base)
    plan = CellPlan(CRS, (area.plan["S1A"],))
    draw_cells(axes, frame, plan, area.base.bounds_m)
    arrow = next(text for text in axes.texts if text.get_text() == "" and text.arrow_patch)
    east, north = np.subtract(arrow.xy, arrow.xyann)
    lon, lat = unproject(CRS, plan.cells[0].east_m, plan.cells[0].north_m)
    convergence = grid_convergence_rad(CRS, float(lon), float(lat))
    assert np.arctan2(north, east) == pytest.approx(convergence, abs=1e-9)
    # West of the central meridian 27° E, grid north lies west of true north.
    assert convergence < 0
    assert np.hypot(east, north) == pytest.approx(0.06 * np.hypot(500.0, 400.0))


def test_parts_of_a_map_have_the_origin_and_the_unit_of_the_whole(area):
    west, south, east, north = area.base.bounds_m
    part = area.base.zoomed((west + 100.0, south + 50.0, east, north))
    axes = Figure().subplots()
    x, y = draw_base(axes, part)(np.array([west + 112.0]), np.array([south + 60.0]))
    assert (x[0], y[0]) == (112.0, 60.0)
    assert (axes.get_xlim(), axes.get_ylim()) == ((100.0, 500.0), (50.0, 400.0))
    again = part.zoomed((west + 200.0, south + 50.0, east, north))
    assert local_frame(again) == local_frame(area.base)
    large = BaseMap((0.0, 0.0, 100.0, 100.0), whole_m=(-1000.0, -500.0, 3000.0, 3000.0))
    x, y = local_frame(large)(np.array([0.0]), np.array([0.0]))
    assert (x[0], y[0]) == (1.0, 0.5)


def test_local_frame_and_scale_bar(area):
    axes = Figure().subplots()
    frame = draw_base(axes, area.base)
    x, y = frame(np.array([WEST_M + 12.0]), np.array([NORTH_M - 400.0]))
    assert (x[0], y[0]) == (12.0, 0.0)
    # A fifth of 500 m: the longest round length that is no more than a quarter of the width.
    assert "100 m" in [text.get_text() for text in axes.texts]
    wide = BaseMap((0.0, 0.0, 9000.0, 9000.0))
    axes = Figure().subplots()
    frame = draw_base(axes, wide)
    x, y = frame(np.array([4500.0]), np.array([3000.0]))
    assert (x[0], y[0]) == (4.5, 3.0)
    assert "2 km" in [text.get_text() for text in axes.texts]
    assert axes.get_xlabel().endswith("km")
