"""A vehicle that nothing but its turns and the map of ways locate: on carriageways.

A vehicle keeps to its lanes, which take a third of a street with its pavements. On ways as narrow
as that its turns say much more of where it is. The true position costs some 0.03 nats a metre then,
a path that lies on none of the roads 0.07 or more once it has been compared with all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

from mapfilter.filters.particle import ParticleOptions
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules
from mapfilter.positioning.bayes.rivals.mirrored import MirrorRules

_LANE_SD_M = 2.0
_NULL_NATS_PER_M = 0.06
"""Cost of a metre under the null hypothesis, between those at the true position and elsewhere."""
_CONVERGE_LOG_ODDS = -3.0
_LEAST_MASS, _LEAST_HOLD_M = 0.99, 50.0


@dataclass(frozen=True)
class CarriagewayFilters:
    """Model, options and rules of a vehicle that nothing but turns and the map locate.

    ``model`` holds carriageways for ways; ``mirror`` is what a belief must show to converge.
    """

    model: BayesModel
    options: ParticleOptions
    rules: AlternativeRules
    mirror: MirrorRules = field(default_factory=MirrorRules)

    @cached_property
    def places(self) -> int:
        """Number of points that a belief is drawn from."""
        return int(self.model.whole.points.shape[1])


def carriageway_filters(
    model: BayesModel,
    options: ParticleOptions,
    rules: AlternativeRules,
    asked: ParticleOptions,
) -> CarriagewayFilters | None:
    """Return the filters of a vehicle; None where an area holds no carriageways.

    Parameters
    ----------
    model, options, rules : BayesModel, ParticleOptions and AlternativeRules
        Those where the map alone is the evidence.
    asked : ParticleOptions
        Those of other evidence, with the share of a belief in one place, and the distance for which
        that must hold, that a user asks for.
    """
    area = model.whole.of_carriageways()
    if area is None:
        return None
    weights = replace(model.weights, sd_m=min(model.weights.sd_m, _LANE_SD_M))
    return CarriagewayFilters(
        replace(model, area=area, weights=weights),
        replace(
            options,
            switch_mass=max(asked.switch_mass, _LEAST_MASS),
            switch_hold_m=max(asked.switch_hold_m, _LEAST_HOLD_M),
        ),
        replace(
            rules,
            converge_log_odds=_CONVERGE_LOG_ODDS,
            map_nats_per_m=_NULL_NATS_PER_M,
            takes_over_searching=True,
        ),
    )
