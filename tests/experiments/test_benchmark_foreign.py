"""Other worlds on disk: which database and which faults a run is given."""

import hashlib
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.experiments.benchmarks import foreign
from mapfilter.experiments.benchmarks.foreign import ForeignWorld, database_name, write_ground
from mapfilter.lattice import Lattice
from mapfilter.simulation.worlds.open_ground import OpenGround

VARIANT_OF = ((0, 0), (1, 1), (2, 2), (3, 0), (4, 1), (11, 2))
"""Routes, and which of the three cities with a fault they take."""
FAULTY = SimpleNamespace(fault="cells-moved")


@pytest.mark.parametrize(("route", "variant"), VARIANT_OF)
def test_routes_take_the_cities_with_a_fault_in_turn(tmp_path, monkeypatch, route, variant):
    city = SimpleNamespace(streets=SimpleNamespace(plan="plan", lattice="lattice"))
    monkeypatch.setattr(ForeignWorld, "city", city)
    monkeypatch.setattr(foreign, "given_inputs", lambda *given: given)
    monkeypatch.setattr(foreign, "opened_filter", lambda *given: given)
    world = ForeignWorld("harsh", tmp_path, seed=8)
    assert world.given(FAULTY, route) == ("cells-moved", "plan", "lattice", 8, variant)
    for name in (f"database-cells-moved-{variant}", "database"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "manifest.json").write_text(name)
        case = FAULTY if name != "database" else SimpleNamespace(fault=None)
        checksum = hashlib.sha256(name.encode()).hexdigest()
        assert world.filter("options", case, route) == (tmp_path / name, checksum, "options")


def test_databases_are_named_by_fault_and_city():
    assert database_name(None, 2) == "database"
    assert database_name("silent", 2) == "database-silent-2"


def test_ground_that_is_kept_is_read_with_the_streets(tmp_path, monkeypatch):
    lattice = Lattice("EPSG:32635", 0.0, 0.0, 20.0, 2, 3)
    free, built = np.eye(2, 3, dtype=bool), np.eye(2, 3, 1, dtype=bool)
    write_ground(OpenGround(lattice, free, built), tmp_path / "ground.npz")
    (tmp_path / "streets").mkdir()
    (tmp_path / "streets" / "world.json").write_text("{}")
    streets = SimpleNamespace(lattice=lattice)
    monkeypatch.setattr(foreign, "open_world", lambda _: streets)
    city = ForeignWorld("harsh", tmp_path, seed=8).city
    assert city.streets is streets
    np.testing.assert_array_equal(city.ground.open, free)
    np.testing.assert_array_equal(city.ground.built, built)
