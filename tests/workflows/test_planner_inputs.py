"""Lists and rasters of a planning tool: check says what build says, and nothing is guessed."""

import csv

import numpy as np
import pytest
from check_world import make_plan, make_world
from command_line import assert_done, assert_refused, mapfilter, settings

from mapfilter.database.store import open_database

SHOWN = ("Transmitter", "Site", "X", "Y", "Height (m)", "Azimuth (°)", "EIRP (dBm)")


@pytest.fixture
def world(tmp_path, levels):
    """Losses, in sixteenths of a decibel, and the list of a planning tool."""
    world = make_world(tmp_path, levels)
    world.landuse, world.quantity = None, ""
    eirp_dbm = {cell.id: cell.eirp_dbm for cell in make_plan().cells}
    world.levels = {i: np.round(16 * (eirp_dbm[i] - v)) for i, v in levels.items()}
    given = settings(rasters__quantity="loss", rasters__factor=0.0625)
    world.set(*given, *settings(cells__layout="atoll", output__pictures="none"))
    world.write()
    return world


def write_list(world, header=SHOWN, without=()):
    """Write the cells as a list; columns ``without`` are left out."""
    with (world.folder / "cells.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, delimiter=";")
        kept = [i for i, name in enumerate(SHOWN) if name not in without]
        writer.writerow([header[i] for i in kept])
        for cell in make_plan().cells:
            azimuth = "" if cell.azimuth_deg is None else cell.azimuth_deg
            place = cell.id, cell.site, cell.east_m, cell.north_m
            row = *place, cell.height_m, azimuth, cell.eirp_dbm
            writer.writerow([row[i] for i in kept])


def check(world, *given):
    return mapfilter("check", "-c", world.toml, "--json", *world.settings, *given).json["findings"]


def build(world, *given):
    out = "--out", world.folder / "built"
    return mapfilter("build", "-c", world.toml, "--json", *out, *world.settings, *given)


def test_displayed_headings_give_the_powers_and_azimuths_of_the_list(world):
    write_list(world)
    assert check(world) == []
    notes = assert_done(build(world)).json["notes"]
    assert [note for note in notes if "without one" in note] == [
        "frequency_mhz = 1800 for 10 of 10 cells without one"
    ]
    built = open_database(world.folder / "built" / "database").plan
    assert [(c.eirp_dbm, c.azimuth_deg, c.height_m) for c in built.cells] == [
        (c.eirp_dbm, c.azimuth_deg, c.height_m) for c in make_plan().cells
    ]


def test_a_default_eirp_is_not_taken_for_losses(world):
    write_list(world, without=("EIRP (dBm)",))
    (finding,) = check(world)
    assert (finding["code"], finding["severity"]) == ("eirp-missing", "error")
    assert "10 of 10 cells have no EIRP" in finding["evidence"]
    assert "cells.eirp_dbm" in finding["remedy"]
    told = "expected an EIRP for each cell", "found none for 10 of 10 cells", "cells.eirp_dbm"
    assert_refused(build(world), *told)
    assert_refused(build(world, "--dry-run"), *told)


def test_losses_of_a_plan_in_our_own_columns_need_an_eirp_that_is_set(world):
    header = "cell", "site", "east", "north", "height_m", "azimuth_deg", "eirp_dbm"
    write_list(world, header, without=("EIRP (dBm)",))
    own = settings(cells__layout="plan", cells__frequency_mhz=1800.0)
    told = "set cells.eirp_dbm, which is then taken for all cells without one"
    assert_refused(build(world, *own), "expected a column eirp_dbm", told)
    done = assert_done(build(world, *own, *settings(cells__eirp_dbm=50.0)))
    assert "eirp_dbm = 50 for 10 of 10 cells without one" in done.json["notes"]


def test_an_eirp_that_is_set_is_taken(world):
    write_list(world, without=("EIRP (dBm)",))
    given = settings(cells__eirp_dbm=43.0)
    assert check(world, *given) == []
    notes = assert_done(build(world, *given)).json["notes"]
    assert "eirp_dbm = 43 for 10 of 10 cells without one" in notes


def test_levels_need_no_eirp(world, levels):
    world.levels, world.quantity = levels, "level"
    world.write()
    write_list(world, without=("EIRP (dBm)",))
    given = settings(cells__layout="atoll", output__pictures="none")
    out = "--out", world.folder / "built"
    notes = assert_done(mapfilter("build", "-c", world.toml, "--json", *out, *given)).json["notes"]
    assert "eirp_dbm = 52 for 10 of 10 cells without one" in notes


def test_ignored_columns_are_warned_of_and_noted(world):
    header = [name.replace("Height (m)", "Height above mean (m)") for name in SHOWN]
    write_list(world, header)
    (finding,) = check(world)
    assert (finding["code"], finding["severity"]) == ("plan-columns", "warning")
    told = "olumns not used that resemble fields: 'Height above mean (m)' (height_m)"
    assert told in finding["evidence"]
    assert any(told in note for note in assert_done(build(world)).json["notes"])


@pytest.mark.parametrize("factor", [1, 10, 0.001, -0.0625])
def test_of_a_wrong_factor_nothing_else_is_told(factor, world):
    write_list(world)
    found = check(world, *settings(rasters__factor=factor))
    assert [one["code"] for one in found] == ["values-implausible"]
    assert "rasters.factor" in found[0]["remedy"]


def test_a_factor_that_was_left_out_is_told_as_build_tells_it(world):
    write_list(world)
    (finding,) = check(world, *settings(rasters__factor=1))
    assert "a loss in 0..400 dB; 10 of 10 rasters hold" in finding["evidence"]
    assert "factor left out" in finding["evidence"]
    assert_refused(build(world, *settings(rasters__factor=1)), "factor left out")


def test_one_raster_out_of_range_is_told_and_not_judged(world):
    world.levels["S1A"] = world.levels["S1A"] * 16
    world.write()
    write_list(world)
    (finding,) = check(world)
    assert finding["code"] == "values-implausible"
    assert finding["where"].endswith("cells S1A")


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        (None, "Correct the path, or put the file there."),
        ("", "Take another file, or export this one anew."),
        ("Transmitter;X;Y\n", "Take another file, or export this one anew."),
        ("Transmitter;Height (m)\nA;3\n", "Correct the header, or name its columns in"),
        ("Transmitter;X;Y\nA;1e9;b\n", "Correct the field."),
    ],
)
def test_the_remedy_of_a_plan_fits_its_fault(text, remedy, world):
    plan = world.folder / "cells.csv"
    plan.unlink() if text is None else plan.write_text(text, encoding="utf-8")
    (finding,) = check(world)
    assert finding["code"] == "plan-invalid"
    assert finding["remedy"].startswith(remedy)


