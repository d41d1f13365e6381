"""A small world whose inputs go together: a plan, rasters by rule, a map of a grid of streets."""

import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import rasterio
from rasterio.transform import Affine

from mapfilter.geodesy import unproject
from mapfilter.lattice import Lattice
from mapfilter.propagation.models import PredictionModel
from mapfilter.propagation.predict import predict
from mapfilter.radio.cells import Cell, CellPlan

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385_000.0, 6_673_600.0, 10.0, 150, 190)
SITES = {
    "S1": (385_420.0, 6_673_230.0, (20.0, 140.0, 260.0)),
    "S2": (386_350.0, 6_672_600.0, (0.0, 120.0, 240.0)),
    "S3": (386_410.0, 6_673_290.0, (70.0, 200.0, 310.0)),
}
COLUMNS = (
    "cell",
    "site",
    "lat",
    "lon",
    "height_m",
    "azimuth_deg",
    "antenna",
    "eirp_dbm",
    "frequency_mhz",
    "indoor",
    "penetration_loss_db",
)


def make_plan():
    cells = [
        Cell(f"{site}{'ABC'[n]}", site, east, north, 30.0, azimuth, 43.0, 1800.0 + n)
        for site, (east, north, azimuths) in SITES.items()
        for n, azimuth in enumerate(azimuths)
    ]
    inside = Cell(
        "I1", "I1", 385_900.0, 6_672_700.0, 5.0, None, 30.0, 1835.0, antenna="omni", indoor=True
    )
    return CellPlan(CRS, (*cells, inside))


@dataclass
class CheckWorld:
    """What a test changes before it writes the files and has them checked."""

    folder: Path
    rows: list[dict[str, object]]
    levels: dict[str, np.ndarray]
    lattice: Lattice = LATTICE
    quantity: str = "level"
    settings: tuple[str, ...] = ()
    landuse: np.ndarray | None = None
    landuse_shift_m: float = 0.0

    def row(self, cell_id):
        return next(row for row in self.rows if row["cell"] == cell_id)

    def change(self, name, function):
        for row in self.rows:
            if row[name] != "":
                row[name] = function(row[name])

    def each(self, function):
        self.levels = {cell_id: function(values) for cell_id, values in self.levels.items()}

    def rename(self, names):
        """Give rasters other labels."""
        self.levels = {names.get(cell_id, cell_id): v for cell_id, v in self.levels.items()}

    def in_metres(self, crs=None):
        """Give positions as east and north, with a column crs or without."""
        for row, cell in zip(self.rows, make_plan().cells, strict=True):
            del row["lat"], row["lon"]
            row |= {"east": cell.east_m, "north": cell.north_m} | ({"crs": crs} if crs else {})

    def set(self, *settings):
        self.settings = (*self.settings, *settings)

    @property
    def toml(self):
        return self.folder / "world.toml"

    @property
    def rasters(self):
        return self.folder / "rxlev.tif"

    def write(self):
        """Write plan, rasters and configuration."""
        with (self.folder / "cells.csv").open("w", encoding="utf-8", newline="") as stream:
            writer = csv.DictWriter(stream, tuple(self.rows[0]))
            writer.writeheader()
            writer.writerows(self.rows)
        if self.levels:
            write_tiff(self.rasters, self.lattice, self.levels, self.quantity)
        roads = ""
        if self.landuse is not None:
            write_landuse(self.folder, self.landuse, self.landuse_shift_m)
            roads = '[roads]\nlanduse = "landuse.tif"\nlanduse_table = "landuse.csv"\n'
        self.toml.write_text(
            f'{roads}[area]\nmap = "streets.osm"\nresolution_m = 10.0\nbbox = {list(box_deg())}\n'
            '[cells]\nplan = "cells.csv"\n[rasters]\npath = "rxlev.tif"\n',
            encoding="utf-8",
        )


def base_levels():
    """Levels by the log-distance law with sectors and shadowing."""
    model = PredictionModel(model="log_distance", shadowing_db=6.0)
    plan = make_plan()
    return {cell_id: np.array(values) for cell_id, values in predict(plan, LATTICE, None, model)}


