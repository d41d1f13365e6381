"""``mapfilter reproduce tesa`` from the command line."""

import json

import numpy as np
from typer.testing import CliRunner

from mapfilter.cli import app
from mapfilter.experiments.papers.tesa import experiment as tesa


def test_tesa(tmp_path, monkeypatch):
    def made(trial, seed):
        """Filters have tests of their own."""
        return np.random.default_rng([trial, seed]).exponential(60.0, (len(tesa.RUNS), 720))

    monkeypatch.setattr(tesa, "trial_errors_m", made)
    words = ["reproduce", "tesa", "--trials", "2", "--json", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, words, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout.splitlines()[-1])
    assert set(found["scenario1"]) == {"gnss_m", "hybrid_m"}
    assert set(found["scenario2"]) == {
        "hybrid_outage_m", "hybrid_outage_interval_m", "gnss_velocity_outage_m",
        "hybrid_identity_outage_m", "gnss_outage_m", "hybrid_known_bearing_outage_m",
        "availability_gnss", "availability_hybrid_identity", "availability_hybrid",
        "outage_below_100m",
    }  # fmt: skip
    assert set(found["scenario2"]["outage_below_100m"]) == {
        "velocity", "identity", "known_bearing",
    }  # fmt: skip
    assert set(found["scenario3"]) == {
        "hybrid_outage_m", "gnss_velocity_outage_m", "hybrid_identity_outage_m",
    }  # fmt: skip
    rows = {(row["scenario"], row["motion"], row["beta_db"]): row for row in found["rows"]}
    assert found["scenario2"]["hybrid_outage_m"] == rows[2, "velocity", 1.0]["outage_m"]
    assert found["scenario2"]["hybrid_identity_outage_m"] == rows[2, "identity", 1.0]["outage_m"]
    assert found["scenario3"]["gnss_velocity_outage_m"] == rows[3, "velocity", None]["outage_m"]
    assert found["trials"] == 2
    assert len(found["rows"]) == 14
    for row in found["rows"]:
        low, high = row["availability_interval"]
        assert 0 <= low <= row["availability"] <= high <= 1
        assert row["outage_interval_m"][0] <= row["outage_m"] <= row["outage_interval_m"][1]
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {
        "figure-4.png", "figure-6.png", "figure-7.png", "figure-8.png", "outage.png",
        "halt.png", "scenarios.csv", "scenarios.tex",
    }  # fmt: skip
    table = (tmp_path / "scenarios.csv").read_text(encoding="utf-8").splitlines()
    assert table[0].startswith("scenario,motion,beta_db,mean_m,mean_m_low,mean_m_high")
    assert len(table) == 15


def test_one_trial_has_no_interval(tmp_path):
    words = ["reproduce", "tesa", "--trials", "1", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, words)
    assert result.exit_code != 0
