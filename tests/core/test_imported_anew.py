"""Objects of classes that were loaded before, as notebooks keep them after a new import."""

import pytest

from mapfilter._arguments import Argument, check_arguments
from mapfilter.errors import ConfigError
from mapfilter.lattice import Lattice

AGAIN = (
    r"\(likely: made before mapfilter was imported anew; make it again, or start Python again\)$"
)


def other(name, module):
    """An object of another class of the same names."""
    return type(name, (), {"__module__": module, "__qualname__": name})()


@pytest.mark.parametrize("kinds", [Lattice, Lattice | None, Lattice | str])
def test_an_object_of_before_is_named(kinds):
    given = Argument("lattice", other("Lattice", Lattice.__module__), kinds, "a lattice")
    with pytest.raises(
        ConfigError, match=rf"^f, lattice: expected a lattice, found Lattice {AGAIN}"
    ):
        check_arguments("f", given)
    with pytest.raises(
        ConfigError, match=rf"^f, lattice: expected a lattice, found Lattice {AGAIN}"
    ):
        check_arguments("f", keywords=[given])


@pytest.mark.parametrize(("name", "module"), [("Lattice", "mine"), ("Grid", Lattice.__module__)])
def test_another_object_is_not(name, module):
    given = Argument("lattice", other(name, module), Lattice, "a lattice")
    with pytest.raises(ConfigError, match=rf"^f, lattice: expected a lattice, found {name}$"):
        check_arguments("f", given)
