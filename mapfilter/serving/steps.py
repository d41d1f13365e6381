"""Work on one session: how it begins, and what its epochs make of it."""

from __future__ import annotations

import copy
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from mapfilter.errors import Faults, InputError
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.log_options import LogStatement
from mapfilter.positioning.step_output import StepOutput
from mapfilter.radio.plan_names import PlanNames
from mapfilter.serving.documents import RequestError, check_keys, text, whole
from mapfilter.serving.epoch_rows import check_pace, read_epochs
from mapfilter.serving.events import fix_document, json_bytes
from mapfilter.serving.filters import LOG, SessionFilter, statement_of
from mapfilter.serving.places import check_fixes, placeless_note, start_of
from mapfilter.serving.session import Progress
from mapfilter.serving.watching import Watcher

SEED_BITS = 63

_MOST_WATCHED = 30
"""Last epochs of a request that are shown with what their readings contributed."""


@dataclass(frozen=True, slots=True)
class Stepped:
    """What the epochs of a request make of a session.

    Parameters
    ----------
    progress : Progress
        After them.
    fixes : list of bytes
        One for each epoch, as JSON.
    details : list of bytes
        The same for a page that shows the session; empty where nobody watches.
    belief : bytes
        Of the last epoch; empty where nobody watches.
    notes : tuple of str
        What the epochs state in vain.
    fault : str
        Traceback of the last fault in what a page shows; empty without one.
    """

    progress: Progress
    fixes: list[bytes]
    details: list[bytes]
    belief: bytes
    notes: tuple[str, ...] = ()
    fault: str = ""


def first(
    positioner: BayesPositioner, seed: int, start: tuple[float, float, float] | None
) -> Progress:
    """Return the beginning of a session, at an unknown place or a known start."""
    rng = np.random.default_rng(seed)
    state = positioner.begin() if start is None else positioner.begin_at(*start, rng)
    return Progress(state, rng.bit_generator.state)


def stepped(
    filter_: SessionFilter,
    names: PlanNames,
    before: Progress,
    document: Mapping[str, Any],
    *,
    watched: bool = False,
) -> Stepped:
    """Return what a request's epochs make of a session.

    Parameters
    ----------
    watched : bool
        Whether somebody watches.

    Raises
    ------
    RequestError
        Faults of the request.
    """
    positioner, watcher = filter_.positioner, filter_.watcher if watched else None
    epochs = read_epochs(document, names, before.time_s, filter_.technology)
    check_fixes(epochs, before.state, positioner.area.lattice)
    rng = np.random.default_rng()
    rng.bit_generator.state = before.rng
    state, fixes, details, faults = before.state, [], [], [""]
    count, explained_from = before.epochs + len(epochs), len(epochs) - _MOST_WATCHED
    for index, epoch in enumerate(epochs):
        held = state
        drawn = copy.deepcopy(rng) if watcher is not None and index >= explained_from else None
        state, output = positioner.step(held, epoch, rng)
        number_ = before.epochs + index + 1
        fixes.append(json_bytes(fix_document(output, number_, positioner.crs)))
        if watcher is not None:
            make = partial(_detail, watcher, held, epoch, drawn, state, output)
            details.append(shown_or(b"{}", make, faults))
    check_pace(state.watch.pace, state.reckoning.travelled_m)
    progress = Progress(state, rng.bit_generator.state, count, epochs[-1].time_s, fixes[-1])
    belief = b""
    if watcher is not None:
        belief = shown_or(b"", partial(watcher.belief, state, count), faults)
    notes = (*filter_.unused(document), *placeless_note(document))
    return Stepped(progress, fixes, details, belief, notes, faults[-1])


def _detail(
    watcher: Watcher,
    before: BayesState,
    epoch: Epoch,
    rng: np.random.Generator | None,
    after: BayesState,
    output: StepOutput,
) -> bytes:
    return json_bytes(watcher.detail(before, epoch, rng, after, output))


def shown_or(nothing: bytes, make: Callable[[], bytes], faults: list[str]) -> bytes:
    """Return what a page shows; a fault there costs the page this part, and the device nothing.

    Its traceback is added to ``faults``. MemoryError is no fault of the page.
    """
    try:
        return make()
    except MemoryError:
        raise
    except Exception:
        faults.append(traceback.format_exc())
        return nothing


class Wanted(NamedTuple):
    """What a client asks of a new session.

    Parameters
    ----------
    start : tuple of float or None
        A known start: east, north and deviation.
    stated : LogStatement
        What the device's log states.
    """

    name: str
    seed: int | None
    start: tuple[float, float, float] | None
    stated: LogStatement


def wanted(document: Mapping[str, Any], lattice: Lattice) -> Wanted:
    """Return what a client asks of a new session over an area.

    Raises
    ------
    RequestError
        With all faults together.
    """
    faults = Faults()
    check_keys(document, ("name", "seed", "start", LOG), "body", faults)
    name, seed, start = "", None, None
    if document.get("name") is not None:
        name = text(document["name"], "name", "1..128 printable characters", faults) or ""
    if document.get("seed") is not None:
        most = 2**SEED_BITS - 1
        seed = whole(document["seed"], "seed", f"a whole number in 0..{most}", faults, 0, most)
    given = document.get("start")
    if isinstance(given, dict):
        start = start_of(given, lattice, faults)
    elif given is not None:
        faults.add("start", "an object with lat_deg, lon_deg and sd_m", "something else")
    stated = statement_of(document.get(LOG), faults)
    if faults.found:
        raise RequestError.of(InputError(tuple(faults.found)))
    return Wanted(name, seed, start, stated)
