"""The doors of files: pipes, devices, other drivers' files, and what leads to other places."""

import ast
import contextlib
import os
import sqlite3
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import geopandas
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pyogrio
import pytest
import rasterio
import shapely

import mapfilter
from mapfilter import _inputs
from mapfilter._gdal import open_raster
from mapfilter._inputs import open_input, read_input
from mapfilter._ogr import vector_source
from mapfilter.errors import InputError
from mapfilter.experiments.sweep.table import SCHEMA, read_runs
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.estimate_store import read_estimate, write_estimate
from mapfilter.roads import vector
from mapfilter.roads.vector import read_layer
from mapfilter.tracks.log import make_log
from mapfilter.tracks.sensors import read_sensors
from mapfilter.tracks.store import write_log
from mapfilter.tracks.table_files import read_table as read_log_table
from mapfilter.workflows.info import run_info

CRS = "EPSG:32635"
BOX = (385000.0, 6671000.0, 386000.0, 6672000.0)
ROOT = Path(mapfilter.__file__).parent


def tiff(path, value=5):
    profile = {"driver": "GTiff", "width": 64, "height": 64, "count": 1, "dtype": "uint8"}
    profile |= {"crs": CRS, "transform": rasterio.Affine(5, 0, 385000, 0, -5, 6672000)}
    with rasterio.open(path, "w", **profile) as target:
        target.write(np.full((1, 64, 64), value, "uint8"))
    return path


def virtual(source):
    return (
        '<VRTDataset rasterXSize="64" rasterYSize="64"><VRTRasterBand dataType="Byte" band="1">'
        f'<SimpleSource><SourceFilename relativeToVRT="0">{source}</SourceFilename>'
        "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>"
    )


def roads(path, **options):
    line = shapely.LineString([(385100, 6671100), (385900, 6671900)])
    geopandas.GeoDataFrame({"a": [1]}, geometry=[line], crs=CRS).to_file(path, **options)
    return path


def test_virtual_rasters_are_no_geotiffs_whatever_their_name(tmp_path):
    secret = tiff(tmp_path / "secret.tif", 77)
    (tmp_path / "use.tif").write_text(virtual(secret))
    with (
        pytest.raises(InputError, match="holds its data itself"),
        open_raster(tmp_path / "use.tif"),
    ):
        pass


@pytest.mark.parametrize("suffix", [".msk", ".ovr"])
def test_masks_and_overviews_beside_a_raster_do_not_lead_elsewhere(tmp_path, suffix):
    secret = tiff(tmp_path / "secret.tif", 77)
    path = tiff(tmp_path / "use.tif")
    path.with_name(f"use.tif{suffix}").write_text(virtual(secret).replace('="64"', '="32"'))
    with pytest.raises(InputError, match="holds its data itself"), open_raster(path):
        pass
    tiff(path.with_name(f"use.tif{suffix}"), 1)
    with open_raster(path) as source:
        assert source.read(1).max() == 5


@pytest.mark.parametrize("inside", [True, False])
def test_overviews_by_metadata_do_not_lead_elsewhere(tmp_path, server, inside):
    address, asked = server
    path, place = tiff(tmp_path / "use.tif"), f"/vsicurl/{address}/o.tif"
    if inside:
        with rasterio.open(path, "r+") as source:
            source.update_tags(ns="OVERVIEWS", OVERVIEW_FILE=place)
    else:
        text = f'<Metadata domain="OVERVIEWS"><MDI key="OVERVIEW_FILE">{place}</MDI></Metadata>'
        path.with_name("use.tif.aux.xml").write_text(f"<PAMDataset>{text}</PAMDataset>")
    with pytest.raises(InputError, match="overviews elsewhere"), open_raster(path):
        pass
    assert not asked


