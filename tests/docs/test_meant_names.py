"""Which object a short name in a docstring links to: the same, whatever is read first."""

from itertools import permutations
from pathlib import Path
from runpy import run_path

import pytest

MEANT = run_path(str(Path(__file__).parents[2] / "docs" / "meant_names.py"))
meant, imported_names = MEANT["meant"], MEANT["imported_names"]
NAMES = ["package.near.one.Part", "package.near.Part", "package.far.Part", "package.far.away.Part"]


@pytest.mark.parametrize(
    ("module", "imported", "expected"),
    [
        ("package.near.other", {"Part": "package.far.away.Part"}, "package.far.away.Part"),
        ("package.near.other", {}, "package.near.Part"),
        ("package.near.one", {}, "package.near.one.Part"),
        ("package.far.away", {}, "package.far.away.Part"),
        # By a module that has it of another one, and on a page of no module.
        ("package.near.other", {"Part": "package.other.Part"}, "package.near.Part"),
        ("", {}, "package.far.Part"),
    ],
)
def test_one_of_several_is_meant_in_any_order(module, imported, expected):
    for names in permutations(NAMES):
        assert meant(names, module, imported) == [expected]


def test_a_name_of_another_package_means_none_of_them():
    assert meant(NAMES, "package.near.other", {"Part": "numpy.Part"}) == []
    assert meant([], "package.near.other", {}) == []
    assert meant(NAMES[:1], "package.near.other", {}) == NAMES[:1]


def test_imports_are_read_without_running_a_module():
    names = imported_names("mapfilter.positioning.bayes.warm_up")
    # For types alone, and at run time.
    assert names["BayesPositioner"] == "mapfilter.positioning.bayes.filter.BayesPositioner"
    assert names["Epoch"] == "mapfilter.positioning.epochs.Epoch"
    assert imported_names("mapfilter.nothing_of_that_name") == imported_names("") == {}
    assert imported_names("math") == {}
