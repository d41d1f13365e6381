"""What replay writes and tells: of good logs, of logs that lack something, over older results."""

import json
import os
import re
import signal
import sys
import time
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pandas as pd
import pytest
from command_line import (
    ONE,
    assert_done,
    assert_refused,
    change,
    contents,
    mapfilter,
    put,
    settings,
)

import mapfilter as mf
from mapfilter.config.load import load_config
from mapfilter.errors import InputError, fail
from mapfilter.filters.contract import Reason
from mapfilter.geodesy import unproject
from mapfilter.positioning.estimate_store import read_estimate
from mapfilter.positioning.loop import locate
from mapfilter.propagation.shadowing import named_rng
from mapfilter.tracks.store import read_log, write_log
from mapfilter.viewing.words import REASONS
from mapfilter.workflows.replay import run_replay
from mapfilter.workflows.replays import located_log as replay_log


def test_some_cells_unknown(log, replay, tmp_path):
    table = pd.read_csv(log / "radio.csv")
    late = (table["role"] == "serving") & (table["time_s"] > 150)
    table.loc[late, "cell"] = "../new"
    table.to_csv(log / "radio.csv", index=False)
    outcome = replay(log, "--json")
    assert outcome.code == 3
    assert outcome.err == (
        "mapfilter: 1 cell is unknown to the database (../new; in my-walk); their readings are "
        "labelled unknown_cell\n"
    )
    assert outcome.json["unused"]["unknown_cell"] == late.sum()
    assert outcome.json["unknown_cells"] == {"../new": late.sum()}
    estimate = read_estimate(tmp_path / "out" / "estimate.parquet")
    labelled = [u for u in estimate.unused if u.reason is Reason.UNKNOWN_CELL]
    assert {(u.kind, u.what) for u in labelled} == {("serving", "../new")}
    assert [u.time_s for u in labelled] == table.loc[late, "time_s"].tolist()
    motion = pd.read_csv(log / "motion.csv")
    assert len(estimate) >= len(motion)
    assert np.isfinite(estimate.east_m[-1])


def test_the_risk_of_protection_levels(log, replay, tmp_path):
    found = {}
    for risk in (None, "1e-3", "1e-4"):
        given = () if risk is None else ("--protection", risk)
        assert_done(replay(log, "--json", "--filter", "bayes", *given))
        found[risk] = read_estimate(tmp_path / "out" / "estimate.parquet")
    usual, rare = found["1e-3"].protection_m, found["1e-4"].protection_m
    assert np.array_equal(found[None].protection_m, usual, equal_nan=True)
    known = np.isfinite(usual)
    assert known.sum() > 50
    # Infinite where the null hypothesis is more probable than the risk.
    assert (rare[known] > usual[known]).all()
    assert np.isfinite(rare).sum() > 20
    features = json.loads((tmp_path / "out" / "estimate.geojson").read_text())["features"]
    points = [one for one in features if one["geometry"]["type"] == "Point"]
    levels = [point["properties"]["protection_m"] for point in points]
    estimate = read_estimate(tmp_path / "out" / "estimate.parquet")
    located = [status.is_followed for status in estimate.status]
    expected = [
        None if not np.isfinite(level) else pytest.approx(level, abs=0.01)
        for level in rare[located]
    ]
    assert levels == expected


@pytest.mark.parametrize("risk", ["0", "1", "-0.1", "nan"])
def test_a_risk_that_is_no_probability_is_refused(log, replay, tmp_path, risk):
    outcome = replay(log, "--protection", risk)
    assert_refused(outcome, "integrity.risk")
    assert not (tmp_path / "out").exists()


def test_all_cells_unknown_with_pictures(log, replay, tmp_path):
    change(log / "radio.csv", cell=lambda c: c.where(c.isna(), "X"))
    outcome = replay(log, "--json", "--set=output.pictures=all")
    assert outcome.code == 3
    assert outcome.json["switched"] is False
    assert outcome.json["error_mean_m"] is None
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"estimate.parquet", "estimate.gpx", "estimate.geojson", "track.png"} <= names


