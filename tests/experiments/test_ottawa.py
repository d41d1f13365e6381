"""Sessions found on the map that other sessions made: a made block, and real walks."""

import json
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mapfilter._json_files import sealed
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, InputError
from mapfilter.experiments.benchmarks.ottawa import (
    FOLDER,
    OttawaOptions,
    centroid_errors_m,
    find_session,
    has_truth,
    locate_session,
)
from mapfilter.experiments.benchmarks.ottawa_sessions import (
    ReckoningErrors,
    read_session,
    session_log,
    step_factor_of,
)
from mapfilter.experiments.benchmarks.ottawa_table import read_left_out
from mapfilter.filters.belief_models import Cloud
from mapfilter.geodesy import unproject
from mapfilter.lattice import Lattice
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.measured_map import MeasuredMapOptions, MeasuredRows, ServingStatistics
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.rasters.opening import open_rasters
from mapfilter.workflows.evaluations.ottawa import Task, find_left_out, run_ottawa

CRS = "EPSG:32618"
WEST, SOUTH = 445_000.0, 5_030_000.0
ANTENNAS = {1: (-60.0, 40.0), 2: (300.0, 460.0), 3: (520.0, -40.0)}
STEP_M, SPEED_MPS = 20.0, 4.0
METHODS = ["bayes", "smoothed", "oracle-start", "oracle-motion", "centroid"]
CHOSEN = OttawaOptions()
QUICK = replace(
    CHOSEN,
    filter=replace(CHOSEN.filter, max_particles=2000, min_search_particles=1500, min_particles=500),
)
"""A fifth of the particles."""


def write_ride(path, seed, start_s):
    """A ride once and a half around a block of 400 m; the strongest cell serves."""
    rng = np.random.default_rng(seed)
    along_m = np.arange(0.0, 2400.0, STEP_M)
    corners = np.array([[0, 0], [400, 0], [400, 300], [0, 300]] * 2 + [[0, 0]], dtype=float)
    sides = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    place_m = np.column_stack([np.interp(along_m, sides, axis) for axis in corners.T])
    ahead_m = np.column_stack([np.interp(along_m + 1, sides, axis) for axis in corners.T])
    seen_m = place_m + rng.normal(0, 2, place_m.shape)
    lon, lat = unproject(CRS, WEST + seen_m[:, 0], SOUTH + seen_m[:, 1])
    distance_m = np.array([np.hypot(*(place_m - site).T) for site in ANTENNAS.values()])
    level_dbm = -30 - 33 * np.log10(distance_m + 20) + 4 * np.sin(along_m / 60)
    heard_dbm = level_dbm + rng.normal(0, 2, level_dbm.shape)
    serving = np.argmax(heard_dbm, axis=0)
    every = np.arange(along_m.size)
    pd.DataFrame(
        {
            "mcc": 1, "mnc": 1, "lac": 7, "cellid": serving + 1, "lat": lat, "lon": lon,
            "signal": heard_dbm[serving, every].round(),
            "measured_at": (1000 * (start_s + along_m / SPEED_MPS)).round().astype(np.int64),
            "rating": np.where(every % 10 == 9, 40.0, 6.0),
            "speed": SPEED_MPS,
            "direction": np.degrees(np.arctan2(*(ahead_m - place_m).T)) % 360,
            "act": "LTE", "ta": distance_m[serving, every] // 78,
        }
    ).to_csv(path, index=False)  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    data = tmp_path_factory.mktemp("made")
    folder = data / FOLDER / "carling"
    folder.mkdir(parents=True)
    for number in range(3):
        name = f"OpenCellID_2021010{number + 1}.csv"
        write_ride(folder / name, number, 1_600_000_000 + 86_400 * number)
    return data


@pytest.fixture(scope="module")
def found(made, tmp_path_factory):
    folder = tmp_path_factory.mktemp("found")
    return run_ottawa(made, folder, runs=1, parts=("carling",), options=QUICK)


def test_made_sessions_are_found_on_the_map_of_the_others(found):
    rows = {row.method: row for row in found.rows}
    assert list(rows) == METHODS
    bayes, centroid = rows["bayes"], rows["centroid"]
    assert bayes.unit_count == 3
    assert bayes.success == 1.0
    assert bayes.success_low == pytest.approx(3 / (3 + 1.96**2), abs=1e-3)
    assert bayes.median_m < 20 < 60 < centroid.median_m
    assert rows["smoothed"].n > bayes.n
    # Who knows the start claims sooner, so that more fixes are scored.
    assert rows["oracle-start"].n > bayes.n
    assert rows["oracle-start"].success == rows["oracle-motion"].success == 1.0
    assert bayes.baseline_m == centroid.median_m
    assert [one.on_map for one in found.sessions] == [1.0, 1.0, 1.0]


