"""Inputs of the digests, by plain formulas: a map, a plan, rasters, a log, configurations.

Nothing here calls mapfilter, so that these inputs stay as they are whatever changes there.
"""

import csv
import json
import math
from pathlib import Path

import numpy as np
import rasterio
from pyproj import Transformer
from rasterio.transform import Affine

CRS = "EPSG:32635"
WEST_M, NORTH_M, PIXEL_M, ROWS, COLS = 385_000.0, 6_673_600.0, 5.0, 180, 220
BLOCK_M, MARGIN_M = 100.0, 50.0
SITES_M = ((150.0, 200.0), (900.0, 250.0), (520.0, 720.0))
AZIMUTHS_DEG = (20.0, 140.0, 260.0)
SPEED_MPS, SECONDS, GSM_STEP_M = 1.4, 480, 553.5
START_UTC_S = 1_700_000_000.0
LOG = "walk"
SATELLITES = {"G03": (40.0, 25.0), "G07": (130.0, 60.0), "E11": (250.0, 35.0), "E19": (330.0, 50.0)}

CONFIG = """[area]
map = "streets.osm"
bbox = {bbox}
resolution_m = 5.0
[cells]
plan = "cells.csv"
[rasters]
path = "rxlev.tif"
[database]
path = "out/database"
floor_dbm = -110.0
tile_px = 64
[journeys]
radio = "as_predicted"
length_m = 400
[filter]
margin_db = 3.0
update_length_m = 10.0
[filter.bayes]
max_particles = 6000
min_search_particles = 4000
[sweep]
sigma_orient_deg = [3, 10]
routes = 3
draws = 2
[[sweep.readings]]
name = "candidates"
filter = "candidate"
[[sweep.readings]]
name = "bayes"
filter = "bayes"
[output]
dir = "out"
pictures = "none"
"""

MADE_CITY = """[area]
map = "synthetic"
size_m = [900, 900]
southwest = [3.0, 0.0]
seed = 5
"""