@pytest.mark.parametrize(
    ("kept", "lack"),
    [
        ((), "no serving cell and no motion"),
        (("motion",), "no serving cell (the filter bayes starts by the streets alone)"),
        (("radio", "truth"), "no motion (mapfilter locate needs none)"),
        (("truth",), "no serving cell and no motion"),
    ],
)
def test_logs_in_which_nothing_can_be_located(kept, lack, log, replay, tmp_path):
    for table in ("motion", "radio", "gnss", "truth"):
        if table not in kept:
            (log / f"{table}.csv").unlink()
    outcome = replay(log, "--json", "--set=output.pictures=all")
    assert outcome.code == 3
    assert outcome.err == f"mapfilter: nothing is located in my-walk: {lack}\n"
    assert outcome.json["partial"] is True
    assert ("error_mean_m" in outcome.json) == ("truth" in kept)
    assert np.isnan(read_estimate(tmp_path / "out" / "estimate.parquet").east_m).all()


def test_a_log_with_neighbours_only(log, replay):
    table = pd.read_csv(log / "radio.csv")
    table[table["role"] == "neighbour"].to_csv(log / "radio.csv", index=False)
    outcome = replay(log)
    assert outcome.code == 3
    assert outcome.err == "mapfilter: nothing is located in my-walk: no serving cell\n"


def test_neighbours_that_name_neither_cell_nor_carrier_are_no_unknown_cells(log, replay):
    table = pd.read_csv(log / "radio.csv")
    neighbour = table["role"] == "neighbour"
    table.loc[neighbour, ["cell", "arfcn", "bsic"]] = None
    table.to_csv(log / "radio.csv", index=False)
    outcome = replay(log, "--json", "--filter", "bayes")
    assert assert_done(outcome).json["unknown_cells"] == {}
    assert 0 < outcome.json["unused"]["no_cell"] <= neighbour.sum()


TOLD_WITHOUT_TRUTH = {
    "final_status", "switched", "switch_time_s", "epochs", "epochs_by_status", "last_lon_deg",
    "last_lat_deg", "last_time_s", "unused", "unknown_cells", "notes",
}  # fmt: skip


def test_a_log_without_truth_is_located_and_told(log, replay, tmp_path):
    with_truth = assert_done(replay(log, "--json")).json
    (log / "truth.csv").unlink()
    found = assert_done(replay(log, "--json")).json
    assert "error_mean_m" not in found
    assert {key: found[key] for key in TOLD_WITHOUT_TRUTH} == {
        key: with_truth[key] for key in TOLD_WITHOUT_TRUTH
    }
    figures = json.loads((tmp_path / "out" / "figures.json").read_text())
    assert {key: figures[key] for key in TOLD_WITHOUT_TRUTH} == {
        key: found[key] for key in TOLD_WITHOUT_TRUTH
    }
    estimate = read_estimate(str(tmp_path / "out" / "estimate.parquet"))
    assert (found["final_status"], found["switched"]) == ("TRACKING", True)
    assert found["switch_time_s"] == estimate.time_s[estimate.converged_at]
    assert found["epochs"] == len(estimate) == sum(found["epochs_by_status"].values())
    assert found["epochs_by_status"]["CONVERGED"] == 1
    lon, lat = unproject(estimate.crs, estimate.east_m[-1:], estimate.north_m[-1:])
    assert (found["last_lon_deg"], found["last_lat_deg"]) == (lon[0], lat[0])
    assert with_truth["scored_epochs"] <= found["epochs"]
    # The candidate filter has no radii.
    assert with_truth["within_95"] is None
    assert "within_95" not in found
    assert found["radius_95_median_m"] is None
    assert sum(found["seconds_by_status"].values()) == pytest.approx(np.ptp(estimate.time_s))
    text = assert_done(replay(log)).out
    assert "final_status: TRACKING\nswitched: True\n" in text
    assert "radius_95_median_m: -\n" in text
    assert re.search(r"\n  TRACKING: \d+ \(\d+ %\)\n", text)
    assert found["unused"]
    for reason, count in found["unused"].items():
        assert f"\n  {reason}: {count} ({REASONS[Reason(reason)]})\n" in text
    assert "unknown_cells" not in text


