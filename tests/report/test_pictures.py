"""Every picture on a small made area: written whole, the same each time, showing the data."""

from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.collections import PathCollection
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from mapfilter.errors import InputError, OutputError
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import grid_convergence_rad, unproject
from mapfilter.lattice import Lattice
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.positioned_track import Snapshot
from mapfilter.positioning.step_output import Fix
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.report.basemap import BaseMap, draw_base, local_frame
from mapfilter.report.canvas import BLUE, DPI, ORANGE, SKY, VERMILLION
from mapfilter.report.coverage import plot_level
from mapfilter.report.errors import plot_error_over_distance
from mapfilter.report.network import draw_cells, plot_best_server, plot_points_per_cell
from mapfilter.report.saving import png_of, save
from mapfilter.report.snapshots import plot_candidates
from mapfilter.report.track import plot_track

CRS = "EPSG:32635"
WEST_M, NORTH_M = 385_000.0, 6_672_000.0


@dataclass(frozen=True)
class Area:
    lattice: Lattice
    base: BaseMap
    plan: CellPlan
    truth: Truth


@pytest.fixture(scope="session")
def area() -> Area:
    lattice = Lattice(CRS, WEST_M, NORTH_M, 5.0, 80, 100)
    west, south, east, _ = lattice.bounds_m
    street = np.array([[west, south + 100.0], [east, south + 100.0]])
    base = BaseMap(lattice.bounds_m, (street,), attribution="© OpenStreetMap contributors")
    common = {"north_m": south + 200.0, "height_m": 30.0, "eirp_dbm": 55.0, "frequency_mhz": 1800.0}
    cells = (
        Cell(id="S1A", site="S1", east_m=west + 250.0, azimuth_deg=90.0, **common),
        Cell(id="S1$B$", site="S1", east_m=west + 250.0, azimuth_deg=270.0, **common),
        Cell(id="I1", site="I1", east_m=west + 50.0, azimuth_deg=None, antenna="omni", indoor=True,
             **common),
        Cell(id="far", site="far", east_m=west - 9000.0, azimuth_deg=0.0, **common),
    )  # fmt: skip
    time_s = np.arange(0.0, 301.0)
    truth = Truth(time_s, west + 20.0 + 1.4 * time_s, np.full(301, south + 100.0))
    return Area(lattice, base, CellPlan(CRS, cells), truth)


def snapshot(area: Area, count: int, travelled_m: float = 0.0, located: bool = False) -> Snapshot:
    west, south, _, _ = area.lattice.bounds_m
    east_m = west + 20.0 + 440.0 * (np.arange(count) + 0.5) / max(count, 1)
    here = (east_m[0], south + 110.0) if located else (np.nan, np.nan)
    return Snapshot(
        travelled_m / 1.4, travelled_m, east_m, np.full(count, south + 100.0),
        np.full(count, 1 / max(count, 1)), *here,
        Status.TRACKING if located else Status.SEARCHING,
    )  # fmt: skip


def estimate(area: Area, switch_s: float | None, error_m: float = 10.0) -> TrackEstimate:
    """Every fifth second; located from ``switch_s`` on, ``error_m`` north of the truth."""
    fixes = []
    for time_s in area.truth.time_s[::5].tolist():
        on = switch_s is not None and time_s >= switch_s
        status = Status.SEARCHING
        if on:
            status = Status.CONVERGED if time_s - 5.0 < switch_s else Status.TRACKING
        east, north = area.truth.at(time_s)
        fixes.append(
            Fix(
                time_s, float(east) if on else np.nan, float(north) + error_m if on else np.nan,
                np.full((2, 2), np.nan), np.full(3, np.nan), status, 7, np.nan, 0, np.nan,
                Reason.USED,
            )
        )  # fmt: skip
    return TrackEstimate.of_fixes(CRS, "candidate", fixes)


def png_size(path: Path) -> tuple[int, int]:
    """Width and height from the header of a whole PNG file."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert data[-8:-4] == b"IEND"
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def pixels_near(path: Path, colour: str) -> int:
    """Count the pixels of a colour, to within the rounding of its channels."""
    image = imread(path)[:, :, :3]
    return int((np.abs(image - to_rgb(colour)).max(axis=2) < 0.02).sum())


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
