"""Sweeps at the front door: what they take, give and draw."""
# ruff: noqa: ARG002

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from cross_world import (
    LATTICE,
    make_database,
    walk_log,
)
from recording_filter import Recording

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.filters.contract import Reason
from mapfilter.roads.routes import read_roads


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


@pytest.fixture(scope="module")
def streets():
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
        shown = found.plot(figure=figure).get_legend_handles_labels()[1]
        assert [label.partition(": ")[0] for label in shown] == list(filters)
        # Here runs of the others succeed, or switch.
        told = {label.partition(": ")[2] for label in shown}
        assert told <= {"", "no run switched", "no run succeeded"}
    with pytest.raises(mf.MapfilterError, match="compare, baseline: expected one of 'c', 'mine'"):
        found.compare("d")
    with pytest.raises(mf.MapfilterError, match="beside another filter"):
        mf.Sweep(found.runs[found.runs["reading"] == "c"]).compare("c")


def test_a_sweep_takes_the_class_of_options(database, rasters, streets):
    given = {"routes": 1, "length_m": 200.0}
    by_class = mf.sweep(database, rasters, streets, {"c": mf.CandidateFilter}, **given).runs
    by_name = mf.sweep(database, rasters, streets, {"c": "candidate"}, **given).runs
    pd.testing.assert_frame_equal(by_class, by_name)


@pytest.mark.parametrize("options", [mf.BayesFilter(), mf.KalmanFilter()])
def test_a_filter_over_an_area_is_swept_by_its_options(options, database, rasters, streets):
    """Workers make it of them; its class is not called with the database."""
    with pytest.raises(mf.MapfilterError) as caught:
        mf.sweep(database, rasters, streets, {"a": options.over(database)})
    (fault,) = caught.value.faults
    assert fault.hint == f"its options, {type(options).__name__}(…)"
