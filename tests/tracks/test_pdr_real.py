"""Dead reckoning on real recordings: step counts by hand, drift beside a plain baseline."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from mapfilter.tracks.sensors import read_sensors
from mapfilter.tracks.store import read_log
from mapfilter.workflows.convert import report_lines, run_convert

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "dead_reckoning.py"


def reckoned_once(reckon_walk):
    """Return the same function that keeps what it found: three tests ask for the same walks."""
    known = {}

    def reckoned(sensors, options):
        key = id(sensors), options
        if key not in known:
            # The sensors are kept as well, so that no others get their address.
            known[key] = sensors, reckon_walk(sensors, options)
        return known[key][1]

    return reckoned


@pytest.fixture(scope="module")
def bench():
    """The script that prints the tables of the documentation."""
    spec = importlib.util.spec_from_file_location("dead_reckoning_benchmark", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    module.reckon_walk = reckoned_once(module.reckon_walk)
    yield module
    del sys.modules[spec.name]


@pytest.fixture(scope="module")
def walks(bench, shared_data):
    return [walk for walk in bench.read_walks(shared_data) if walk.judged]


def test_steps_are_those_counted_by_hand(bench, walks):
    table = bench.step_table(walks)
    middle = (table["by hand"] + table["with half steps"]) / 2
    assert len(table) == 5
    assert abs(table["mapfilter"].sum() / middle.sum() - 1) < 0.03
    assert (np.abs(table["mapfilter"] / middle - 1) < 0.05).all()
    assert table["plain"].sum() / middle.sum() > 1.1


def test_drift_of_walks_is_well_below_the_plain_baseline(bench, walks):
    methods = {"plain": bench.plain, "mapfilter": bench.ours}
    table = bench.walk_table(walks, methods).set_index("method")
    assert table.loc["mapfilter", "end 50 %"] < 9
    assert table.loc["mapfilter", "end 90 %"] < 20
    for share in ("end 50 %", "20 m 50 %"):
        assert table.loc["mapfilter", share] < 0.72 * table.loc["plain", share]
    errors = bench.length_errors(walks, judged=True)
    assert abs(errors.mean()) < 0.03
    assert errors.std() < 0.07


def test_drift_of_drives(bench, shared_data):
    table = bench.drive_table(shared_data).set_index(["drive", "method", "over, m"])
    found = table["drift 90 %"]
    plain = found["smartLoc", "plain: speed and yaw rate", 100.0]
    assert found["smartLoc", "mapfilter", 100.0] < plain < 4
    assert found["Mountain View", "mapfilter, speed and course", 500.0] < 1.5


def test_errors_stated_of_a_walk_cover_its_heading(bench, walks):
    """The lasting heading error of walks of 40 m, by their waypoints, is as large as stated."""
    from mapfilter.tracks.pdr.options import WalkOptions

    ratios = []
    for walk in walks:
        options = WalkOptions(declination_deg=bench.DECLINATION_DEG)
        found, _ = bench.reckon_walk(walk.sensors, options)
        if found is None or np.ptp(walk.truth["time_s"]) < 30:
            continue
        truth = walk.truth[["east_m", "north_m"]].diff().iloc[1:].to_numpy() @ [1, 1j]
        motion = found.motion
        moved = motion["step_m"].fillna(0) * np.exp(1j * motion["heading_rad"])
        number = np.searchsorted(walk.truth["time_s"].to_numpy(), motion["time_s"]) - 1
        inside = (number >= 0) & (number < len(truth))
        legs = np.zeros(len(truth), dtype=complex)
        np.add.at(legs, number[inside], moved[inside])
        error = np.degrees(np.angle((legs * truth.conj()).sum()))
        ratios.append(error / found.imu.bias_sd_deg)
    assert len(ratios) > 15
    assert 0.3 < np.sqrt(np.mean(np.square(ratios))) < 1.1


def test_a_recording_is_converted_with_motion_and_its_errors(shared_data, tmp_path):
    import tarfile

    with tarfile.open(shared_data / "imu-wifi-indoor-mall/site1_F4_paths.tar.xz") as archive:
        name = next(m for m in archive if m.name.endswith("5ddb6f0f9191710006b575fb.txt"))
        name.name = "walk.txt"
        archive.extract(name, tmp_path, filter="data")
    result = run_convert([tmp_path / "walk.txt"], tmp_path / "log")
    log = read_log(tmp_path / "log")
    assert (log.motion["step_m"] > 0).sum() == pytest.approx(108, abs=6)
    assert log.motion["heading_rad"].notna().all()
    assert log.imu is not None
    assert log.imu.turns == "headings"
    assert 5 < log.imu.bias_sd_deg < 25
    assert len(read_sensors(tmp_path / "log")["reckoning"]) == len(log.motion)
    lines = "\n".join(report_lines(result))
    assert "steps" in lines
    assert "errors of motion" in lines
