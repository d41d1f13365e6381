"""Wrong configurations and command lines: one message, exit code 2, nothing written."""

import os

import pytest
from command_line import assert_done, assert_refused, contents, mapfilter

from mapfilter.config.mistakes import mistake_in_toml

BOX = "area.bbox=24.9420,60.1660,24.9495,60.1697"


@pytest.fixture
def write(tmp_path):
    def write(text: str | bytes):
        file = tmp_path / "given.toml"
        file.write_bytes(text.encode() if isinstance(text, str) else text)
        return file

    return write


@pytest.mark.parametrize("command", ["predict", "build", "simulate", "replay"])
def test_missing_file(command, tmp_path):
    refused = mapfilter(command, "-c", tmp_path / "none.toml")
    assert_refused(refused, "none.toml: expected a readable file, found No such file")
    assert not contents(tmp_path)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "found an empty file (likely: cut off when saved)"),
        ("\n \n", "found an empty file"),
        ("[area]\nbbox = [24.9420, 60.16", "expected TOML"),
        (b"[area]\nmap = '\xff\xfe'", "expected TOML"),
        ("[rasters]\nfactor = 0,0625  # dB", "(likely: a decimal comma; write a point)"),
        ("[area]\nresolution_m = 5 m", "(likely: a unit after a number; write the number alone"),
        ("[area]\ncrs = EPSG:32635", "(likely: a text without quotes)"),
        ('[cells]\nplan = "C:\\maps\\cells.csv"', "(likely: backslashes in a text; write /"),
        ('[cells]\nplan = "cells.csv\n', "(likely: a quotation mark left out)"),
        ("[area]\n[area]\n", "expected TOML"),
        ("[area]\n[area]\n", "(likely: a section given twice)"),
        ("[x]\nsmooth = true\nsmooth = true\ny = 1", "(likely: a key given twice)"),
        ("[x]\nmap = 'a'\nmap = 'b'  # new", "(likely: a key given twice)"),
        ("x = {y = 1, y = 2}\n", "(likely: a key given twice)"),
        ("[x]\nsmooth = true yes\n", "(likely: a text without quotes)"),
        ("[x]\nsmooth = True\n", "(likely: a text without quotes)"),
    ],
)
def test_empty_truncated_or_other_file(text, told, write):
    assert_refused(mapfilter("predict", "-c", write(text)), "given.toml: ", told)


@pytest.mark.parametrize("value", ["true", "false", "inf", "nan", "true  # as before"])
def test_a_good_value_is_not_called_a_text_without_quotes(value):
    assert mistake_in_toml(f"a = {value}", ValueError("Else (at line 1, column 5)")) == ""


def test_a_folder_for_a_file(tmp_path):
    assert_refused(mapfilter("predict", "-c", tmp_path), "Is a directory")