def test_a_search_that_ends_without_a_position_is_told(log, replay):
    (log / "truth.csv").unlink()
    change(log / "motion.csv", step_m=lambda m: m * 0.01)
    found = assert_done(replay(log, "--json")).json
    assert (found["final_status"], found["switched"]) == ("SEARCHING", False)
    assert found["switch_time_s"] is None
    assert found["last_lon_deg"] is None


def test_timing_advances_in_metres_are_noted(log, replay):
    serving = pd.read_csv(log / "radio.csv")["role"] == "serving"
    metres = serving.map({True: 700, False: None}).astype("Int64")
    change(log / "radio.csv", timing_advance=lambda _: metres)
    notes = assert_done(replay(log, "--json")).json["notes"]
    assert any("radio, timing_advance: " in note and "(metres for steps" in note for note in notes)


def test_notes_of_a_log_are_told(log, replay):
    change(log / "motion.csv", time_s=put(0.0))
    (log / "motion.txt").write_text("")
    assert_done(replay(log))
    told = [
        f"{log / 'motion.txt'}: not a table of a log, not read",
        f"{log / 'motion.csv'}: out of order in 1 place, sorted by time",
    ]
    assert assert_done(replay(log, "--json")).json["notes"] == told
    done = replay(log)
    assert "notes:" not in done.out
    # Each of them once, with --json as without.
    for one in (done, replay(log, "--json")):
        assert one.err.splitlines() == [f"mapfilter: note: {note}" for note in told]


def test_notes_known_before_are_printed_before_a_log_is_located(log, replay, monkeypatch):
    (log / "motion.txt").write_text("")
    note, before = f"{log / 'motion.txt'}: not a table of a log, not read", []

    def located(*args, **options):
        before.append(sys.stderr.getvalue())
        return locate(*args, **options)

    monkeypatch.setattr(replay_log, "locate", located)
    done = assert_done(replay(log))
    assert before == [f"mapfilter: note: {note}\n"]
    assert done.err.count(note) == 1

    refused = fail(InputError, "motion.csv", "steps", "none")
    monkeypatch.setattr(replay_log, "locate", Mock(side_effect=refused))
    assert_refused(replay(log), note, "found none")


def test_a_ground_truth_that_begins_after_the_switch_tells_nothing_of_it(log, replay, tmp_path):
    at_s = assert_done(replay(log, "--json")).json["switch_time_s"]
    truth = pd.read_csv(log / "truth.csv")
    truth[truth["time_s"] > at_s].to_csv(log / "truth.csv", index=False)
    found = assert_done(replay(log, "--json", "--set", 'output.pictures="first"')).json
    assert (found["switched"], found["success"], found["switch_time_s"]) == (True, None, at_s)
    assert (found["switch_distance_m"], found["error_at_switch_m"]) == (None, None)
    assert found["error_mean_m"] > 0
    told = f"the ground truth has no position at the switch ({at_s:.0f} s): whether that was right"
    assert [note[: len(told)] for note in found["notes"]] == [told]
    assert (tmp_path / "out" / "error.png").exists()


