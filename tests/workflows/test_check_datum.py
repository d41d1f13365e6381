"""Sites in ED50 beside rasters in WGS 84 are found by check, and others are left alone."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.check.datum_shift import ed50_shifts_m, plan_by_datum
from mapfilter.check.findings import Findings
from mapfilter.check.samples import RasterSample
from mapfilter.lattice import Lattice
from mapfilter.propagation.models import PredictionModel
from mapfilter.propagation.predict import predict
from mapfilter.radio.cells import Cell, CellPlan

CRS = "EPSG:32632"
SITES = [(3_100.0 + 2_900 * (n % 3), 2_900.0 + 3_300 * (n // 3)) for n in range(6)]
WEST_M, SOUTH_M = 500_000.0, 5_500_000.0


def lattice_of(pixel_m):
    side = int(12_000 / pixel_m)
    return Lattice(CRS, WEST_M, SOUTH_M + side * pixel_m, pixel_m, side, side)


def plan_of(antenna="sector"):
    cells = [
        Cell(
            f"{n}-{azimuth}",
            f"{n}",
            WEST_M + east,
            SOUTH_M + north,
            30.0,
            float(azimuth + 7 * n),
            45.0,
            1800.0,
            antenna=antenna,
            downtilt_deg=4.0,
        )
        for n, (east, north) in enumerate(SITES)
        for azimuth in (0, 120, 240)
    ]
    return CellPlan(CRS, tuple(cells))


@cache
def levels_of(pixel_m, seed, shadowing_db=7.0, antenna="sector"):
    model = PredictionModel(model="okumura_hata", shadowing_db=shadowing_db, seed=seed)
    rasters = predict(plan_of(antenna), lattice_of(pixel_m), None, model)
    return {name: np.asarray(dbm, np.float32) for name, dbm in rasters}


def judged(levels, pixel_m, plan):
    findings = Findings()
    samples = [RasterSample(i, lattice_of(pixel_m), dbm, i) for i, dbm in levels.items()]
    return findings.found, plan_by_datum(samples, plan, frozenset(), "plan and ras", findings)


def moved(plan, east_m, north_m):
    cells = [replace(c, east_m=c.east_m + east_m, north_m=c.north_m + north_m) for c in plan.cells]
    return replace(plan, cells=tuple(cells))


@pytest.mark.parametrize("pixel_m", [25.0, 50.0])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("name", ["degrees", "UTM metres"])
def test_both_shifts_both_ways(pixel_m, sign, name):
    shift_m = np.array(ed50_shifts_m(CRS, WEST_M + 6000, SOUTH_M + 4500)[name])
    wrong = moved(plan_of(), *(-sign * shift_m))
    (found,), meant = judged(levels_of(pixel_m, 1), pixel_m, wrong)
    assert (found.code, found.severity, found.where) == ("datum-shifted", "warning", "plan and ras")
    assert f"the shift of {name} of ED50" in found.evidence
    whose = "the sites are in ED50" if sign > 0 else "the rasters are in ED50"
    assert whose in found.evidence
    away_m = [
        np.hypot(a.east_m - b.east_m, a.north_m - b.north_m)
        for a, b in zip(meant.cells, plan_of().cells, strict=True)
    ]
    assert max(away_m) < 1


@settings(max_examples=15, deadline=None)
@given(
    st.integers(0, 9),
    st.sampled_from([25.0, 50.0]),
    st.sampled_from(["sector", "3gpp"]),
    st.floats(0, 40),
    st.integers(0, 99),
)
def test_right_plans_with_noise_are_left_alone(seed, pixel_m, antenna, placed_m, draw):
    """Sites of a plan stand some metres off, and levels are noisy."""
    rng = np.random.default_rng(draw)
    levels = {
        i: dbm + rng.normal(0, 6, dbm.shape).astype(np.float32)
        for i, dbm in levels_of(pixel_m, seed, antenna=antenna).items()
    }
    plan = plan_of(antenna)
    by_site = {c.site: rng.normal(0, placed_m / 2, 2) for c in plan.cells}
    cells = [
        replace(c, east_m=c.east_m + by_site[c.site][0], north_m=c.north_m + by_site[c.site][1])
        for c in plan.cells
    ]
    plan = replace(plan, cells=tuple(cells))
    assert judged(levels, pixel_m, plan) == ([], plan)


@pytest.mark.parametrize("shift_m", [(200.0, -80.0), (25.0, 25.0), (-400.0, 0.0)])
def test_other_shifts_are_none(shift_m):
    plan = moved(plan_of(), *shift_m)
    assert judged(levels_of(50.0, 1), 50.0, plan) == ([], plan)


def test_too_few_sites_and_too_wide_pixels_are_not_judged():
    plan = moved(plan_of(), 82.0, 91.0)
    few = {i: dbm for i, dbm in levels_of(50.0, 1).items() if i[0] in "0123"}
    assert judged(few, 50.0, plan)[0] == []
    assert judged(levels_of(100.0, 1), 100.0, plan)[0] == []


def test_outside_europe_there_is_no_ed50():
    assert ed50_shifts_m("EPSG:32617", 500_000.0, 4_500_000.0) == {}


def test_in_a_national_grid_degrees_alone():
    assert list(ed50_shifts_m("EPSG:25832", 500_000.0, 5_500_000.0)) == ["degrees"]
