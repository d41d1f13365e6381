"""The cross of streets as a database, built once."""

import pytest
from cross_world import make_database

from mapfilter.positioning.global_positioning import cell_points


@pytest.fixture(scope="session")
def cross_database(tmp_path_factory):
    return make_database(tmp_path_factory.mktemp("cross"))


@pytest.fixture(scope="session")
def cross_points(cross_database):
    return cell_points(cross_database)