def test_several_logs_are_summed_up_without_truth(own_world, replay, tmp_path):
    for folder in sorted(own_world.journeys.iterdir()):
        log = read_log(folder)
        radio = log.radio.assign(cell=log.radio["cell"].where(log.radio["cell"] != "C", "X"))
        write_log(replace(log, radio=radio, truth=log.truth.iloc[:0]), folder, "csv")
        (folder / "log.json").write_text(json.dumps({"crs": log.crs}))
        (folder / "weather.txt").write_text("fine")
    outcome = replay(own_world.journeys, "--json")
    assert outcome.code == 3
    found = outcome.json
    each = [
        json.loads((tmp_path / "out" / name / "figures.json").read_text())
        for name in (ONE, "journey-0001-draw-000")
    ]
    assert found["switched"] == sum(figures["switched"] for figures in each)
    assert sum(found["final_statuses"].values()) == found["logs"] == 2
    assert "success" not in found
    assert sum(found["seconds_by_status"].values()) == pytest.approx(
        sum(sum(figures["seconds_by_status"].values()) for figures in each)
    )
    for reason, count in found["unused"].items():
        assert count == sum(figures["unused"].get(reason, 0) for figures in each)
    readings = sum(figures["unknown_cells"].get("X", 0) for figures in each)
    assert found["unknown_cells"] == {"X": readings}
    assert set(found["logs_with_unknown_cells"]) <= {ONE, "journey-0001-draw-000"}
    assert "1 cell is unknown to the database (X; in journey-" in outcome.err
    note = "weather.txt: not a table of a log, not read"
    assert found["notes"] == [f"{note} (in {ONE}, journey-0001-draw-000)"]
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert {key: found[key] for key in summary} == summary


@pytest.mark.parametrize(
    ("columns", "lack"),
    [
        (["time_s", "step_m"], "no heading"),
        (
            ["time_s", "step_m", "turn_rad"],
            "no heading (turns alone do not give one; the filter bayes needs none)",
        ),
        (["time_s", "heading_rad"], "no motion (mapfilter locate needs none)"),
    ],
)
def test_logs_whose_motion_lacks_something(columns, lack, log, replay):
    motion = pd.read_csv(log / "motion.csv").assign(turn_rad=0.1)
    motion[columns].to_csv(log / "motion.csv", index=False)
    outcome = replay(log)
    assert outcome.code == 3
    *notes, said = outcome.err.splitlines()
    assert said == f"mapfilter: nothing is located in my-walk: {lack}"
    undirected = columns == ["time_s", "step_m"]
    assert [": no headings and no turns" in note for note in notes] == [True] * undirected


def test_turns_alone_are_enough_for_the_bayes_filter(log, replay):
    heading = pd.read_csv(log / "motion.csv")["heading_rad"]
    change(log / "motion.csv", turn_rad=lambda _: heading.diff().fillna(0.0))
    change(log / "motion.csv", heading_rad=put(None))
    found = assert_done(replay(log, "--json", "--filter", "bayes")).json
    assert (found["partial"], found["epochs"] > 100) == (False, True)


def test_what_converged_lacks_nothing(log, replay):
    """With fixes a position is found, whatever else there is not."""
    motion = pd.read_csv(log / "motion.csv").drop(columns="heading_rad")
    motion.to_csv(log / "motion.csv", index=False)
    truth = pd.read_csv(log / "truth.csv")
    fixes = truth[["time_s", "east_m", "north_m"]].assign(var_east_m2=9.0, var_north_m2=9.0)
    fixes.to_csv(log / "gnss.csv", index=False)
    outcome = assert_done(replay(log, "--json", "--filter", "bayes"))
    assert outcome.json["switched"]
    assert outcome.err == ""


def test_a_log_of_motion_alone_is_located_by_the_streets(log, replay, world):
    for table in ("radio", "gnss", "truth"):
        (log / f"{table}.csv").unlink(missing_ok=True)
    outcome = assert_done(replay(log, "--json", "--filter", "bayes", "--set=output.pictures=all"))
    assert (
        "no cells in the log: located by streets, and by positions where it has some"
        in (outcome.json["notes"])
    )
    database = mf.open_database(world.database)
    roads = database.without_cells()
    assert (len(database.cell_ids), roads.cell_ids) == (3, ())
    assert np.array_equal(roads.points().point, database.points().point)
    assert roads.field().level_dbm.shape[2] == 0
    track = mf.locate(mf.read_log(log), database)
    assert (track.estimate.hypotheses > 0).any()
    # Others cannot, and no filter with a step or two.
    for name in ("candidate", "grid"):
        refused = replay(log, "--filter", name)
        assert "no serving cell (the filter bayes starts by the streets alone)" in refused.err
    pd.read_csv(log / "motion.csv").iloc[:4].to_csv(log / "motion.csv", index=False)
    short = replay(log, "--filter", "bayes")
    assert (short.code, "too short a way" in short.err) == (3, True)


