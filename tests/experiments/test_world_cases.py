"""The cases of the foreign worlds: definitions, truthful data sheets, one change."""

from dataclasses import fields

import numpy as np
import pytest

from mapfilter.experiments.benchmarks.cases import CASES
from mapfilter.experiments.benchmarks.world_cases import (
    CASES_OF,
    FOREIGN,
    HARSH,
    PHONE_UNIT,
    SENSORS,
)
from mapfilter.simulation.worlds.faults import FAULTS
from mapfilter.simulation.worlds.inertial import compass_error_rad

TIME_S = np.arange(1.0, 601.0)


def test_the_cases_of_each_world():
    assert list(FOREIGN) == ["levels-6", "levels-bias10", "cell-6"]
    assert set(FAULTS) < set(HARSH)
    assert set(CASES_OF) == {"foreign", "harsh", "sensors"}
    for cases in CASES_OF.values():
        assert all(name == case.name for name, case in cases.items())


@pytest.mark.parametrize("name", HARSH)
def test_a_harsh_case_differs_from_the_usual_one_in_one_respect(name):
    usual, case = FOREIGN["levels-6"], HARSH[name]
    changed = {f.name for f in fields(case) if getattr(case, f.name) != getattr(usual, f.name)}
    changed -= {"name"}
    if name.startswith("phone-"):
        assert changed == {"inertial", "data_sheet"}
        assert not case.data_sheet
    else:
        assert len(changed) == 1
        (respect,) = changed
        assert respect in {"pedestrian", "phone", "fault", "other_city"}


@pytest.mark.parametrize("name", SENSORS)
def test_a_case_of_faulty_sensors_differs_from_the_usual_one_in_its_fault_only(name):
    usual, case = FOREIGN["levels-6"], SENSORS[name]
    changed = {f.name for f in fields(case) if getattr(case, f.name) != getattr(usual, f.name)}
    assert changed == {"name", "sensor"}


@pytest.mark.parametrize("name", FOREIGN)
def test_data_sheets_are_true(name):
    """Deviations of the errors at the start, of many journeys; within four standard errors."""
    case = FOREIGN[name]
    drawn = np.degrees(
        [
            compass_error_rad(TIME_S, case.inertial, np.random.default_rng(seed))
            for seed in range(800)
        ]
    )
    sheet = case.data_sheet
    stated = np.hypot(sheet["heading_sd_deg"], sheet.get("bias_sd_deg", 0.0))
    assert drawn[:, 0].std() == pytest.approx(stated, rel=4 / np.sqrt(1600))
    walk_deg = sheet.get("drift_deg_per_sqrt_m", 0.0) * np.sqrt(1.4 * 599)
    grown = drawn[:, -1].var() - drawn[:, 0].var()
    assert grown == pytest.approx(walk_deg**2, abs=4 * 2 * stated**2 / np.sqrt(800) + 4)
    assert case.inertial.scale_sd == sheet.get("scale", 0.0)


def test_the_biased_case_is_that_of_the_plain_world():
    assert FOREIGN["levels-bias10"].data_sheet == CASES["levels-bias10"].data_sheet


def test_the_phones_unit():
    assert (PHONE_UNIT.step_range, PHONE_UNIT.missed) == (0.15, 0.03)
    assert PHONE_UNIT.gyro_sd_deg_per_min == 15.0
    assert (PHONE_UNIT.disturbance_deg, PHONE_UNIT.disturbance_s) == (40.0, 20.0)
