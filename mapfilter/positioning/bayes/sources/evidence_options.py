"""How much reports of cells count."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, sqrt
from typing import Annotated

from annotated_types import Ge

from mapfilter.models.fingerprint import ServingWeights
from mapfilter.models.level_errors import LevelErrors
from mapfilter.options import NotNegative, Options, Positive, Share


@dataclass(frozen=True, slots=True)
class EvidenceOptions(Options):
    """Weights of radio reports.

    Parameters
    ----------
    spacing_m : float
        Least distance between two reports that are used.
    first_m : float
        Distance that the first report counts for, and the most that any report does.
    use_levels : bool
        Use levels, too, not serving cells only.
    serving_with_levels : float
        Share of a serving cell's weight where levels are reported, too: given these, it depends on
        the position no more.
    full_list : int
        With so many neighbours or more a report may have left out others, weaker than these; with
        fewer, all cells above the floor are in it, unless they share a carrier and the stronger
        ones may drown them.
    bound_weight : float
        Exponent of the likelihood of bounds and of levels of one of several cells.
    beside_db, beside_m : float
        How much predictions vary over a distance, as hypotheses lie beside the true position.
    """

    serving: ServingWeights = field(default_factory=ServingWeights)
    levels: LevelErrors = field(default_factory=LevelErrors)
    spacing_m: NotNegative = 5.0
    first_m: NotNegative = 25.0
    use_levels: bool = True
    serving_with_levels: Share = 1.0
    full_list: Annotated[int, Ge(0)] = 6
    bound_weight: Share = 0.5
    beside_db: NotNegative = 6.0
    beside_m: Positive = 50.0

    def offset_db(self, particle_spacing_m: float) -> float:
        """Return the standard deviation of a prediction so far beside the true position."""
        return self.beside_db * sqrt(2 * (1 - exp(-particle_spacing_m / self.beside_m)))
