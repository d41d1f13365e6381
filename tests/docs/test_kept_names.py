"""The documentation finds the names that Sphinx finds, among those that end in the same word."""

from itertools import product
from pathlib import Path
from runpy import run_path
from types import SimpleNamespace

import pytest
from sphinx.domains.python import ObjectEntry, PythonDomain

Names = run_path(str(Path(__file__).parents[2] / "docs" / "kept_names.py"))["Names"]
OBJECTS = {
    "mapfilter": "module", "mapfilter.errors": "module", "mapfilter.errors.Part": "class",
    "mapfilter.errors.Part.size": "method", "mapfilter.errors.size": "function", "Part": "class",
    "mapfilter.options": "module", "mapfilter.options.Other.size": "attribute",
    "mapfilter.options.Part.size": "method", "mapfilter.unsize": "data",
}  # fmt: skip


@pytest.fixture(scope="module")
def domains():
    """Sphinx's names, and those of the documentation."""
    env = SimpleNamespace(domaindata={})
    both = PythonDomain(env), Names(env)
    for name, kind in OBJECTS.items():
        both[0].objects[name] = ObjectEntry("page", name, kind, False)
    assert both[1].objects is both[0].objects
    return both


@pytest.mark.parametrize("by_ending", [0, 1])
def test_all_names_are_found_that_sphinx_finds(domains, by_ending):
    """Of one word alone at most one is meant, where several end in it."""
    theirs, ours = domains
    words = [*OBJECTS, *(name.rpartition(".")[2] for name in OBJECTS)]
    words += ["errors.Part", "Part.size", "Part.size()", "size()", "nothing", "Part.nothing", "()"]
    found = 0
    for module, class_, name, kind in product(
        (None, "mapfilter", "mapfilter.errors"),
        (None, "Part"),
        words,
        ("meth", "class", "mod", "data"),
    ):
        sought = module, class_, name, kind, by_ending
        expected = theirs.find_obj(None, *sought)
        given = ours.find_obj(None, *sought)
        if by_ending and "." not in name and len(expected) > 1:
            assert [one in expected for one in given] == [True], sought
        else:
            assert given == expected, sought
        found += len(expected)
    assert found > 100
