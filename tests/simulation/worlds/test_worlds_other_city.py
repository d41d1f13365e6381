"""Another city: mirrored streets, identities dealt out anew."""

import numpy as np
from blocks_town import LATTICE, WEST_M, ground, heights_m, network, plan

from mapfilter.simulation.worlds.other_city import (
    dealt_anew,
    mirrored_ground,
    mirrored_heights,
    mirrored_network,
)


def test_streets_houses_and_ground_are_mirrored_together():
    west, _, east, _ = LATTICE.bounds_m
    mirrored = mirrored_network(network(), LATTICE)
    assert np.array_equal(mirrored.east_m, west + east - network().east_m)
    assert np.array_equal(mirrored.north_m, network().north_m)
    assert np.array_equal(mirrored.length_m, network().length_m)
    other = mirrored_ground(ground())
    places = WEST_M + np.arange(7.5, 1100.0, 15.0), np.full(73, LATTICE.north_m - 207.5)
    assert np.array_equal(
        other.is_built(west + east - places[0], places[1]), ground().is_built(*places)
    )
    assert np.array_equal(mirrored_heights(heights_m()) > 0, other.built)
    assert mirrored_heights(None) is None


def test_identities_are_dealt_out_anew():
    other = dealt_anew(plan(), LATTICE, np.random.default_rng(1))
    west, _, east, _ = LATTICE.bounds_m
    assert other.ids == plan().ids
    assert [cell.arfcn for cell in other.cells] == [cell.arfcn for cell in plan().cells]
    places = {(round(west + east - c.east_m), round(c.north_m)) for c in other.cells}
    assert places == {(round(c.east_m), round(c.north_m)) for c in plan().cells}
    assert any(a.north_m != b.north_m for a, b in zip(other.cells, plan().cells, strict=True))


def test_sectors_are_mirrored():
    """What pointed east points west."""
    other = dealt_anew(plan(), LATTICE, np.random.default_rng(1))
    found = sorted(cell.azimuth_deg for cell in other.cells if cell.azimuth_deg is not None)
    assert found == [0.0, 0.0, 120.0, 120.0, 240.0, 240.0]
