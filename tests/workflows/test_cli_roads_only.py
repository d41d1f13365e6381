"""Commands over roads alone: a road raster, its database, and drives of KITTI located over it."""

import numpy as np
import pandas as pd
import pytest
import rasterio
from command_line import mapfilter

import mapfilter as mf

WEST_M, NORTH_M, SIDE_PX = 455_000.0, 5_431_000.0, 400


@pytest.fixture
def roads(tmp_path):
    """A raster of three streets, one of them a footway, and a configuration."""
    values = np.zeros((SIDE_PX, SIDE_PX), dtype=np.uint8)
    values[100, 20:380] = values[20:380, 200] = 1
    values[300, 50:150] = 2
    with rasterio.open(
        tmp_path / "roads.tif", "w", driver="GTiff", height=SIDE_PX, width=SIDE_PX, count=1,
        dtype="uint8", crs="EPSG:32632", transform=rasterio.Affine(1, 0, WEST_M, 0, -1, NORTH_M),
    ) as target:  # fmt: skip
        target.write(values, 1)
    (tmp_path / "roads.toml").write_text(
        '[area]\nmap = "none"\n[roads]\nraster = "roads.tif"\n'
        "raster_classes = { residential = 1, footway = 2 }\n"
        '[database]\ncells = false\n[output]\ndir = "out"\n'
    )
    return tmp_path / "roads.toml"


def write_drive(folder):
    """A short drive along a street."""
    time_s = np.arange(40.0)
    pd.DataFrame({"time_s": time_s, "step_m": 2.0, "turn_rad": 0.0}).to_csv(
        folder / "drive.csv", index=False
    )
    return folder / "drive.csv"


def test_a_road_raster_is_checked_built_and_described(roads):
    assert mapfilter("check", "-c", roads).out.strip() == "Nothing found that looks wrong."
    built = mapfilter("build", "-c", roads, "--json").json
    assert (built["cells"], built["pictures"]) == (0, [])
    shown = mapfilter("info", built["database"], "--json").json
    assert shown["points"] == built["points"] == built["routable_points"] > 300
    assert shown["bounds_m"] == [WEST_M, NORTH_M - 400, WEST_M + 400, NORTH_M]
    assert [one["role"] for one in shown["inputs"]] == ["roads"]
    without = mapfilter(
        "build", "-c", roads, "--set", "roads.half_width_by_class_m.footway=0", "--json"
    ).json
    assert without["points"] < built["points"]


def test_the_flag_needs_neither_plan_nor_rasters(roads):
    text = roads.read_text().replace("cells = false", "cells = true")
    roads.write_text(text)
    refused = mapfilter("build", "-c", roads)
    assert (refused.code, "not predicted yet" in refused.err) == (2, True)
    assert mapfilter("build", "--roads-only", "-c", roads).code == 0


def test_what_a_database_of_roads_alone_cannot_do_is_refused(roads):
    built = mapfilter("build", "-c", roads, "--json").json["database"]
    drive = write_drive(roads.parent)
    for command in (
        ("build", "-c", roads, "--dry-run"),
        ("bound", built, "--out", roads.parent / "bound"),
        ("export", built, "--to", roads.parent / "roads.tif.tif"),
        ("merge", built, built, "--out", roads.parent / "merged"),
    ):
        outcome = mapfilter(*command)
        assert outcome.code == 2, command
        assert "Traceback" not in outcome.err
        assert "expected" in outcome.err
    for name in ("candidate", "grid"):
        out = roads.parent / name
        outcome = mapfilter("replay", "--db", built, "--log", drive, "--filter", name, "--out", out)
        assert (outcome.code, f"the filter {name} needs cells" in outcome.err) == (3, True)
        assert "the filter bayes starts by the streets alone" in outcome.err


def test_a_drive_that_is_too_short_is_said_to_be(roads):
    built = mapfilter("build", "-c", roads, "--json").json["database"]
    drive = roads.parent / "drive.csv"
    pd.DataFrame({"time_s": [0.0, 1.0], "step_m": 2.0, "turn_rad": 0.0}).to_csv(drive, index=False)
    outcome = mapfilter("replay", "--db", built, "--log", drive, "--out", roads.parent / "short")
    assert (outcome.code, "too short a way" in outcome.err) == (3, True)


def test_a_filter_without_a_map_over_roads_alone_has_no_start(roads):
    built = mapfilter("build", "-c", roads, "--json").json["database"]
    drive, out = write_drive(roads.parent), roads.parent / "ekf"
    done = mapfilter("replay", "--db", built, "--log", drive, "--filter", "ekf", "--out", out)
    assert (done.code, "no positions and no radio to start from" in done.err) == (3, True)


def test_steps_without_turns_are_said_to_be(roads):
    built = mapfilter("build", "-c", roads, "--json").json["database"]
    drive = roads.parent / "drive.csv"
    pd.DataFrame({"time": range(60), "wheel_speed_kmh": 30.0}).to_csv(drive, index=False)
    done = mapfilter("replay", "--db", built, "--log", drive, "--out", roads.parent / "a", "--json")
    assert (done.code, "no headings and no turns" in done.err) == (3, True)
    assert not any("taken for a vehicle" in note for note in done.json["notes"])


