"""Cases of the benchmark: errors of the unit, and what the filter is given of them."""

from dataclasses import fields, replace
from math import sqrt

import pytest

from mapfilter.experiments.benchmarks.cases import CASES, USUAL
from mapfilter.experiments.benchmarks.global_positioning import informed
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.tracks.imu_noise import ImuNoise

BIASED = [
    "levels-bias10",
    "cell-bias10",
    "smooth-bias10",
    "spoofed",
    *(f"satellites-{n}" for n in range(5)),
]
COMPASS_DEG = {
    **{f"{kind}-{deg}": deg for kind in ("levels", "cell") for deg in (3, 6, 10, 20)},
    **dict.fromkeys(("levels-nocompass", "levels-missing10", "levels-error10", "smooth-6"), 6),
    **dict.fromkeys(("recovery-levels", "recovery-cell"), 6),
}
DEFAULTS = BayesFilter()


def known(name, options=None, fixed=frozenset()):
    return informed(options or DEFAULTS, CASES[name], fixed)


def sheet(name):
    """What a case states besides dead reckoning."""
    height = {"antenna_height_m": 100.0, "antenna_height_sd_m": 20.0}
    return {"smooth": CASES[name].smooth} | (height if CASES[name].satellites is not None else {})


def test_all_cases_are_looked_at():
    assert set(COMPASS_DEG) | {*BIASED, "levels-bias20"} == set(CASES)
    assert len(USUAL) == len(CASES) - 6


@pytest.mark.parametrize(("name", "deg"), COMPASS_DEG.items())
def test_a_compass_has_its_stated_noise_and_the_filter_its_own_defaults(name, deg):
    errors = CASES[name].errors_in(ImuNoise())
    assert errors == replace(ImuNoise(), sigma_orient_deg=deg)
    assert known(name) == replace(DEFAULTS, **sheet(name), heading_sd_deg=deg)


@pytest.mark.parametrize(
    ("names", "bias_sd_deg", "drift_deg", "scale"),
    [(BIASED, 10.0, 0.2, 0.05), (["levels-bias20"], 20.0, 0.4, 0.1)],
)
def test_a_biased_unit_is_stated_to_be_one(names, bias_sd_deg, drift_deg, scale):
    for name in names:
        errors = CASES[name].errors_in(ImuNoise())
        assert errors == replace(
            ImuNoise(),
            sigma_orient_deg=6,
            bias_sd_deg=bias_sd_deg,
            drift_deg_per_sqrt_s=drift_deg,
            scale=scale,
        )
        found = known(name)
        # A drift by the second at 1.4 m/s, by the metre.
        assert found.drift_deg_per_sqrt_m == pytest.approx(drift_deg / sqrt(1.4), rel=1e-12)
        assert found == replace(
            DEFAULTS,
            **sheet(name),
            heading_sd_deg=6.0,
            bias_sd_deg=bias_sd_deg,
            drift_deg_per_sqrt_m=found.drift_deg_per_sqrt_m,
            scale=scale,
        )


def test_what_cases_differ_in_beside_dead_reckoning():
    assert {n for n, c in CASES.items() if not c.levels} == {
        *(f"cell-{deg}" for deg in (3, 6, 10, 20)), "cell-bias10", "recovery-cell",
    }  # fmt: skip
    assert {n for n, c in CASES.items() if not c.compass} == {"levels-nocompass"}
    assert {n: c.missing_ways for n, c in CASES.items() if c.missing_ways} == {
        "levels-missing10": 0.1
    }
    assert {n: c.level_error_db for n, c in CASES.items() if c.level_error_db is not None} == {
        "levels-error10": 10.0
    }
    assert {n for n, c in CASES.items() if c.smooth} == {"smooth-6", "smooth-bias10"}
    assert {n: c.recovery_within_m for n, c in CASES.items() if c.recovery_within_m} == {
        "recovery-levels": 300.0, "recovery-cell": 700.0,
    }  # fmt: skip
    assert {n: c.satellites for n, c in CASES.items() if c.satellites is not None} == {
        **{f"satellites-{n}": n for n in range(5)}, "spoofed": 4,
    }  # fmt: skip
    assert [n for n, c in CASES.items() if c.spoofed] == ["spoofed"]


@pytest.mark.parametrize("name", CASES)
def test_nothing_but_the_sheet_reaches_the_filter(name):
    """All other options are those that were chosen, whatever the ground truth is like."""
    chosen = GridFilter(step_sd_m=0.77, bias_sd_deg=28.0, scale=0.3, level_error_db=9.0)
    found, case = known(name, chosen), CASES[name]
    stated = {"heading_sd_deg", "bias_sd_deg", "drift_deg_per_sqrt_m", "scale"}
    assert set(case.data_sheet) <= stated
    assert found == replace(chosen, **case.data_sheet, **sheet(name))
    assert (type(found), found.step_sd_m) == (GridFilter, 0.77)


def test_what_was_set_is_not_changed_by_a_sheet():
    own = BayesFilter(heading_sd_deg=30.0, bias_sd_deg=15.0)
    found = known("levels-bias10", own, frozenset({"heading_sd_deg", "antenna_height_m"}))
    assert (found.heading_sd_deg, found.bias_sd_deg) == (30.0, 10.0)
    own = BayesFilter(antenna_height_m=7.0)
    sky = known("satellites-2", own, frozenset({"antenna_height_m"}))
    assert (sky.antenna_height_m, sky.antenna_height_sd_m) == (7.0, 20.0)
    world = ImuNoise(sigma_orient_deg=40.0, scale=0.01)
    errors = CASES["levels-bias10"].errors_in(world, frozenset({"imu.sigma_orient_deg"}))
    assert (errors.sigma_orient_deg, errors.scale) == (40.0, 0.05)


@pytest.mark.parametrize("name", CASES)
def test_the_worlds_other_errors_stay_in_every_case(name):
    world = ImuNoise(
        sigma_trans_m=0.3,
        heading_correlation_s=20.0,
        step_scale_wander=0.1,
        turns="gyro",
        gyro_noise_deg_per_sqrt_s=0.6,
        gyro_bias_deg_per_s=0.06,
    )
    found, changed = CASES[name].errors_in(world), CASES[name].imu
    for field in fields(ImuNoise):
        expected = changed.get(field.name, getattr(world, field.name))
        assert getattr(found, field.name) == expected


def test_the_candidate_filter_takes_no_sheet():
    choice = CandidateFilter(margin_db=3.0)
    assert all(informed(choice, case) is choice for case in CASES.values())


def test_sheets_and_errors_name_what_there_is():
    for case in CASES.values():
        assert set(case.imu) <= {f.name for f in fields(ImuNoise)}
        assert set(case.data_sheet) <= {f.name for f in fields(BayesFilter)}
