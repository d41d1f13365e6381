"""Rasters of a planning tool as they are: names around ids, another datum, a smaller extent."""

from dataclasses import replace

import numpy as np
import pytest
import rasterio
from command_line import assert_done, assert_refused, mapfilter, settings
from rasterio.warp import Resampling, reproject

from mapfilter.geodesy import unproject
from mapfilter.radio.plan_files import read_cell_plan
from mapfilter.rasters.names import named_by_plan
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import check_against_plan

NAMES = ("HD{}_RSRP", "{}_best", "net-{}", "{}")


def bands(path):
    with rasterio.open(path) as source:
        yield from ((name, source.read(i + 1)) for i, name in enumerate(source.descriptions))


def write(path, like, values, **changed):
    with rasterio.open(like) as source:
        profile = {**source.profile, "driver": "GTiff", "count": 1, "tiled": False, **changed}
    profile = {k: v for k, v in profile.items() if not k.startswith("block")}
    with rasterio.open(path, "w", **profile) as target:
        target.write(values.astype(np.float32), 1)


@pytest.fixture
def export(own_world):
    """Write one GeoTIFF for each cell into a folder that the configuration names."""
    folder = own_world.folder / "export"
    folder.mkdir()

    def of(pattern, **changed):
        for name, values in bands(own_world.rasters):
            write(folder / f"{pattern.format(name)}.tif", own_world.rasters, values, **changed)
        text = own_world.toml.read_text()
        if "[rasters]" not in text:
            own_world.toml.write_text(text + '[rasters]\npath = "export"\nquantity = "level"\n')
        return folder

    return of


@pytest.mark.parametrize("pattern", NAMES)
def test_a_common_prefix_or_suffix_is_recognised(pattern, export, own_world):
    export(pattern)
    done = assert_done(mapfilter("build", "-c", own_world.toml, "--json")).json
    assert done["cells"] == 3
    note = f"rasters named {pattern.format('*')}, where * is a cell of the plan"
    assert (note in done["notes"]) == (pattern != "{}")
    found = mapfilter("check", "-c", own_world.toml, "--json").json["findings"]
    assert not [f for f in found if "raster" in f["code"] and "cell" in f["code"]]
    simulated = assert_done(mapfilter("simulate", "-c", own_world.toml, "--json")).json
    assert (note in simulated["notes"]) == (pattern != "{}")


def test_names_and_notes_of_what_drive_tests_calibrate(export, own_world, tmp_path):
    """One drive along a row of pixels; the plan has no EIRP."""
    folder = export("HD{}_RSRP")
    rasters = open_rasters(own_world.rasters)
    lattice, level = rasters.lattice, rasters.read(cells=("A",))[0]
    col = np.arange(lattice.cols)
    lon, lat = unproject(lattice.crs, *lattice.east_north(np.full(lattice.cols, 20), col))
    rows = [f"A,{lat[i]:.7f},{lon[i]:.7f},{level[20, i] + 3:.2f},{2 * i}\n" for i in col]
    drive = tmp_path / "drive.csv"
    drive.write_text("cell,lat,lon,level_dbm,time\n" + "".join(rows))
    plan = read_cell_plan(own_world.plan, lattice.crs)
    cells = tmp_path / "cells.csv"
    cells.write_text(
        "cell,site,lat,lon,height_m,azimuth_deg,frequency_mhz\n"
        + "".join(f"{c.id},{c.site},{lat[0]},{lon[0]},20,0,1800\n" for c in plan.cells)
    )
    more = settings(
        cells__plan=cells,
        cells__eirp_dbm=43.0,
        prediction__model="survey",
        prediction__survey__files=drive,
        prediction__survey__calibrate=folder,
        prediction__survey__fill="true",
        rasters__path=tmp_path / "made.tif",
    )
    done = assert_done(mapfilter("predict", "-c", own_world.toml, "--json", *more)).json
    assert done["notes"][:2] == [
        "rasters named HD*_RSRP, where * is a cell of the plan",
        "eirp_dbm = 43 for 3 of 3 cells without one",
    ]
    off_db = open_rasters(tmp_path / "made.tif").read(cells=("A",))[0] - level
    assert np.abs(off_db[20] - 3).max() < 1