def test_all_faults_are_told_together_with_the_near_match(write):
    file = write(
        "[aera]\nmap = 'helsinki'\n[cells]\nsite = 3\nsectors = 9\nindoor = 'four'\n"
        "[prediction]\nmetropolitan = 1\n[prediction.ground_truth]\nslope_eror = 0.1\n"
        "[roads]\nprofile = 'cycling'\nlanduse = 'x.tif'\n[journeys]\nlength_m = -3.0\n"
    )
    refused = mapfilter("predict", "-c", file)
    assert_refused(
        refused,
        "given.toml, aera: expected a known section, found 'aera' (likely: 'area')",
        "given.toml, cells.site: expected a known key, found 'site' (likely: 'sites')",
        "given.toml, cells.sectors: expected a whole number in 1..6, found 9",
        "given.toml, cells.indoor: expected a whole number in 0..1000, found 'four'",
        "given.toml, prediction.metropolitan: expected true or false, found 1",
        "given.toml, prediction.ground_truth.slope_eror: expected a known key, found 'slope_eror'",
        "given.toml, roads.profile: expected 'walking' or 'driving', found 'cycling'",
        "given.toml, journeys.length_m: expected a number > 0, found -3.0",
    )
    assert len(refused.err.splitlines()) == 8


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("output = 5", "output: expected a section, found 5"),
        ("area = [1, 2]", "area: expected a section, found [1, 2]"),
        ("[output]\ndir = 5", "output.dir: expected a path, found 5"),
        ("[cells]\nsites = true", "cells.sites: expected a whole number in 1..1000, found True"),
        ("[area]\nresolution_m = '5'", "area.resolution_m: expected a number > 0, found '5'"),
        ("[area]\nmap = 5", "area.map: expected a text, found 5"),
        ("[area]\nbbox = [1, 2, 3]", "area.bbox: expected four numbers: west, south, east, north"),
        (
            "[area]\nbbox = [1, 2, 3, 4, 5]",
            "area.bbox: expected four numbers: west, south, east, north",
        ),
        ("[area]\nbbox = [1, 2, nan, 4]", "area.bbox.2: expected a finite number, found nan"),
        (
            "[area]\nresolution_m = inf",
            "area.resolution_m: expected a finite number > 0, found inf",
        ),
        ("[area]\nsouthwest = [24.9, 60.1]", "area: expected southwest and size_m together"),
        (
            "[area]\nbbox = [1, 2, 3, 4]\nsouthwest = [1, 2]\nsize_m = [9, 9]",
            "area: expected bbox, or southwest with size_m, not both",
        ),
        ("[roads]\nlanduse = 'x'", "roads: expected landuse and landuse_table together"),
    ],
)
def test_wrong_values(text, told, write):
    assert_refused(mapfilter("predict", "-c", write(text)), told)


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("area", "--set area: expected section.key=value"),
        ("area=3", "--set area=3: expected section.key=value"),
        ("=3", "--set =3: expected section.key=value"),
        ("area.=3", "--set area.=3: expected section.key=value"),
        ("", "--set : expected section.key=value, found ''"),
        ("area.map.name=3", "setting area.map: expected a text, found {'name': 3}"),
        ("aera.map=x", "setting aera: expected a known section, found 'aera' (likely: 'area')"),
        ("area.mop=x", "setting area.mop: expected a known key, found 'mop' (likely: 'map')"),
        # Known elsewhere, nearest sections first.
        ("filter.levels=false", "found 'levels' (likely: 'filter.bayes.levels'"),
        (
            "filter.grid.level_eror_db=5",
            "(likely: 'filter.bayes.level_error_db' or 'filter.kalman.",
        ),
        ("prediction.slope_error=5", "(likely: 'prediction.ground_truth.slope_error'"),
        ("database.seed=5", "setting database.seed: expected a known key, found 'seed'\n"),
        ("bayes.levels=false", "expected a known section, found 'bayes' (likely: 'filter.bayes'"),
        ("filter.qqq=1", "setting filter.qqq: expected a known key, found 'qqq'\n"),
        # The section itself is no hint.
        (
            "journeys.journeys=2",
            "setting journeys.journeys: expected a known key, found 'journeys'\n",
        ),
        (
            "cells.sites=many",
            "setting cells.sites: expected a whole number in 1..1000, found 'many'",
        ),
        (
            "area.bbox=1,2,x,4",
            "setting area.bbox: expected four numbers: west, south, east, north, found '1,2,x,4'",
        ),
        (
            "area.bbox=",
            "setting area.bbox: expected four numbers: west, south, east, north, found ''",
        ),
        ("track.without=gnss", "setting track.without: expected a list, found 'gnss'"),
        (
            "rasters.factor=0,0625",
            "expected a number, found '0,0625' (likely: a decimal comma; write 0.0625)",
        ),
        ("area.resolution_m=2,5", "found [2, 5] (likely: a decimal comma; write 2.5)"),
        ("area.resolution_m=5 m", "found '5 m' (likely: a unit after the number; write 5)"),
        ("area.crs=32635", 'area.crs: expected a text, found 32635 (likely: "EPSG:32635")'),
    ],
)
def test_malformed_settings(setting, told):
    assert_refused(mapfilter("predict", "--set", setting), told)


def test_a_setting_is_not_blamed_on_the_file(write):
    file = write("[cells]\nsites = 0\nindoor = 1\n")
    refused = mapfilter("predict", "-c", file, "--set=cells.indoor=-1", "--set=journeys.count=0")
    assert_refused(
        refused, "given.toml, cells.sites: ", "setting cells.indoor: ", "setting journeys.count: "
    )


def test_a_setting_inside_a_value_of_the_file(write):
    refused = mapfilter("predict", "-c", write("[area]\nmap = 'helsinki'\n"), "--set=area.map.x=1")
    assert_refused(refused, "--set area.map.x=1: expected a section, found map, which is a value")


