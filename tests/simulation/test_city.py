"""Made cities: connected, dry, with free streets, and the same from the same seed."""

import numpy as np
import pytest
import shapely

from mapfilter.errors import ConfigError
from mapfilter.lattice import Lattice
from mapfilter.roads.network import street_network
from mapfilter.roads.route_points import route_lattice
from mapfilter.simulation.synthetic_city import manhattan, synthetic_city


def lattice(size_m, north_m=0.0):
    side = int(size_m / 5)
    return Lattice("EPSG:32631", 500_000.0, north_m + size_m, 5.0, side, side)


@pytest.fixture(scope="module", params=[0, 7])
def city(request):
    return synthetic_city(lattice(1500.0), request.param)


def test_all_ways_are_one_network(city):
    length_m = shapely.length(city.ways.geometry).sum()
    assert street_network(city.ways).length_m.sum() == pytest.approx(length_m, rel=1e-6)


def test_streets_stay_walkable_between_the_houses(city):
    points = route_lattice(
        city.ways, city.squares, city.buildings, lattice(1500.0), water=city.water
    )
    length_m = shapely.length(city.ways.geometry).sum()
    assert street_network(city.ways, points).length_m.sum() > 0.97 * length_m


def test_no_house_stands_on_a_street_or_in_the_river(city):
    assert (
        not shapely.STRtree(city.buildings.footprints)
        .query(city.ways.geometry, predicate="crosses")
        .size
    )
    wet = shapely.intersection(shapely.union_all(city.water.geometry), city.buildings.footprints)
    assert shapely.area(wet).sum() == 0


def test_houses_do_not_overlap_and_have_heights_of_houses(city):
    both = shapely.area(city.buildings.footprints).sum()
    assert shapely.union_all(city.buildings.footprints).area == pytest.approx(both, rel=2e-3)
    assert city.buildings.height_m.min() >= 3
    assert 8 < np.median(city.buildings.height_m) < 25
    assert city.buildings.height_m.max() < 60


def test_the_river_is_crossed_on_few_bridges_only(city):
    river = shapely.union_all(city.water.geometry)
    crossing = shapely.intersects(city.ways.geometry, river)
    assert 1 <= len(np.unique(city.ways.way_id[crossing])) <= 4
    names = np.array(city.ways.class_names)[city.ways.way_class[crossing]]
    assert set(names) == {"primary"}
    # From bank to bank, and not along it.
    wet_m = shapely.length(shapely.intersection(city.ways.geometry[crossing], river))
    assert wet_m.max() < 3 * 0.036 * 1500


def test_figures_are_those_of_a_european_city(city):
    per_km = shapely.length(city.ways.geometry).sum() / 1000 / 1.5**2
    assert 17 < per_km < 29
    degree = np.bincount(np.bincount(np.concatenate(ends(city))))
    junctions = degree[3:].sum()
    assert degree[3] / junctions > 0.6
    assert 0.1 < degree[1] / (junctions + degree[1]) < 0.35
    assert len(city.squares) >= 1


def ends(city):
    network = street_network(city.ways)
    return network.node_a, network.node_b


def test_same_seed_same_city_and_another_seed_another():
    first, again = (synthetic_city(lattice(600.0), 3) for _ in range(2))
    for name in ("ways", "buildings", "squares", "water"):
        geometry = "footprints" if name == "buildings" else "geometry"
        a, b = (getattr(getattr(made, name), geometry) for made in (first, again))
        assert shapely.to_wkb(a).tolist() == shapely.to_wkb(b).tolist()
    assert first.buildings.height_m.tolist() == again.buildings.height_m.tolist()
    other = synthetic_city(lattice(600.0), 4)
    assert shapely.length(other.ways.geometry).sum() != shapely.length(first.ways.geometry).sum()


def test_the_place_moves_the_city_and_changes_nothing_else():
    here, there = synthetic_city(lattice(600.0), 3), synthetic_city(lattice(600.0, 5000.0), 3)
    moved = shapely.get_coordinates(there.ways.geometry) - [0.0, 5000.0]
    np.testing.assert_allclose(shapely.get_coordinates(here.ways.geometry), moved, atol=1e-6)


def test_without_a_river_nothing_is_wet():
    assert len(synthetic_city(lattice(900.0), 1, river=False).water) == 0
    assert len(synthetic_city(lattice(600.0), 1).water) == 0


def test_one_may_drive_along_most_streets(city):
    driving = city.driving_ways
    share = shapely.length(driving.geometry).sum() / shapely.length(city.ways.geometry).sum()
    assert 0.6 < share < 0.95
    assert len(street_network(driving).node_a) > 0


def test_manhattan_is_what_it_says():
    city = manhattan(lattice(1000.0))
    assert shapely.area(city.buildings.footprints).max() == pytest.approx(6400)
    assert set(city.buildings.height_m) == {26.0}
    # Houses are as far from the middle of a street as half its width, 22 m or 25 m.
    away_m = shapely.distance(city.buildings.footprints[:, None], city.ways.geometry[None, :]).min(
        axis=1
    )
    assert away_m == pytest.approx(11.0)
    assert (np.bincount(np.concatenate(ends(city))) == 4).sum() == 100
    assert shapely.length(city.ways.geometry).sum() == pytest.approx(20 * 1000, rel=0.06)


@pytest.mark.parametrize(("size_m", "seed"), [(100.0, 0), (60_000.0, 0), (600.0, -1)])
def test_what_cannot_be_a_city_is_refused(size_m, seed):
    with pytest.raises(ConfigError, match="synthetic city"):
        synthetic_city(lattice(size_m), seed)


def test_impossible_canyons_are_refused():
    with pytest.raises(ConfigError, match="metres > 0"):
        manhattan(lattice(600.0), block_m=0.0)
