"""The benchmark of builds runs, on a small task, and tells figures that belong together."""

import pytest
from command_line import assert_refused, mapfilter

from mapfilter.errors import ConfigError
from mapfilter.lattice import Lattice
from mapfilter.workflows.bench import CRS, made_routes, run_bench


@pytest.mark.parametrize("points", [500, 3000])
def test_made_routes_have_as_many_points_as_asked(points):
    routes = made_routes(Lattice(CRS, 500_000.0, 4_600_000.0, 5.0, 200, 200), points)
    assert 0.9 * points <= len(routes) <= points


def test_a_small_bench():
    found = run_bench("build", rasters=2, side_px=120, points=900, runs=1)
    assert (found.rasters, found.side_px, found.runs) == (2, 120, 1)
    assert found.build_s > 0
    assert found.build_ratio == pytest.approx(found.build_s / found.read_s)
    assert found.speedup == pytest.approx(found.build_s / found.two_processes_s)
    assert found.peak_memory_bytes > 50e6
    assert found.estimated_bytes == pytest.approx(found.bytes, rel=0.3)


def test_an_unknown_stage():
    with pytest.raises(ConfigError, match="'roads'"):
        run_bench("roads")
    assert_refused(mapfilter("bench", "roads"), "build")