def write_inputs(folder: Path) -> None:
    """Write the map, the cell plan, the rasters, the log and the configurations."""
    east, north = crossings()
    _write_map(folder / "streets.osm", east, north)
    cells = _cells()
    with (folder / "cells.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, tuple(cells[0]))
        writer.writeheader()
        writer.writerows(cells)
    levels_dbm = _levels(cells)
    _write_rasters(folder / "rxlev.tif", cells, levels_dbm)
    _write_log(folder / LOG, cells, levels_dbm, east, north)
    (folder / "world.toml").write_text(CONFIG.format(bbox=_box_deg()), encoding="utf-8")
    (folder / "made.toml").write_text(MADE_CITY, encoding="utf-8")


def crossings() -> tuple[np.ndarray, np.ndarray]:
    """Return east and north of the crossings: a grid of 100 m, each up to 25 m aside."""
    down, along = np.indices((8, 10)).astype(float)
    aside = np.random.default_rng(11).uniform(-25.0, 25.0, (2, 8, 10))
    east = WEST_M + MARGIN_M + 0.5 * BLOCK_M + BLOCK_M * along + aside[0]
    north = NORTH_M - MARGIN_M - 0.5 * BLOCK_M - BLOCK_M * down + aside[1]
    return east, north


def _cells() -> list[dict[str, object]]:
    return [
        {
            "cell": f"{'XYZ'[site]}{'ABC'[sector]}",
            "site": "XYZ"[site],
            "east": WEST_M + at[0],
            "north": NORTH_M - at[1],
            "crs": CRS,
            "height_m": 30.0,
            "azimuth_deg": azimuth,
            "eirp_dbm": 50.0,
            "frequency_mhz": 1800.0,
            "arfcn": 600 + 3 * site + sector,
            "bsic": 10 + site,
        }
        for site, at in enumerate(SITES_M)
        for sector, azimuth in enumerate(AZIMUTHS_DEG)
    ]


def _levels(cells: list[dict[str, object]]) -> np.ndarray:
    """Return levels (C, rows, cols): distance, sector, and waves of about 60 m in place of clutter.

    Rounded to 0.01 dB, as rasters are.
    """
    row, col = np.indices((ROWS, COLS))
    east, north = WEST_M + PIXEL_M * (col + 0.5), NORTH_M - PIXEL_M * (row + 0.5)
    found = []
    for number, cell in enumerate(cells):
        x, y = east - float(str(cell["east"])), north - float(str(cell["north"]))
        off = np.arctan2(x, y) - math.radians(float(str(cell["azimuth_deg"])))
        aside = np.abs(np.arctan2(np.sin(off), np.cos(off)))
        waves = np.sin(east / (9.0 + number)) + np.cos(north / (8.0 + 0.5 * number) + number)
        level = -35.0 - 32.0 * np.log10(np.hypot(x, y) + 15.0) + 70.0
        found.append(level - np.minimum(12.0 * (aside / 0.57) ** 2, 25.0) - 40.0 + 3.0 * waves)
    return np.round(np.array(found), 2)


def _write_rasters(path: Path, cells: list[dict[str, object]], levels_dbm: np.ndarray) -> None:
    profile = {
        "driver": "GTiff", "dtype": "float32", "count": len(cells), "crs": CRS, "height": ROWS,
        "width": COLS, "transform": Affine(PIXEL_M, 0, WEST_M, 0, -PIXEL_M, NORTH_M),
    }  # fmt: skip
    with rasterio.open(path, "w", **profile) as target:
        for band, cell in enumerate(cells, start=1):
            target.write(levels_dbm[band - 1].astype(np.float32), band)
            target.set_band_description(band, str(cell["cell"]))
            target.set_band_unit(band, "dBm")


def _lonlat(east: np.ndarray, north: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    turned = Transformer.from_crs(CRS, "EPSG:4326", always_xy=True)
    lon, lat = turned.transform(np.ravel(east), np.ravel(north))
    return np.asarray(lon), np.asarray(lat)


def _box_deg() -> list[float]:
    east = np.array([WEST_M + MARGIN_M, WEST_M + COLS * PIXEL_M - MARGIN_M])
    north = np.array([NORTH_M - ROWS * PIXEL_M + MARGIN_M, NORTH_M - MARGIN_M])
    lon, lat = _lonlat(east, north)
    return [round(float(value), 6) for value in (lon[0], lat[0], lon[1], lat[1])]


def _write_map(path: Path, east: np.ndarray, north: np.ndarray) -> None:
    lon, lat = _lonlat(east, north)
    number = np.arange(1, east.size + 1).reshape(east.shape)
    names = ("minlon", "minlat", "maxlon", "maxlat")
    bounds = " ".join(f'{n}="{v}"' for n, v in zip(names, _box_deg(), strict=True))
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


def _walk(east: np.ndarray, north: np.ndarray) -> np.ndarray:
    """Return the positions each second (K, 2) of a walk from crossing to crossing."""
    rng = np.random.default_rng(23)
    at, last, corners = (4, 1), (4, 0), []
    for _ in range(12):
        corners.append((east[at], north[at]))
        steps = [(at[0] + a, at[1] + b) for a, b in ((0, 1), (0, 1), (1, 0), (-1, 0))]
        open_to = [to for to in steps if to != last and 0 <= to[0] < 8 and 0 <= to[1] < 10]
        at, last = open_to[int(rng.integers(len(open_to)))], at
    path = np.array(corners)
    gone_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    wanted_m = SPEED_MPS * np.arange(SECONDS + 1)
    return np.stack([np.interp(wanted_m, gone_m, axis) for axis in path.T], axis=1)


def _write_log(
    folder: Path, cells: list[dict[str, object]], levels_dbm: np.ndarray,
    east: np.ndarray, north: np.ndarray,
) -> None:  # fmt: skip
    rng = np.random.default_rng(31)
    place = _walk(east, north)
    time_s = np.arange(len(place), dtype=float)
    step = np.diff(place, axis=0)
    length_m = np.hypot(*step.T) * 1.01 + rng.normal(0.0, 0.1, len(step))
    heading = np.arctan2(step[:, 1], step[:, 0])
    heading += math.radians(2.0) + rng.normal(0.0, math.radians(4.0), len(step))
    tables: dict[str, list[tuple[object, ...]]] = {
        "motion": list(zip(time_s[1:], length_m, heading, strict=True)),
        "radio": [],
        "gnss": [],
        "pseudoranges": [],
        "truth": list(zip(time_s, *place.T, strict=True)),
    }
    serving = None
    for second in range(0, len(place), 2):
        x, y = place[second]
        at = int((NORTH_M - y) // PIXEL_M), int((x - WEST_M) // PIXEL_M)
        heard = np.round(levels_dbm[:, at[0], at[1]] + rng.normal(0.0, 5.0, len(cells)))
        order = np.argsort(-heard, kind="stable")
        if serving is None or heard[order[0]] > heard[serving] + 4.0:
            serving = int(order[0])
        cell = cells[serving]
        away_m = math.hypot(x - float(str(cell["east"])), y - float(str(cell["north"])))
        steps = int(away_m // GSM_STEP_M)
        first = (cell["cell"], cell["arfcn"], cell["bsic"], heard[serving], 0, steps)
        tables["radio"].append((second, "serving", *first))
        for other in [one for one in order[:5] if one != serving][:4]:
            row = ("", cells[other]["arfcn"], cells[other]["bsic"], heard[other], 0, "")
            tables["radio"].append((second, "neighbour", *row))
        if 300 <= second < 340:
            fix = place[second] + rng.normal(0.0, 8.0, 2)
            tables["gnss"].append((second, *fix, 64.0, 64.0, 0.0))
        if 380 <= second < 440:
            tables["pseudoranges"] += _ranges(second, x, y, rng)
    heads = {
        "motion": ("time_s", "step_m", "heading_rad"),
        "radio": (
            "time_s", "role", "cell", "arfcn", "bsic", "level_dbm", "censored", "timing_advance",
        ),
        "gnss": (
            "time_s", "east_m", "north_m", "var_east_m2", "var_north_m2", "cov_east_north_m2",
        ),
        "pseudoranges": ("time_s", "satellite", "pseudorange_m", "x_m", "y_m", "z_m"),
        "truth": ("time_s", "east_m", "north_m"),
    }  # fmt: skip
    folder.mkdir()
    head = {"crs": CRS, "start_utc_s": START_UTC_S}
    (folder / "log.json").write_text(json.dumps(head), encoding="utf-8")
    for name, rows in tables.items():
        with (folder / f"{name}.csv").open("w", encoding="utf-8", newline="") as stream:
            csv.writer(stream).writerows([heads[name], *rows])


def _ranges(second: int, x: float, y: float, rng: np.random.Generator) -> list[tuple[object, ...]]:
    """Return pseudoranges to satellites that stand still in the sky of a receiver at 100 m."""
    lon, lat = np.radians([float(one[0]) for one in _lonlat(np.array([x]), np.array([y]))])
    turned = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    here = np.array(turned.transform(math.degrees(lon), math.degrees(lat), 100.0))
    east = np.array([-math.sin(lon), math.cos(lon), 0.0])
    up = np.array([math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)])
    north = np.cross(up, east)
    rows: list[tuple[object, ...]] = []
    for name, angles in SATELLITES.items():
        azimuth, elevation = np.radians(angles)
        level = math.sin(azimuth) * east + math.cos(azimuth) * north
        there = here + 2.2e7 * (math.cos(elevation) * level + math.sin(elevation) * up)
        range_m = 2.2e7 + 1e4 + 3.0 * second + rng.normal(0.0, 2.0 / math.sin(elevation))
        rows.append((second, name, range_m, *there))
    return rows
