"""What a program gives to a filter beside epochs: kinds of measurements, states and generators."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from mapfilter._inputs import shown
from mapfilter.errors import InputError, fail
from mapfilter.positioning.epoch_checks import check_epoch
from mapfilter.positioning.epochs import Epoch
from mapfilter.tracks.schema import ALL_KINDS


def check_kinds_given(kinds: Collection[str]) -> None:
    """Check the kinds of measurements that a journey records.

    Raises
    ------
    InputError
        They are no collection of texts, or one of them is no kind.
    """
    given: Any = kinds
    wrong = [given]
    if isinstance(given, Collection) and not isinstance(given, str):
        wrong = [one for one in given if not (isinstance(one, str) and one in ALL_KINDS)]
    if wrong:
        expected = f"a collection of {', '.join(sorted(ALL_KINDS))}"
        raise fail(InputError, "kinds", expected, ", ".join(map(shown, wrong)))


def check_step(state: Any, kind: type, epoch: Epoch, rng: np.random.Generator) -> None:
    """Check what a step is given: an epoch, a state with the time of the one before, a generator.

    Parameters
    ----------
    state : object
        With its time in ``time_s``.
    kind : type
        Class of the filter's states.
    epoch : Epoch
    rng : numpy.random.Generator

    Raises
    ------
    InputError
        A value of the epoch is of another type or beyond its range, it is before the last one, the
        state is one of another filter, or ``rng`` is no generator.
    """
    check_epoch(epoch)
    check_state_kind(state, kind)
    check_later(epoch, state.time_s)
    check_generator(rng)


def check_state_kind(state: object, kind: type) -> None:
    """Check that a state is one of the filter that it is given to.

    Raises
    ------
    InputError
        It is one of another filter, or none.
    """
    if not isinstance(state, kind):
        expected = "a state of this filter, of begin or step"
        raise fail(InputError, "state", expected, f"a {type(state).__name__}")


def check_later(epoch: Epoch, last_s: float) -> None:
    """Check that an epoch is not before the one that a state is of.

    Parameters
    ----------
    last_s : float
        Time of the epoch before; NaN for none.

    Raises
    ------
    InputError
        It is before that.
    """
    if epoch.time_s < last_s:
        expected = f"{last_s!r} or later, as the epoch before is of that time"
        hint = "epochs out of order, or a clock that was set back; begin anew after a pause"
        raise fail(InputError, "epoch, time_s", expected, repr(epoch.time_s), hint)


def check_generator(rng: np.random.Generator) -> None:
    """Check that random numbers come from a generator: of a seed each step would draw the same.

    Raises
    ------
    InputError
        They do not.
    """
    given: Any = rng
    if not isinstance(given, np.random.Generator):
        expected, hint = "a numpy.random.Generator", "numpy.random.default_rng(seed), once for all"
        raise fail(InputError, "rng", expected, shown(given), hint)