def test_a_plain_raster_and_its_world_file_are_read(tmp_path):
    path = tiff(tmp_path / "use.tif")
    (tmp_path / "use.tfw").write_text("5\n0\n0\n-5\n385002.5\n6671997.5\n")
    with open_raster(path) as source:
        assert source.crs is not None


@pytest.mark.parametrize("name", ["roads.geojson", "roads.gpkg", "roads.shp", "roads.kml"])
def test_virtual_layers_are_refused_whatever_their_name(tmp_path, server, name):
    address, asked = server
    (tmp_path / name).write_text(
        '<OGRVRTDataSource><OGRVRTLayer name="a"><SrcDataSource>/vsicurl/'
        f"{address}/x</SrcDataSource></OGRVRTLayer></OGRVRTDataSource>"
    )
    with pytest.raises(InputError, match="leads to other places"):
        read_layer(tmp_path / name, CRS, BOX, None)
    assert not asked


@pytest.mark.parametrize("inner", ["a.vrt", "a.geojson", "a.shp"])
def test_virtual_layers_are_refused_in_a_zip(tmp_path, server, inner):
    address, asked = server
    text = f"<OGRVRTDataSource><OGRVRTLayer><SrcDataSource>/vsicurl/{address}/x</SrcDataSource>"
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(inner, f"{text}</OGRVRTLayer></OGRVRTDataSource>")
    with pytest.raises(InputError):
        read_layer(tmp_path / "a.zip", CRS, BOX, None)
    assert not asked


def test_of_a_zip_gdal_is_given_the_one_file_of_layers(tmp_path):
    roads(tmp_path / "roads.shp")
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for part in tmp_path.glob("roads.*"):
            archive.write(part, f"folder/{part.name}")
        archive.writestr("more.vrt", "<OGRVRTDataSource/>")
    assert str(vector_source(tmp_path / "a.zip").path).endswith("}/folder/roads.shp")
    assert len(read_layer(tmp_path / "a.zip", CRS, BOX, None).geometry) == 1


