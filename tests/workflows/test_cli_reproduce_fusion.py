"""``mapfilter reproduce`` and ``bench`` for fusion, from the command line."""

import json

import pytest
from typer.testing import CliRunner

from mapfilter.cli import app
from mapfilter.experiments.papers.fritsche_klein_2009 import paper
from mapfilter.workflows.benchmarks import fusion as bench_fusion

QUANTITIES = {"location_m", "velocity_mps", "bias_m", "drift_mps"}


def told(words):
    result = CliRunner().invoke(app, [*words, "--json"], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout.splitlines()[-1])


def test_fritsche_and_klein(tmp_path, monkeypatch):
    monkeypatch.setattr(paper, "SUM_PARTS", {0: 3, 2: 3})
    (tmp_path / "mine.toml").write_text("steps = 20\nserving = 1\n", encoding="utf-8")
    found = told([
        "reproduce", "fritsche-klein-2009", "--trials", "6", "--out", str(tmp_path / "a"),
        "--layout", str(tmp_path / "mine.toml"),
    ])  # fmt: skip
    for name in ("rbukf", "ekf", "pcrlb"):
        assert set(found[name]) == {"gsm", "hybrid1", "hybrid2"}
        for kind, row in found[name].items():
            assert set(row) == QUANTITIES
            assert (row["bias_m"] is None) == (kind == "gsm")
            assert row["location_m"] > 0
    assert found["published"]["ekf"]["hybrid2"]["location_m"] == 45.3
    pictures = {path.name for path in (tmp_path / "a").glob("*.png")}
    assert {"figure-1.png", "figure-2.png", "smoothed.png", "hard.png"} <= pictures
    rows = (tmp_path / "a" / "table-3.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0].startswith("algorithm,method,location_m")
    assert any(row.startswith("rbukf,hybrid2") and row.endswith("44.4,2.7,4.6,1.2") for row in rows)
    again = told([
        "reproduce", "fritsche-klein-2009", "--trials", "6", "--out", str(tmp_path / "b"),
        "--layout", str(tmp_path / "mine.toml"),
    ])  # fmt: skip
    assert again["ekf"] == found["ekf"]
    for name in ("figure-2.png", "table-3.csv"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_zhang(tmp_path):
    found = told(["reproduce", "zhang-2006", "--trials", "5", "--out", str(tmp_path)])
    assert set(found["bound_m"]) == {"0.4", "4", "40"}
    assert set(found["bound_m"]["4"]) == {"fusion", "ta", "rss"}
    assert set(found["bound_m"]["4"]["rss"]) == {"10", "100", "400"}
    assert found["bound_m"]["4"]["fusion"]["10"] == pytest.approx(150.7, rel=0.005)
    assert set(found["ekf_over_bound"]) == {"50", "100", "200", "400"}
    names = {path.name for path in tmp_path.iterdir()}
    assert {"figure-1.png", "figure-2.png", "figure-3.png", "wide-start.png", "bounds.csv"} <= names


BAD = {
    "no TOML": ("steps = ", "TOML"),
    "an unknown key": ("step = 3\n", "keys among"),
    "too few directions": ("boresights_deg = [1.0]\n", "one direction"),
    "text for numbers": ('sites_m = [["a", 1.0]]\n', "numbers"),
    "a site of one number": ("sites_m = [[1.0]]\n", "numbers"),
    "half a step": ("steps = 2.5\n", "whole number"),
    "a step that is none": ("steps = true\n", "whole number"),
    "steps without end": ("steps = 1000000000\n", "whole number"),
    "half a site": ("serving = 0.5\n", "whole number"),
    "a satellite nowhere": ("satellite_azimuths_deg = [nan, 1.0]\n", "finite"),
    "a satellite out of reach": ("satellite_distance_m = inf\n", "a number > 0, found inf"),
    "below the horizon": ("satellite_elevation_deg = -3\n", "a number > 0 and <= 90, found -3"),
    "one satellite": ("satellite_azimuths_deg = [1.0]\n", "two or more"),
    "infinity": ("boresights_deg = [inf, 0, 0, 0, 0, 0, 0]\n", "finite"),
}


@pytest.mark.parametrize(("text", "said"), BAD.values(), ids=BAD)
def test_a_layout_that_is_none_is_said_so(text, said, tmp_path):
    (tmp_path / "bad.toml").write_text(text, encoding="utf-8")
    words = ["reproduce", "fritsche-klein-2009", "--layout", str(tmp_path / "bad.toml")]
    from mapfilter.errors import InputError

    with pytest.raises(InputError, match=said):
        CliRunner().invoke(app, [*words, "--out", str(tmp_path / "o")], catch_exceptions=False)


@pytest.mark.parametrize("paper", ["fritsche-klein-2009", "zhang-2006"])
def test_more_trials_than_memory_holds_are_refused(paper, tmp_path):
    from mapfilter.errors import ConfigError

    words = ["reproduce", paper, "--trials", "1000000000", "--out", str(tmp_path / "o")]
    with pytest.raises(ConfigError, match="20000"):
        CliRunner().invoke(app, words, catch_exceptions=False)


def test_bench_of_fusion(monkeypatch):
    monkeypatch.setattr(bench_fusion, "_TRIALS", 20)
    found = told(["bench", "fusion", "--runs", "1"])
    assert found["trials"] == 20
    assert found["ekf_per_s"] > 0
    assert found["rbukf_per_s"] > 0
    assert found["table_3_s"] > 0
