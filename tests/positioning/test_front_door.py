"""The front door: names, laziness, how objects are shown, errors."""
# ruff: noqa: ARG002

import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from cross_world import (
    LATTICE,
    WALK,
    levels_dbm,
    make_database,
    make_plan,
    make_routes,
    walk_log,
)
from matplotlib.figure import Figure

import mapfilter as mf
from mapfilter.database.build import build
from mapfilter.errors import InputError
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Reason
from mapfilter.positioning.locators import as_filter
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.routes import read_roads


@pytest.mark.parametrize("name", mf.__all__)
def test_every_name_loads_and_is_documented(name):
    assert getattr(mf, name).__doc__


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = mf.nothing


def test_importing_it_loads_no_library():
    code = (
        "import sys, mapfilter; "
        "print(sorted({'numpy', 'pandas', 'geopandas', 'numba', 'pydantic'} & set(sys.modules)))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


@pytest.fixture(scope="module")
def track(database):
    return mf.locate(walk_log(), database, "candidate")


def test_objects_are_shown_in_two_lines(database, track):
    bayes = mf.locate(walk_log(), database).estimate
    scored = mf.score(track, walk_log().truth)
    for one in (database, walk_log(), track, track.estimate, bayes, bayes.evidence, scored):
        lines = repr(one).splitlines()
        assert 1 <= len(lines) <= 2, one
        assert max(map(len, lines)) <= 130, one


def test_a_track_as_tables_and_a_picture(track, database):
    table, places = track.to_dataframe(), track.to_geodataframe()
    assert len(table) == len(track)
    assert {"time_s", "east_m", "north_m", "radius_95_m", "status", "reason"} <= set(table)
    assert len(places) == table["east_m"].notna().sum() < len(table)
    assert places.crs == database.lattice.crs
    assert track.plot().get_title()
    assert "<table" in track._repr_html_()


def test_a_picture_is_saved_as_the_commands_save_theirs(track, tmp_path):
    """Also one of several in a figure, whose axes have a part of it as their figure."""
    path = mf.save_picture(track.plot(), str(tmp_path / "new" / "track.png"))
    assert path == tmp_path / "new" / "track.png"
    again = mf.save_picture(track.plot(), tmp_path / "again.png")
    assert path.read_bytes() == again.read_bytes()
    figure = Figure()
    left, _ = figure.subfigures(1, 2)
    mf.save_picture(track.plot(left.subplots()), tmp_path / "parts.svg")
    assert (tmp_path / "parts.svg").read_text().startswith("<?xml")
    with pytest.raises(mf.MapfilterError, match=r"\.png, \.svg or \.pdf"):
        mf.save_picture(figure, tmp_path / "track.bmp")


@pytest.mark.parametrize("filter_", ["ekf", mf.KalmanFilter(), mf.KalmanFilter], ids=str)
def test_a_filter_without_a_map_needs_no_database(filter_, tmp_path):
    walk = walk_log(WALK[:2])
    fixes = walk.truth[["time_s", "east_m", "north_m"]]
    log = mf.make_log(walk.crs, motion=walk.motion, gnss=fixes, truth=walk.truth)
    found = mf.locate(log, None, filter_)
    assert found.database is None
    assert mf.score(found, log.truth).error_mean_m < 20
    assert any(one.get_text() == "end" for one in found.plot().texts)
    assert found.view() is not None
    mf.write_log(log, tmp_path / "log")
    by_path = mf.locate(tmp_path / "log", filter=filter_)
    pd.testing.assert_frame_equal(by_path.to_dataframe(), found.to_dataframe())


def test_a_filter_without_a_map_may_have_sites_of_its_own(database):
    over_sites = mf.KalmanFilter().over_sites(database.plan)
    found = mf.locate(walk_log(), filter=over_sites).to_dataframe()
    by_database = mf.locate(walk_log(), database, over_sites).to_dataframe()
    pd.testing.assert_frame_equal(found, by_database)
    still = mf.make_log(walk_log().crs, motion=walk_log().motion)
    for filter_ in ("ekf", over_sites):
        (note,) = mf.locate(still, filter=filter_).log.notes
        assert note == "nothing is located: no positions and no radio to start from"


def test_cells_without_sites_are_left_out_where_there_are_fixes():
    walk = walk_log(WALK[:2])
    fixes = walk.truth[["time_s", "east_m", "north_m"]]
    placed = mf.make_log(walk.crs, motion=walk.motion, radio=walk.radio, gnss=fixes)
    found = mf.locate(placed, filter="ekf")
    note, _ = found.log.notes
    assert note.startswith(f"{len(walk.radio)} rows of cells (radio) left out: ")
    assert "KalmanFilter().over_sites(plan)" in note
    bare = mf.locate(mf.make_log(walk.crs, motion=walk.motion, gnss=fixes), filter="ekf")
    pd.testing.assert_frame_equal(bare.to_dataframe(), found.to_dataframe())


@pytest.mark.parametrize("filter_", [mf.CandidateFilter(), "candidate"], ids=str)
def test_a_filter_is_given_by_options_or_name(filter_, database, track):
    found = mf.locate(walk_log(), database, filter_)
    pd.testing.assert_frame_equal(found.to_dataframe(), track.to_dataframe())


def test_a_track_says_what_a_log_lacks_that_was_not_located(database):
    walk = walk_log(WALK[:2])
    fixes = walk.truth[["time_s", "east_m", "north_m"]]
    still = mf.make_log(walk.crs, radio=walk.radio, truth=walk.truth)
    (note,) = mf.locate(still, database).log.notes
    assert note.startswith("nothing is located: no motion (mf.read_log makes it of")
    assert note.endswith("mf.locate_reports needs none)")
    placed = mf.make_log(walk.crs, radio=walk.radio, gnss=fixes)
    lost = mf.locate(placed, database, "candidate")
    (note,) = lost.log.notes[-1:]
    assert note.startswith("nothing is located: no motion")
    assert note.endswith('filter="ekf" needs none beside positions)')
    for kept in ({"gnss": fixes}, {"gnss": fixes, "radio": walk.radio}):
        fixed = mf.make_log(walk.crs, **kept)
        (note,) = mf.locate(fixed, database).log.notes[-1:]
        assert note.startswith("no motion: positions alone are followed (mf.read_log makes it of")
        assert mf.locate(fixed, database, "ekf").estimate.converged_at is not None
    alone = mf.make_log(walk.crs, motion=walk.motion[:40])
    notes = mf.locate(alone, database).log.notes
    assert any("never converged in" in one for one in notes)
    assert mf.locate(walk, database, "candidate").log.notes == walk.notes


def test_a_score_has_the_error_of_each_epoch(track):
    score = mf.score(track, walk_log().truth)
    assert score.switched
    assert score.error_m.shape == (len(track),)
    assert list(score.to_dataframe()["success"]) == [score.success]
    assert repr(mf.score(track.estimate, walk_log().truth)) == repr(score)


def test_a_score_takes_ground_truth_in_any_order_and_each_row_once(track):
    truth = walk_log().truth
    expected = repr(mf.score(track, truth))
    for other in (truth.sample(frac=1, random_state=0), pd.concat([truth, truth]), truth[::-1]):
        assert repr(mf.score(track, other)) == expected
        assert repr(mf.score(track, Truth.of_table(other))) == expected
    with pytest.raises(mf.MapfilterError, match="truth row 6, east_m"):
        mf.score(track, truth.assign(east_m=truth["east_m"].where(truth.index != 5)))


def test_a_score_has_the_share_within_the_radius(track):
    truth = walk_log().truth
    assert np.isnan(mf.score(track, truth).within_95)
    wide_m = np.where(np.arange(len(track.estimate)) % 4, 1e6, 1e-6)
    radii_m = np.repeat(wide_m[:, None], 3, axis=1)
    score = mf.score(replace(track.estimate, radii_m=radii_m), truth)
    begin = track.estimate.converged_at
    scored = np.flatnonzero(np.isfinite(score.error_m))
    expected = np.mean(scored[scored >= begin] % 4 > 0)
    assert score.within_95 == score.to_dataframe()["within_95"][0] == expected
    assert repr(score).endswith(f" m at 95 %; the 95 % radius holds {expected:.2f}")


def test_a_score_says_what_the_ground_truth_does_not_tell(track):
    truth = walk_log().truth
    whole = mf.score(track, truth)
    late = mf.score(track, truth[truth["time_s"] > whole.switch_time_s])
    assert (late.switched, late.success) == (True, None)
    begins = "Score: converged where there is no ground truth; then "
    assert repr(late).startswith(begins + f"{late.error_mean_m:.1f} m on average")
    other = mf.score(track, truth.assign(time_s=truth["time_s"] + 1e6))
    assert repr(other).splitlines() == [
        "Score: converged where there is no ground truth; no error is known",
        f"  {other.notes[0]}",
    ]
    assert "covers no epoch of the log" in other.notes[0]
    assert other.notes[0].endswith("another clock or time zone?")
    assert whole.notes == ()
    assert "notes" not in other.to_dataframe()


def test_a_ground_truth_of_elsewhere_is_refused(track, database):
    log = walk_log()
    degrees = log.truth.assign(east_m=-8.61, north_m=41.15)
    likely = "degrees given for metres"
    with pytest.raises(mf.MapfilterError, match=f"truth: expected positions near .+{likely}"):
        mf.score(track, degrees)
    far = mf.make_log(log.crs, motion=log.motion, radio=log.radio, truth=degrees)
    with pytest.raises(mf.MapfilterError, match=f"log, truth: expected positions near .+{likely}"):
        mf.locate(far, database)


def test_a_log_of_unknown_cells_says_which(database):
    log = walk_log()
    radio = log.radio.assign(cell="X" + log.radio["cell"].astype(str))
    found = mf.locate(mf.make_log(log.crs, motion=log.motion, radio=radio), database)
    (note,) = [one for one in found.log.notes if "nothing is located" in one]
    first = radio.loc[radio["role"] == "serving", "cell"].value_counts().index[0]
    assert f"(the log has {first}" in note
    assert f"the database has {database.cell_ids[0]}, " in note
    assert len(found.log.notes) == 1
    assert "capitals" not in note
    assert repr(found).endswith("; 1 note in log.notes")
    small = log.radio.assign(cell=log.radio["cell"].str.lower())
    found = mf.locate(mf.make_log(log.crs, motion=log.motion, radio=small), database)
    (note,) = [one for one in found.log.notes if "nothing is located" in one]
    assert "some differ by capitals alone)" in note


@pytest.mark.parametrize(
    ("name", "likely"),
    [("Bayes", "bayes"), ("bays", "bayes"), ("EKF", "ekf"), ("my.module.Mine", "my.module:Mine")],
)
def test_a_wrong_name_of_a_filter_names_the_likely_one(database, name, likely):
    with pytest.raises(mf.MapfilterError) as caught:
        mf.locate(walk_log(), database, name)
    assert str(caught.value).endswith(f"(likely: {likely})")


def test_the_embedded_map_in_other_letters_is_named(rasters):
    with pytest.raises(mf.MapfilterError, match='the embedded map "helsinki"'):
        mf.read_routes("Helsinki", rasters.lattice)


def test_what_is_no_ground_truth_is_refused(track):
    with pytest.raises(mf.MapfilterError, match="columns time_s, east_m and north_m, found x"):
        mf.score(track, pd.DataFrame({"x": [1.0]}))
    with pytest.raises(mf.MapfilterError, match="two positions or more, found 1"):
        mf.score(track, walk_log().truth.iloc[:1])
    blind = mf.make_log(walk_log().crs, motion=walk_log().motion)
    with pytest.raises(mf.MapfilterError, match="the log has no ground truth"):
        mf.score(track, blind.truth)


def test_an_unknown_filter_is_refused(database):
    with pytest.raises(mf.MapfilterError, match="filter: expected bayes"):
        mf.locate(walk_log(), database, "bays")


class Recording(mf.Filter):
    """Takes GNSS only; fails where it is told to."""

    name, crs = "recording", "EPSG:32629"
    uses = ("gnss",)

    def __init__(self, database):
        pass

    def begin(self, kinds=()):
        return 0

    def step(self, state, epoch, rng):
        if state == 3:
            raise ValueError("no idea")
        fix = mf.Fix.nowhere(epoch.time_s, mf.Status.SEARCHING, Reason.NO_READING)
        return state + 1, mf.StepOutput(fix)


class Centre:
    """Somewhere about the middle of the points of the serving cell, by chance."""

    def __init__(self, database):
        self.database = database

    def begin(self, kinds=()):
        return mf.Status.SEARCHING

    def step(self, state, epoch, rng):
        searching = state is mf.Status.SEARCHING
        cells = [row.cell for row in epoch.radio if row.role == "serving"]
        if not cells:
            status = mf.Status.TRACKING if not searching else state
            fix = mf.Fix.nowhere(epoch.time_s, status, Reason.NO_SERVING_CELL)
            return status, mf.StepOutput(fix)
        row, col, _ = self.database.cell_points(cells[0])
        east_m, north_m = self.database.lattice.east_north(row, col)
        at = east_m.mean() + rng.normal(0, 30), north_m.mean() + rng.normal(0, 30)
        status = mf.Status.CONVERGED if searching else mf.Status.TRACKING
        unknown = np.full((2, 2), np.nan), np.full(3, np.nan)
        fix = mf.Fix(epoch.time_s, *at, *unknown, status, 1, np.nan, 0, np.nan, Reason.USED)
        return status, mf.StepOutput(fix)


@pytest.mark.parametrize("given", [Recording, f"{__name__}:Recording"], ids=["class", "name"])
def test_a_custom_filter_is_the_same_by_class_and_by_name(given, database):
    with pytest.raises(mf.MapfilterError, match=r"test_front_door.py line \d+, in step.*no idea"):
        mf.locate(walk_log(), database, given)
    bound = as_filter(given, database)
    assert bound.uses == ("gnss",)


def test_the_class_of_options_means_its_defaults(database):
    assert as_filter(mf.CandidateFilter, database).filter.options == mf.CandidateFilter()


@pytest.fixture(scope="module")
def streets():
    from cross_world import LATTICE
    from shapely import LineString

    west, south, east, north = LATTICE.bounds_m
    lines = [
        LineString([(west + 25, south + 147.5), (east - 25, south + 147.5)]),
        LineString([(west + 127.5, south + 20), (west + 127.5, north - 20)]),
    ]
    return gpd.GeoDataFrame({"highway": ["residential"] * 2}, geometry=lines, crs="EPSG:32629")


@pytest.fixture(scope="module")
def rasters(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rasters")
    make_database(folder)
    return mf.open_rasters(next(folder.rglob("*.tif")), "level")


def swept(database, rasters, streets, **given):
    filters = {"c": mf.CandidateFilter(), "again": "candidate"}
    return mf.sweep(database, rasters, streets, filters, routes=2, length_m=200.0, **given)


def test_a_sweep_takes_reports_and_periods_as_given(database, rasters, streets):
    reports = mf.ReportModel(report_period_s=5.0)
    noise = mf.ImuNoise(period_s=0.5)
    runs = swept(database, rasters, streets, noises=(noise,), reports=reports).runs
    assert set(runs["report_period_s"]) == {5.0}
    assert set(runs["imu_period_s"]) == {0.5}
    assert set(runs["radio"]) == {"ground truth"}
    plain = mf.ReportModel(report_period_s=5.0, radio="as_predicted")
    assert set(swept(database, rasters, streets, reports=plain).runs["radio"]) == {"as_predicted"}


def test_streets_of_another_system_than_the_rasters_are_refused(database, rasters, streets):
    ways = replace(read_roads(streets, rasters.lattice).ways, crs="EPSG:32630")
    with pytest.raises(InputError, match="streets, crs: expected the rasters' EPSG:32629"):
        swept(database, rasters, ways)
    with pytest.raises(InputError, match="streets, crs"):
        mf.simulate(rasters, replace(database.plan, crs="EPSG:32630"), ways, length_m=200.0)


def test_noises_of_any_field_have_cells_of_their_own(database, rasters, streets):
    noises = (mf.ImuNoise(), mf.ImuNoise(heading_correlation_s=20.0, step_scale_wander=0.3))
    found = swept(database, rasters, streets, noises=noises)
    assert repr(found) == "Sweep: 8 runs in 4 cells of its grid"
    assert {"imu.heading_correlation_s", "imu.step_scale_wander"} <= set(found.runs)
    assert found.plot().get_title()


def test_cells_of_a_sweep_are_a_table_of_plain_columns(database, rasters, streets):
    noises = (mf.ImuNoise(), mf.ImuNoise(heading_correlation_s=20.0))
    filters = {"c": mf.CandidateFilter(update_length_m=5.0), "b": mf.BayesFilter()}
    given = {"routes": 1, "length_m": 200.0, "noises": noises}
    found = mf.sweep(database, rasters, streets, filters, **given)
    table = found.to_dataframe()
    assert "varied" not in table
    assert table["imu.heading_correlation_s"].tolist() == [0.0, 0.0, 20.0, 20.0]
    assert len(table.drop_duplicates()) == 4
    assert table.groupby("imu.heading_correlation_s").size().tolist() == [2, 2]
    by_name = table.groupby("reading")["update_length_m"].first()
    assert by_name["c"] == 5.0
    assert np.isnan(by_name["b"])
    coordinates = list(found.runs)[: list(found.runs).index("route")]
    assert list(table)[: len(coordinates)] == coordinates


def test_a_sweep_of_drives_is_one_of_logs_of_vehicles(database, rasters, streets):
    """Drives are faster than walks, and their filters are those of vehicles, as by mf.locate."""

    def runs(profile, options):
        given = {"routes": 2, "length_m": 200.0, "seed": 4, "profile": profile}
        return mf.sweep(database, rasters, streets, {"b": options}, **given).runs

    easy = {"switch_mass": 0.1, "switch_hold_m": 0.0}
    walks, drives = (runs(profile, mf.BayesFilter(**easy)) for profile in ("walking", "driving"))
    assert (drives["epochs"] < 0.5 * walks["epochs"]).all()
    vehicle = mf.BayesFilter(vehicle=True, **easy)
    pd.testing.assert_frame_equal(runs("driving", vehicle), drives)
    assert not runs("walking", vehicle).equals(walks)
    with pytest.raises(mf.MapfilterError, match="sweep, profile: expected 'walking'"):
        runs("cycling", vehicle)


def test_a_sweep_reports_its_progress_and_fills_its_workers(database, rasters, streets):
    """As many batches are under way at once as in_flight says."""

    class Counts(ThreadPoolExecutor):
        handed, most = 0, 0

        def submit(self, fn, /, *args, **kwargs):
            self.handed += 1
            self.most = max(self.most, self.handed - len(told) + 1)
            return super().submit(fn, *args, **kwargs)

    told = []
    with Counts(2) as executor:
        given = {"draws": 50, "executor": executor, "in_flight": 6}
        found = swept(database, rasters, streets, **given, progress=lambda *at: told.append(at))
    assert told[0] == (0, 200)
    assert told[-1] == (200, 200) == (len(found.runs), 200)
    assert executor.most == 6
    with pytest.raises(mf.MapfilterError, match="sweep, progress: expected a function, found 3"):
        swept(database, rasters, streets, progress=3)


def test_the_radius_of_a_sweep_is_drawn_where_there_is_one(database, rasters, streets):
    alone = swept(database, rasters, streets)
    assert alone.to_dataframe()["coverage_95"].isna().all()
    with pytest.raises(mf.MapfilterError, match="plot, figure: expected 'success', as no position"):
        alone.plot(figure="coverage_95")
    with pytest.raises(mf.MapfilterError, match="plot, figure: expected 'success', 'coverage_95'"):
        alone.plot(figure="coverage")


def ticks_of(axes):
    return [label.get_text() for label in axes.get_xticklabels()]


def test_a_sweep_is_drawn_over_what_it_varies(database, rasters, streets):
    noises = (mf.ImuNoise(scale=0.0), mf.ImuNoise(scale=0.05))
    axes = swept(database, rasters, streets, noises=noises).plot()
    assert axes.get_xlabel() == "standard deviation of the step scale"
    assert ticks_of(axes) == ["0", "0.05"]
    filters_alone = swept(database, rasters, streets)
    axes = filters_alone.plot()
    assert (axes.get_xlabel(), ticks_of(axes)) == ("filter", ["c", "again"])
    at = {float(x) for line in axes.lines for x in line.get_xdata()}
    assert at == {0.0, 1.0}


def test_what_cannot_be_swept_is_refused(database, rasters, streets):
    with pytest.raises(mf.MapfilterError, match="noises: expected one noise or several, each once"):
        swept(database, rasters, streets, noises=(mf.ImuNoise(), mf.ImuNoise()))
    with pytest.raises(mf.MapfilterError, match="noises, turns: expected one value for all"):
        swept(database, rasters, streets, noises=(mf.ImuNoise(), mf.ImuNoise(turns="gyro")))
    gyro = mf.ImuNoise(turns="gyro"), mf.ImuNoise(turns="gyro", gyro_bias_deg_per_s=1.0)
    with pytest.raises(mf.MapfilterError, match=r"gyro_bias_deg_per_s: .*one without effect"):
        swept(database, rasters, streets, noises=gyro)
    made = "the name of a filter, found Recording .likely: its class, Recording"
    for wrong, told in ((3.0, "found float$"), (Recording(database), made)):
        with pytest.raises(mf.MapfilterError, match=told):
            mf.sweep(database, rasters, streets, {"mine": wrong})


def test_a_sweep_takes_the_class_of_a_filter(database, rasters, streets):
    """As mf.locate does, of a notebook, too; workers have to import it."""
    given = {"routes": 2, "length_m": 200.0}
    named = f"{Centre.__module__}:Centre"
    by_name = mf.sweep(database, rasters, streets, {"mine": named}, **given).runs

    class Local(Centre):
        pass

    for made in (Centre, Local, lambda area: Centre(area), partial(Centre)):
        found = mf.sweep(database, rasters, streets, {"mine": made}, **given).runs
        pd.testing.assert_frame_equal(found.drop(columns="filter"), by_name.drop(columns="filter"))
        known = mf.locate(walk_log(), database, made).estimate
        assert known.filter == found["filter"].iloc[0]
    with ThreadPoolExecutor(2) as executor:
        found = mf.sweep(database, rasters, streets, {"mine": Local}, executor=executor, **given)
        pd.testing.assert_frame_equal(
            found.runs.drop(columns="filter"), by_name.drop(columns="filter")
        )
    with ProcessPoolExecutor(1) as executor:
        for nameless in (Local, lambda area: Centre(area), partial(Local)):
            with pytest.raises(mf.MapfilterError, match=r"can import, .*in?to a file of its own"):
                mf.sweep(database, rasters, streets, {"mine": nameless}, executor=executor)


def test_filters_of_a_sweep_are_compared_run_by_run(database, rasters, streets):
    filters = {"c": mf.CandidateFilter(), "mine": Centre, "b": mf.BayesFilter()}
    noises = (mf.ImuNoise(), mf.ImuNoise(sigma_orient_deg=9.0))
    given = {"noises": noises, "routes": 2, "length_m": 200.0}
    found = mf.sweep(database, rasters, streets, filters, **given)
    pairs = found.compare("c")
    assert pairs["reading"].tolist() == ["mine", "b"] * 2
    assert set(pairs["baseline"]) == {"c"}
    assert (pairs["runs"] == 2).all()
    rates = found.to_dataframe().set_index(["sigma_orient_deg", "reading"])["success"]
    for one in pairs.itertuples():
        at = one.sigma_orient_deg
        assert one.success == rates[at, one.reading] - rates[at, "c"]
    for figure in ("error_at_switch_m", "error_mean_m", "switch_distance_m"):
        assert found.plot(figure=figure).get_legend_handles_labels()[1] == list(filters)
    with pytest.raises(mf.MapfilterError, match="compare, baseline: expected one of 'c', 'mine'"):
        found.compare("d")
    with pytest.raises(mf.MapfilterError, match="beside another filter"):
        mf.Sweep(found.runs[found.runs["reading"] == "c"]).compare("c")


def test_a_sweep_takes_the_class_of_options(database, rasters, streets):
    given = {"routes": 1, "length_m": 200.0}
    by_class = mf.sweep(database, rasters, streets, {"c": mf.CandidateFilter}, **given).runs
    by_name = mf.sweep(database, rasters, streets, {"c": "candidate"}, **given).runs
    pd.testing.assert_frame_equal(by_class, by_name)


def test_single_reports_are_named_by_the_plan_as_replays_are(tmp_path):
    plan = make_plan()
    numbered = [
        replace(cell, mcc=262, mnc=1, lac=7, ci=100 + k) for k, cell in enumerate(plan.cells)
    ]
    plan = replace(plan, cells=tuple(numbered))
    items = ((cell.id, levels_dbm(cell)) for cell in plan.cells)
    write_rasters(tmp_path / "rxlev.tif", LATTICE, items, plan.ids)
    known = build(open_rasters(tmp_path / "rxlev.tif"), plan, make_routes(), tmp_path / "database")
    walk = walk_log()
    number = {cell.id: cell.ci for cell in plan.cells}
    radio = walk.radio.assign(
        mcc=262, mnc=1, lac=7, ci=walk.radio["cell"].map(number).astype("Int64"), cell=None
    )
    nameless = mf.make_log(walk.crs, motion=walk.motion, radio=radio, truth=walk.truth)
    found = mf.locate_reports(nameless, known, "knn").to_dataframe()
    named = mf.locate_reports(walk, known, "knn").to_dataframe()
    assert len(named) > 50
    pd.testing.assert_frame_equal(found, named)


@pytest.mark.parametrize("options", [mf.BayesFilter(), mf.KalmanFilter()])
def test_a_filter_over_an_area_is_swept_by_its_options(options, database, rasters, streets):
    """Workers make it of them; its class is not called with the database."""
    with pytest.raises(mf.MapfilterError) as caught:
        mf.sweep(database, rasters, streets, {"a": options.over(database)})
    (fault,) = caught.value.faults
    assert fault.hint == f"its options, {type(options).__name__}(…)"
