"""Usual options of methods for single reports, and their names."""

from dataclasses import asdict

import pytest

from mapfilter.errors import ConfigError
from mapfilter.positioning.fingerprints.options import (
    CANDIDATES,
    METHODS,
    Centroid,
    Neighbours,
    Probabilistic,
    SurveyMaps,
    method_name,
    method_options,
)

NEIGHBOURS = {"k": 15, "metric": "sorensen", "representation": "powed", "exponent": 1.5,
              "weight_power": 4.0}  # fmt: skip
PROBABILISTIC = {
    "level_db": 5.0, "shared_db": 3.0, "absence_per_db": 0.2, "effective_readings": 8.0,
    "timing_sd_steps": 0.5, "outliers": 0.001,
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "kind", "usual"),
    [("centroid", Centroid, {}), ("knn", Neighbours, NEIGHBOURS),
     ("probabilistic", Probabilistic, PROBABILISTIC),
     ("gp", SurveyMaps, PROBABILISTIC | {"level_db": 4.0})],
)  # fmt: skip
def test_methods_by_name_with_their_usual_options(name, kind, usual):
    found = method_options(name)
    assert type(found) is kind is METHODS[name]
    assert asdict(found) == usual
    assert method_name(found) == name


def test_what_differs_from_the_usual_is_in_the_name():
    assert method_name(Probabilistic(shared_db=2.5)) == "probabilistic (shared_db 2.5)"
    assert [method_name(one) for one in CANDIDATES] == [
        "knn", "knn (representation positive)", "probabilistic",
    ]  # fmt: skip


@pytest.mark.parametrize("given", [{"k": 0}, {"k": 10_001}, {"exponent": 0.0}, {"exponent": 10.5},
                                   {"weight_power": -1.0}, {"weight_power": 51.0}])  # fmt: skip
def test_neighbours_have_limits(given):
    with pytest.raises(ConfigError, match=next(iter(given))):
        Neighbours(**given)


def test_the_limits_of_neighbours_are_allowed():
    for given in ({"k": 1}, {"k": 10_000}, {"exponent": 10.0}, {"weight_power": 0.0},
                  {"weight_power": 50.0}):  # fmt: skip
        assert asdict(Neighbours(**given)) == NEIGHBOURS | given


def test_a_name_of_no_method_is_told():
    with pytest.raises(ConfigError, match="auto, centroid, knn, probabilistic, gp"):
        method_options("no_method")