def test_names_in_a_zip_stay_in_it(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("../a.geojson", '{"type": "FeatureCollection", "features": []}')
    with pytest.raises(InputError, match="names within the ZIP"):
        read_layer(tmp_path / "a.zip", CRS, BOX, None)


def test_gml_needs_its_schema_and_nothing_is_written_beside_it(tmp_path):
    path, schema = roads(tmp_path / "roads.gml"), tmp_path / "roads.xsd"
    assert len(read_layer(path, CRS, BOX, None).geometry) == 1
    assert sorted(inner.name for inner in tmp_path.iterdir()) == ["roads.gml", "roads.xsd"]
    text = schema.read_text()
    schema.write_text(
        text.replace("<xs:element", '<xs:include schemaLocation="/x"/><xs:element', 1)
    )
    with pytest.raises(InputError, match="includes other files"):
        read_layer(path, CRS, BOX, None)
    schema.unlink()
    with pytest.raises(InputError, match=r"its schema roads\.xsd"):
        read_layer(path, CRS, BOX, None)
    assert sorted(inner.name for inner in tmp_path.iterdir()) == ["roads.gml"]


@pytest.mark.parametrize(
    "mark", [b"<!DOCTYPE kml [<!ENTITY x SYSTEM 'file:///etc/hostname'>]>", b""]
)
def test_xml_brings_in_no_other_files(tmp_path, mark):
    body = b'<?xml version="1.0"?>' + mark + b'<kml xmlns="http://www.opengis.net/kml/2.2">'
    body += b"<Document><Placemark><name>a</name><LineString><coordinates>24.94,60.16 24.95,60.17"
    body += b"</coordinates></LineString></Placemark></Document></kml>"
    (tmp_path / "a.kml").write_bytes(body)
    if mark:
        with pytest.raises(InputError, match="leads to other places"):
            vector_source(tmp_path / "a.kml")
    else:
        assert vector_source(tmp_path / "a.kml").options == {}


@pytest.mark.parametrize("suffix", [".dbf", ".shx", ".prj"])
def test_pipes_beside_a_shapefile_are_refused(tmp_path, suffix):
    roads(tmp_path / "roads.shp")
    (tmp_path / f"roads{suffix}").unlink()
    os.mkfifo(tmp_path / f"roads{suffix}")
    with pytest.raises(InputError, match="pipe"):
        vector_source(tmp_path / "roads.shp")


def test_a_pipe_and_a_device_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero")):
        began_s = time.perf_counter()
        with pytest.raises(InputError, match="pipe, socket or device"):
            open_input(path)
        with pytest.raises(InputError, match="pipe, socket or device"):
            read_input(path, 10, "a file")
        assert time.perf_counter() - began_s < 5


# Each reads its argument; all in one process of their own, which a pipe would hold for ever.
READERS = """
import sys
from pathlib import Path
import mapfilter as mf
from mapfilter.errors import MapfilterError
from mapfilter.config.load import load_config
from mapfilter.gnss.almanacs import read_yuma
from mapfilter.learning.patch import read_patch
from mapfilter.positioning.estimate_store import read_estimate
from mapfilter.radio.plan_files import read_cell_plan
from mapfilter.radio.msi import read_msi
from mapfilter.radio.tables import read_table
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.landuse import read_landuse
from mapfilter.roads.maps import map_bounds_deg
from mapfilter.roads.vector import read_layer
from mapfilter.roads.raster import raster_lattice
from mapfilter.survey.read_measurements import read_measurements
from mapfilter.tracks.readers.formats import format_of, read_recording
from mapfilter.tracks.table_files import read_table as read_log_table
from mapfilter.workflows.info import run_info
from mapfilter._io import sha256_file
from mapfilter._json_files import read_json
"""


def test_every_reader_refuses_a_pipe(tmp_path):
    calls = {
        "x.toml": "load_config(p, [])", "yuma.txt": "read_yuma(p)", "a.json": "read_json(p)",
        "b.json": "sha256_file(p)", "e.parquet": "read_estimate(p)", "plan.csv":
        f"read_cell_plan(p, '{CRS}')", "a.msi": "read_msi(p)", "t.csv": "read_table(p, 'x')",
        "a.tif": "open_rasters(p)", "b.tif": "raster_lattice(p, 5.0)", "a.osm.pbf":
        "map_bounds_deg(p)", "a.osm": "map_bounds_deg(p)", "a.osm.gz": "map_bounds_deg(p)",
        "a.gpkg": f"read_layer(p, '{CRS}', {BOX}, None)", "a.parquet":
        f"read_layer(p, '{CRS}', {BOX}, None)", "drive.csv": "read_measurements([p])",
        "folder/drive.csv": "read_measurements([p.parent])", "rec.nmea": "read_recording(p)",
        "motion.csv": "read_log_table('motion', p)", "motion.parquet":
        "read_log_table('motion', p)", "i.csv": "run_info(p)", "a.asc": "open_rasters(p)",
        "a.bil": "open_rasters(p)", "n.patch": "read_patch(p)",
    }  # fmt: skip
    lines = READERS.splitlines()
    for name, call in calls.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        os.mkfifo(path)
        lines += [f"p = Path({str(path)!r})", "try:", f"    {call}", f"    print('READ {name}')"]
        lines += ["except MapfilterError as error:", f"    print('refused {name}', error)"]
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, timeout=100,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    said = done.stdout.splitlines()
    assert not [line for line in said if line.startswith("READ")]
    assert sum(line.startswith("refused") for line in said) == len(calls)


def with_table_of(path, target, form):
    """Write a database of which one table is what SQLite calls virtual: a file elsewhere."""
    roads(path, driver=form, layer="roads")
    with contextlib.closing(sqlite3.connect(path)) as database:
        database.execute("PRAGMA writable_schema = ON")
        made = f"CREATE VIRTUAL TABLE other USING VirtualOGR('{target}')"
        row = "INSERT INTO sqlite_master VALUES ('table', 'other', 'other', 0, ?)"
        database.execute(row, (made,))
        if form == "GPKG":
            listed = "INSERT INTO gpkg_contents (table_name, data_type, identifier, srs_id) "
            database.execute(f"{listed} VALUES ('other', 'attributes', 'other', 0)")
        database.commit()
    return path


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(("form", "suffix"), [("SQLite", "sqlite"), ("GPKG", "gpkg")])
def test_a_table_of_another_file_or_address_is_not_opened(tmp_path, server, form, suffix, packed):
    address, asked = server
    path = with_table_of(tmp_path / f"a.{suffix}", f"/vsicurl/{address}/x.geojson", form)
    if packed:
        with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
            archive.write(path, path.name)
        path = tmp_path / "a.zip"
    assert read_layer(path, CRS, BOX, "roads").number.size == 1
    with pytest.raises(InputError):
        read_layer(path, CRS, BOX, "other")
    with contextlib.suppress(InputError):
        run_info(path)
    assert not asked
    assert pyogrio.get_gdal_config_option("OGR_SQLITE_STATIC_VIRTUAL_OGR") is None


def swapped_after_check(path, monkeypatch):
    """Put something else in a file's place as soon as it was found to be a regular file."""
    check = _inputs._check_regular

    def checked(checked_path, mode, kind):
        check(checked_path, mode, kind)
        if Path(checked_path) == path:
            path.unlink()
            path.write_bytes(b"of somebody else")

    monkeypatch.setattr(_inputs, "_check_regular", checked)


def test_what_was_checked_is_what_is_read(tmp_path, monkeypatch):
    """And not what took its place under the same name."""
    log = tmp_path / "log"
    rows = pd.DataFrame({"time_s": [0.0, 1.0], "x_mps2": 1.0, "y_mps2": 0.0, "z_mps2": 9.8})
    motion = pd.DataFrame({"time_s": [0.0, 1.0], "step_m": 1.0, "heading_rad": 0.0})
    write_log(make_log(CRS, motion=motion), log, sensors={"accelerometer": rows})
    estimate = tmp_path / "estimate.parquet"
    write_estimate(TrackEstimate.of_fixes(CRS, "candidate", ()), estimate)
    layer = tmp_path / "roads.parquet"
    line = shapely.LineString([(385100, 6671100), (385900, 6671900)])
    geopandas.GeoDataFrame({"a": [1]}, geometry=[line], crs=CRS).to_parquet(layer)
    runs = tmp_path / "runs.parquet"
    pq.write_table(SCHEMA.empty_table(), runs)
    monkeypatch.setattr(vector, "vector_source", lambda _: None)
    for path, read in (
        (estimate, lambda: read_estimate(estimate)),
        (log / "motion.parquet", lambda: read_log_table("motion", log / "motion.parquet")),
        (log / "sensors" / "accelerometer.parquet", lambda: read_sensors(log)),
        (runs, lambda: read_runs(runs)),
        (layer, lambda: read_layer(layer, CRS, BOX, None, [])),
    ):
        with monkeypatch.context() as patch:
            swapped_after_check(path, patch)
            read()
        assert path.read_bytes() == b"of somebody else", path


DOORS = {"_inputs.py", "_gdal.py", "_ogr.py", "roads/vector.py"}
"""Modules that may open what others made, or give GDAL what has passed a door."""
ALLOWED = {
    # Files that mapfilter wrote itself, listed by a head with their checksums.
    ("database/", "open_parquet"), ("database/", "read_metadata"),
    ("experiments/", "read_metadata"),
    ("experiments/", "open_parquet"), ("experiments/", "load"), ("database/export.py", "open"),
    ("positioning/estimate_store.py", "open_parquet"), ("learning/tracks.py", "load"),
    ("survey/survey_rasters.py", "load"), ("survey/survey_rasters.py", "open"),
    # From files that a door opened, or from bytes that were read.
    ("tracks/sensors.py", "read_csv"), ("tracks/sensors.py", "open_parquet"),
    ("tracks/table_files.py", "read_csv"), ("tracks/table_files.py", "open_parquet"),
    ("tracks/readers/texts/lines.py", "read_csv"),
    ("positioning/fingerprints/tables.py", "read_csv"),
    ("experiments/benchmarks/ottawa_sessions.py", "read_csv"), ("radio/tables.py", "ZipFile"),
    ("radio/placemarks.py", "ZipFile"),
    ("tracks/readers/texts/zipped.py", "ZipFile"), ("tracks/readers/texts/zipped.py", "open"),
    ("roads/osm_xml.py", "read_dataframe"), ("roads/osm_xml.py", "GzipFile"),
    ("roads/osm_xml.py", "open"),
    ("tracks/readers/contained/data_frames.py", "open_parquet"),
    # What has passed the door for vector files, with GDAL sealed.
    ("tracks/readers/contained/sheets_and_layers.py", "list_layers"),
    ("tracks/readers/contained/sheets_and_layers.py", "read_dataframe"),
    ("workflows/descriptions/geo.py", "list_layers"),
    ("workflows/descriptions/geo.py", "read_info"),
    ("viewing/page.py", "GzipFile"),
    # Who calls it is listed here by `open_parquet`.
    ("_arrow.py", "ParquetFile"),
    # The null device, in place of an output that the caller closed.
    ("workflows/outputs/guard.py", "open"),
    # Parts of the page that come with the package.
    ("viewing/page.py", "read_text"),
    ("experiments/recorded/denver.py", "read_csv"), ("experiments/recorded/mall.py", "open"),
    # An empty file that is locked only.
    ("_alone.py", "open"),
    # New files; journeys; the kernel's own; the code of a custom filter, which runs anyway.
    ("workflows/replays/logs.py", "open"), ("rasters/geotiff_writer.py", "open"),
    ("_io.py", "open"),
    ("database/estimate.py", "read_text"), ("_code.py", "read_bytes"), ("_replace.py", "read_text"),
    ("_workers.py", "open"), ("database/parquet.py", "open"), ("serving/store.py", "open"),
    ("positioning/custom_filter.py", "read_bytes"),
}  # fmt: skip
OPENING = {
    "open", "read_text", "read_bytes", "read_csv", "read_table", "read_metadata", "ParquetFile",
    "ZipFile", "GzipFile", "read_dataframe", "list_layers", "read_info", "read_parquet", "load",
    "loadtxt", "genfromtxt", "fromfile", "read_file", "read_excel", "read_json",
}  # fmt: skip
LIBRARIES = {"pd", "pq", "np", "rasterio", "pyogrio", "gzip", "zipfile", "geopandas", "os", "io"}


def openings():
    """Return (file, function) of each call that opens a file other than by a door."""
    for file in sorted(ROOT.rglob("*.py")):
        place = file.relative_to(ROOT).as_posix()
        if place in DOORS:
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            if isinstance(node.func, ast.Name) and node.func.id in ("open", "open_parquet"):
                yield place, node.func.id
            if not isinstance(node.func, ast.Attribute) or node.func.attr not in OPENING:
                continue
            of = node.func.value
            owner = of.id if isinstance(of, ast.Name) else ""
            of_path = node.func.attr in ("open", "read_text", "read_bytes")
            if owner in LIBRARIES or (
                of_path and owner not in ("Ways", "OpenMap", "cls", "journeys")
            ):
                yield place, node.func.attr


def test_every_file_is_opened_by_a_door():
    found = set(openings())
    assert ("_io.py", "open") in found
    strange = {
        (place, name)
        for place, name in found
        if not any(place.startswith(start) and name == known for start, known in ALLOWED)
    }
    assert not strange
