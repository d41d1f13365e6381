"""Sites in the zone of UTM that its rule without exceptions gives to western Norway."""

import numpy as np
import rasterio
from check_world import make_world
from command_line import assert_refused, mapfilter

from mapfilter.check.findings import Findings
from mapfilter.geodesy import project, utm_crs
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.workflows.checks.places import check_sites

BERGEN = 5.32, 60.39


def test_sites_in_zone_31_are_found_about_bergen():
    crs = utm_crs(*BERGEN)
    east, north = (float(value) for value in project(crs, *BERGEN))
    lattice = Lattice(crs, east - 2000, north + 2000, 10.0, 400, 400)
    lon, lat = BERGEN[0] + np.arange(4) / 200, BERGEN[1] + np.arange(4) / 400
    places = zip(*project("EPSG:32631", lon, lat), strict=True)
    cells = [
        Cell(id=f"C{at}", site=f"S{at}", east_m=float(x), north_m=float(y), height_m=30.0,
             azimuth_deg=0.0, eirp_dbm=50.0, frequency_mhz=1800.0)
        for at, (x, y) in enumerate(places)
    ]  # fmt: skip
    findings = Findings()
    check_sites(CellPlan(crs, tuple(cells)), lattice, "cells.csv", findings)
    (found,) = findings.found
    assert found.code == "crs-mixed"
    assert "With their numbers read as EPSG:32631, 4 of them lie inside" in found.evidence


def test_rasters_in_web_mercator_are_reported_as_build_reports_them(tmp_path):
    """100 m of it are 50 m in Helsinki."""
    world = make_world(tmp_path, {})
    world.landuse = None
    world.write()
    lattice = Lattice("EPSG:3857", 2_775_000.0, 8_438_000.0, 10.0, 40, 40)
    cells = [row["cell"] for row in world.rows]
    write_rasters(world.rasters, lattice, [(one, np.full((40, 40), -70.0)) for one in cells], cells)
    (finding,) = mapfilter("check", "-c", world.toml, "--json").json["findings"]
    assert finding["code"] == "crs-mixed"
    told = "found EPSG:3857, of which 100 m are 50 m"
    assert told in finding["evidence"]
    assert_refused(mapfilter("build", "-c", world.toml), told)


def test_rasters_in_degrees_are_to_be_projected(tmp_path):
    world = make_world(tmp_path, {})
    world.landuse = None
    world.write()
    cells = [row["cell"] for row in world.rows]
    with rasterio.open(
        world.rasters, "w", driver="GTiff", height=40, width=40, count=len(cells),
        dtype="float32", crs="EPSG:4326", transform=rasterio.Affine(1e-4, 0, 24.9, 0, -1e-4, 60.2),
    ) as target:  # fmt: skip
        target.write(np.full((len(cells), 40, 40), -70.0, dtype="float32"))
        target.descriptions = cells
    (finding,) = mapfilter("check", "-c", world.toml, "--json").json["findings"]
    assert finding["code"] == "degrees-for-metres"
    assert "gdalwarp" in finding["remedy"]
