"""A compass in radians in a column of degrees is noted; a straight walk to the north is not."""

import numpy as np
import pytest

from mapfilter.tracks.checks.headings import compass_fault
from mapfilter.tracks.joining.combine import combine
from mapfilter.tracks.open_options import CombineOptions
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.readers.formats import read_recording

STEP_M = 1.4


def city_walk_deg(seed, rows=400):
    """Azimuths of blocks of 30 to 120 m with corners, scattered by 6 degrees."""
    rng = np.random.default_rng(seed)
    azimuth, way = [], rng.uniform(0, 360)
    while len(azimuth) < rows:
        azimuth += [way] * int(rng.uniform(20, 80))
        way += rng.choice([-90, 90]) + rng.normal(0, 8)
    return (np.array(azimuth[:rows]) + rng.normal(0, 6, rows)) % 360


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("signed", [False, True])
def test_radians_of_a_walk_with_corners_are_noted_and_its_degrees_are_not(seed, signed):
    degrees = city_walk_deg(seed)
    if signed:
        degrees = (degrees + 180) % 360 - 180
    walked_m = STEP_M * len(degrees)
    assert "radians for degrees?" in compass_fault(np.radians(degrees), walked_m)
    assert compass_fault(degrees, walked_m) == ""


@pytest.mark.parametrize("north_deg", [0.0, 2.0, 3.1])
@pytest.mark.parametrize("scatter_deg", [0.0, 0.3, 1.0, 4.0])
@pytest.mark.parametrize("rows", [30, 70, 300])
def test_a_straight_walk_to_the_north_is_not_noted(north_deg, scatter_deg, rows):
    for seed in range(20):
        azimuth = north_deg + np.random.default_rng(seed).normal(0, scatter_deg, rows)
        for degrees in (azimuth, azimuth % 360, np.round(azimuth)):
            assert compass_fault(degrees, STEP_M * rows) == ""


def test_a_few_steps_say_nothing_of_the_unit():
    radians = np.radians(city_walk_deg(0))
    assert compass_fault(radians[:60], 99.0) == ""
    assert compass_fault(radians[:19], 500.0) == ""
    assert compass_fault(np.full(400, np.nan), 500.0) == ""


@pytest.mark.parametrize("kind", ["steps", "step_m"])
@pytest.mark.parametrize("unit", ["radians", "degrees"])
def test_a_recording_with_radians_has_a_note(kind, unit, tmp_path):
    azimuth = city_walk_deg(3)
    shown = np.radians(azimuth) if unit == "radians" else azimuth
    steps = (2 * np.arange(400)).astype(str) if kind == "steps" else ["1.4"] * 400
    rows = [f"{k},{steps[k]},{shown[k]:.4f},48.0,11.0" for k in range(400)]
    path = tmp_path / "phone.csv"
    path.write_text("\n".join([f"time_s,{kind},compass_deg,latitude,longitude", *rows]) + "\n")
    options = CombineOptions(truth=(path,), measured=(path,), walk=WalkOptions())
    notes = combine([read_recording(path)], options).log.notes
    assert any("radians for degrees?" in note for note in notes) == (unit == "radians")
