"""Sweeps by the command: the same table however it is done, cut short, gone on with, refused."""

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest
from command_line import assert_done, assert_refused, mapfilter, settings
from killed_worker import KillsOneWorker

from mapfilter._cluster import cluster_executor
from mapfilter._json_files import sealed
from mapfilter._parallel import SerialExecutor, local_executor
from mapfilter.config.load import load_config
from mapfilter.errors import ConfigError, MapfilterError, StoreError
from mapfilter.experiments.sweep import run
from mapfilter.experiments.sweep.run import sweep
from mapfilter.experiments.sweep.table import read_runs
from mapfilter.workflows.simulate import run_simulate
from mapfilter.workflows.sweep import load_sweep, run_sweep
from mapfilter.workflows.sweeps.plan import sweep_plans, sweep_world
from mapfilter.workflows.sweeps.tables import brief_pairs

GRID = settings(
    sweep__sigma_orient_deg="0,6",
    sweep__sigma_trans_m="0,0.3",
    sweep__update_length_m="5,20",
    sweep__routes=3,
    sweep__draws=2,
    journeys__length_m=120,
    output__pictures="none",
)
GIVEN = [text.removeprefix("--set=") for text in GRID]
RUNS = 2 * 2 * 2 * 3 * 2


@pytest.fixture(scope="module", autouse=True)
def _short_batches():
    """Have as few runs as there are in several batches, two for each journey of the grid."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mapfilter.experiments.sweep.plan.SHORTEST_BATCH", 12)
        yield


@pytest.fixture(scope="module")
def parts(world):
    """Plan, world and databases of one sweep."""
    config = load_config(world.toml, GIVEN)
    (plan,), databases = sweep_plans(config)
    folders = {name: one.path for name, one in databases.items()}
    return plan, sweep_world(config, plan.radios), folders


@pytest.fixture(scope="module")
def whole(parts, tmp_path_factory):
    """The table, as one process makes it."""
    return sweep(*parts, tmp_path_factory.mktemp("whole")).read_bytes()


def test_the_command_and_what_it_tells(world, whole, tmp_path):
    shutil.copytree(world.folder, tmp_path / "world")
    toml = tmp_path / "world" / "world.toml"
    found = assert_done(mapfilter("sweep", "-c", toml, *GRID, "--json")).json
    assert found["runs"] == RUNS
    assert len(found["cells"]) == 8
    assert found["pairs"] == []
    cell = found["cells"][0]
    assert (cell["runs"], cell["routes"], cell["filter"]) == (6, 3, "candidate")
    assert cell["low"] <= cell["success"] <= cell["high"]
    out = tmp_path / "world" / "out" / "sweep"
    assert (out / "runs.parquet").read_bytes() == whole
    assert {file.name for file in out.iterdir()} == {
        "runs.parquet",
        "sweep.json",
        "table.csv",
        "table.tex",
    }
    table = pd.read_csv(out / "table.csv")
    assert table["success"].tolist() == pytest.approx(
        [cell["success"] for cell in found["cells"]], abs=1e-4
    )
    assert {"sigma_trans_m", "sigma_orient_deg", "update_length_m"} <= set(table)
    # The candidate filter has no radii.
    assert {cell["coverage_95"] for cell in found["cells"]} == {None}
    assert table["radius_95_median_m"].isna().all()
    assert table["claimed"].tolist() == pytest.approx(
        [cell["claimed"] for cell in found["cells"]], abs=1e-4
    )
    assert "\\toprule" in (out / "table.tex").read_text()
    runs = read_runs(out / "runs.parquet")
    assert runs["success"].sum() == sum(round(c["success"] * 6) for c in found["cells"])
    assert (runs["switched"] | ~runs["success"]).all()


def test_logs_of_a_sweep_are_as_sound_as_checked_ones(parts):
    """The logs of a sweep pass the checks that logs of others pass, and stay as they are."""
    from mapfilter.experiments.sweep import journeys
    from mapfilter.tracks.log import make_log

    plan, world, _ = parts
    run = next(plan.select(0, 1))
    truth = journeys.true_path(world, plan, run.route)
    log = journeys.radio_log(world, plan, truth, run.route, run.radio, run.report_period_s)
    sensed = journeys.sensed(plan, log, run)
    assert (log.vehicle, sensed.vehicle) == (None, None)
    checked = make_log(sensed.crs, motion=sensed.motion, radio=sensed.radio, truth=sensed.truth)
    for name in ("motion", "radio", "truth"):
        assert getattr(checked, name).equals(getattr(sensed, name)), name


def test_an_older_version_is_not_resumed(parts, whole, tmp_path, monkeypatch):
    """Neither a finished sweep nor an unfinished one mixes with rows of another version."""
    version = run._VERSION
    for stops in (None, 1):
        monkeypatch.setattr(run, "_VERSION", version - 1)
        out = tmp_path / str(stops)
        if stops is None:
            sweep(*parts, out)
        else:
            with pytest.raises(KeyboardInterrupt):
                sweep(*parts, out, executor=StopsAfter(stops), in_flight=1)
        monkeypatch.setattr(run, "_VERSION", version)
        with pytest.raises(ConfigError, match="another version of the sweep"):
            sweep(*parts, out, resume=True)
        assert (out / "unfinished").exists() == (stops is not None)
        assert sweep(*parts, out).read_bytes() == whole


def test_two_processes_give_the_same_bytes(parts, whole, tmp_path):
    with local_executor(2) as executor:
        assert sweep(*parts, tmp_path, executor=executor).read_bytes() == whole


@pytest.mark.filterwarnings("default")
def test_dask_gives_the_same_bytes_though_a_worker_is_killed(parts, whole, tmp_path):
    with cluster_executor("local:2") as (executor, workers):
        assert workers == 2
        deadly = KillsOneWorker(executor, tmp_path / "died")
        table = sweep(*parts, tmp_path / "out", executor=deadly, in_flight=4)
        deadly.deaths[0].result()
    assert (tmp_path / "died").exists()
    assert table.read_bytes() == whole


class StopsAfter(SerialExecutor):
    """Is interrupted, as by Ctrl-C, when so many tasks are done."""

    def __init__(self, tasks):
        self.left, self.done = tasks, 0

    def submit(self, fn, /, *args, **kwargs):
        if self.left == 0:
            raise KeyboardInterrupt
        self.left -= 1
        self.done += 1
        return super().submit(fn, *args, **kwargs)


@pytest.mark.parametrize("stops", [[1], [0, 3, 2]], ids=str)
def test_interrupted_and_resumed_nothing_is_lost_or_done_twice(parts, whole, tmp_path, stops):
    plan = parts[0]
    total, done = len(list(plan.batches())), 0
    for tasks in stops:
        stopping = StopsAfter(tasks)
        with pytest.raises(KeyboardInterrupt):
            sweep(*parts, tmp_path, executor=stopping, in_flight=1, resume=True)
        done += stopping.done
    last = StopsAfter(total)
    told = []
    table = sweep(
        *parts, tmp_path, executor=last, in_flight=1, resume=True,
        progress=lambda *at: told.append(at),
    )  # fmt: skip
    assert done + last.done == total
    assert told[0][0] > 0 or stops == [0]
    assert told[-1] == (RUNS, RUNS)
    assert table.read_bytes() == whole
    again = StopsAfter(0)
    assert sweep(*parts, tmp_path, executor=again, resume=True).read_bytes() == whole


def test_a_batch_that_was_cut_off_is_done_again(parts, whole, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        sweep(*parts, tmp_path, executor=StopsAfter(3), in_flight=1)
    batch = min((tmp_path / "unfinished" / "batches").iterdir())
    batch.write_bytes(batch.read_bytes()[:100])
    assert sweep(*parts, tmp_path, resume=True).read_bytes() == whole


def test_a_batch_with_a_flipped_bit_is_done_again(parts, whole, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        sweep(*parts, tmp_path, executor=StopsAfter(3), in_flight=1)
    for number, batch in enumerate(sorted((tmp_path / "unfinished" / "batches").iterdir())):
        data = bytearray(batch.read_bytes())
        data[len(data) * (number + 1) // 4] ^= 1
        batch.write_bytes(bytes(data))
    assert sweep(*parts, tmp_path, resume=True).read_bytes() == whole


def test_an_older_table_stays_until_the_new_one_is_whole(parts, whole, world, tmp_path):
    sweep(*parts, tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    config = load_config(world.toml, [*GIVEN, "sweep.seed=5"])
    (plan,), _ = sweep_plans(config)
    with pytest.raises(KeyboardInterrupt) as caught:
        sweep(plan, *parts[1:], tmp_path, executor=StopsAfter(1), in_flight=1)
    assert caught.value.__notes__ == ["finished batches are kept: go on with --resume"]
    assert {name: (tmp_path / name).read_bytes() for name in before} == before
    assert (tmp_path / "runs.parquet").read_bytes() == whole
    assert sweep(plan, *parts[1:], tmp_path, resume=True).read_bytes() != whole
    assert sorted(path.name for path in tmp_path.iterdir()) == ["runs.parquet", "sweep.json"]


def test_a_table_that_was_changed_is_neither_read_nor_resumed_with(parts, whole, tmp_path):
    table = sweep(*parts, tmp_path)
    table.write_bytes(whole[:500] + bytes([whole[500] ^ 1]) + whole[501:])
    with pytest.raises(StoreError, match=r"runs\.parquet.*changed after it was written"):
        read_runs(table)
    assert sweep(*parts, tmp_path, resume=True).read_bytes() == whole


def test_a_sweep_over_a_database_that_is_replaced_meanwhile_stops(parts, tmp_path):
    plan, streets, databases = parts
    folders = {}
    for name, path in databases.items():
        shutil.copytree(path, tmp_path / name)
        folders[name] = tmp_path / name

    class Replaces(StopsAfter):
        def submit(self, fn, /, *args, **kwargs):
            if self.done == 0:
                for path in folders.values():
                    manifest = json.loads((path / "manifest.json").read_text())
                    changed = json.dumps(sealed({**manifest, "attribution": "another"}))
                    (path / "manifest.json").write_text(changed)
            return super().submit(fn, *args, **kwargs)

    with pytest.raises(StoreError, match="replaced while in use"):
        sweep(plan, streets, folders, tmp_path / "out", executor=Replaces(9), in_flight=1)


def test_another_sweep_is_not_resumed(parts, world, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        sweep(*parts, tmp_path, executor=StopsAfter(1), in_flight=1)
    config = load_config(world.toml, [*GIVEN, "sweep.seed=5"])
    (plan,), _ = sweep_plans(config)
    with pytest.raises(ConfigError, match="found another plan "):
        sweep(plan, *parts[1:], tmp_path, resume=True)
    # Without --resume it starts anew.
    assert len(read_runs(sweep(plan, *parts[1:], tmp_path))) == RUNS


def test_a_stopped_command_tells_how_to_go_on(own_world, monkeypatch):
    def stopped(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("mapfilter.experiments.sweep.run.run_batch", stopped)
    outcome = mapfilter("sweep", "-c", own_world.toml, *GRID)
    assert outcome.code == 3
    assert "stopped by SIGINT: finished batches are kept: go on with --resume" in outcome.err


VARIED = ("--vary", "imu.scale=0,0.1", "--vary", "filter.update_length_m=5,20")
SMALL = settings(sweep__routes=2, sweep__draws=3, output__pictures="none")


def test_any_numeric_option_is_an_axis(own_world):
    """A varied option is a column by its key; runs are those of a sweep with that value."""
    given = ("-c", own_world.toml, *SMALL)
    found = assert_done(mapfilter("sweep", *given, *VARIED, "--json")).json
    out = own_world.out / "sweep"
    runs = read_runs(out / "runs.parquet")
    assert found["runs"] == len(runs) == 2 * 2 * 2 * 3
    points = [(0.0, 5.0), (0.0, 20.0), (0.1, 5.0), (0.1, 20.0)]
    keys = ["imu.scale", "filter.update_length_m"]
    assert [tuple(cell["varied"][key] for key in keys) for cell in found["cells"]] == points
    assert list(runs[keys].drop_duplicates().itertuples(index=False, name=None)) == points
    assert (runs["scale"] == runs["imu.scale"]).all()
    assert list(pd.read_csv(out / "table.csv").columns[:2]) == keys
    alone = settings(imu__scale=0.1, filter__update_length_m=20.0)
    assert_done(mapfilter("sweep", *given, *alone, "--json"))
    single = read_runs(out / "runs.parquet")
    last = runs[(runs["imu.scale"] == 0.1) & (runs["filter.update_length_m"] == 20.0)]
    pd.testing.assert_frame_equal(last.drop(columns=keys).reset_index(drop=True), single)


def test_radii_are_in_table_and_picture_and_of_drives(own_world):
    """Coverage and median radius, by hand from the runs; filters take a vehicle's defaults."""
    given = settings(
        filter__name="bayes",
        roads__profile="driving",
        sweep__routes=2,
        sweep__draws=2,
        journeys__length_m=300,
        imu__sigma_trans_m=0.05,
        output__pictures="first",
    )
    result = run_sweep(load_sweep(own_world.toml, [text.removeprefix("--set=") for text in given]))
    assert {"radii.png", "success.png"} <= {picture.name for picture in result.pictures}
    runs, (cell,) = read_runs(result.table), result.cells
    held, claimed = runs["held_95_epochs"].sum(), runs["claimed_epochs"].sum()
    assert cell.coverage_95 == held / claimed > 0.5
    assert cell.coverage_95_low <= cell.coverage_95 <= cell.coverage_95_high
    assert cell.radius_95_median_m == runs["radius_95_median_m"].median() > 0
    shown = pd.read_csv(own_world.out / "sweep" / "table.csv").iloc[0]
    names = ("claimed", "coverage_95", "coverage_95_low", "radius_95_median_m")
    for name in names:
        assert shown[name] == pytest.approx(getattr(cell, name), rel=1e-3)
    vehicle = settings(filter__bayes__vehicle="true")
    stated = [text.removeprefix("--set=") for text in (*given, *vehicle)]
    again = run_sweep(load_sweep(own_world.toml, stated))
    pd.testing.assert_frame_equal(read_runs(again.table), runs)