def test_a_drive_that_fits_no_street_ends_with_advice(roads):
    built = mapfilter("build", "-c", roads, "--json").json["database"]
    drive = write_drive(roads.parent)
    given = ("replay", "--db", built, "--log", drive, "--json")
    notes = mapfilter(*given, "--out", roads.parent / "a").json["notes"]
    assert notes[0].startswith("never converged in 80 m: by streets alone it takes about a kilo")
    assert "set filter.bayes.vehicle = true" in notes[1]
    stated = mapfilter(*given, "--set", "filter.bayes.vehicle=true", "--out", roads.parent / "b")
    assert [note.split(":")[0] for note in stated.json["notes"]] == ["never converged in 80 m"]


def test_positions_alone_are_no_way_that_fits_no_street(roads):
    """It said that the way of 0 m is too short, and a walker's."""
    built = mapfilter("build", "-c", roads, "--json").json["database"]
    drive = roads.parent / "fixes.csv"
    places = {"east_m": WEST_M + 100.0 + np.arange(60), "north_m": NORTH_M - 100.5}
    pd.DataFrame({"time_s": np.arange(60.0), **places}).to_csv(drive, index=False)
    given = ("replay", "--db", built, "--log", drive, "--json")
    done = mapfilter(*given, "--out", roads.parent / "a")
    told = "note: no motion: positions alone are followed ("
    assert (done.code, told in done.err) == (0, True), done.err
    assert done.json["switched"]
    assert not any("never converged" in note or "walker" in note for note in done.json["notes"])


def test_a_log_without_a_frame_is_one_of_the_database(roads):
    built = mapfilter("build", "-c", roads, "--json").json["database"]
    drive = write_drive(roads.parent)
    log = roads.parent / "drive"
    assert "local frame" in mapfilter("convert", drive, "--out", log).out
    done = mapfilter("replay", "--db", built, "--log", log, "--out", roads.parent / "a", "--json")
    assert done.code == 0, done.err
    assert "no positions in the log: taken to be in EPSG:32632" in done.json["notes"]
    checked = mapfilter("check", "-c", roads, "--set", f"track.path={log}")
    assert checked.out.strip() == "Nothing found that looks wrong."
    assert mf.locate(mf.read_log(log), mf.open_database(built)).log.crs == "EPSG:32632"
    # With places of its own it has to be placed by somebody who knows where.
    truth = roads.parent / "truth.csv"
    truth.write_text("time_s,east_m,north_m\n0,1,2\n39,80,2\n")
    placed = mapfilter("convert", drive, "--truth", truth, "--out", log)
    assert placed.code == 0, placed.err
    refused = mapfilter("replay", "--db", built, "--log", log, "--out", roads.parent / "b")
    assert refused.code == 2
    assert "found a local frame (likely: convert it with --crs EPSG:CODE, and --ori" in refused.err


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("roads.raster_classes.residential=7", "pixels of value 7"),
        ('roads.layer="roads.tif"', "one of layer, raster and tracks.files"),
        ("area.resolution_m=0.001", "at most 4e+08 pixels"),
        ('area.crs="EPSG:32633"', "another zone"),
    ],
)
def test_faults_of_a_road_raster_are_named_by_check_and_build(roads, setting, expected):
    given = ["-c", roads, "--set", setting]
    if "crs" in setting:
        given += ["--set", "area.bbox=8.385,49.025,8.388,49.027"]
    built, checked = mapfilter("build", *given), mapfilter("check", *given)
    assert (built.code, checked.code) == (2, 2)
    assert expected in built.err
    assert expected in checked.out + checked.err


AROUND = "8.3815,48.9755,8.4065,48.9955"
"""All streets around drive 00, 3.3 km2 that are far from those of the other drives."""


def head(path, folder):
    """Copy the first 207 s of a table; both drives are found within 100 s."""
    lines = path.read_text().splitlines()[:2001]
    copy = folder / path.name
    copy.write_text("\n".join(lines) + "\n")
    return copy


@pytest.mark.long
def test_real_odometry_is_located_on_real_streets(tmp_path, shared_data):
    data = shared_data / "kitti-osm"
    if not data.exists():
        pytest.skip("the drives of KITTI are not in the shared data")
    truth = head(data / "truth" / "00.csv", tmp_path)
    for name in ("orb-slam", "s-ptam"):
        motion = head(data / "odometry" / f"{name}-00.csv", tmp_path)
        log = tmp_path / "logs" / name
        done = mapfilter("convert", motion, "--truth", truth, "--crs", "EPSG:32632", "--out", log)
        assert done.code == 0, done.err
    settings = [
        "--set", "area.map=none", "--set", f"roads.raster={data / 'roads.tif'}",
        "--set", "roads.raster_classes={road = 1}", "--set", "output.pictures=none",
        "--set", f"area.bbox={AROUND}",
    ]  # fmt: skip
    built = mapfilter("build", "--roads-only", *settings, "--out", tmp_path / "out", "--json").json
    result = mapfilter(
        "replay", *settings, "--db", built["database"], "--log", tmp_path / "logs",
        "--out", tmp_path / "located", "--json",
    ).json  # fmt: skip
    assert (result["successes"], result["wrong"]) == (2, 0)
    for name in ("orb-slam", "s-ptam"):
        estimate = pd.read_parquet(tmp_path / "located" / name / "estimate.parquet")
        true = pd.read_csv(truth)
        east_m, north_m = (
            np.interp(estimate["time_s"], true["time_s"], true[axis])
            for axis in ("east_m", "north_m")
        )
        error_m = np.hypot(estimate["east_m"] - east_m, estimate["north_m"] - north_m)
        found = estimate["status"].isin(["CONVERGED", "TRACKING"])
        assert found.mean() > 0.5
        assert np.median(error_m[found]) < 5
        assert (error_m[found] > 50).mean() == 0