@pytest.mark.parametrize(
    ("box", "told"),
    [
        ("60.1660,24.9420,60.1697,24.9495", "(likely: longitude and latitude swapped)"),
        ("24.9420,160.1660,24.9495,160.1697", "(likely: longitude and latitude swapped)"),
        ("385795,6671660,386230,6672090", "(likely: metres given for degrees)"),
        ("24.9495,60.1697,24.9420,60.1660", "(likely: corners swapped)"),
        ("8.6,49.3,8.7,49.4", "(likely: the area lies outside the map; name another, or none"),
    ],
)
@pytest.mark.parametrize("command", ["predict", "build", "simulate"])
def test_boxes(command, box, told, own_world):
    before = contents(own_world.folder)
    assert_refused(mapfilter(command, "-c", own_world.toml, f"--set=area.bbox={box}"), told)
    assert contents(own_world.folder) == before


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ([BOX, "area.crs=EPSG:4326"], "expected a projected CRS in metres, found WGS 84"),
        ([BOX, "area.crs=EPSG:99999"], "area.crs: expected a CRS such as EPSG:32629"),
        ([BOX, "area.crs=EPSG:3857"], "of which 100 m are 50 m (likely: a CRS of another region"),
        ([BOX, "area.crs=EPSG:32629"], "EPSG:32629, of which 100 m are 96 m"),
        ([BOX, "area.resolution_m=0.00005"], "a box or a resolution in the wrong unit"),
        (
            ["area.southwest=24.942,60.166", "area.size_m=0.004,0.004"],
            "area.size_m: expected metres, at least 5, found (0.004, 0.004)"
            " (likely: degrees given for metres)",
        ),
        (["area.southwest=60.166,24.942", "area.size_m=400,400"], "longitude and latitude swapped"),
    ],
)
def test_areas(given, told, tmp_path):
    settings = [f"--set={setting}" for setting in given]
    assert_refused(mapfilter("predict", *settings, "--out", tmp_path / "out"), told)
    assert not contents(tmp_path)


@pytest.mark.parametrize(
    ("args", "told"),
    [
        (["predcit"], "No such command 'predcit'"),
        (["build", "--workes", "2"], "No such option: --workes"),
        (["build", "--workers", "0"], "'--workers'"),
        (["simulate", "--seed", "-1"], "'--seed'"),
        (["export"], "Missing argument 'DB'"),
        (["bound", "--db"], "Missing argument 'DB'"),
        (["bound", "--db", "one", "other"], "unexpected extra argument"),
        (["bound", "--db", "nowhere"], "nowhere: expected a database folder, found nothing"),
        (["export", "--db=nowhere", "--to", "a.gpkg"], "nowhere: expected a database folder"),
        (["learn", "--logs", ".", "--db", "nowhere"], "expected a track log, or a folder of logs"),
        (["info"], "Missing argument 'PATH'"),
    ],
)
def test_wrong_command_lines_end_as_the_rest_does(args, told):
    refused = mapfilter(*args)
    assert (refused.code, refused.out) == (2, "")
    assert told in refused.err
    assert "Traceback" not in refused.err
    assert not set("╭│╰") & set(refused.err)


@pytest.mark.skipif(os.name == "nt", reason="a file name that Windows does not allow")
def test_the_message_shows_a_name_with_control_characters_on_its_own_line(tmp_path):
    refused = mapfilter("predict", "-c", tmp_path / "two\nlines.toml")
    assert refused.code == 2
    assert all(line.startswith("mapfilter: error: ") for line in refused.err.splitlines())


def test_demo_refuses_wrong_settings(tmp_path):
    refused = mapfilter("demo", "--out", tmp_path / "demo", "--set", "journeys.lenght_m=3")
    assert_refused(refused, "setting journeys.lenght_m", "(likely: 'length_m')")
    assert not contents(tmp_path)


def test_a_byte_order_mark_and_windows_lines_are_read(write, world):
    text = world.toml.read_text(encoding="utf-8").replace("\n", "\r\n")
    text = text.replace('"cells.csv"', f"'{world.plan}'").replace('"out"', f"'{world.out}'")
    file = write(b"\xef\xbb\xbf" + text.encode())
    assert_done(mapfilter("build", "-c", file, "--dry-run"))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "[cells]\nseed = " + "9" * 5000,
            "given.toml: expected TOML, found a number of thousands of digits",
        ),
        ("[area]\nbbox = " + "[" * 3000 + "]" * 3000, "given.toml: expected TOML, found"),
        (
            "[cells]\nseed = " + "9" * 4000,
            "given.toml, cells.seed: expected a whole number >= 0 and < 9223",
        ),
        ("[cells]\nheight_m = " + "9" * 4000, "given.toml, cells.height_m: expected"),
        ("[output]\ndir = 'a\\u0000b'".replace("'", '"'), "output.dir: expected a path without a"),
        ("[output]\ndir = '~nouser/out'", "expected a path whose ~ is the folder of a user"),
        (f"[cells]\nplan = '{'a' * 300}'", "cells.plan: expected a path that the system takes"),
        (f"[area]\nmap = '{'a/' * 3000}'", "area.map: expected a path that the system takes"),
        ("[area]\nresolution_m = 1e9", "area.resolution_m: expected metres, at most the area's"),
        ("[journeys]\naveraging_s = 1e300", "averaging_s: expected at most 1000 reports"),
        ("[journeys]\nlength_m = 1e12", "journeys, period_s: expected at most 1e+07 times"),
        ("[journeys]\nspeed_mps = 1e-9", "journeys, period_s: expected at most 1e+07 times"),
        (
            "[journeys]\nreport_period_s = 1e-9\naveraging_s = 0",
            "report_period_s: expected at most 1e+07 times",
        ),
        ("[imu]\nperiod_s = 1e-9", "imu, period_s: expected at most 1e+07 times"),
        ("[cells]\nsites = 10000", "cells.sites: expected a whole number in 1..1000, found 10000"),
    ],
)
def test_hostile_values(text, told, write, own_world):
    given = ["-c", write(text), "--set=journeys.radio=as_predicted", f"--set={BOX}"]
    if "[output]" not in text:
        given += ["--out", own_world.out]
    if "[cells]" not in text:
        given += [f"--set=cells.plan={own_world.plan}"]
    assert_refused(mapfilter("simulate", *given), told)


