"""Another city with the same cell identities: for logs that belong to another place.

Identities are reused: two operators, or two regions, have cells of the same carrier and identity
code, and a wrong database may be chosen for a log. The other city is this one mirrored, so that
blocks, bends and widths are as plausible, with its cells' identities dealt out anew.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mapfilter._types import Floats32
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.roads.network import StreetNetwork
from mapfilter.simulation.worlds.open_ground import OpenGround

AWAY_M = 50_000.0
"""How far east the other city lies."""


def mirrored_network(network: StreetNetwork, lattice: Lattice) -> StreetNetwork:
    """Return streets mirrored east to west within an area."""
    west, _, east, _ = lattice.bounds_m
    return replace(network, east_m=west + east - network.east_m)


def mirrored_ground(ground: OpenGround) -> OpenGround:
    """Return open ground mirrored east to west."""
    return OpenGround(ground.lattice, ground.open[:, ::-1], ground.built[:, ::-1])


def mirrored_heights(heights_m: Floats32 | None) -> Floats32 | None:
    """Return building heights mirrored east to west."""
    return None if heights_m is None else np.asarray(heights_m[:, ::-1])


def dealt_anew(plan: CellPlan, lattice: Lattice, rng: np.random.Generator) -> CellPlan:
    """Return a plan mirrored east to west, whose identities were exchanged at random."""
    west, _, east, _ = lattice.bounds_m
    order = rng.permutation(len(plan))
    cells = []
    for cell, other in zip(plan.cells, (plan.cells[int(i)] for i in order), strict=True):
        azimuth = other.azimuth_deg
        cells.append(
            replace(
                other,
                id=cell.id,
                arfcn=cell.arfcn,
                bsic=cell.bsic,
                mcc=cell.mcc,
                mnc=cell.mnc,
                lac=cell.lac,
                ci=cell.ci,
                east_m=west + east - other.east_m,
                azimuth_deg=None if azimuth is None else (-azimuth) % 360.0,
            )
        )
    return replace(plan, cells=tuple(cells))
