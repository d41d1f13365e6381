"""How long the hard tests of databases run."""

import pytest

KILLS = 6


def pytest_addoption(parser: pytest.Parser) -> None:
    said = "how many times a build is killed at a random moment"
    parser.addoption("--kills", type=int, default=KILLS, help=said)


@pytest.fixture(scope="session")
def kill_count(request: pytest.FixtureRequest) -> int:
    """How many times a build is killed at a random moment."""
    return int(request.config.getoption("--kills", KILLS))
