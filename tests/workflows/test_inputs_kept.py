"""Inputs are never written to, and one area means one area for all commands."""

import ctypes
import json
import os
import shutil
import signal
import subprocess
import sys
import time

import geopandas
import numpy as np
import pytest
import rasterio
import shapely
from command_line import (
    ONE,
    Outcome,
    assert_done,
    assert_refused,
    contents,
    mapfilter,
    settings,
)

from mapfilter.rasters.opening import open_rasters
from mapfilter.tracks.log_folders import list_logs
from mapfilter.tracks.store import read_log


def test_own_rasters_that_were_edited_are_not_predicted_anew(own_world):
    """As a planner does with a prediction: it keeps the tags of the program that made it."""
    assert_done(mapfilter("predict", "-c", own_world.toml))
    with rasterio.open(own_world.rasters, "r+", IGNORE_COG_LAYOUT_BREAK="YES") as source:
        values = source.read(1)
        values[values.shape[0] // 2, values.shape[1] // 2] += 1
        source.write(values, 1)
    before = contents(own_world.folder)
    refused = mapfilter("predict", "-c", own_world.toml)
    assert_refused(refused, "rxlev.tif: expected nothing yet, or rasters that", "changed since")
    assert contents(own_world.folder) == before


def test_a_plan_in_the_output_folder_is_not_replaced(own_world):
    shutil.copy(own_world.plan, own_world.out / "cells.csv")
    before = contents(own_world.folder)
    plan = settings(cells__plan=own_world.out / "cells.csv")
    refused = mapfilter("predict", "-c", own_world.toml, *plan)
    assert_refused(refused, "cells.csv: expected another place than an input", "cells.plan")
    assert contents(own_world.folder) == before


@pytest.mark.parametrize("place", ["out/database", "out/database/mine", f"out/journeys/{ONE}"])
def test_results_are_not_written_into_inputs(own_world, place):
    before = contents(own_world.folder)
    log = own_world.journeys / ONE
    given = ["--db", own_world.database, "--log", log, "--out", own_world.folder / place]
    assert_refused(mapfilter("replay", "-c", own_world.toml, *given), "--out", "which is an input")
    assert contents(own_world.folder) == before


def test_single_reports_and_bounds_are_not_written_into_inputs(own_world):
    before = contents(own_world.folder)
    log = own_world.journeys / ONE
    for folder in (own_world.database, log):
        given = ["--db", own_world.database, "--log", log, "--out", folder]
        assert_refused(mapfilter("locate", *given), "--out", "which is an input")
    refused = mapfilter("bound", own_world.database, "--out", own_world.database / "bound")
    assert_refused(refused, "--out", "which is an input")
    assert contents(own_world.folder) == before


def test_results_of_several_logs_are_not_written_into_these(own_world):
    """Each has a folder of its name."""
    before = contents(own_world.folder)
    given = ["--db", own_world.database, "--log", own_world.journeys]
    refused = mapfilter("replay", "-c", own_world.toml, *given, "--out", own_world.journeys)
    assert_refused(refused, f"--out: expected a folder outside {own_world.journeys / ONE}")
    assert contents(own_world.folder) == before


@pytest.fixture
def recordings(tmp_path):
    """A folder with a recording of positions."""
    folder = tmp_path / "walk"
    folder.mkdir()
    rows = [f"{1_700_000_000 + i},{60.166 + 1e-5 * i:.5f},24.94,-70,A" for i in range(40)]
    (folder / "positions.csv").write_text("\n".join(["time,lat,lon,level_dbm,cell", *rows]))
    return folder


def test_results_are_not_written_among_recordings(recordings):
    """They would be read with them next time: an estimate as GNSS fixes."""
    before = contents(recordings)
    given = ["replay", "--filter", "ekf", "--log", recordings]
    assert_refused(mapfilter(*given, "--out", recordings), "--out", "which is an input")
    assert contents(recordings) == before
    undrawn = settings(output__pictures="none")
    assert_done(mapfilter(*given, *undrawn, "--out", recordings / "located"))
    assert_done(mapfilter(*given, *undrawn, "--out", recordings / "located"))


@pytest.mark.parametrize("option", ["--log", "--truth"])
def test_results_that_are_read_are_not_replaced(recordings, tmp_path, option):
    replay = ["replay", "--filter", "ekf", *settings(output__pictures="none")]
    log, out = recordings / "positions.csv", tmp_path / "located"
    assert_done(mapfilter(*replay, "--log", log, "--out", out))
    before = contents(out)
    given = ["--log", log] if option == "--truth" else []
    refused = mapfilter(*replay, *given, option, out / "estimate.gpx", "--out", out)
    told = "estimate.gpx: expected no file of the results, found an input that they would replace"
    assert_refused(refused, told, "another folder by --out")
    assert contents(out) == before


def test_results_of_one_of_several_logs_are_not_replaced_where_they_are_read(recordings, tmp_path):
    """Results of all logs are left out where those of one replace them."""
    replay = ["replay", "--filter", "ekf", *settings(output__pictures="none")]
    inner, out = tmp_path / "located" / "positions", tmp_path / "located"
    assert_done(mapfilter(*replay, "--log", recordings / "positions.csv", "--out", inner))
    before = contents(out)
    refused = mapfilter(*replay, "--log", inner / "estimate.gpx", "--out", out)
    assert_refused(refused, "estimate.gpx: expected no file of the results")
    assert contents(out) == before


def test_positions_of_single_reports_are_not_replaced_where_they_are_read(recordings, tmp_path):
    out = tmp_path / "located"
    given = ["locate", "--db", recordings, "--log", recordings, "--out", out]
    assert_done(mapfilter(*given))
    before = contents(out)
    given[4] = out / "positions.csv"
    assert_refused(mapfilter(*given), "positions.csv: expected no file of the results")
    assert contents(out) == before


@pytest.mark.parametrize("log", [".", "positions.csv"])
def test_a_recording_called_positions_is_not_replaced_by_positions(recordings, log):
    before = contents(recordings)
    given = ["--db", recordings, "--log", recordings / log, "--out", recordings]
    assert_refused(mapfilter("locate", *given), "--out", "which is an input")
    given[1] = recordings / "positions.csv"
    if log != ".":
        told = "positions.csv: expected positions of mapfilter locate, or nothing yet"
        assert_refused(mapfilter("locate", *given), told, "another folder by --out")
    assert contents(recordings) == before


def test_the_map_of_a_survey_is_not_written_among_its_measurements(recordings):
    """Its cells would be read as measurements next time."""
    before = contents(recordings)
    given = settings(
        area__map="none", prediction__model="survey", prediction__survey__files=recordings
    )
    told = "cells.csv: expected another place", "folder of prediction.survey.files"
    assert_refused(mapfilter("predict", *given, "--out", recordings), *told)
    assert contents(recordings) == before


def test_journeys_go_where_the_database_is(own_world):
    """In an area that is wider than the rasters, as when a planner's export is smaller."""
    wider = settings(area__bbox="24.9390,60.1645,24.9530,60.1710", rasters__path=own_world.rasters)
    done = assert_done(mapfilter("simulate", "-c", own_world.toml, *wider, "--json")).json
    assert any("the set of rasters covers" in note for note in done["notes"])
    west, south, east, north = open_rasters(own_world.rasters).lattice.bounds_m
    for path in list_logs(own_world.journeys):
        log = read_log(path)
        east_m, north_m = (log.truth[name].to_numpy() for name in ("east_m", "north_m"))
        assert np.all((east_m >= west) & (east_m <= east))
        assert np.all((north_m >= south) & (north_m <= north))
        assert not log.radio.empty
    beyond = settings(area__bbox="24.9380,60.1720,24.9450,60.1760", rasters__path=own_world.rasters)
    before = contents(own_world.folder)
    refused = mapfilter("simulate", "-c", own_world.toml, *beyond)
    assert_refused(refused, "area: expected an area that overlaps the rasters")
    assert contents(own_world.folder) == before


def test_journeys_that_receive_nothing_are_done_in_part(own_world):
    with rasterio.open(own_world.rasters, "r+", IGNORE_COG_LAYOUT_BREAK="YES") as source:
        for band in source.indexes:
            source.write(np.full(source.shape, np.nan, np.float32), band)
    outcome = mapfilter("simulate", "-c", own_world.toml)
    assert outcome.code == 3
    assert "no journey receives a cell" in outcome.err


SLOW = """
import signal
import time
# Shells start commands in the background with this one ignored, and it would stay so.
signal.signal(signal.SIGINT, signal.default_int_handler)
from mapfilter._resume import FinishedParts
from mapfilter.cli import main
save = FinishedParts.save
def slowly(self, number, part):
    save(self, number, part)
    time.sleep(0.3)
FinishedParts.save = slowly
main()
"""


def slow(world, *args):
    """Run a command that rests after each part."""
    given = [sys.executable, "-c", SLOW, *map(str, args), "-c", str(world.toml)]
    pipe = subprocess.PIPE
    return subprocess.Popen(given, stdout=pipe, stderr=pipe, text=True, start_new_session=True)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_a_build_that_is_stopped_says_what_is_kept_and_goes_on(own_world, number):
    """With two workers, which end with it; the older database is as it was until the end."""
    before = contents(own_world.database)
    tiles = settings(database__tile_px=16, database__margin_db=2.0)
    with slow(own_world, "build", "--workers", 2, *tiles) as build:
        until_s = time.monotonic() + 60
        while not list(own_world.out.glob(".database.tiles-*/*")):
            assert build.poll() is None, build.stderr.read()
            assert time.monotonic() < until_s
            time.sleep(0.02)
        build.send_signal(number)
        out, err = build.communicate(timeout=60)
    assert (build.returncode, out) == (128 + number, "")
    assert err.endswith(f"stopped by {number.name}: finished tiles are kept: go on with --resume\n")
    assert "Traceback" not in err
    assert contents(own_world.database) == before
    assert not list(own_world.out.glob(".database.partial-*"))
    (kept,) = own_world.out.glob(".database.tiles-*")
    assert list(kept.iterdir())
    assert_done(mapfilter("build", "-c", own_world.toml, "--resume", *tiles))
    resumed = contents(own_world.database)
    assert not kept.exists()
    assert_done(mapfilter("build", "-c", own_world.toml, *tiles))
    assert contents(own_world.database) == resumed != before


OVERRIDES = (1, 2)
"""CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH, by which root writes and reads everywhere."""


def as_anybody():
    """Give up what root may more than others, at the next exec."""
    for capability in OVERRIDES if os.geteuid() == 0 else ():
        if ctypes.CDLL(None).prctl(24, capability, 0, 0, 0) != 0:
            raise OSError("PR_CAPBSET_DROP")


ONE_AFTER_ANOTHER = """
import dataclasses, json, sys
from command_line import mapfilter
outcomes = [dataclasses.asdict(mapfilter(*command)) for command in json.loads(sys.argv[1])]
print(json.dumps(outcomes))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="gives up capabilities")
@pytest.mark.long
def test_folders_that_nobody_may_write_to_are_read_and_refused_as_outputs(own_world):
    places = [own_world.folder, *own_world.folder.rglob("*")]
    for path in places:
        path.chmod(path.stat().st_mode & ~0o222)

    def run(*commands):
        """Run commands one after another in a process that may not more than anybody."""
        given = [sys.executable, "-c", ONE_AFTER_ANOTHER, json.dumps(commands, default=str)]
        done = subprocess.run(
            given, capture_output=True, text=True, check=True, preexec_fn=as_anybody,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        )  # fmt: skip
        return [Outcome(**one) for one in json.loads(done.stdout)]

    try:
        before = contents(own_world.folder)
        given = ["--db", own_world.database, "--log", own_world.journeys / ONE]
        writing = (["build", "--resume"], ["simulate"], ["sweep"], ["replay", *given])
        others = [[*words, "-c", own_world.toml] for words in writing]
        read, *refusals = run(["info", own_world.database], *others)
        assert_done(read)
        for words, refused in zip(writing, refusals, strict=True):
            assert refused.code == 2, (words, refused.err)
            assert "a place that can be written, found Permission denied" in refused.err
            assert "Traceback" not in refused.err
        assert len(refusals) == len(writing)
        assert contents(own_world.folder) == before
    finally:
        for path in places:
            path.chmod(path.stat().st_mode | 0o200)


def test_a_box_of_latitudes_first_over_rasters_is_named(own_world):
    """Without a map of OpenStreetMap the rasters alone tell where the area is."""
    layer = own_world.folder / "streets.gpkg"
    line = shapely.LineString([(24.94, 60.165), (24.95, 60.17)])
    geopandas.GeoDataFrame(geometry=[line], crs="EPSG:4326").to_file(layer)
    given = {"area__map": "none", "roads__layer": layer, "rasters__path": own_world.rasters}
    over = settings(**given, area__bbox="60.1645,24.9390,60.1710,24.9530")
    refused = mapfilter("build", "-c", own_world.toml, *over)
    assert_refused(refused, "area.bbox: expected", "longitude and latitude swapped")
    checked = mapfilter("check", "-c", own_world.toml, *over, "--json")
    assert [one["code"] for one in checked.json["findings"]] == ["lon-lat-swapped"]
