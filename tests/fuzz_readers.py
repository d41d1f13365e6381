"""Every reader of a file that others made, with a small good file of its format."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator
from pathlib import Path

import geopandas
import numpy as np
import pandas as pd
import rasterio
import shapely
from fuzz_command import Target
from made_maps import AREA, write_pbf, write_xml
from made_maps import CRS as MAP_CRS
from made_recordings import MADE
from made_workbook import workbook

from mapfilter.config.load import load_config
from mapfilter.gnss.almanacs import read_yuma
from mapfilter.lattice import Lattice
from mapfilter.positioning.fingerprints.tables import read_fingerprint_table
from mapfilter.radio.msi import read_msi
from mapfilter.radio.plan_files import read_cell_plan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.landuse import read_landuse
from mapfilter.roads.layers import read_layer_roads
from mapfilter.roads.osm import read_ways
from mapfilter.survey.read_measurements import read_measurements
from mapfilter.tracks.log import make_log
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.store import read_log, write_log
from mapfilter.workflows.info import run_info
from mapfilter.workflows.inputs.measured import recorded_rows

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 12, 9)
_SHOWN = ("raster GeoTIFF", "layer gpkg", "layer fgb", "map osm.gz", "recording csv", "cell plan")
WAYS = [
    (1, {"highway": "residential", "oneway": "yes"}, [(10, 10), (60, 10), (61, 40)]),
    (2, {"highway": "footway"}, [(50, 50), (90, 50), (90, 80)]),
]


def targets(folder: Path) -> Iterator[Target]:
    """Write a good file of each format, and yield it with its reader; some with ``info``, too."""
    for one in _readers(folder):
        yield one
        if one.name in _SHOWN:
            yield Target(f"info {one.name}", one.path, run_info)


def _readers(folder: Path) -> Iterator[Target]:
    for name, (file, text, *_) in MADE.items():
        path = _new(folder, f"recording {name}") / file
        path.write_bytes(text.encode())
        yield Target(f"recording {name}", path, read_recording)
    yield from _rasters(folder)
    yield from _maps(folder)
    yield from _logs(folder)
    yield from _tables(folder)


def _new(folder: Path, name: str) -> Path:
    path = folder / name.replace("/", "-")
    path.mkdir()
    return path


def _rasters(folder: Path) -> Iterator[Target]:
    level = np.linspace(-120, -60, 108).reshape(12, 9).round()

    def read(path: Path) -> None:
        rasters = open_rasters(path, "level", crs=CRS)
        rows, cols = min(rasters.lattice.rows, 256), min(rasters.lattice.cols, 256)
        rasters.read((0, 0, rows, cols), rasters.cell_ids[:4])

    path = _new(folder, "raster GeoTIFF") / "x.tif"
    write_rasters(path, LATTICE, [("A", level), ("B", level - 3)], ["A", "B"])
    yield Target("raster GeoTIFF", path, read)
    path = _new(folder, "raster ASCII grid") / "x.asc"
    rows = "\n".join(" ".join(f"{value:g}" for value in row) for row in level)
    head = "NCOLS 9\nNROWS 12\nXLLCORNER 385000\nYLLCORNER 6672940\nCELLSIZE 5\n"
    path.write_text(f"{head}NODATA_VALUE -9999\n{rows}\n")
    yield Target("raster ASCII grid", path, read)
    own = _new(folder, "raster Planet index")
    (own / "A1.bin").write_bytes(level.astype(">i2").tobytes())
    index = own / "index.txt"
    index.write_text("A1.bin 385000 385045 6672940 6673000 5\n")
    for path in (index, own / "A1.bin"):
        yield Target(f"raster Planet {path.name}", path, lambda _: read(index))
    own = _new(folder, "land use")
    table = own / "table.csv"
    table.write_text("class,walkable,value\nroad,1,1\nwater,0,2\n")
    profile = {"driver": "GTiff", "width": 9, "height": 12, "count": 1, "dtype": "uint8"}
    place = rasterio.Affine(5, 0, 385000, 0, -5, 6673000)
    with rasterio.open(own / "x.tif", "w", crs=CRS, transform=place, **profile) as target:
        target.write(np.arange(108, dtype=np.uint8).reshape(1, 12, 9) % 2 + 1)
    yield Target("land use", table, lambda path: read_landuse(own / "x.tif", path, LATTICE))


def _maps(folder: Path) -> Iterator[Target]:
    def ways(path: Path) -> object:
        return read_ways(path, "walking", *AREA)

    for name, write in (("a.osm.pbf", write_pbf), ("a.osm", write_xml), ("a.osm.gz", write_xml)):
        path = _new(folder, f"map {name}") / name
        write(path, WAYS, [])
        yield Target(f"map {name[2:]}", path, ways)
    _, (west, south, _, _) = AREA
    lines = [shapely.LineString([(west + 10, south + 10), (west + 300, south + 40 * i)])
             for i in range(4)]  # fmt: skip
    frame = geopandas.GeoDataFrame({"kind": list("abcd")}, geometry=lines, crs=MAP_CRS)
    for name in ("a.shp", "a.gpkg", "a.geojson", "a.fgb", "a.parquet"):
        path = _new(folder, f"layer {name}") / name
        if name.endswith("parquet"):
            frame.to_parquet(path)
        else:
            frame.to_file(path)
        yield Target(f"layer {name[2:]}", path, lambda path: read_layer_roads(path, *AREA))


def _logs(folder: Path) -> Iterator[Target]:
    time_s = np.arange(60.0)
    motion = pd.DataFrame({"time_s": time_s, "step_m": 1.4, "heading_rad": 0.01 * time_s})
    radio = pd.DataFrame({"time_s": time_s, "role": "serving", "cell": "S1A", "level_dbm": -80.0})
    log = make_log(CRS, motion=motion, radio=radio)
    for form in ("csv", "parquet"):
        own = folder / f"log {form}"
        write_log(log, own, form)
        # Without the checksums, which would refuse each copy.
        (own / "log.json").write_text(json.dumps({"crs": CRS, "notes": ["made"]}))
        for file in (f"motion.{form}", f"radio.{form}"):
            yield Target(f"log {file}", own / file, lambda path: read_log(path.parent))
    yield Target("log log.json", own / "log.json", lambda path: read_log(path.parent))


def _tables(folder: Path) -> Iterator[Target]:
    own = _new(folder, "tables")

    def made(name: str, text: str) -> Path:
        path = own / name
        path.write_text(text)
        return path

    plan = "cell,lat,lon,height_m,eirp_dbm,frequency_mhz,azimuth_deg\n" + "".join(
        f"S{i},60.17{i},24.94{i},30,55,950,{40 * i}\n" for i in range(9)
    )
    yield Target("cell plan", made("plan.csv", plan), lambda path: read_cell_plan(path, CRS))
    yield from _placemarks(own)
    cuts = "".join(f"{i} {abs(i - 180) / 9:.1f}\n" for i in range(360))
    head = "NAME one\nFREQUENCY 947\nGAIN 15 dBd\nTILT ELECTRICAL 3\n"
    msi = f"{head}HORIZONTAL 360\n{cuts}VERTICAL 360\n{cuts}"
    yield Target("antenna pattern", made("one.msi", msi), read_msi)
    rows = "".join(f"S1A,60.17{i},24.94{i},-8{i},2026-05-01T10:00:0{i}Z\n" for i in range(9))
    survey = made("survey.csv", f"cell,lat,lon,level_dbm,time\n{rows}")
    yield Target("measurements", survey, lambda path: read_measurements([path]))
    names = ("cell", "lat", "lon", "level_dbm", "time")
    records = [dict(zip(names, line.split(","), strict=True)) for line in rows.splitlines()]
    drive = made("drive.json", json.dumps(records))
    yield Target("measurements json", drive, _measured)
    book = own / "drive.xlsx"
    book.write_bytes(workbook([[*names], *([*record.values()] for record in records)]))
    yield Target("measurements xlsx", book, _measured)
    reports = "".join(f"-6{i},-7{i},100,{10 * i},{5 * i}\n" for i in range(9))
    table = made("reports.csv", f"WAP001,WAP002,WAP003,x,y\n{reports}")
    yield Target("fingerprints", table, lambda path: read_fingerprint_table(path, CRS))
    toml = '[area]\nmap = "helsinki"\nresolution_m = 5.0\n[database]\nmargin_db = 6.0\n'
    yield Target("configuration", made("area.toml", toml), lambda path: load_config(path, []))
    block = (
        "******** Week 300 almanac for PRN-01 ********\nID: 01\nHealth: 000\n"
        "Eccentricity: 0.5E-002\nTime of Applicability(s): 319488.0000\n"
        "Orbital Inclination(rad): 0.96\nRate of Right Ascen(r/s): -0.78E-008\n"
        "SQRT(A)  (m 1/2): 5153.6\nRight Ascen at Week(rad): 0.13E+001\n"
        "Argument of Perigee(rad): 0.8\nMean Anom(rad): 0.2E+001\nAf0(s): 0.1E-003\n"
        "Af1(s/s): 0.0\nweek: 300\n\n"
    )
    yield Target("almanac", made("almanac.txt", block), read_yuma)


def _measured(path: Path) -> None:
    read_measurements([path], recorded=recorded_rows)


def _placemarks(folder: Path) -> Iterator[Target]:
    data = {"height_m": 30, "eirp_dbm": 55, "frequency_mhz": 950}
    marks = "".join(
        f"<Placemark><name>S{i}</name><ExtendedData>"
        + "".join(
            f'<Data name="{name}"><value>{value}</value></Data>'
            for name, value in {**data, "azimuth_deg": 40 * i}.items()
        )
        + f"</ExtendedData><Point><coordinates>24.94{i},60.17{i}</coordinates></Point></Placemark>"
        for i in range(9)
    )
    text = f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{marks}</Document></kml>'
    path = folder / "plan.kml"
    path.write_text(text)
    yield Target("cell plan kml", path, lambda path: read_cell_plan(path, CRS))
    path = folder / "plan.kmz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("doc.kml", text)
    yield Target("cell plan kmz", path, lambda path: read_cell_plan(path, CRS))
