"""Messages of GDAL that quote bytes of a file that are no text."""

import subprocess
import sys
from threading import Thread

import numpy as np
import pytest
import rasterio

from mapfilter._gdal import open_raster


def tiff(path):
    profile = {"driver": "GTiff", "width": 64, "height": 64, "count": 1, "dtype": "uint8"}
    profile |= {"crs": "EPSG:32635", "transform": rasterio.Affine(5, 0, 385000, 0, -5, 6672000)}
    with rasterio.open(path, "w", **profile) as target:
        target.write(np.full((1, 64, 64), 5, "uint8"))
    return path


@pytest.mark.parametrize("number", [0xFF, 0x9C])
def test_bytes_that_gdal_quotes_print_no_traceback(tmp_path, number):
    path = tiff(tmp_path / "a.tif")
    with rasterio.open(path, "r+") as target:
        target.update_tags(NOTE="of a band", OTHER="of another")
    good = path.read_bytes()
    at = good.index(b'<Item name="OTHER"') + len("<Item")
    path.write_bytes(good[:at] + bytes([number]) + b"u\0" + good[at + 3 :])
    # Python prints such a traceback by hooks that only a process of its own has as they are.
    code = f"from mapfilter._gdal import open_raster\nwith open_raster(Path({str(path)!r})): pass"
    run = [sys.executable, "-c", f"from pathlib import Path\n{code}"]
    done = subprocess.run(run, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_hooks_of_tracebacks_are_as_before(tmp_path):
    before, path = (sys.excepthook, sys.unraisablehook), tiff(tmp_path / "a.tif")
    first, second = open_raster(path), open_raster(path)
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    second.__exit__(None, None, None)
    assert (sys.excepthook, sys.unraisablehook) == before
    threads = [Thread(target=_open_often, args=(path,)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (sys.excepthook, sys.unraisablehook) == before


def _open_often(path):
    for _ in range(20):
        with open_raster(path):
            pass