def test_the_table_is_written(found):
    table = json.loads((found.out / "table.json").read_text())
    assert [row["method"] for row in table["rows"]] == METHODS
    assert [one["method"] for one in table["intervals"]] == METHODS
    assert table["sessions"][0]["successes"] == 1


def test_what_is_finished_is_kept_and_another_benchmark_not_resumed(found, made, tmp_path):
    shutil.copytree(found.out, tmp_path / "out")
    options = {"runs": 1, "parts": ("carling",), "options": QUICK, "resume": True}
    written = tmp_path / "out" / "carling" / "OpenCellID_20210102" / "found.json"
    told = json.loads(written.read_text())
    told["found"][0]["error_m"] = [7.0, 7.0]
    told["found"][0]["covered"] = [True, False]
    written.write_text(json.dumps(sealed(told)))
    seen = []
    again = run_ottawa(made, tmp_path / "out", progress=lambda *at: seen.append(at), **options)
    assert seen == [(3, 3)]
    assert again.sessions[1].median_m == 7.0
    assert again.sessions[1].coverage_95 == 0.5
    assert again.sessions[::2] == found.sessions[::2]
    assert (tmp_path / "out" / "carling" / "errors.png").stat().st_size > 10_000
    with pytest.raises(ConfigError, match="another seed"):
        run_ottawa(made, tmp_path / "out", seed=5, **options)
    written.write_text(json.dumps({**sealed(told), "session": "edited"}))

    def first_two_are_kept(*at):
        raise ZeroDivisionError(at)

    with pytest.raises(ZeroDivisionError, match=r"2, 3"):
        run_ottawa(made, tmp_path / "out", progress=first_two_are_kept, **options)
    data = next((made / FOLDER / "carling").glob("*.csv"))
    before = data.read_bytes()
    data.write_bytes(before + before.splitlines(keepends=True)[-1])
    with pytest.raises(ConfigError, match="another data"):
        run_ottawa(made, tmp_path / "out", **options)
    data.write_bytes(before)
    anew = options | {"resume": False, "progress": lambda *_: 1 / 0}
    with pytest.raises(ZeroDivisionError):
        run_ottawa(made, tmp_path / "out", seed=5, **anew)
    # What was cut short leaves no results of another seed.
    assert not list((tmp_path / "out").rglob("found.json"))


def test_a_place_where_a_cell_was_not_measured_says_less_of_its_level(found, made):
    one = read_session(min((made / FOLDER / "carling").iterdir()))
    folder = found.out / "carling" / one.name
    deviation = open_rasters(folder / "rxlev-deviation.tif")
    database = open_database(folder / "database")
    model = QUICK.filter.over(database).model
    told = deviation.read(cells=model.area.cell_ids)[:, model.area.on_way]
    held = model.level_sd_db.reshape(len(told), *model.area.on_way.shape)[:, model.area.on_way]
    assert np.isnan(told).any()
    np.testing.assert_array_equal(held[np.isnan(told)], 8.0)
    np.testing.assert_array_equal(held[~np.isnan(told)], told[~np.isnan(told)])
    assert np.isfinite(database.field().level_dbm).all()
    level = LevelReport(
        np.array([0], "i4"), np.array([-100], "f4"), np.zeros(0, "i4"), np.zeros(0, "f4"), 0.0
    )
    state = np.zeros((STATES, model.area.points.shape[1]), dtype=np.float32)
    state[:2] = model.area.points
    cloud = Cloud(state, np.empty((0, state.shape[1]), np.float32))
    errors = replace(model.evidence.levels, fault_probability=1e-300)
    sound = replace(model, evidence=replace(model.evidence, levels=errors))

    def found_by(sd_db):
        by, log_weight = replace(sound, level_sd_db=sd_db), np.zeros(state.shape[1])
        by.weigh(cloud, log_weight, RadioReading(levels=level))
        return log_weight

    same = np.full_like(model.level_sd_db, errors.total_db)
    pixel = [model.area.lattice.row_col(*place) for place in model.area.points.T
             + np.array(model.area.origin_m)]  # fmt: skip
    here = np.array([model.area.level_dbm[int(row), int(col), 0] for row, col in pixel])
    for factor in (1.0, 0.5, 2.0):
        # A map that is better than the errors' total is not believed to be.
        total_db = max(factor, 1.0) * errors.total_db
        variance = total_db**2 + errors.device_db**2
        expected = -0.5 * ((-100.0 - here) ** 2 / variance + np.log(variance))
        np.testing.assert_allclose(
            found_by(factor * same), errors.weight * expected, rtol=5e-3, atol=5e-3
        )
    # At half of the pixels less is known.
    part = same.copy()
    part[:, ::2] *= 2
    at = np.array([int(row) * model.area.lattice.cols + int(col) for row, col in pixel])
    expected = np.where(at % 2 == 0, found_by(2 * same), found_by(same))
    np.testing.assert_allclose(found_by(part), expected, rtol=1e-6)


