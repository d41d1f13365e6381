"""The contract of filters over epochs.

A filter is a frozen object. ``begin`` returns the state before the first epoch, and ``step`` takes
one epoch: state in, state out, with a :class:`StepOutput`.
:func:`mapfilter.positioning.loop.locate` calls it for every epoch of a log, a live application for
every one that comes in: equal epochs give equal bytes.
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from mapfilter._arguments import shown
from mapfilter._same import EqualByContent
from mapfilter._types import Floats
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import ConfigError, fail
from mapfilter.geodesy import short_crs
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import StepOutput
from mapfilter.tracks.schema import ALL_KINDS as ALL_KINDS
from mapfilter.tracks.schema import Kind as Kind

StateT = TypeVar("StateT")


@dataclass(frozen=True, slots=True, eq=False)
class Hypotheses(EqualByContent):
    """Position hypotheses of a belief, in the CRS of the filter.

    Parameters
    ----------
    east_m, north_m, weight : (n,) arrays
        Weights sum to one.
    """

    east_m: Floats
    north_m: Floats
    weight: Floats


class Smoother(Protocol):
    """Collects the states of a forward pass, and smooths the track by them."""

    def add(self, before: Any, after: Any) -> None:
        """Record the states before and after one epoch."""

    def smoothed(self, estimate: TrackEstimate, rng: np.random.Generator) -> TrackEstimate:
        """Return the estimate with positions given the whole log; statuses stay."""


class Recorder(Protocol):
    """Sees every step of a filter, to show or explain it afterwards."""

    def record(
        self, before: Any, epoch: Epoch, rng: np.random.Generator, after: Any, output: StepOutput
    ) -> None:
        """Record one step; ``rng`` is a copy of the generator as it was before the step."""


class Filter(ABC, Generic[StateT]):
    """A filter over an area, from an unknown start; subclasses are frozen dataclasses.

    ``begin`` and ``step`` are all that a filter needs. They are pure: states are never changed in
    place, and the generator alone decides the result.
    """

    def __repr__(self) -> str:
        """Return its class, name and CRS: the map that it holds has millions of numbers."""
        return f"<{type(self).__name__} {self.name!r}, {short_crs(self.crs)}>"

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the filter, as in estimates and commands."""

    @property
    @abstractmethod
    def crs(self) -> str:
        """CRS of its positions."""

    @property
    def uses(self) -> Collection[Kind]:
        """Kinds of measurements that it takes; others are reported as not used."""
        return ALL_KINDS

    @abstractmethod
    def begin(self, kinds: Collection[Kind] = ALL_KINDS) -> StateT:
        """Return the state before the first epoch.

        Parameters
        ----------
        kinds : collection of str
            What the journey records: without "motion" there is no dead reckoning to wait for.
        """

    @abstractmethod
    def step(
        self, state: StateT, epoch: Epoch, rng: np.random.Generator
    ) -> tuple[StateT, StepOutput]:
        """Take one epoch: first move, then measure."""

    @property
    def made_of(self) -> Any:
        """Options that it was made of, where :meth:`with_options` takes others; else None."""
        return None

    def with_options(self, options: Any) -> Filter[StateT]:  # noqa: ARG002
        """Return the filter by other options, such as those that a log states, where it was."""
        return self

    def warm_up(self, merged: Sequence[Epoch]) -> None:
        """Load kernels and map data before the clock starts."""

    def for_scores(self) -> Filter[StateT]:
        """Return a filter whose positions and statuses are these, and that may leave out the rest.

        Success and errors need neither ways nor protection levels. By default it is this one.
        """
        return self

    def smoother(self) -> Smoother | None:
        """Return a new smoother where positions shall be smoothed, else None."""
        return None

    def hypotheses(self, state: StateT) -> Hypotheses | None:
        """Return the hypotheses of a state, for pictures; None where there are none."""
        del state
        return None


class FilterOptions(Protocol):
    """Options of a filter, hashable: :meth:`over` binds them to a database."""

    @property
    def name(self) -> str:
        """Name of the filter, as ``--filter`` takes it."""

    def __hash__(self) -> int:
        """Return a hash: workers keep one filter for equal options."""

    def over(self, database: RadioRouteDatabase, *, ways: bool = True) -> Filter[Any]:
        """Return the filter over the area of a database.

        Parameters
        ----------
        database : RadioRouteDatabase
            What is read of it is kept, and shared by all logs.
        ways : bool
            Whether positions are matched to ways; success and errors do not need it.
        """


def check_over(options: FilterOptions, database: object) -> None:
    """Check that options are not bound to the path of a database.

    Raises
    ------
    ConfigError
        They are.
    """
    if isinstance(database, str | os.PathLike):
        where, expected = f"{type(options).__name__}.over, database", "a database of open_database"
        hint = "its path; open_database opens it"
        raise fail(ConfigError, where, expected, shown(database), hint)
