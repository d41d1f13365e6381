"""``mapfilter reproduce dlr`` from the command line."""

import csv
import json

import numpy as np
from command_line import assert_refused, mapfilter
from typer.testing import CliRunner

from mapfilter.cli import app
from mapfilter.experiments.papers.dlr import experiment as dlr


def made(trial, seed):
    """Filters have tests of their own."""
    rng = np.random.default_rng([trial, seed])
    errors = rng.exponential(10.0, (len(dlr.RUNS), 290))
    seen = rng.integers(1, 9, 290)
    errors[dlr.RUNS.index(dlr.STATIC), seen < 4] = np.nan
    return dlr.TrackErrors(errors, seen, seen // 2)


def made_again(draw, trial, seed):
    return np.random.default_rng([draw, trial, seed]).exponential(5.0, (3, 290))


def test_dlr(tmp_path, monkeypatch):
    monkeypatch.setattr(dlr, "track_errors", made)
    monkeypatch.setattr(dlr, "errors_over_time", made_again)
    monkeypatch.setattr(dlr, "DRAWS", 2)
    words = ["reproduce", "dlr", "--trials", "3", "--json", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, words, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout.splitlines()[-1])
    groups = {
        "all": {"static", "pkf", "ekf", "pf"},
        "tdoa_only": {"ekf_edge", "pf_edge", "pf_near"},
        "hybrid": {"ekf_gnss", "ekf_edge", "ekf_near", "fixed3_edge"},
        "critical": {"gps", "gps_galileo", "near", "edge"},
    }
    for group, names in groups.items():
        assert set(found[group]) == set(found["published"][group]) == names
        for name in names:
            low, high = found["intervals"][group][name]
            assert low <= found[group][name] <= high
    assert 0 < found["static_availability"] < 1
    assert abs(found["critical_share"] + found["static_availability"] - 1) < 1e-12
    # Epochs without a fix are failures there: 3 of 8 are more than 10 %.
    assert found["every_epoch"]["static"] is None
    assert (found["trials"], found["epochs"]) == (3, 870)
    assert any("geometry only" in one for one in found["assumptions"])
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"errors.csv", "errors.tex"} | {
        f"figure-{name}.png" for name in ("1", "6", "7", "8", "9", "9-thresholds", "10", "11", "12")
    }
    with (tmp_path / "errors.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(found["rows"]) == 4 * len(dlr.RUNS)
    assert {row["epochs"] for row in rows} == {"every", "fixed", "critical", "gps_critical"}


def test_one_track_has_no_interval(tmp_path):
    words = ["reproduce", "dlr", "--trials", "1", "--out", str(tmp_path)]
    assert_refused(mapfilter(*words), "--trials", "at least 2")


def test_what_it_takes_no_heed_of_is_refused(tmp_path):
    words = ["reproduce", "dlr", "--map", "helsinki", "--out", str(tmp_path / "out")]
    assert_refused(mapfilter(*words), "--map", "dlr takes none")