def test_equal_seeds_find_the_same(found, made):
    one = read_session(min((made / FOLDER / "carling").iterdir()))
    folder = found.out / "carling" / one.name
    positioner = QUICK.filter.over(open_database(folder / "database"))
    first, again, other = (
        find_session("carling", one, positioner, QUICK, seed, 0)[0] for seed in (7, 7, 8)
    )
    assert first.error_m.size > 10
    assert first.error_m.tobytes() == again.error_m.tobytes()
    assert first.error_m.tobytes() != other.error_m.tobytes()


def test_dead_reckoning_without_errors_follows_the_truth(made):
    session = read_session(made / FOLDER / "carling" / "OpenCellID_20210101.csv")
    log = session_log(session, CRS, ReckoningErrors(0.0, 0.0, 0.0), np.random.default_rng(0))
    step_m, heading = log.motion["step_m"].to_numpy(), log.motion["heading_rad"].to_numpy()
    place_m = np.cumsum(step_m[:, None] * np.column_stack([np.cos(heading), np.sin(heading)]), 0)
    truth_m = log.truth[["east_m", "north_m"]].to_numpy()
    assert np.abs(truth_m[1:] - truth_m[0] - place_m[1::2]).max() < 40
    assert log.radio["timing_advance"].max() <= 6
    assert log.gnss.empty


def test_the_step_factor_is_learnt_of_sessions_whose_speed_is_too_low(made):
    sessions = [read_session(path) for path in sorted((made / FOLDER / "carling").iterdir())]
    assert step_factor_of(sessions, CRS) == pytest.approx(1.0, abs=0.03)
    slow = [replace(one, speed_mps=0.8 * one.speed_mps) for one in sessions]
    factor = step_factor_of(slow, CRS)
    assert factor == pytest.approx(1.25, abs=0.04)
    told, right = (
        session_log(one, CRS, ReckoningErrors(0, 0, 0), np.random.default_rng(0), step_factor=by)
        for one, by in ((slow[0], 1.25), (sessions[0], 1.0))
    )
    np.testing.assert_allclose(told.motion["step_m"], right.motion["step_m"])
    still = [replace(one, speed_mps=0 * one.speed_mps) for one in sessions]
    assert step_factor_of(still, CRS) == 1.0


def test_the_bias_is_of_all_headings_of_a_session(made):
    session = read_session(made / FOLDER / "carling" / "OpenCellID_20210101.csv")
    plain, turned = (
        session_log(session, CRS, ReckoningErrors(0.0, 0.0, bias), np.random.default_rng(1))
        for bias in (0.0, 0.1)
    )
    beside = turned.motion["heading_rad"] - plain.motion["heading_rad"]
    assert np.ptp(np.angle(np.exp(1j * beside))) < 1e-9
    assert np.abs(np.angle(np.exp(1j * beside))).max() == pytest.approx(0.1)


def test_nothing_is_known_of_the_way_over_a_silence(made, tmp_path):
    table = pd.read_csv(made / FOLDER / "carling" / "OpenCellID_20210101.csv")
    table.loc[50:, "measured_at"] += 60_000
    table.to_csv(tmp_path / "silent.csv", index=False)
    log = session_log(
        read_session(tmp_path / "silent.csv"), CRS, ReckoningErrors(), np.random.default_rng(0)
    )
    assert np.flatnonzero(log.motion["step_m"].isna()).tolist() == [98, 99]


