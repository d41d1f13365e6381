"""Custom filters: classes that users write, given as objects or imported by name.

A name is ``package.module:Name``. Called with a database, it gives a filter of either contract:
``begin`` and ``step`` over epochs (:class:`mapfilter.positioning.filter.Filter`), or ``init``,
``predict``, ``update`` and ``locate`` over beliefs
(:class:`mapfilter.filters.contract.BeliefFilter`) with epochs as prior and readings. Importing a
name runs the code of its module: give only names of modules that you trust.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import ConfigError, fail
from mapfilter.filters.contract import (
    PLACE_SHAPES,
    Estimate,
    Reason,
    ReturnTypeError,
    Status,
    check_kinds,
    check_shapes,
    checked_pair,
)
from mapfilter.positioning.belief_tracker import BeliefTracker, TrackState
from mapfilter.positioning.candidate import cell_points, startable
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.filter import ALL_KINDS, Filter, Hypotheses, Kind, Smoother
from mapfilter.positioning.step_output import Fix, StepOutput
from mapfilter.positioning.user_errors import fault_text, file_of, module_of, wrap_user_errors

_ALONE = ("time_s", "mass_50m", "way_probability", "radius_99_m", "protection_m")
_FIX_SHAPES: Mapping[str, tuple[int, ...]] = PLACE_SHAPES | dict.fromkeys(_ALONE, ())
_BELIEF_FUNCTIONS = ("init", "predict", "update", "locate")
_EPOCH_FUNCTIONS = ("begin", "step")


def own_name(made: object, otherwise: str) -> str:
    """Return the name that a filter gives itself by a text ``name``, or another one without it."""
    name = getattr(made, "name", None)
    return name if isinstance(name, str) and name else otherwise


@dataclass(frozen=True, slots=True)
class CustomFilter:
    """A filter by its name; it is imported anew by every process.

    Parameters
    ----------
    name : str
        ``package.module:Name``.
    source_sha256 : str
        Of the module's file, so that what an older text of it found is not taken for its results.
    """

    name: str
    source_sha256: str = ""

    def over(self, database: RadioRouteDatabase, *, ways: bool = True) -> Filter[Any]:
        """Import the filter and make it over a database.

        Raises
        ------
        ConfigError
            As :func:`custom_filter`, or the filter does not take a database.
        """
        with wrap_user_errors(self.name):
            made = _imported(self.name)(database)
        return adapted(made, database, self.name, ways=ways)


@dataclass(frozen=True, eq=False)
class GivenFilter:
    """A filter by the class, or the function of a database, that makes it.

    Processes get it by its name: it has to be one that they can import. Two of the same class are
    two filters, as the class may have been changed in between.
    """

    make: Callable[[RadioRouteDatabase], Any]

    @property
    def name(self) -> str:
        """The name that the class gives itself, else that of the class or function."""
        make = self.make
        while isinstance(make, partial):
            make = make.func
        return own_name(make, str(getattr(make, "__name__", type(make).__name__)))

    def over(self, database: RadioRouteDatabase, *, ways: bool = True) -> Filter[Any]:
        """Make the filter over a database; ConfigError where it lacks a function."""
        with wrap_user_errors(self.name, self.make):
            made = self.make(database)
            name = own_name(made, self.name)
        return adapted(made, database, name, ways=ways)


def custom_filter(name: str) -> CustomFilter:
    """Import a filter to see that it is there, and return its options.

    Raises
    ------
    ConfigError
        It cannot be imported, is not called, or lacks a function of a filter.

    Examples
    --------
    >>> custom_filter("math:pi")
    Traceback (most recent call last):
        ...
    mapfilter.errors.ConfigError: filter math:pi: expected a class, or a function that makes a \
