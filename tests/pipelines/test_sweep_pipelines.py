"""The pipelines of sweeps run, on a small part of the embedded map."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pipeline_scripts import PIPELINES, run_script

from mapfilter.config.load import load_config

SMALL = ["--set", "area.bbox=24.938,60.164,24.950,60.170"]


@pytest.mark.long
@pytest.mark.usefixtures("small_pictures")
def test_build_and_sweep(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = ["--out", str(tmp_path)]
    run_script("build_database", capsys, *SMALL, *out)
    few = ["--set", "sweep.routes=2", "--set", "sweep.draws=1"]
    found = run_script("sweep_imu_noise", capsys, *SMALL, *out, *few)["sweep"]
    assert found["runs"] == 36 * 2
    assert len(found["cells"]) == 36
    assert all(Path(picture).is_file() for picture in found["pictures"])


@pytest.mark.parametrize("file", sorted(PIPELINES.glob("*.toml")), ids=lambda file: file.stem)
def test_paths_that_a_pipeline_prints_have_no_dots(file: Path) -> None:
    assert load_config(file).output.dir.parent == PIPELINES.parent / "out"


def test_settings_of_the_readme_are_those_of_the_pipelines() -> None:
    readme = (PIPELINES.parent / "README.md").read_text(encoding="utf-8")
    lines = re.findall(r"^python pipelines/(\w+)\.py +(.+)$", readme, flags=re.MULTILINE)
    assert [name for name, _ in lines] == ["build_database", "replay_tracks"]
    for name, given in lines:
        shown = given.replace("WEST,SOUTH,EAST,NORTH", "24.938,60.164,24.950,60.170")
        settings = re.findall(r"--set (\S+)", shown)
        config = load_config(PIPELINES / f"{name}.toml", settings)
        assert Path(config.area.map).name == "CITY.osm.pbf"
    # What the README says of the second one.
    assert (config.filter.name, config.journeys.radio) == ("candidate", "as_predicted")
    assert "*candidate filter*, and a phone that is served exactly as predicted" in readme
    assert (config.journeys.count, config.journeys.draws) == (40, 5)


def test_settings_of_the_reproduction() -> None:
    config = load_config(PIPELINES / "reproduce_papers.toml")
    assert config.area.map == "synthetic"
    assert config.sweep.routes * config.sweep.draws == 100
