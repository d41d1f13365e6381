"""Options that would change nothing in a mode of a command are refused, with their name."""

import numpy as np
import pandas as pd
import pytest
from command_line import ONE, assert_refused, mapfilter


@pytest.mark.parametrize(
    "options", [["--workers", 4], ["--cluster", "local:2"], ["--resume"]], ids=lambda one: one[0]
)
@pytest.mark.parametrize("roads", [["--roads-only"], ["--set", "database.cells=false"]])
def test_roads_alone_are_built_by_one_process_at_once(world, tmp_path, roads, options):
    out = mapfilter("build", "-c", world.toml, *roads, *options, "--out", tmp_path / "out")
    assert_refused(out, options[0], "as a build of roads alone takes none")
    assert not (tmp_path / "out").exists()


def test_memory_is_measured_twice_whatever_the_runs():
    assert_refused(mapfilter("bench", "--memory", "--runs", 2), "--runs", "bench --memory")


@pytest.mark.parametrize(
    "options",
    [
        ["--set", "filter.name=grid"],
        ["-c", "area.toml"],
        ["--workers", 2],
        ["--resume"],
        ["--seed", 0],
        ["--no-truth"],
    ],
    ids=lambda one: one[0],
)
def test_accepting_a_patch_learns_nothing(tmp_path, options):
    given = ["learn", tmp_path / "db", "--accept", tmp_path / "patch.toml", *options]
    name = options[0].replace("-c", "--config")
    assert_refused(mapfilter(*given), f"{name}: expected nothing, as --accept PATCH takes none")


def test_single_reports_have_no_processes(tmp_path):
    given = ("evaluate", "single-reports", "--data", tmp_path, "--workers", 2)
    assert_refused(mapfilter(*given), "--workers", "single-reports takes none")


@pytest.mark.parametrize(
    ("options", "whom"),
    [
        (["--filter", "candidate"], "the filter candidate"),
        (["--filter", "bayes", "--smooth"], "a smoothed track"),
    ],
)
def test_without_protection_levels_there_is_no_risk(world, tmp_path, options, whom):
    given = ["--log", world.out / "journeys" / ONE, *options, "--protection", 0.01]
    given += ["-c", world.toml, "--out", tmp_path / "out"]
    outcome = mapfilter("replay", "--db", world.out / "database", *given)
    assert_refused(outcome, f"--protection: expected nothing, as {whom} takes none")


def test_a_database_has_its_own_crs_and_a_track_log_its_columns(world, tmp_path):
    journeys = world.out / "journeys"
    over = ["locate", "--db", world.out / "database", "--out", tmp_path / "out"]
    told = mapfilter(*over, "--log", journeys / ONE, "--crs", "EPSG:3067")
    assert_refused(told, f"--crs of {world.out / 'database'}: expected none, as it is in EPSG:")
    column = ["--column", "time=t", "--log"]
    told = mapfilter(*over, *column, journeys / ONE)
    assert_refused(told, f"--column of {journeys / ONE}", "found a track log")
    told = mapfilter(*over, *column, journeys)
    assert_refused(told, f"--column of {journeys}", "found 2 journeys")


def test_fingerprints_have_levels_without_a_stated_error(world, tmp_path):
    journeys = world.out / "journeys"
    given = ["locate", "--db", journeys, "--log", journeys / ONE, "--out", tmp_path / "out"]
    told = mapfilter(*given, "--level-error", 6)
    assert_refused(told, f"--level-error of {journeys}: expected a radio-route database")
    told = mapfilter(*given, "--crs", "EPSG:3067")
    assert_refused(told, f"--crs of {journeys}: expected none, as track logs have theirs")


@pytest.fixture
def compass(tmp_path):
    """Steps to the east by a compass, without a place."""
    steps = {"time_s": np.arange(30.0), "step_m": 1.0, "compass_deg": 90.0}
    pd.DataFrame(steps).to_csv(tmp_path / "compass.csv", index=False)
    return tmp_path / "compass.csv"


def test_an_origin_turns_no_headings_of_a_frame_without_places(compass, tmp_path):
    """North at the origin was that of a frame about 0, 0: 21.9 degrees off here."""
    given = ["convert", compass, "--out", tmp_path / "log", "--origin", "60.1,24.9"]
    done = mapfilter(*given)
    assert "note: --origin has no effect: no positions in metres of a local frame\n" in done.out
    heading_rad = pd.read_parquet(tmp_path / "log" / "motion.parquet")["heading_rad"]
    assert np.abs(heading_rad).max() == 0
    # In a CRS it says where the steps were made: grid north is not true north there.
    done = mapfilter(*given, "--crs", "EPSG:3067")
    assert "no effect" not in done.out
    heading_rad = pd.read_parquet(tmp_path / "log" / "motion.parquet")["heading_rad"]
    np.testing.assert_allclose(np.degrees(heading_rad), -1.8207, atol=1e-3)


def test_motion_of_a_file_needs_none_of_a_course(compass, tmp_path):
    done = mapfilter("convert", compass, "--out", tmp_path / "log", "--course-motion")
    assert "note: --course-motion has no effect: motion is that of compass.csv" in done.out
