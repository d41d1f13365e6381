"""The map alone as evidence: turns against streets, where nothing else is measured.

Hypotheses are weighed by the map as they move. This source makes a belief start after some tens of
metres, and makes it due for resampling and for the switch rule every few metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mapfilter.positioning.bayes.beliefs.path import LEG_M
from mapfilter.positioning.bayes.sources.evidence import (
    Context,
    EvidenceSource,
    EvidenceUpdate,
    FixedTerm,
)
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch
from mapfilter.tracks.schema import Kind

_NOTHING = (FixedTerm(np.zeros(1)),)


@dataclass(frozen=True)
class MapSource(EvidenceSource):
    """The map of ways, over an area without cells.

    The state is the distance travelled at the last update; ``spacing_m`` that between updates.
    """

    spacing_m: float = LEG_M
    name: ClassVar[str] = "map"
    kinds: ClassVar[frozenset[Kind]] = frozenset({"motion"})

    def begin(self) -> float:
        """Return the distance before the first update."""
        return 0.0

    def first(self, epoch: Epoch) -> EvidenceUpdate:  # noqa: ARG002
        """Return nothing: without motion a map holds no evidence."""
        return EvidenceUpdate(0.0)

    def first_after(self, state: BayesState, epoch: Epoch) -> EvidenceUpdate:  # noqa: ARG002
        """Return the last metres, when they are enough to start with."""
        now_m = state.reckoning.travelled_m
        if not state.path.whole:
            return EvidenceUpdate(now_m)
        return EvidenceUpdate(now_m, _NOTHING, path=state.path)

    def update(self, state: BayesState, epoch: Epoch, context: Context) -> EvidenceUpdate:  # noqa: ARG002
        """Return a term that is the same for all hypotheses, when one is due."""
        last_m, now_m = state.sources[self.name], state.reckoning.travelled_m
        if now_m - last_m < self.spacing_m:
            return EvidenceUpdate(last_m)
        return EvidenceUpdate(now_m, _NOTHING)