def test_names_that_do_not_fit_are_left_alone(export, own_world):
    folder = export("HD{}_RSRP")
    (folder / "HDA_RSRP.tif").rename(folder / "XXA_RSRP.tif")
    (folder / "HDB_RSRP.tif").rename(folder / "YYB.tif")
    said = "cells of the plan only, found 'HDC_RSRP', 'XXA_RSRP', 'YYB'"
    assert_refused(mapfilter("build", "-c", own_world.toml), said)


def test_names_by_a_plan_of_many_cells(tmp_path, own_world):
    (values,) = [values for name, values in bands(own_world.rasters) if name == "A"]
    for name in ("L1_1_x", "L1_11_x", "L1_2_x", "L1_L1_x"):
        write(tmp_path / f"{name}.tif", own_world.rasters, values)
    rasters = open_rasters(tmp_path, "level")
    plan = read_cell_plan(own_world.plan, rasters.lattice.crs)
    first = plan.cells[0]

    def of(*ids):
        return replace(plan, cells=tuple(replace(first, id=one) for one in ids))

    named = named_by_plan(rasters, of("1", "11", "2", "L1"))
    assert sorted(named.cell_ids) == ["1", "11", "2", "L1"]
    check_against_plan(named, of("1", "11", "2", "L1"))
    assert np.array_equal(named.read(cells=("11",)), rasters.read(cells=("L1_11_x",)), True)
    assert named_by_plan(named, of("1", "11", "2", "L1")) is named
    assert named_by_plan(rasters, of("7", "8")) is rasters
    assert named_by_plan(rasters, of("1", "2")) is rasters


def test_rasters_of_another_datum_go_through_the_whole_chain(own_world, export):
    folder = export("{}")
    for path in folder.glob("*.tif"):
        with rasterio.open(path) as source:
            values, profile = source.read(1), source.profile
        moved = np.full_like(values, np.nan)
        reproject(
            values,
            moved,
            src_transform=profile["transform"],
            src_crs="EPSG:32635",
            dst_transform=profile["transform"],
            dst_crs="EPSG:25835",
            resampling=Resampling.nearest,
            src_nodata=np.nan,
            dst_nodata=np.nan,
        )
        write(path, own_world.rasters, moved, crs="EPSG:25835")
    for command in ("build", "simulate"):
        assert_done(mapfilter(command, "-c", own_world.toml))
    out = ("--out", own_world.folder / "located", *settings(output__pictures="none"))
    assert mapfilter("replay", "-c", own_world.toml, *out).code in (0, 3)
    given = settings(area__crs="EPSG:32635")
    for command in ("build", "simulate"):
        assert_refused(
            mapfilter(command, "-c", own_world.toml, *given),
            'another zone or datum: set area.crs = "EPSG:25835"',
        )


def test_journeys_stay_on_the_rasters_where_no_box_is_given(own_world, export):
    export("{}")
    text = own_world.toml.read_text()
    assert text.startswith("[area]\nbbox")
    own_world.toml.write_text("[area]\nmap = 'helsinki'\n" + text.split("\n", 2)[2])
    assert_done(mapfilter("build", "-c", own_world.toml))
    done = assert_done(mapfilter("simulate", "-c", own_world.toml, "--json")).json
    assert done["notes"] == []


def test_journeys_without_any_cell_are_told(own_world, export):
    folder = export("{}")
    for path in folder.glob("*.tif"):
        with rasterio.open(path, "r+") as target:
            target.write(np.full((target.height, target.width), np.nan, np.float32), 1)
    outcome = mapfilter("simulate", "-c", own_world.toml, "--json")
    assert outcome.code == 3
    done = outcome.json
    assert done["notes"][-1].startswith("no cell is received in 2 of 2 journeys (journey-")


def test_neighbours_that_no_report_can_name_are_told(own_world, export):
    """A plan without carriers or codes leaves a phone's neighbours without a name."""
    export("{}")
    plan = own_world.folder / "cells.csv"
    rows = [line.split(",") for line in plan.read_text().splitlines()]
    drop = {rows[0].index("arfcn"), rows[0].index("bsic")}
    kept = [",".join(v for k, v in enumerate(row) if k not in drop) for row in rows]
    plan.write_text("\n".join(kept) + "\n")
    notes = assert_done(mapfilter("simulate", "-c", own_world.toml, "--json")).json["notes"]
    assert notes[-1].startswith(f"{len(rows) - 1} cells have no carrier and code")