def test_a_varied_sweep_is_resumed(own_world):
    given = ("-c", own_world.toml, *SMALL, *VARIED, "--json")
    assert_done(mapfilter("sweep", *given))
    table = own_world.out / "sweep" / "runs.parquet"
    before = table.read_bytes()
    assert_done(mapfilter("sweep", *given, "--resume"))
    assert table.read_bytes() == before
    other = (*given[:-2], "filter.update_length_m=5,10", "--resume")
    assert_refused(mapfilter("sweep", *other), "another plan")


def test_the_margin_of_the_database_is_the_filters(own_world):
    given = ("-c", own_world.toml, *SMALL, "--vary", "database.margin_db=0,3")
    runs = read_runs(Path(assert_done(mapfilter("sweep", *given, "--json")).json["table"]))
    assert sorted(set(runs["database.margin_db"])) == [0.0, 3.0]


@pytest.mark.parametrize(
    ("axes", "expected"),
    [
        (["filter.bayes.heading_sd_deg=3,6"], ["heading_sd_deg", "one without effect"]),
        (["filter.kalman.step_sd_m=1,2"], ["filter.kalman.step_sd_m", "one without effect"]),
        (["imu.gyro_noise_deg_per_sqrt_s=0,1"], ["one without effect", "motion has headings"]),
        (["journeys.seed=1,2"], ["journeys.seed", "an option that a sweep uses", "sweep.seed"]),
        (["imu.turns=1,2", "imu.scale=2"], ["imu.turns", "a numeric option", "imu.scale", "< 1"]),
        (["imu.scale=0", "imu.scale=0.1"], ["imu.scale", "every option once"]),
    ],
)
def test_axes_that_cannot_be_varied(own_world, axes, expected):
    given = [part for axis in axes for part in ("--vary", axis)]
    assert_refused(mapfilter("sweep", "-c", own_world.toml, *SMALL, *given), *expected)
    assert not (own_world.out / "sweep").exists()


