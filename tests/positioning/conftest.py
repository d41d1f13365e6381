"""The database of the cross, and its area, made once for each module that asks for them."""

import pytest
from cross_world import make_database

from mapfilter.positioning.bayes.area.opened_area import open_area


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    return make_database(tmp_path_factory.mktemp("cross"))


@pytest.fixture(scope="module")
def area(database):
    return open_area(database)