def make_world(folder, levels):
    plan = make_plan()
    lon, lat = unproject(CRS, [c.east_m for c in plan.cells], [c.north_m for c in plan.cells])
    rows = []
    for cell, x, y in zip(plan.cells, lon, lat, strict=True):
        azimuth = "" if cell.azimuth_deg is None else cell.azimuth_deg
        values = (
            cell.id,
            cell.site,
            round(float(y), 7),
            round(float(x), 7),
            cell.height_m,
            azimuth,
            cell.antenna,
            cell.eirp_dbm,
            cell.frequency_mhz,
            int(cell.indoor),
            0,
        )
        rows.append(dict(zip(COLUMNS, values, strict=True)))
    write_map(folder / "streets.osm")
    landuse = np.ones((LATTICE.rows, LATTICE.cols))
    copies = {cell_id: values.copy() for cell_id, values in levels.items()}
    return CheckWorld(folder, rows, copies, landuse=landuse)


def box_deg():
    """The lattice's box, 120 m inside, in degrees."""
    west, south, east, north = LATTICE.bounds_m
    lon, lat = unproject(CRS, [west + 120, east - 120], [south + 120, north - 120])
    return tuple(round(float(value), 6) for value in (lon[0], lat[0], lon[1], lat[1]))


def write_tiff(path, lattice, levels, quantity):
    """Write as a planner's tool does: plain bands, the quantity told by the unit."""
    profile = {
        "driver": "GTiff",
        "dtype": "float32",
        "count": len(levels),
        "crs": lattice.crs,
        "height": lattice.rows,
        "width": lattice.cols,
        "transform": Affine.from_gdal(*lattice.gdal_transform),
    }
    with rasterio.open(path, "w", **profile) as target:
        for band, (name, values) in enumerate(levels.items(), start=1):
            target.write(values.astype(np.float32), band)
            target.set_band_description(band, name)
            if quantity:
                target.set_band_unit(band, "dBm" if quantity == "level" else "dB")


def write_map(path):
    """Write streets in a grid of 150 m, in and about the lattice."""
    west, south, east, north = LATTICE.bounds_m
    xs, ys = np.arange(west - 300, east + 301, 150), np.arange(south - 300, north + 301, 150)
    x, y = np.meshgrid(xs, ys)
    lon, lat = unproject(CRS, x.ravel(), y.ravel())
    number = np.arange(1, x.size + 1).reshape(x.shape)
    box = zip(("minlon", "minlat", "maxlon", "maxlat"), box_deg(), strict=True)
    bounds = " ".join(f'{name}="{value}"' for name, value in box)
    lines = ["<?xml version='1.0' encoding='UTF-8'?>", '<osm version="0.6">', f"<bounds {bounds}/>"]
    lines += [
        f'<node id="{i}" lat="{b:.7f}" lon="{a:.7f}" version="1"/>'
        for i, a, b in zip(number.ravel(), lon, lat, strict=True)
    ]
    for way, nodes in enumerate((*number, *number.T), start=1):
        refs = "".join(f'<nd ref="{node}"/>' for node in nodes)
        tag = '<tag k="highway" v="residential"/>'
        lines.append(f'<way id="{way}" version="1">{refs}{tag}</way>')
    path.write_text("\n".join([*lines, "</osm>"]), encoding="utf-8")


def write_landuse(folder, values, shift_m):
    """Write a land-use raster of one walkable class, and its table."""
    transform = Affine(10, 0, LATTICE.west_m + shift_m, 0, -10, LATTICE.north_m + shift_m)
    profile = {"driver": "GTiff", "dtype": "uint8", "count": 1, "crs": CRS, "transform": transform}
    rows, cols = values.shape
    with rasterio.open(folder / "landuse.tif", "w", height=rows, width=cols, **profile) as target:
        target.write(values.astype(np.uint8), 1)
    table = "value,class,walkable\n1,street,1\n"
    (folder / "landuse.csv").write_text(table, encoding="utf-8")


def shifted(east_m, north_m, crs=CRS):
    return replace(
        LATTICE, west_m=LATTICE.west_m + east_m, north_m=LATTICE.north_m + north_m, crs=crs
    )