@pytest.mark.parametrize("name", ["max_particles", "min_search_particles", "min_particles"])
def test_a_grid_has_no_particles_to_vary(own_world, name):
    """Each value ran the same again, under another name."""
    given = ("-c", own_world.toml, "--vary", f"filter.bayes.{name}=4000,9000")
    refused = mapfilter("sweep", *given, "--set", "filter.name=grid")
    assert_refused(refused, f"--vary filter.bayes.{name}", "one without effect")


def test_a_dry_run_counts_and_estimates(own_world):
    given = ("-c", own_world.toml, *SMALL, *VARIED, "--dry-run", "--json")
    found = assert_done(mapfilter("sweep", *given)).json
    assert (found["runs"], found["points"]) == (24, 4)
    assert found["seconds"] == pytest.approx(24 * found["seconds_per_run"])
    assert found["seconds"] > 0
    assert not (own_world.out / "sweep").exists()


def test_axes_of_everything_else(world, tmp_path):
    """Filters, databases, periods and prediction errors side by side; pictures of each group."""
    shutil.copytree(world.folder, tmp_path / "world")
    toml = tmp_path / "world" / "world.toml"
    toml.write_text(
        toml.read_text()
        + """[sweep]
prediction_error_db = [0, 7]
report_period_s = [2.0, 8.0]
imu_period_s = 2
bias_sd_deg = 20
sigma_orient_deg = [0.0, 6.0]
routes = 2
draws = 1
[[sweep.readings]]
name = "printed"
prediction = "last_heading"
margin_db = 3.0
[[sweep.readings]]
name = "list"
duplicates = "list"
threshold = 10
update_length_m = 5.0
"""
    )
    found = run_sweep(load_sweep(toml, ["output.pictures=first"]))
    assert found.runs == 2 * 2 * 2 * 2 * 2
    runs = read_runs(found.table)
    assert set(runs["radio"]) == {"ground truth 0 dB", "ground truth 7 dB"}
    assert set(runs["prediction_error_db"]) == {0.0, 7.0}
    lengths = dict(zip(runs["reading"], runs["update_length_m"], strict=True))
    assert lengths == {"printed": 10.0, "list": 5.0}
    assert {(one.reading, one.baseline, one.runs) for one in found.pairs} == {
        ("list", "printed", 2)
    }
    pairs = pd.read_csv(found.tables[-1])
    assert found.tables[-1].name == "pairs.csv"
    assert len(pairs) == len(found.pairs) == 2 * 2 * 2
    assert {"prediction_error_db", "report_period_s", "sigma_orient_deg"} <= set(pairs)
    assert "bias_sd_deg" not in pairs
    assert len(brief_pairs(found.pairs)) == 8
    assert len(found.pictures) == 3 * 2 * 2 * 2
    assert all(picture.stat().st_size > 10_000 for picture in found.pictures)


