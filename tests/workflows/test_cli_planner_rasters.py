"""Databases from what planning tools export: losses as raw pixels with an index, cell lists."""

import numpy as np
import pandas as pd
import pytest
import rasterio
from command_line import assert_done, assert_refused, mapfilter, settings

EIRP_DBM = 50.0
INDEX = "TX_NAME;FILE_NAME;RESOLUTION;AREA_XMIN;AREA_XMAX;AREA_YMIN;AREA_YMAX;NBITS\n"
HDR = """NROWS {rows}
NCOLS {cols}
NBITS 32
PIXELTYPE SIGNEDINT
BYTEORDER M
ULXMAP {ulx}
ULYMAP {uly}
XDIM {side}
YDIM {side}
NODATA -1
"""


@pytest.fixture
def export(own_world):
    """A folder with one raster of losses, in hundredths of a decibel, per cell of the world."""
    folder = own_world.folder / "atoll"
    folder.mkdir()
    index = INDEX
    with rasterio.open(own_world.rasters) as source:
        west, south, east, north = source.bounds
        side = source.res[0]
        place = {"ulx": west + side / 2, "uly": north - side / 2, "side": side}
        for band, name in enumerate(source.descriptions, start=1):
            loss = EIRP_DBM - source.read(band).astype(np.float64)
            stored = np.where(np.isnan(loss), -1, np.round(100 * loss)).astype(">i4")
            (folder / f"{name}.bil").write_bytes(stored.tobytes())
            rows, cols = stored.shape
            (folder / f"{name}.hdr").write_text(HDR.format(rows=rows, cols=cols, **place))
            area = f"{west};{east};{south};{north}"
            index += f"{name};{name}.bil;{side};{area};32\n"
        crs = f"EPSG:{source.crs.to_epsg()}"
    (folder / "index.csv").write_text(index)
    plan = own_world.plan.read_text(encoding="utf-8")
    assert plan.count(",25,") == 1
    own_world.toml.write_text(
        own_world.toml.read_text(encoding="utf-8")
        + f'[rasters]\npath = "atoll"\nquantity = "loss"\ncrs = "{crs}"\nfactor = 0.01\n',
        encoding="utf-8",
    )
    return folder


def levels(database):
    return pd.concat(
        pd.read_parquet(part, columns=["point", "cell", "level_dbm"])
        for part in sorted(database.glob("levels/*/*.parquet"))
    ).sort_values(["cell", "point"])


@pytest.mark.usefixtures("export")
def test_losses_with_an_index_give_the_database_that_levels_gave(own_world):
    before = levels(own_world.database)
    done = assert_done(mapfilter("build", "-c", own_world.toml, "--json")).json
    assert done["cells"] == 3
    after = levels(own_world.database)
    both = before.merge(after, on=["point", "cell"], suffixes=("", "_new"))
    # Rounding may lift or drop a level across the floor.
    assert abs(len(before) - len(after)) <= 2
    assert len(both) >= len(before) - 2
    assert (both["level_dbm"] - both["level_dbm_new"]).abs().max() < 0.02


@pytest.mark.usefixtures("export")
def test_the_same_export_on_another_lattice_is_told(own_world):
    given = settings(rasters__resolution_m=10.0, rasters__resampling="bilinear")
    done = assert_done(mapfilter("build", "-c", own_world.toml, *given, "--json")).json
    assert any("3 of 3 rasters resampled (bilinear)" in note for note in done["notes"])


@pytest.mark.usefixtures("export")
@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"rasters__factor": 1}, "a loss in 0..400 dB"),
        ({"rasters__factor": 0}, "a factor other than 0"),
        ({"rasters__factor": 0.001}, "a factor that is not the file's"),
        ({"rasters__quantity": "level"}, "path losses, or raw RXLEV, given for levels"),
        ({"rasters__quantity": "gain"}, "'level' or 'loss'"),
        ({"rasters__crs": "EPSG:4326"}, "degrees given for metres"),
    ],
)
def test_what_is_said_of_the_export_is_checked(given, told, own_world):
    assert_refused(mapfilter("build", "-c", own_world.toml, *settings(**given)), told)


def test_half_a_pixel(export, own_world):
    header = export / "B.hdr"
    lines = header.read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("ULXMAP"))
    lines[at] = f"ULXMAP {float(lines[at].split()[1]) - 2.5}"
    header.write_text("\n".join(lines))
    told = "B.bil shifted by -0.50 pixels east, +0.00 north"
    assert_refused(mapfilter("build", "-c", own_world.toml), "index.csv row 3, area", told)


def test_keys_without_a_path(own_world):
    given = settings(rasters__quantity="loss")
    assert_refused(mapfilter("build", "-c", own_world.toml, *given), "rasters: expected path")


def test_info_of_a_folder_of_rasters(own_world, tmp_path):
    folder = tmp_path / "rasters"
    folder.mkdir()
    own_world.rasters.rename(folder / "rxlev.tif")
    found = assert_done(mapfilter("info", folder, "--json")).json
    assert (found["kind"], found["cell_ids"], found["notes"]) == ("rasters", ["A", "B", "C"], [])


def test_a_list_with_other_columns_predicts_the_same(own_world):
    assert_done(mapfilter("predict", "-c", own_world.toml))
    before = own_world.rasters.read_bytes()
    header, rows = own_world.plan.read_text(encoding="utf-8").split("\n", 1)
    header = header.replace("cell,site", "TX_ID,SITE_NAME").replace("eirp_dbm", "Power")
    header = header.replace("height_m", "HEIGHT").replace("azimuth_deg", "AZIMUT")
    header = header.replace("frequency_mhz", "FREQUENCY")
    text = (header + ",Remark\n" + rows.replace("\n", ",x\n")).replace(",", ";").replace(".", ",")
    own_world.plan.write_text(text, encoding="utf-8")
    given = settings(cells__layout="atoll", cells__columns__eirp_dbm="Power")
    assert_done(mapfilter("predict", "-c", own_world.toml, *given))
    assert own_world.rasters.read_bytes() == before
