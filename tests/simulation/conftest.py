"""A made town: a grid of streets and a few cells with levels that fall with distance."""

import numpy as np
import pytest

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.roads.network import StreetNetwork

CRS = "EPSG:32629"


def make_network(east_m, north_m, edges, oneway=None, way_class=None):
    east, north = np.asarray(east_m, dtype=float), np.asarray(north_m, dtype=float)
    a, b = np.array(edges, dtype=np.int32).reshape(-1, 2).T
    return StreetNetwork(
        CRS,
        east,
        north,
        a,
        b,
        np.hypot(east[b] - east[a], north[b] - north[a]),
        1000 + np.arange(len(a), dtype=np.int64),
        np.zeros(len(a), np.int16) if way_class is None else np.asarray(way_class, np.int16),
        ("residential", "secondary"),
        np.zeros(len(a), np.int8) if oneway is None else np.asarray(oneway, np.int8),
    )


@pytest.fixture(scope="session")
def network_of():
    return make_network


@pytest.fixture(scope="session")
def town():
    """Fifteen by fifteen crossings, 100 m apart, slightly displaced so that paths are unique."""
    size = 15
    node = np.arange(size * size).reshape(size, size)
    edges = [
        *zip(node[:, :-1].ravel(), node[:, 1:].ravel(), strict=True),
        *zip(node[:-1].ravel(), node[1:].ravel(), strict=True),
    ]
    row, col = np.divmod(np.arange(size * size), size)
    shift = np.random.default_rng(1).uniform(-20, 20, (2, size * size))
    classes = np.arange(len(edges)) % 2
    return make_network(
        530000 + 100.0 * col + shift[0],
        4555000 + 100.0 * row + shift[1],
        edges,
        way_class=classes,
    )


def make_plan(positions_m, carriers=None):
    carriers = carriers or [(512 + i, i) for i in range(len(positions_m))]
    return CellPlan(
        CRS,
        tuple(
            Cell(
                id=f"C{i}",
                site=f"S{i}",
                east_m=530000.0 + east,
                north_m=4555000.0 + north,
                height_m=30.0,
                azimuth_deg=None,
                antenna="omni",
                eirp_dbm=55.0,
                frequency_mhz=1800.0,
                arfcn=arfcn,
                bsic=bsic,
            )
            for i, ((east, north), (arfcn, bsic)) in enumerate(
                zip(positions_m, carriers, strict=True)
            )
        ),
    )


@pytest.fixture(scope="session")
def plan_of():
    return make_plan


@pytest.fixture(scope="session")
def plan():
    east_m = [200, 1200, 700, 300, 1300, 700, 100, 1000, 450, 900]
    north_m = [200, 300, 1200, 900, 1300, 600, 1300, 900, 450, 100]
    return make_plan(list(zip(east_m, north_m, strict=True)))


@pytest.fixture(scope="session")
def levels(plan):
    """Levels of the plan by a made law: -20 - 35 log10(d / 10 m), at least 20 m away."""
    cell_east = np.array([cell.east_m for cell in plan.cells])
    cell_north = np.array([cell.north_m for cell in plan.cells])

    def levels_dbm(east_m, north_m):
        away = np.hypot(east_m[:, None] - cell_east, north_m[:, None] - cell_north)
        return -20 - 35 * np.log10(np.maximum(away, 20) / 10)

    return levels_dbm
