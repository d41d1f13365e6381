"""``mapfilter learn`` and ``check --logs`` from end to end, and what they refuse."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from learning_world import CRS, database_of, log_of, plan_of
from typer.testing import CliRunner

from mapfilter.cli import app
from mapfilter.config.load import load_config
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, InputError, MapfilterError
from mapfilter.geodesy import unproject
from mapfilter.learning.blank import EVERYWHERE, blank_database, blank_log
from mapfilter.learning.patch import read_patch
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.kinds import leave_out
from mapfilter.tracks.log import make_log
from mapfilter.tracks.store import read_log, write_log
from mapfilter.workflows.checks.suspects import run_check_suspects
from mapfilter.workflows.learn import run_learn
from mapfilter.workflows.lessons import study as learn_study

pytestmark = pytest.mark.usefixtures("small_pictures")
JOURNEYS, FEW_JOURNEYS = 5, 3
FEW = [f"filter.bayes.{n}_particles=1500" for n in ("max", "min_search", "min")]


def configured(database, logs, *more):
    paths = [f"database.path={json.dumps(str(database))}", f"track.path={json.dumps(str(logs))}"]
    return load_config(None, [*paths, *FEW, *more])


@pytest.fixture(scope="module")
def faulty(tmp_path_factory):
    """A database with a cell 12 dB too weak and a silent one, and some journeys with truth."""
    folder = tmp_path_factory.mktemp("learn")
    given = plan_of()
    true = CellPlan(
        CRS,
        tuple(replace(c, eirp_dbm=c.eirp_dbm + 12.0 * (c.id == "S2B")) for c in given.cells),
    )
    database_of(given, folder / "given")
    rng = np.random.default_rng(3)
    for number in range(JOURNEYS):
        write_log(log_of(true, rng, silent=("S1C",), blocks=20), folder / "logs" / f"j{number}")
    return folder / "given" / "database", folder / "logs"


@pytest.fixture(scope="module")
def taught(faulty, tmp_path_factory):
    out = tmp_path_factory.mktemp("taught") / "out"
    return run_learn(configured(*faulty), out, accept=True), out


def found(result):
    return {(row["kind"], row["cell"]) for row in result.findings}


def test_faults_are_named_with_truth(taught):
    result, _ = taught
    assert found(result) == {("offset", "S2B"), ("dead", "S1C")}
    assert (result.logs, result.used) == (JOURNEYS, JOURNEYS)


def test_logs_of_the_serving_cell_alone_invent_no_faults(faulty, tmp_path):
    database, _ = faulty
    rng = np.random.default_rng(4)
    for number in range(JOURNEYS + 1):
        log = log_of(plan_of(), rng, blocks=20)
        serving = log.radio[log.radio["role"] == "serving"]
        alone = make_log(CRS, motion=log.motion, radio=serving, truth=log.truth)
        write_log(alone, tmp_path / "logs" / f"j{number}")
    result = run_learn(configured(database, tmp_path / "logs"), tmp_path / "out")
    assert result.findings == ()
    assert result.patch is None


def test_the_accepted_database_is_another_one_and_the_report_lies_beside_it(taught, faulty):
    result, out = taught
    other = open_database(out, verify="full")
    assert result.database == out
    assert "S1C" not in other.plan
    before = open_database(faulty[0], verify="full").plan["S2B"].eirp_dbm
    assert other.plan["S2B"].eirp_dbm - before == pytest.approx(12.0, abs=2.5)
    names = {file.name for file in result.out.iterdir()}
    assert names == {"patch.toml", "findings.csv", "cells.csv", "journeys.csv", "learned.png"}
    assert {entry["role"] for entry in other.manifest["inputs"]} == {"database", "patch"}


def test_tables_and_patch_say_the_same(taught):
    result, _ = taught
    table = pd.read_csv(result.out / "findings.csv")
    patch = read_patch(result.out / "patch.toml")
    assert table["kind"].tolist() == [change.kind for change in patch.changes]
    assert (table["log_bayes_factor"] > 3).all()
    cells = pd.read_csv(result.out / "cells.csv").set_index("cell")
    assert cells.loc["S1C", "received"] == 0
    assert cells.loc["S2B", "offset_db"] == pytest.approx(12.0, abs=2.5)
    journeys = pd.read_csv(result.out / "journeys.csv")
    assert journeys["log"].tolist() == [f"j{n}" for n in range(JOURNEYS)]
    assert (journeys["trust"] > 0.9).all()


@pytest.mark.long
def test_without_truth_and_interrupted_it_goes_on_where_it_was(faulty, tmp_path, monkeypatch):
    database, logs = faulty
    for number in range(FEW_JOURNEYS):
        shutil.copytree(logs / f"j{number}", tmp_path / "logs" / f"j{number}")
    config, out = configured(database, tmp_path / "logs"), tmp_path / "out"
    locate, calls = learn_study.locate, []

    def interrupted(*args):
        calls.append(args)
        if len(calls) == FEW_JOURNEYS:
            raise KeyboardInterrupt
        return locate(*args)

    monkeypatch.setattr(learn_study, "locate", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_learn(config, out, use_truth=False)
    shown = []
    result = run_learn(
        config, out, use_truth=False, resume=True, progress=lambda *at: shown.append(at)
    )
    # All but one were kept; where the map alone places no journey of equal blocks, there is a third
    # pass.
    assert len(calls) == FEW_JOURNEYS + 1 + FEW_JOURNEYS * (1 + len(result.notes))
    assert shown[-1] == (3 * FEW_JOURNEYS, 3 * FEW_JOURNEYS)
    assert [done for done, _ in shown] == sorted(done for done, _ in shown)
    assert {("dead", "S1C")} <= found(result) <= {("offset", "S2B"), ("dead", "S1C")}
    assert not list(tmp_path.glob(".out*"))
    assert result.database is None


def test_suspects_are_named_by_logs_alone(faulty, monkeypatch):
    # With truth in place of tracks, which are tested above, the check is quick.
    real = learn_study.study_logs
    monkeypatch.setattr(
        "mapfilter.workflows.checks.suspects.study_logs",
        lambda *args, **named: real(*args, **(named | {"use_truth": True})),
    )
    result = run_check_suspects(configured(*faulty))
    assert result.ok
    told = {finding.where: finding.evidence for finding in result.findings}
    assert set(told) == {"cells S2B", "cells S1C"}
    assert "+1" in told["cells S2B"]
    assert "log Bayes factor" in told["cells S1C"]


def test_journeys_of_no_use_are_warned_of(faulty, monkeypatch):
    taught = SimpleNamespace(
        patch=SimpleNamespace(changes=()), unlisted=(), unused=("j1, j2 not used: no motion",)
    )
    monkeypatch.setattr(
        "mapfilter.workflows.checks.suspects.study_logs", lambda *_args, **_named: taught
    )
    config = configured(*faulty)
    result = run_check_suspects(config)
    (finding,) = result.findings
    assert (finding.code, finding.severity, result.ok) == ("journeys-unused", "warning", True)
    assert finding.where == str(config.track_path)
    assert finding.evidence == "j1, j2 not used: no motion."


def test_a_cell_that_the_database_lacks_is_named(faulty, tmp_path):
    database, logs = faulty
    plan = open_database(database).plan
    less = CellPlan(CRS, tuple(c for c in plan.cells if c.id != "I1"))
    database_of(less, tmp_path / "less")
    result = run_learn(configured(tmp_path / "less" / "database", logs), tmp_path / "out")
    unlisted = [row for row in result.findings if row["kind"] == "unlisted"]
    assert [row["cell"] for row in unlisted] == ["I1"]
    cell = plan["I1"]
    assert (
        np.hypot(unlisted[0]["east_m"] - cell.east_m, unlisted[0]["north_m"] - cell.north_m) < 300
    )


def write(folder, log):
    write_log(log, folder / "one")
    return folder


def test_logs_whose_crs_puts_them_elsewhere_are_refused(faulty, tmp_path):
    logs = write(tmp_path / "logs", log_of(plan_of(), np.random.default_rng(0), crs="EPSG:32633"))
    with pytest.raises(
        InputError, match="a wrong CRS: EPSG:32633 is stated for metres of EPSG:32632"
    ):
        run_learn(configured(faulty[0], logs), tmp_path / "out")
    assert not (tmp_path / "out" / "patch.toml").exists()


def test_a_log_without_positions_is_taken_to_be_in_the_databases_frame(faulty, tmp_path):
    """As `replay` takes it."""
    log = read_log(faulty[1] / "j0")
    local = "+proj=tmerc +lat_0=0 +lon_0=0 +type=crs"
    logs = write(tmp_path / "logs", replace(log, truth=log.truth[:0], crs=local))
    assert run_learn(configured(faulty[0], logs), tmp_path / "out").logs == 1


@pytest.mark.parametrize("kind", ["no levels", "no radio"])
def test_logs_without_levels_are_refused(faulty, tmp_path, kind):
    log = log_of(plan_of(), np.random.default_rng(0), levels=False)
    logs = write(tmp_path / "logs", leave_out(log, ["radio"]) if kind == "no radio" else log)
    with pytest.raises(InputError, match="levels of cells"):
        run_learn(configured(faulty[0], logs), tmp_path / "out")


def test_empty_logs_and_empty_folders_are_refused(faulty, tmp_path):
    logs = write(tmp_path / "logs", make_log(CRS))
    with pytest.raises(InputError, match="levels"):
        run_learn(configured(faulty[0], logs), tmp_path / "out")
    (tmp_path / "none").mkdir()
    with pytest.raises(InputError, match="track log"):
        run_learn(configured(faulty[0], tmp_path / "none"), tmp_path / "out")


def test_the_database_itself_is_no_output(faulty):
    database, logs = faulty
    with pytest.raises(ConfigError, match="in place"):
        run_learn(configured(database, logs), database, accept=True)


def test_other_filters_are_refused(faulty, tmp_path):
    config = load_config(
        None,
        [
            f"database.path={json.dumps(str(faulty[0]))}",
            f"track.path={json.dumps(str(faulty[1]))}",
            'filter.name="candidate"',
        ],
    )
    with pytest.raises(ConfigError, match=r"filter\.name"):
        run_learn(config, tmp_path / "out")


def test_a_blank_database_has_the_points_and_no_radio(faulty, tmp_path):
    database = open_database(faulty[0])
    blank = blank_database(database, tmp_path / "blank")
    assert np.array_equal(blank.points().point, database.points().point)
    assert np.ptp(blank.field().level_dbm) == 0.0
    log = blank_log(log_of(plan_of(), np.random.default_rng(0)))
    assert set(log.radio["cell"]) == {EVERYWHERE}
    assert log.radio["level_dbm"].isna().all()
    assert log.radio["time_s"].is_unique
    assert Path(blank.path).name == "blank"


def test_journeys_that_are_not_used_are_noted_with_the_reason(faulty, tmp_path):
    database, _ = faulty
    rng = np.random.default_rng(4)
    good = [log_of(plan_of(), rng, blocks=20) for _ in range(3)]
    for number, log in enumerate(good):
        write_log(log, tmp_path / "logs" / f"good{number}")
    write_log(make_log(CRS, radio=good[0].radio), tmp_path / "logs" / "still")
    odd = good[1].radio.assign(level_dbm=np.nan)
    log = make_log(CRS, motion=good[1].motion, radio=odd, truth=good[1].truth)
    write_log(replace(log, notes=("read with a remark",)), tmp_path / "logs" / "silent")
    log = make_log(CRS, motion=good[2].motion, radio=good[2].radio, truth=good[0].truth)
    write_log(log, tmp_path / "logs" / "astray")
    result = run_learn(configured(database, tmp_path / "logs"), tmp_path / "out")
    assert result.used == 3
    of = {note.partition(" ")[0]: note for note in result.notes if " not used: " in note}
    assert set(of) == {"astray", "silent", "still"}
    assert of["silent"].endswith("no levels")
    assert of["still"].endswith("no motion")
    assert "do not fit" in of["astray"]


def test_a_log_alone_without_motion_is_refused_with_the_reason(faulty, tmp_path):
    log = log_of(plan_of(), np.random.default_rng(0))
    logs = write(tmp_path / "logs", make_log(CRS, radio=log.radio))
    with pytest.raises(InputError, match="one not used: no motion"):
        run_learn(configured(faulty[0], logs), tmp_path / "out")


def test_recordings_that_lie_hours_apart_are_noted(faulty, tmp_path):
    log = log_of(plan_of(), np.random.default_rng(0))
    lon, lat = unproject(CRS, log.truth["east_m"].to_numpy(), log.truth["north_m"].to_numpy())
    (tmp_path / "logs").mkdir()
    serving = log.radio[log.radio["role"] == "serving"]
    for hour, name in enumerate(("one", "other")):
        time = 1.7e9 + 86400 * hour + serving["time_s"].to_numpy()
        table = {"time": time, "lat": lat, "lon": lon}
        table |= {"cell": serving["cell"].to_numpy(), "level_dbm": serving["level_dbm"].to_numpy()}
        pd.DataFrame(table).to_csv(tmp_path / "logs" / f"{name}.csv", index=False)
    truth = json.dumps([str(tmp_path / "logs" / f"{name}.csv") for name in ("one", "other")])
    config = configured(faulty[0], tmp_path / "logs", f"track.truth={truth}")
    result = run_learn(config, tmp_path / "out")
    assert any("h apart" in note for note in result.notes)


def told(*args):
    return CliRunner().invoke(app, [str(arg) for arg in args])


def test_the_command_line_prints_findings_and_accepts_the_patch(faulty, tmp_path):
    database, logs = faulty
    shown = told("learn", database, "--logs", logs, "--out", tmp_path / "learned", "--json")
    assert shown.exit_code == 0, shown.output
    found = json.loads(shown.stdout.splitlines()[-1])
    assert {one["kind"] for one in found["findings"]} == {"offset", "dead"}
    assert all(one["journeys"] == JOURNEYS for one in found["findings"])
    patch = tmp_path / "learned" / "patch.toml"
    patch.write_text(patch.read_text().replace("accept = true", "accept = false", 1))
    out = tmp_path / "after"
    shown = told("learn", database, "--accept", patch, "--out", out, "--json")
    accepted = json.loads(shown.stdout.splitlines()[-1])
    assert (accepted["changes"], accepted["refused"]) == (1, 1)
    assert accepted["notes"] == []
    assert open_database(out).manifest["inputs"][-1]["name"] == "patch.toml"


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("learn", "DB"), "--logs LOGS, or --accept PATCH"),
        (("learn", "DB", "--accept", "all"), "--logs LOGS, or --accept PATCH"),
        (("learn", "DB", "--logs", "LOGS", "--accept", "patch.toml"), "all, with --logs"),
        (("learn", "nowhere", "--logs", "LOGS"), "a database folder"),
        (("learn", "DB", "--accept", "nowhere.toml"), "a readable file"),
        (("learn", "DB", "--logs", "nowhere"), "a track log"),
        (("check", "--db", "DB"), "--db"),
    ],
)
def test_wrong_commands_are_refused(faulty, tmp_path, monkeypatch, args, message):
    database, logs = faulty
    monkeypatch.chdir(tmp_path)
    names = {"DB": database, "LOGS": logs}
    with pytest.raises(MapfilterError, match=message):
        raise told(*(names.get(arg, arg) for arg in args)).exception
    assert not (tmp_path / "learned" / "patch.toml").exists()