def test_a_log_with_a_header_and_no_rows(log, replay):
    for table in ("motion", "radio", "gnss", "truth"):
        file = log / f"{table}.csv"
        file.write_text(file.read_text().splitlines()[0] + "\n")
    outcome = replay(log, "--set=output.pictures=all")
    assert outcome.code == 3
    assert "nothing is located in my-walk: no serving cell and no motion" in outcome.err


def test_a_logs_randomness_depends_on_its_name_not_on_its_neighbours(world, tmp_path, monkeypatch):
    drawn = {}

    def drawing(log, filter_, rng, **options):
        drawn.setdefault(log.truth_length_m, []).append(rng.integers(2**62))
        return locate(log, filter_, rng, **options)

    monkeypatch.setattr("mapfilter.workflows.replays.located_log.locate", drawing)
    settings = ["output.pictures=none", f"database.path={world.database}"]
    for path in (world.journeys, world.journeys / "journey-0001-draw-000"):
        config = load_config(world.toml, [*settings, f"track.path={path}"])
        run_replay(config, tmp_path / "out")
    first, second = drawn.values()
    assert len(first) == 1
    assert second[0] == second[1] != first[0]


@pytest.mark.parametrize("same", ["options", "notes"])
def test_logs_share_a_filter_where_their_options_are_equal(same, world, tmp_path, monkeypatch):
    fits, filters = [], []

    def fitted(options, _log):
        fits.append(len(fits) + 1.0)
        if same == "options":
            return options, (f"at {fits[-1]} m/s",)
        return replace(options, margin_db=fits[-1]), ("fitted",)

    def drawing(log, filter_, rng, **options):
        filters.append(filter_)
        return locate(log, filter_, rng, **options)

    monkeypatch.setattr("mapfilter.workflows.replays.located_log.fitted_to_log", fitted)
    monkeypatch.setattr("mapfilter.workflows.replays.located_log.locate", drawing)
    settings = ["output.pictures=none", f"database.path={world.database}"]
    config = load_config(world.toml, [*settings, f"track.path={world.journeys}"])
    run_replay(config, tmp_path / "out")
    assert len(filters) > 1
    assert len(set(map(id, filters))) == (1 if same == "options" else len(filters))


def test_older_results_stay_when_a_replay_is_stopped(world, tmp_path, monkeypatch):
    """Of two logs the second is never located: nothing of the first replaces anything."""
    given = ["--db", world.database, "--log", world.journeys, "--out", tmp_path / "out"]
    assert_done(mapfilter("replay", "-c", world.toml, *given))
    (tmp_path / "out" / "mine.txt").write_text("of the user")
    before = contents(tmp_path / "out")
    located, calls = replay_log.locate, []

    def stopped(*args, **named):
        calls.append(args)
        if len(calls) == 2:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(30)
        return located(*args, **named)

    monkeypatch.setattr(replay_log, "locate", stopped)
    outcome = mapfilter("replay", "-c", world.toml, *given, *settings(filter__margin_db=3.0))
    assert (outcome.code, outcome.out) == (128 + signal.SIGTERM, "")
    assert "stopped by SIGTERM" in outcome.err
    assert "older results are as they were" in outcome.err
    assert contents(tmp_path / "out") == before
    monkeypatch.undo()
    assert_done(mapfilter("replay", "-c", world.toml, *given, *settings(filter__margin_db=3.0)))
    after = contents(tmp_path / "out")
    assert after != before
    assert after.keys() == before.keys()


