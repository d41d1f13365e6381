"""Places that a CRS names, and pipes under the names of a satellite's data beside a raster."""

import json
import os
import subprocess
import sys

import geopandas
import numpy as np
import pyogrio
import pyproj
import pytest
import rasterio
import shapely

from mapfilter._gdal import open_raster
from mapfilter._inputs import named_file
from mapfilter.errors import InputError
from mapfilter.geodesy import known_crs, projected_crs
from mapfilter.roads.vector import read_layer

CRS = "EPSG:32635"
BOX = (385000.0, 6671000.0, 386000.0, 6672000.0)


def features(crs):
    lon, lat = pyproj.Transformer.from_crs(CRS, "EPSG:4326", always_xy=True).transform(
        [385100.0, 385900.0], [6671100.0, 6671900.0]
    )
    line = {"type": "LineString", "coordinates": [[lon[0], lat[0]], [lon[1], lat[1]]]}
    feature = {"type": "Feature", "properties": {"type": "link"}, "geometry": line}
    return {"type": "FeatureCollection", "crs": crs, "features": [feature]}


@pytest.mark.parametrize("kind", ["link", "url"])
@pytest.mark.parametrize("key", ["href", "url"])
def test_an_address_of_a_crs_is_refused_and_not_asked(tmp_path, server, kind, key):
    address, asked = server
    address += "/crs"
    path = tmp_path / "roads.geojson"
    path.write_text(json.dumps(features({"type": kind, "properties": {key: address}})))
    with pytest.raises(InputError, match="an address of its CRS"):
        read_layer(path, CRS, BOX, None)
    assert not asked


def test_an_address_that_hides_is_not_asked_either(tmp_path, server, monkeypatch):
    address, asked = server
    address += "/crs"
    for name in ("no_proxy", "NO_PROXY"):
        monkeypatch.delenv(name, raising=False)
    path = tmp_path / "roads.geojson"
    text = json.dumps(features({"properties": {"href": address}, "type": "link"}))
    path.write_text(text.replace('"crs"', '"\\u0063rs"'))
    assert read_layer(path, CRS, BOX, None).number.size == 1
    assert not asked
    # It is such a request that the seal keeps GDAL from.
    pyogrio.read_info(path)
    assert asked


def test_a_named_crs_and_properties_called_link_are_read(tmp_path):
    path = tmp_path / "roads.geojson"
    named = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
    path.write_text(json.dumps(features(named)))
    assert read_layer(path, CRS, BOX, None).number.size == 1


GRID = "+proj=utm +zone=35 +ellps=bessel +units=m +nadgrids={}"


def forms(file):
    """Return CRSs that name a file, as text of each dialect and as JSON."""
    bound = pyproj.CRS(GRID.format(file))
    text = bound.to_wkt()
    method = f"PROJ-based operation method: +proj=pipeline +step +proj=hgridshift +grids={file}"
    return {
        "proj": GRID.format(file),
        "init": f"+init={file}:x",
        "wkt": text,
        "json": json.dumps(bound.to_json_dict()),
        "parsed": bound.to_json_dict(),
        "method": text[: text.find("ABRIDGED")]
        + f'ABRIDGEDTRANSFORMATION["x",METHOD["{method}"]]]',
    }


@pytest.mark.parametrize("form", ["proj", "init", "wkt", "json", "parsed", "method"])
def test_a_crs_that_names_a_file_is_refused_before_it_is_opened(tmp_path, form):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="a CRS without files"):
        projected_crs(forms(tmp_path / "pipe")[form])


def test_grids_of_proj_are_named_without_a_folder():
    for text in (CRS, "EPSG:3857", GRID.format("@null"), GRID.format("BETA2007.gsb")):
        assert known_crs(text) is not None
    assert named_file(GRID.format("C:\\grids\\a.gsb"))
    assert named_file("x" * 10 + "grids=" * 100_000) == ""


def test_a_layer_whose_crs_names_a_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    line = shapely.LineString([(385100, 6671100), (385900, 6671900)])
    frame = geopandas.GeoDataFrame({"a": [1]}, geometry=[line], crs=forms(tmp_path / "pipe")["wkt"])
    with pytest.raises(InputError, match="a CRS without files"):
        read_layer(frame, CRS, BOX, None)


BESIDE = """
import sys
from pathlib import Path
from mapfilter._gdal import open_raster
from mapfilter.errors import InputError
try:
    with open_raster(Path(sys.argv[1])) as source:
        source.tags()
except InputError as error:
    sys.exit("refused" if "pipe" in str(error) else 1)
"""
NAMES = ["use.xml", "use_rpc.txt", "use_MTL.txt", "summary.txt", "METADATA.DIM", "use.rpc", "a.imd"]
NAMES += ["use.pass", "use.tfw", "USE.TFW", "use_metadata.xml", "use.tif.aux.xml", "use.pvl"]


def plain_raster(folder):
    """Write a small GeoTIFF."""
    path = folder / "use.tif"
    with rasterio.open(
        path, "w", driver="GTiff", width=8, height=8, count=1, dtype="uint8", crs=CRS,
        transform=rasterio.Affine(5, 0, 385000, 0, -5, 6672000),
    ) as target:  # fmt: skip
        target.write(np.zeros((1, 8, 8), "uint8"))
    return path


def opened_elsewhere(path):
    """Open a raster in a process that may hang."""
    return subprocess.run(
        [sys.executable, "-c", BESIDE, str(path)], capture_output=True, text=True, timeout=60,
        check=False,
    )  # fmt: skip


def test_pipes_beside_a_raster_are_refused(tmp_path):
    path = plain_raster(tmp_path)
    for name in NAMES:
        os.mkfifo(tmp_path / name)
        with pytest.raises(InputError, match="pipe"), open_raster(path):
            pass
        (tmp_path / name).unlink()
    # What GDAL does not look for is nobody's business.
    os.mkfifo(tmp_path / "debug-pipe")
    (tmp_path / "use.xml").symlink_to(tmp_path / "gone")
    done = opened_elsewhere(path)
    assert done.returncode == 0, done.stderr


def test_a_link_to_itself_hides_no_pipe(tmp_path):
    path = plain_raster(tmp_path)
    (tmp_path / "a.xml").symlink_to("a.xml")
    assert opened_elsewhere(path).returncode == 0
    os.mkfifo(tmp_path / "use.tfw")
    assert "refused" in opened_elsewhere(path).stderr