filter of a database, found float
    """
    found = _imported(name)
    if isinstance(found, type):
        _check_functions(name, found)
    file = file_of(inspect.getmodule(found) or module_of(name))
    text = file.read_bytes() if file is not None and file.is_file() else b""
    return CustomFilter(name, hashlib.sha256(text).hexdigest())


def _imported(name: str) -> Any:
    module, _, path = name.partition(":")
    try:
        found: Any = import_module(module)
        for part in path.split("."):
            found = getattr(found, part)
    # A module may do anything when it is imported, also end the program.
    except (Exception, SystemExit) as error:
        hint = "its folder is neither the working folder nor in PYTHONPATH"
        raise fail(
            ConfigError,
            f"filter {name}",
            "a filter that can be imported as package.module:Name",
            fault_text(error),
            hint if isinstance(error, ModuleNotFoundError) else "",
        ) from error
    if not callable(found):
        expected = "a class, or a function that makes a filter of a database"
        raise fail(ConfigError, f"filter {name}", expected, type(found).__name__)
    return found


def _check_functions(name: str, found: object) -> None:
    if _lacking(found, _EPOCH_FUNCTIONS):
        lacking = _lacking(found, _BELIEF_FUNCTIONS)
        if lacking:
            expected = f"the functions {', '.join(_BELIEF_FUNCTIONS)} (or begin and step)"
            raise fail(ConfigError, f"filter {name}", expected, f"no {', '.join(lacking)}")


def _lacking(found: object, names: tuple[str, ...]) -> list[str]:
    return [one for one in names if not callable(getattr(found, one, None))]


def adapted(
    made: Any, database: RadioRouteDatabase, name: str, *, ways: bool = True
) -> Filter[Any]:
    """Return an object of either contract as a filter over epochs.

    Parameters
    ----------
    name : str
        Of the filter, in estimates and in messages of errors in its code.
    ways : bool
        Whether positions of a filter of beliefs are matched to ways.

    Raises
    ------
    ConfigError
        It lacks a function.
    """
    _check_functions(name, made)
    if not _lacking(made, _EPOCH_FUNCTIONS):
        return CustomEpochFilter(made, name, getattr(made, "crs", database.lattice.crs))
    return CustomTracker(
        made,
        database,
        startable(cell_points(database)),
        lambda epoch: epoch if epoch.measured else None,
        name,
        start_by_fix=True,
        ways=ways,
    )


@dataclass(frozen=True, eq=False, repr=False)
class CustomTracker(BeliefTracker):
    """A custom filter of beliefs; errors in its code name its file and line."""

    def step(
        self, state: TrackState, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[TrackState, StepOutput]:
        """Take one epoch: first move, then measure."""
        with wrap_user_errors(self.name, self.filter):
            return super().step(state, epoch, rng)

    def _fix(
        self, epoch: Epoch, located: Estimate, status: Status, count: int, reason: Reason
    ) -> Fix:
        check_shapes("locate", located, PLACE_SHAPES)
        return super()._fix(epoch, located, status, count, reason)


@dataclass(frozen=True, eq=False)
class CustomEpochFilter(Filter[Any]):
    """A custom filter over epochs; errors in its code name its file and line.

    Parameters
    ----------
    filter : object
        With ``begin(kinds)`` and ``step(state, epoch, rng)``.
    filter_crs : str
        Of the database.
    """

    filter: Any
    filter_name: str
    filter_crs: str

    @property
    def name(self) -> str:
        """Name of the filter."""
        return self.filter_name

    @property
    def crs(self) -> str:
        """CRS of the database."""
        return self.filter_crs

    @property
    def uses(self) -> Collection[Kind]:
        """Kinds of measurements that it takes."""
        return getattr(self.filter, "uses", ALL_KINDS)

    def warm_up(self, merged: Sequence[Epoch]) -> None:
        """Prepare the filter, where it can be prepared."""
        if hasattr(self.filter, "warm_up"):
            with wrap_user_errors(self.name, self.filter):
                self.filter.warm_up(merged)

    def smoother(self) -> Smoother | None:
        """Return the filter's smoother, where it has one."""
        with wrap_user_errors(self.name, self.filter):
            return self.filter.smoother() if hasattr(self.filter, "smoother") else None

    def hypotheses(self, state: Any) -> Hypotheses | None:
        """Return the filter's hypotheses, where it shows them."""
        with wrap_user_errors(self.name, self.filter):
            return self.filter.hypotheses(state) if hasattr(self.filter, "hypotheses") else None

    def begin(self, kinds: Collection[Kind] = ALL_KINDS) -> Any:
        """Return the state before the first epoch."""
        with wrap_user_errors(self.name, self.filter):
            return self.filter.begin(kinds)

    def step(self, state: Any, epoch: Epoch, rng: np.random.Generator) -> tuple[Any, StepOutput]:
        """Take one epoch."""
        with wrap_user_errors(self.name, self.filter):
            returned = self.filter.step(state, epoch, rng)
            after, output = checked_pair(returned, "step", "state", StepOutput)
            check_kinds("step", output.fix.status, output.fix.reason)
            check_shapes("step", output.fix, _FIX_SHAPES)
            for name in ("hypotheses", "way_id"):
                if not hasattr(getattr(output.fix, name), "__index__"):
                    found = type(getattr(output.fix, name)).__name__
                    raise ReturnTypeError("step", f"{name} as a whole number", found)
            return after, output