def test_rows_of_one_time_count_once_and_strange_timing_advances_not(made, tmp_path):
    table = pd.read_csv(made / FOLDER / "carling" / "OpenCellID_20210101.csv")
    table.loc[5, "ta"] = 2**31 - 1
    pd.concat([table, table.iloc[:7]]).to_csv(tmp_path / "twice.csv", index=False)
    session = read_session(tmp_path / "twice.csv")
    assert len(session) == len(table)
    assert np.flatnonzero(np.isnan(session.timing_advance)).tolist() == [5]


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", "mcc,mnc\n"])
def test_a_file_of_another_kind_is_refused(tmp_path, text):
    (tmp_path / "other.csv").write_text(text)
    with pytest.raises(InputError, match=r"other\.csv"):
        read_session(tmp_path / "other.csv")


def test_a_data_set_that_is_not_there_is_told(tmp_path):
    with pytest.raises(InputError, match=FOLDER):
        run_ottawa(tmp_path, tmp_path / "out")


def test_centroids_of_real_rides_are_far_off(shared_data):
    folder = shared_data / FOLDER / "lacolyoc"
    names = [path for path in sorted(folder.glob("*.csv")) if "20200830" not in path.name]
    sessions = [read_session(path) for path in names]
    errors_m = np.concatenate(
        [
            centroid_errors_m(one, [other for other in sessions if other is not one], CRS)
            for one in sessions
        ]
    )
    assert errors_m.size > 600
    assert np.median(errors_m) == pytest.approx(126, abs=4)


def test_a_real_walk_is_found(shared_data, tmp_path):
    folder = tmp_path / FOLDER / "carling"
    folder.mkdir(parents=True)
    for day in ("20210404", "20210506", "20210523"):
        (path,) = (shared_data / FOLDER / "carling").glob(f"OpenCellID_{day}*.csv")
        shutil.copy(path, folder)
    first, *others = sorted(folder.iterdir())
    task = Task("carling", first, tuple(others), tmp_path / "out", QUICK, runs=1)
    find_left_out(task)
    bayes, smoothed, *oracles = read_left_out(task.result).found
    assert [one.method for one in oracles] == METHODS[2:4]
    assert (bayes.method, smoothed.method) == ("bayes", "smoothed")
    assert bayes.success
    assert np.median(bayes.error_m) < 60
    assert np.median(smoothed.error_m) < 60


def test_another_cell_of_the_site_may_serve():
    lattice = Lattice(CRS, WEST, SOUTH + 200.0, 10.0, 20, 20)
    rows = MeasuredRows(
        np.array([0] * 9 + [2]),
        WEST + np.array([55.0] * 9 + [155.0]),
        np.full(10, SOUTH + 55.0),
        np.array([2.0] * 9 + [7.0]),
    )
    options = MeasuredMapOptions(reach_m=20.0, prior_rows=1.0, site_part=0.2)
    maps = ServingStatistics.of_rows(rows, lattice, np.array([0, 0, 1]), options)
    row, col = lattice.row_col([WEST + 55.0, WEST + 155.0], [SOUTH + 55.0] * 2)
    at = np.asarray(row) * lattice.cols + np.asarray(col)
    share = np.exp(maps.log_share[:, at])
    assert share.sum(axis=0) == pytest.approx([1.0, 1.0], abs=1e-5)
    assert share[0, 0] > 0.8 > share[2, 1] > share[0, 1]
    alone = ServingStatistics.of_rows(rows, lattice, np.arange(3), options)
    assert share[1, 0] > 1.5 * np.exp(alone.log_share[1, at[0]])
    assert maps.advance_steps[1, at] == pytest.approx([2.0, 2.0])
    told = maps.log_advance(0, at.astype(np.int32), 2.0)
    assert told == pytest.approx([-np.log(0.5)] * 2, abs=1e-5)


def test_a_session_with_one_good_fix_has_no_oracles(made):
    files = sorted((made / FOLDER / "carling").glob("*.csv"))
    session = read_session(files[0])
    assert has_truth(session)
    poor = replace(session, accuracy_m=np.where(np.arange(len(session.time_s)) == 5, 6.0, 40.0))
    assert not has_truth(poor)
    area = SimpleNamespace(lattice=SimpleNamespace(crs=CRS))
    with pytest.raises(InputError, match="expected two fixes of 20 m or better for oracle-motion"):
        locate_session(poor, SimpleNamespace(area=area), QUICK, 0, 0, method="oracle-motion")
