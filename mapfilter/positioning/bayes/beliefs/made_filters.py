"""The filters of a single belief, for headings with and without a compass."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mapfilter._device import Device, arrays_of
from mapfilter._threads import ONE
from mapfilter.filters.contract import BeliefFilter
from mapfilter.filters.grid import GridBelief, GridFilter
from mapfilter.filters.particle import ParticleFilter, ParticleOptions
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start, any_heading
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.grid import StreetGrid
from mapfilter.positioning.bayes.rivals.alternative import MapBelief
from mapfilter.positioning.bayes.rivals.hold_rules import RivalRules
from mapfilter.positioning.bayes.sources.evidence import RadioReading

MapFilter = BeliefFilter[Start, Any, RadioReading]

_MORE_PARTICLES, _MORE_SEARCHING = 6, 3
"""Factors of the numbers of particles where headings are unknown."""
_AROUND, _AROUND_LATER = 6, 3
"""Factors of a rival's number of particles where it looks for another place near by, at first and
until it has found one."""


def particle_filters(model: BayesModel, known: ParticleOptions) -> dict[bool, MapFilter]:
    """Return the filters by hypotheses; ``known`` are their numbers where there is a compass."""
    # Every place times every heading: most of them die out after a few steps.
    most = _MORE_PARTICLES * known.max_particles
    searching = _MORE_SEARCHING * known.min_search_particles
    unknown = replace(known, max_particles=most, min_search_particles=searching)
    return {
        True: ParticleFilter(model, known, model.threads),
        False: ParticleFilter(model, unknown, model.threads),
    }


def grid_filters(
    model: BayesModel, options: ParticleOptions, device: Device
) -> dict[bool, MapFilter]:
    """Return the filters by masses on a grid, with and without a compass."""
    return {
        compass: GridFilter(_street_grid(model, device, compass=compass), options, device)
        for compass in (True, False)
    }


def smaller_filter(model: BayesModel, options: ParticleOptions, rules: RivalRules) -> MapFilter:
    """Return the filter of a rival that began as the belief: of fewer hypotheses."""
    few = min(rules.particles, options.max_particles)
    fewer = replace(options, max_particles=2 * few, min_particles=few, min_search_particles=few)
    return ParticleFilter(model, fewer, model.threads)


def around_filter(model: BayesModel, options: ParticleOptions, rules: RivalRules) -> MapFilter:
    """Return the filter of a belief about the place that a search has found."""
    few, most = rules.particles, options.max_particles
    some = replace(
        options,
        max_particles=min(_AROUND * few, most),
        min_particles=min(few, most),
        min_search_particles=min(_AROUND_LATER * few, most),
    )
    return ParticleFilter(model, some, model.threads)


def over_headings(
    model: BayesModel, belief: MapBelief, device: Device, rng: np.random.Generator
) -> MapBelief:
    """Spread a belief over all headings."""
    if isinstance(belief, GridBelief):
        grid = _street_grid(model, device, compass=False)
        count = grid.bias_rad.size
        on, off = (
            arrays_of(mass).repeat(mass.sum(axis=0, keepdims=True) / count, count, axis=0)
            for mass in (belief.on, belief.off)
        )
        return replace(belief, on=on, off=off, model=grid)
    state = any_heading(model, belief.state, _MORE_PARTICLES, rng)
    log_weight = np.tile(belief.log_weight, _MORE_PARTICLES) - np.log(_MORE_PARTICLES)
    kept = np.tile(belief.kept, (1, _MORE_PARTICLES))
    return replace(belief, state=state, log_weight=log_weight, kept=kept)


def _street_grid(model: BayesModel, device: Device, *, compass: bool) -> StreetGrid:
    plain = replace(model, remember=False, threads=ONE)
    return StreetGrid(plain, compass, device=device)