def test_results_of_an_older_replay_do_not_stay_beside_new_ones(world, log, replay, tmp_path):
    out = tmp_path / "out"
    for keep in ("notes.txt", "other/notes.txt", "my-walk/figures.json", f"{ONE}-b/figures.json"):
        (out / keep).parent.mkdir(parents=True, exist_ok=True)
        (out / keep).write_text('{"log": "another"}')
    kept = contents(out)
    assert_done(replay(world.journeys, "--set=output.pictures=all"))
    assert {"out/summary.json", f"out/{ONE}/figures.json", f"out/{ONE}/track.png"} < set(
        contents(out)
    )
    assert_done(replay(log))
    now = contents(out)
    assert {name: now[name] for name in kept} == kept
    files = {"estimate.parquet", "estimate.gpx", "estimate.geojson", "figures.json"}
    assert set(now) - set(kept) == {f"out/{name}" for name in files}
    assert_done(replay(world.journeys))
    assert not (out / "figures.json").exists()


def test_what_is_left_out_is_counted(log, replay, tmp_path):
    change(log / "radio.csv", timing_advance=put(3))
    (log / "gnss.csv").write_text("time_s,east_m,north_m\n5,386000,6671800\n")
    neighbours = (pd.read_csv(log / "radio.csv")["role"] == "neighbour").sum()
    found = assert_done(replay(log, "--without", "neighbours,ta,gnss", "--json")).json
    assert found["unused"] == {}
    notes = json.loads((tmp_path / "out" / "figures.json").read_text())["notes"]
    left = ["gnss: 1 left out", "ta: 1 left out", f"neighbours: {neighbours} left out"]
    assert notes == left
    assert_done(replay(log))
    every = read_estimate(tmp_path / "out" / "estimate.parquet")
    assert {u.kind for u in every.unused} == {"neighbour", "gnss"}


def test_only_logs_that_know_their_start_give_times_in_gpx(log, replay, tmp_path):
    assert_done(replay(log))
    gpx = tmp_path / "out" / "estimate.gpx"
    assert "<time>" not in gpx.read_text()
    head = json.loads((log / "log.json").read_text())
    (log / "log.json").write_text(json.dumps({**head, "start_utc_s": 1_700_000_000}))
    assert_done(replay(log))
    assert "<time>2023-11-14T22:16:18.000Z<" in gpx.read_text()
    assert assert_done(mapfilter("info", log, "--json")).json["start_utc_s"] == 1_700_000_000


def test_a_database_that_nobody_names_is_named(log, world, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "database").symlink_to(world.out / "database")
    few = settings(output__pictures="none")
    done = mapfilter("replay", "--log", log, *few, "--json")
    taken = tmp_path / "out" / "database"
    assert (done.code, done.err) == (0, f"mapfilter: no --db: the database is {taken}\n")
    named = "--db", taken
    assert_done(mapfilter("replay", "--log", log, *named, *few, "--json"))


def test_logs_that_nobody_names_are_named(log, world, tmp_path, monkeypatch):
    """Without --log simulated journeys of the folder were located, and nothing said so."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    taken = tmp_path / "out" / "journeys"
    taken.symlink_to(log.parent)
    named = "--db", world.out / "database", *settings(output__pictures="none")
    done = mapfilter("replay", *named, "--json")
    assert done.code == 0
    assert done.err == f"mapfilter: no --log: the logs are those of {taken}\n"


def test_python_draws_as_the_command_by_the_name_of_the_log(world, log, replay, tmp_path):
    assert_done(replay(log, "--filter", "bayes", "--seed", "3"))
    written = read_estimate(tmp_path / "out" / "estimate.parquet")
    options = load_config(world.toml).filter.bayes.of(mf.BayesFilter)
    track = mf.locate(log, world.database, options, seed=named_rng(3, "replay", "my-walk"))
    np.testing.assert_array_equal(track.estimate.east_m, written.east_m)
    np.testing.assert_array_equal(track.estimate.north_m, written.north_m)
