"""The errors of single reports beside those of a replay."""

import json

import numpy as np
import pandas as pd
import pytest
from command_line import assert_done, mapfilter

import mapfilter as mf
from mapfilter.positioning.fingerprints.locating import fit_locator, locate_by, usual_readings
from mapfilter.positioning.fingerprints.options import Probabilistic
from mapfilter.positioning.fingerprints.sources import reports_of_database, reports_of_logs
from mapfilter.workflows.replays import baseline
from mapfilter.workflows.replays import logs as replay_logs
from mapfilter.workflows.replays.baseline import MOST_REPORTS, Baselines, SingleReports, together


def test_a_replay_shows_what_single_reports_would(log, replay, world, tmp_path):
    found = assert_done(replay(log, "--json", "--filter", "bayes")).json["baseline"]
    database, given = mf.open_database(world.database), mf.read_log(log)
    reports = reports_of_logs([given], database.plan)
    placed = np.isfinite(reports.east_m) & (np.diff(reports.first) > 0)
    assert found["reports"] == placed.sum()
    assert found["tried"] == min(placed.sum(), MOST_REPORTS)
    # Positions are those that locate finds; all of them here, as the log is short.
    strongest = usual_readings(reports.some(placed))
    fitted = fit_locator(
        reports_of_database(database), Probabilistic(), strongest=strongest, validated=50
    )
    error_m = locate_by(fitted, reports.some(placed)).error_m
    assert found["tried"] == placed.sum()
    assert found["error_median_m"] == pytest.approx(np.median(error_m), rel=0.02)
    assert found["scored"] == np.isfinite(error_m).sum()
    assert 0 <= found["within_95"] <= 1
    kept = json.loads((tmp_path / "out" / "figures.json").read_text())
    assert kept["baseline"] == found
    again = assert_done(replay(log, "--json", "--filter", "bayes")).json["baseline"]
    assert again == found


def test_without_truth_reports_or_cells_there_is_none(log, replay, world):
    database, given = mf.open_database(world.database), mf.read_log(log)
    assert Baselines(database, 0).of(given) is not None
    for table in ("truth", "radio"):
        empty = getattr(given, table).iloc[:0]
        lacking = mf.make_log(
            given.crs,
            **{
                name: getattr(given, name) if name != table else empty
                for name in ("motion", "radio", "truth")
                if name != table
            },
        )
        assert Baselines(database, 0).of(lacking) is None
    assert Baselines(database.without_cells(), 0).of(given) is None
    assert Baselines(None, 0).of(given) is None
    (log / "truth.csv").unlink()
    assert "baseline" not in assert_done(replay(log, "--json", "--filter", "bayes")).json


def test_long_logs_are_thinned(log, world):
    database, given = mf.open_database(world.database), mf.read_log(log)
    radio, truth = given.radio, given.truth
    copies = 1 + 2 * MOST_REPORTS // radio["time_s"].nunique()
    last_s = float(max(radio["time_s"].max(), truth["time_s"].max())) + 100.0
    long = mf.make_log(
        given.crs,
        radio=pd.concat([radio.assign(time_s=radio["time_s"] + k * last_s) for k in range(copies)]),
        truth=pd.concat([truth.assign(time_s=truth["time_s"] + k * last_s) for k in range(copies)]),
    )
    found = Baselines(database, 0).of(long)
    assert found.reports > MOST_REPORTS
    assert (found.tried, found.error_m.size <= MOST_REPORTS) == (MOST_REPORTS, True)


def test_the_reports_tried_are_spread_over_the_log_and_held_by_their_95_percent(
    log, world, monkeypatch
):
    database, given = mf.open_database(world.database), mf.read_log(log)
    reports, most = reports_of_logs([given], database.plan), 20
    monkeypatch.setattr(baseline, "MOST_REPORTS", most)
    placed = np.flatnonzero(np.isfinite(reports.east_m) & (np.diff(reports.first) > 0))
    at = np.linspace(0, placed.size - 1, most).astype(np.int64)
    assert at[-1] == placed.size - 1 > most
    tried = reports.some(placed[at])
    made = Baselines(database, 0)
    located = locate_by(made._locator(tried), tried)
    known = np.isfinite(located.error_m)
    found = made.of(given)
    np.testing.assert_array_equal(found.error_m, located.error_m[known])
    np.testing.assert_array_equal(
        found.within_95, located.error_m[known] <= located.radii_m[known, 2]
    )
    # The 50 and 67 % hold fewer.
    assert (located.error_m[known] <= located.radii_m[known, 1]).sum() < found.within_95.sum()


def test_reports_of_several_logs_are_put_together():
    one = SingleReports(4, 3, np.array([1.0, 5.0, 9.0]), np.array([True, True, False]))
    two = SingleReports(2, 2, np.array([3.0, 7.0]), np.array([True, True]))
    both = together([one, None, two]).figures
    assert (both["reports"], both["tried"], both["scored"]) == (6, 5, 5)
    assert (both["error_median_m"], both["error_95_m"]) == (5.0, 9.0)
    assert both["within_95"] == pytest.approx(0.8)
    assert together([None]) is None
    none = SingleReports(1, 1, np.empty(0), np.empty(0, bool)).figures
    assert np.isnan([none["error_median_m"], none["within_95"]]).all()


@pytest.mark.parametrize(("kept_rows", "times"), [(1_000_000, 1), (0, 2)])
def test_small_logs_are_read_once_and_large_ones_again(
    kept_rows, times, log, replay, tmp_path, monkeypatch
):
    read, open_journey = [], replay_logs.open_journey

    def counted(config, path, area):
        read.append(path)
        return open_journey(config, path, area)

    monkeypatch.setattr(replay_logs, "open_journey", counted)
    monkeypatch.setattr(replay_logs, "_MOST_KEPT_ROWS", kept_rows)
    assert_done(replay(log))
    assert read == [log] * times
    figures = json.loads((tmp_path / "out" / "figures.json").read_text())
    assert figures["baseline"]["scored"] > 0


def test_several_logs_have_one_baseline(world, tmp_path):
    outcome = mapfilter(
        "replay", "-c", world.toml, "--db", world.database, "--log", world.out / "journeys",
        "--out", tmp_path / "out", "--json",
    )  # fmt: skip
    found = outcome.json["baseline"]
    parts = [
        json.loads(p.read_text())["baseline"] for p in (tmp_path / "out").glob("*/figures.json")
    ]
    assert found["reports"] == sum(part["reports"] for part in parts)
    assert len(parts) == 2
