"""The paper's set-up on a real city: sizes and success rates (Khalaf-Allah 2007, Fig. 5)."""

from __future__ import annotations

from pathlib import Path

import pytest
from pipeline_scripts import run_script

from mapfilter.workflows.replays import baseline

ROUTES, DRAWS = 40, 1
"""The paper has 100 runs. Routes differ more than draws do: a share of success has a deviation of
0.065 to 0.075 by one draw (binomial), of 0.06 by two and of 0.05 by five."""


@pytest.fixture(scope="module")
def porto(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    settings = {
        "area.map": shared_data / "osm-extracts" / "porto.osm.pbf",
        "area.southwest": "-8.6235,41.1325",
        "area.size_m": "3000,3000",
        # Journeys are as predicted.
        "prediction.ground_truth.write": "false",
        "output.pictures": "none",
    }
    out = ["--out", str(tmp_path_factory.mktemp("porto"))]
    return [
        *(part for key, value in settings.items() for part in ("--set", f"{key}={value}")),
        *out,
    ]


@pytest.fixture
def _hardly_any_single_reports(monkeypatch: pytest.MonkeyPatch) -> None:
    """Locate them beside the replays as ever, but so few that they take no time."""
    monkeypatch.setattr(baseline, "MOST_REPORTS", 2)
    monkeypatch.setattr(baseline, "CALIBRATED_WITH", 10)


@pytest.mark.long
@pytest.mark.usefixtures("_hardly_any_single_reports")
def test_porto_has_the_points_and_the_success_of_the_paper(
    porto: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    database = run_script("build_database", capsys, *porto)
    assert database["predict"]["rows"] == database["predict"]["cols"] == 600
    assert database["predict"]["cells"] == 10
    assert 55_000 <= database["build"]["points"] <= 75_000
    counts = ["--set", f"journeys.count={ROUTES}", "--set", f"journeys.draws={DRAWS}"]
    for sigma_deg, published in ((3, 0.78), (6, 0.65)):
        noise = ["--set", f"imu.sigma_orient_deg={sigma_deg}"]
        found = run_script("replay_tracks", capsys, *porto, *counts, *noise)["replay"]
        assert found["runs"] == ROUTES * DRAWS
        assert abs(found["success"] - published) <= 0.10
