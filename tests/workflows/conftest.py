"""One small world for all commands: 400 m of central Helsinki with three cells."""

import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from check_world import base_levels
from command_line import IDENTITIES, ONE, assert_done, mapfilter, settings

from mapfilter.tracks.store import read_log, write_log

PLAN = """cell,site,lat,lon,height_m,azimuth_deg,eirp_dbm,frequency_mhz,arfcn,bsic
A,S1,60.16690,24.94300,30,60,50,1825.2,612,17
B,S1,60.16690,24.94300,30,180,50,1826.4,618,17
C,S2,60.16890,24.94880,25,240,50,1827.6,624,17
"""

LOOKED_AT = {
    "test_build_pictures", "test_cli_locate", "test_cli_reproduce", "test_cli_survey",
    "test_cli_sweep", "test_drawn_beside", "test_evaluate_pictures", "test_evaluate_recorded",
    "test_film_command", "test_sweep_titles",
}  # fmt: skip
"""Tests of pictures; others ask whether there are files, and of which names."""

TOML = """[area]
bbox = [24.9420, 60.1660, 24.9495, 60.1697]
[cells]
plan = "cells.csv"
[prediction]
shadowing_db = 8.0
[journeys]
count = 2
length_m = 250
radio = "as_predicted"
[filter]
name = "candidate"
margin_db = 0.0
update_length_m = 10.0
[output]
dir = "out"
pictures = "none"
"""

BENCHMARK_TOML = """[area]
bbox = [24.9420, 60.1660, 24.9495, 60.1697]
[cells]
plan = "cells.csv"
[prediction]
shadowing_db = 8.0
[journeys]
length_m = 250
[output]
pictures = "none"
"""


@dataclass(frozen=True)
class World:
    """Files of the world; nobody may change them: take a copy."""

    folder: Path

    @property
    def toml(self) -> Path:
        return self.folder / "world.toml"

    @property
    def benchmark_toml(self) -> Path:
        """The same place with no settings but those that benchmarks take."""
        return self.folder / "benchmark.toml"

    @property
    def plan(self) -> Path:
        return self.folder / "cells.csv"

    @property
    def out(self) -> Path:
        return self.folder / "out"

    @property
    def rasters(self) -> Path:
        return self.out / "rxlev.tif"

    @property
    def database(self) -> Path:
        return self.out / "database"

    @property
    def journeys(self) -> Path:
        return self.out / "journeys"


def make_world(folder: Path) -> World:
    world = World(folder)
    world.plan.write_text(PLAN, encoding="utf-8")
    world.toml.write_text(TOML, encoding="utf-8")
    world.benchmark_toml.write_text(BENCHMARK_TOML, encoding="utf-8")
    for command in ("predict", "build", "simulate"):
        assert_done(mapfilter(command, "-c", world.toml))
    return world


@pytest.fixture(scope="module", autouse=True)
def _small_baselines(request):
    """Locate few single reports beside each replay; tests of this baseline as many as a user."""
    if request.path.stem != "test_replay_baseline":
        request.getfixturevalue("few_single_reports")


@pytest.fixture(scope="module", autouse=True)
def _small_pictures(request):
    """Draw small pictures where they are not looked at: large ones take longer than commands."""
    if request.path.stem not in LOOKED_AT:
        request.getfixturevalue("small_pictures")


@pytest.fixture(scope="session")
def world(tmp_path_factory: pytest.TempPathFactory) -> World:
    """Plan, rasters, database and two journeys, made by the commands themselves."""
    return make_world(tmp_path_factory.mktemp("world"))


@pytest.fixture(scope="module")
def levels():
    """Levels of the world of checks."""
    return base_levels()


@pytest.fixture(scope="session")
def database(tmp_path_factory):
    """The small world's database, of a plan with identities."""
    folder = tmp_path_factory.mktemp("identified")
    head, *rows = PLAN.splitlines()
    lines = [f"{head},technology,mcc,mnc,lac,ci"]
    for number, row in enumerate(rows):
        # One carrier, as cells of LTE share it.
        place, _, _ = row.rsplit(",", 2)
        identity = ",".join(map(str, IDENTITIES[row[0]]))
        lines.append(f"{place},1300,{17 + number},LTE,244,91,{identity}")
    (folder / "cells.csv").write_text("\n".join(lines) + "\n")
    (folder / "world.toml").write_text(TOML)
    for command in ("predict", "build"):
        assert_done(mapfilter(command, "-c", folder / "world.toml"))
    return folder / "out" / "database"


@pytest.fixture
def own_world(world: World, tmp_path: Path) -> World:
    """A copy of the world that a test may spoil."""
    shutil.copytree(world.folder, tmp_path / "world")
    return World(tmp_path / "world")


@pytest.fixture
def log(world, tmp_path):
    """A log folder as a person makes it: ``log.json`` with a CRS, and CSV tables."""
    folder = tmp_path / "my-walk"
    write_log(read_log(world.journeys / ONE), folder, "csv")
    crs = json.loads((folder / "log.json").read_text())["crs"]
    (folder / "log.json").write_text(json.dumps({"crs": crs}))
    return folder


@pytest.fixture
def replay(world, tmp_path):
    def replay(log, *more):
        given = ["--db", world.database, "--log", log, "--out", tmp_path / "out"]
        pictures = settings(output__pictures="none")
        return mapfilter("replay", "-c", world.toml, *given, *pictures, *more)

    return replay
