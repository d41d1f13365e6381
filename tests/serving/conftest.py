"""One small database for all tests of the service."""

import numpy as np
import pytest
from asking import SMALL
from positioning.cross_world import make_database

from mapfilter.positioning.fingerprints.locating import fit_locator
from mapfilter.positioning.fingerprints.sources import reports_of_database
from mapfilter.serving.geolocate import geolocator


@pytest.fixture(scope="session")
def cross(tmp_path_factory):
    return make_database(tmp_path_factory.mktemp("cross"))


@pytest.fixture(scope="session")
def positioner(cross):
    return SMALL.over(cross)


@pytest.fixture(scope="session")
def fitted(cross):
    known = reports_of_database(cross)
    return fit_locator(known, "probabilistic", np.random.default_rng(0), validated=300)


@pytest.fixture(scope="session")
def locate(cross, fitted):
    return geolocator(fitted, cross.plan)