def test_a_correlation_that_no_memory_holds(own_world):
    before = contents(own_world.folder)
    given = ["-c", own_world.toml, "--set=prediction.shadowing_correlation_m=20000"]
    assert_refused(mapfilter("predict", *given), "shadowing, correlation_m: expected area and ten")
    assert contents(own_world.folder) == before


@pytest.mark.parametrize("setting", ["cells.seed=" + "9" * 5000, "cells.seed=" + "[" * 3000])
def test_hostile_settings(setting):
    assert_refused(mapfilter("predict", "--set", setting), "cells.seed: expected a whole number")


def test_a_user_without_a_folder_in_a_setting():
    refused = mapfilter("predict", "--set=output.dir=~nouser/x")
    assert_refused(refused, "output.dir: expected a path whose ~ is the folder of a user")


@pytest.mark.skipif(os.name == "nt", reason="pipes are no files on Windows")
def test_pipes_are_refused_not_waited_for(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    told = "expected a file or a folder, not a pipe, socket or device"
    for args in (
        ["predict", "-c", pipe],
        ["info", pipe],
        ["export", pipe, "--to", tmp_path / "x.gpkg"],
        ["predict", f"--set=cells.plan={pipe}"],
        ["replay", "--log", pipe],
        ["demo", "--out", pipe],
    ):
        assert_refused(mapfilter(*args), told)


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ("a" * 5000, "expected a path that the system takes"),
        (os.fsdecode(b"out-\xff"), "expected a path in UTF-8, found "),
    ],
)
@pytest.mark.parametrize(
    "args",
    [
        ["info"],
        ["demo", "--out"],
        ["predict", "--out"],
        ["replay", "--out"],
        ["replay", "--db"],
        ["export", "x", "--to"],
        ["predict", "-c"],
    ],
)
def test_paths_that_are_none(args, path, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert_refused(mapfilter(*args, path), told)
    assert not any(tmp_path.iterdir())


def test_out_of_memory_is_one_message(monkeypatch):
    def full(*_args, **_more):
        raise MemoryError

    monkeypatch.setattr("mapfilter.workflows.info.run_info", full)
    assert_refused(mapfilter("info", "x"), "memory: expected enough of it, found none left")


@pytest.mark.parametrize(
    ("command", "given"),
    [
        ("build", ()),
        ("build", ("--dry-run",)),
        ("simulate", ()),
        ("sweep", ()),
        ("sweep", ("--dry-run",)),
    ],
)
def test_without_a_configuration_that_is_told_first(command, given, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused = mapfilter(command, *given)
    assert_refused(refused, "found none; defaults were taken")
    first = refused.err.splitlines()[0]
    assert first.startswith("mapfilter: error: command line: expected a configuration (-c FILE)")
    refused = mapfilter(command, *given, "--set=cells.sites=3")
    assert_refused(refused)
    assert "-c FILE" not in refused.err


def test_check_without_a_configuration_says_so(tmp_path, monkeypatch, own_world):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    own_world.rasters.rename(tmp_path / "out" / "rxlev.tif")
    checked = mapfilter("check")
    assert (checked.code, "cell-without-raster" in checked.out) == (2, True)
    assert "expected a configuration (-c FILE)" in checked.err


@pytest.mark.parametrize("crs", ["EPSG:4326", "UTM35"])
@pytest.mark.parametrize("command", ["build", "check"])
def test_a_wrong_crs_of_rasters_names_the_setting(command, crs, own_world):
    given = [f"--set=rasters.path={own_world.rasters}", f"--set=rasters.crs={crs}"]
    done = mapfilter(command, "-c", own_world.toml, *given)
    assert done.code == 2
    assert "rasters.crs: " in (done.err if command == "build" else done.out)
    if command == "check":
        assert "Set rasters.crs to the projected CRS of the numbers" in done.out