@pytest.mark.parametrize(
    "given",
    [
        ("build", *settings(rasters__factor=1)),
        ("build", *settings(rasters__factor=1), "--cluster", "local:1"),
        ("build", "--roads-only", *settings(roads__half_width_m=0.001)),
        ("predict", *settings(cells__antennas="none")),
        ("predict", *settings(prediction__model="survey", prediction__survey__files="cells.csv")),
        ("simulate",),
        ("sweep",),
        ("demo", *settings(area__map="none.osm.pbf")),
    ],
    ids=lambda given: " ".join(given[:2]),
)
def test_a_command_that_fails_leaves_no_folder(given, world, monkeypatch):
    write_list(world, [name.replace("Site", "Antenna") for name in SHOWN])
    monkeypatch.chdir(world.folder)
    before = sorted(world.folder.rglob("*"))
    command, *more = given
    config = () if command == "demo" else ("-c", world.toml, *world.settings)
    out = world.folder / "deep" / "out"
    failed = mapfilter(command, *config, "--set=rasters.path=rxlev.tif", "--out", out, *more)
    assert_refused(failed)
    assert sorted(world.folder.rglob("*")) == before


@pytest.mark.parametrize("command", ["build", "sweep"])
def test_a_cluster_is_asked_for_when_the_inputs_are_right(command, world, monkeypatch):
    def connect(*_):
        raise AssertionError("connected to")

    monkeypatch.setattr(f"mapfilter.workflows.{command}.executor_of", connect)
    (world.folder / "cells.csv").unlink()
    given = *world.settings, "--cluster", "tcp://127.0.0.1:1", "--out", world.folder / "out"
    refused = mapfilter(command, "-c", world.toml, *given)
    assert_refused(refused)
    assert "connected to" not in refused.err


def test_losses_to_calibrate_need_an_eirp_too(world, levels):
    eirp_dbm = {cell.id: cell.eirp_dbm for cell in make_plan().cells}
    world.levels = {i: eirp_dbm[i] - v for i, v in levels.items()}
    world.quantity = "loss"
    world.write()
    write_list(world, without=("EIRP (dBm)",))
    text = world.toml.read_text(encoding="utf-8").replace('[rasters]\npath = "rxlev.tif"\n', "")
    world.toml.write_text(text, encoding="utf-8")
    rows = "".join(f"S1A,60.18{n},24.94{n},-80\n" for n in range(9))
    (world.folder / "drive.csv").write_text(f"cell,lat,lon,level_dbm\n{rows}", encoding="utf-8")
    given = settings(
        prediction__model="survey",
        prediction__survey__files=world.folder / "drive.csv",
        prediction__survey__calibrate=world.rasters,
        cells__layout="atoll",
    )
    out = "--out", world.folder / "out"
    refused = mapfilter("predict", "-c", world.toml, *given, *out)
    assert_refused(refused, "expected an EIRP for each cell", "found none for 10 of 10 cells")
    assert not (world.folder / "out").exists()
    set_ = settings(cells__eirp_dbm=43.0)
    assert "EIRP" not in mapfilter("predict", "-c", world.toml, *given, *set_, *out).err


def test_points_below_the_usual_floor_are_not_left_out_without_a_word(world):
    """Levels of an LTE carrier, 45 dB below those of GSM, of cells without a technology."""
    world.levels = {i: v + 45 * 16 for i, v in world.levels.items()}
    world.write()
    write_list(world)
    built = assert_done(build(world)).json
    (note,) = (note for note in built["notes"] if "left out" in note)
    left_out = built["routable_points"] - built["points"]
    assert 0.3 < left_out / built["routable_points"] < 1
    assert note.startswith(f"{left_out} of {built['routable_points']} points left out")
    lower = assert_done(build(world, *settings(database__floor_dbm=-150))).json
    assert lower["points"] == built["routable_points"]
    assert not [note for note in lower["notes"] if "left out" in note]
