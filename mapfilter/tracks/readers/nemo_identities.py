"""The serving cell's identity in Nemo logs: events tell it apart from the measurements."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter.tracks.readers.recorded.identities import available
from mapfilter.tracks.readers.texts.events import Events

_MOST_CONTEXTS = 64
_DEDICATED = 5.0


@dataclass(frozen=True, eq=False)
class _Known:
    """Values that hold from a line on: (N,) lines and (N, K) values."""

    line: Ints
    values: Floats

    def at(self, lines: Ints) -> Floats:
        """Return the values of the last line before each, (M, K), NaN where there is none."""
        at = np.searchsorted(self.line, lines) - 1
        found = np.full((len(lines), self.values.shape[1]), np.nan)
        found[at >= 0] = self.values[at[at >= 0]]
        return found

    def then(self, line: Ints, values: Floats) -> _Known:
        """Return the last of these values, and those that follow."""
        return _Known(
            np.concatenate([self.line[-1:], line]), np.concatenate([self.values[-1:], values])
        )


def _nothing(count: int) -> _Known:
    return _Known(np.zeros(0, dtype=np.int64), np.zeros((0, count)))


@dataclass(frozen=True)
class Identities:
    """Network (mcc, mnc) and serving cell (carrier, PCI, state, ci, lac) of one system."""

    network: _Known
    serving: _Known


def nothing_known() -> Identities:
    """Return what is known before the first event."""
    return Identities(_nothing(2), _nothing(5))


def context_size(events: Events, at: Ints) -> Ints:
    """Return how many ids of a context stand before the parameters."""
    count, _ = events.columns(at, context=2).whole("context")
    return np.clip(count, 0, _MOST_CONTEXTS)


def followed(
    events: Events, family: str, systems: Collection[int], known: Identities
) -> Identities:
    """Return what a system is known by after these events."""
    network, serving = known.network, known.serving
    at, system = of_systems(events, "SEI")
    at = at[np.isin(system, list(systems))]
    if at.size:
        shift = context_size(events, at)
        rows = events.columns(at, mcc=shift + 6, mnc=shift + 7)
        values = np.stack([available(*rows.whole(name)) for name in ("mcc", "mnc")], axis=1)
        named = ~np.isnan(values[:, 0])
        network = network.then(rows.line[named], values[named])
    at, system = of_systems(events, "CHI")
    at = at[np.isin(system, list(systems))]
    if at.size and family != "GSM":
        shift = context_size(events, at)
        lte = family == "LTE"
        rows = events.columns(
            at,
            arfcn=shift + (7 if lte else 6),
            bsic=shift + (8 if lte else -99),
            state=shift + 5,
            ci=shift + (9 if lte else 7),
            lac=shift + (10 if lte else 8),
        )
        values = np.stack([available(*rows.whole(name)) for name in rows.names], axis=1)
        serving = serving.then(rows.line, values)
    return Identities(network, serving)


def of_systems(events: Events, kind: str) -> tuple[Ints, Ints]:
    """Return the events of a kind, and the radio system of each."""
    at = np.flatnonzero(events.kind == kind)
    if not at.size:
        return at, np.zeros(0, dtype=np.int64)
    return at, events.columns(at, system=context_size(events, at) + 3).whole("system")[0]


def identity_at(
    lines: Ints, arfcn: Floats, bsic: Floats, family: str, known: Identities, alone: Bools
) -> dict[str, Floats]:
    """Return the identity of each cell of LTE or UMTS, as if it were the serving one.

    ``alone`` tells of UMTS where the active set is one cell.
    """
    mcc, mnc = known.network.at(lines).T
    at_arfcn, at_bsic, state, ci, lac = known.serving.at(lines).T
    same = at_arfcn == arfcn
    if family == "LTE":
        same &= at_bsic == bsic
    else:
        # Of an active set of several cells, and after soft handovers, it is not known which.
        same &= alone & (state != _DEDICATED)
    same &= ~np.isnan(ci)
    found = {"mcc": mcc, "mnc": mnc, "ci": ci, "lac": lac}
    return {name: np.where(same, values, np.nan) for name, values in found.items()}
