"""The small world of these tests, and how long the hard ones run."""

import shutil
from pathlib import Path

import pytest
from small_world import World, make_database, make_world

from mapfilter.database.radioroutes import RadioRouteDatabase

KILLS = 6


def pytest_addoption(parser: pytest.Parser) -> None:
    said = "how many times a build is killed at a random moment"
    parser.addoption("--kills", type=int, default=KILLS, help=said)


@pytest.fixture(scope="session")
def kill_count(request: pytest.FixtureRequest) -> int:
    """How many times a build is killed at a random moment."""
    return int(request.config.getoption("--kills", KILLS))


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> World:
    """Rasters, a plan and routes."""
    return make_world(tmp_path_factory.mktemp("rasters"))


@pytest.fixture(scope="module")
def database(world: World, tmp_path_factory: pytest.TempPathFactory) -> RadioRouteDatabase:
    """A database of the world, which no test changes."""
    return make_database(world, tmp_path_factory.mktemp("built"))


@pytest.fixture
def copy(database: RadioRouteDatabase, tmp_path: Path) -> Path:
    """A copy of the database, to be changed."""
    shutil.copytree(database.path, tmp_path / "db")
    return tmp_path / "db"