def test_ground_truth_must_have_been_predicted(own_world):
    (own_world.out / "rxlev-ground-truth.tif").unlink()
    ground_truth = settings(journeys__radio="ground_truth")
    assert_refused(
        mapfilter("sweep", "-c", own_world.toml, *GRID, *ground_truth),
        "rxlev-ground-truth.tif",
        "rasters of the ground truth",
    )


def test_every_fault_of_a_bad_plan_in_one_message(own_world):
    own_world.toml.write_text(
        own_world.toml.read_text()
        + """[sweep]
sigma_trans_m = []
sigma_orient_deg = [-3, 3]
scale = [2.0]
databases = ["nowhere"]
runs = 3
[[sweep.readings]]
naem = "x"
threshold = 0
"""
    )
    assert_refused(
        mapfilter("sweep", "-c", own_world.toml),
        "sweep.sigma_trans_m", "at least one value", "sweep.sigma_orient_deg.0", "sweep.scale.0",
        "nowhere", "not built yet", "sweep.runs", "'name'", "sweep.readings.0.threshold",
    )  # fmt: skip
    assert not (own_world.out / "sweep").exists()


def test_values_and_names_given_twice_are_told_with_what_is_missing(own_world):
    twice = """[[sweep.readings]]
name = "same"
[[sweep.readings]]
name = "same"
"""
    own_world.toml.write_text(own_world.toml.read_text() + twice)
    with pytest.raises(MapfilterError) as caught:
        run_sweep(
            load_sweep(own_world.toml, ["sweep.sigma_trans_m=1,1", 'sweep.databases=["gone"]'])
        )
    text = str(caught.value)
    assert "sweep.readings: expected readings of different names" in text
    assert "sweep.sigma_trans_m: expected every value once" in text
    assert "gone" in text


def test_sweeps_and_simulate_hear_alike(world, parts, tmp_path):
    """A place hears what ``simulate`` lets it hear: the same cells serve as predicted."""
    from mapfilter.tracks.store import read_log

    config = load_config(world.toml, ["journeys.count=1"], out=world.out)
    config = config.model_copy(
        update={"track": config.track.model_copy(update={"path": tmp_path / "logs"})}
    )
    run_simulate(config)
    log = read_log(next((tmp_path / "logs").iterdir()))
    _, swept, _ = parts
    serving = log.radio[log.radio["role"] == "serving"]
    row, col = swept.lattice.row_col(
        log.truth["east_m"].to_numpy(), log.truth["north_m"].to_numpy()
    )
    best = swept.levels_dbm["as_predicted"][:, row, col].argmax(axis=0)
    assert [swept.plan.ids[i] for i in best] == serving["cell"].tolist()


def test_a_value_given_twice_is_told_by_its_key(world):
    twice = mapfilter("sweep", "-c", world.toml, "--set=sweep.sigma_orient_deg=3,3")
    assert_refused(twice, "sweep.sigma_orient_deg: expected every value once")
