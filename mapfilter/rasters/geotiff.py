"""Reading rasters of cells from GeoTIFF files, once their headers are checked."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.windows import Window as RasterioWindow

from mapfilter._gdal import open_raster, reason_of
from mapfilter._types import Floats32
from mapfilter.errors import Faults, InputError, MapfilterError, fail
from mapfilter.geodesy import projected_crs, same_crs, shown_crs
from mapfilter.lattice import Lattice
from mapfilter.radio.cell_rules import id_fault
from mapfilter.rasters.files import Declared, Quantity, RasterFile, Window, without_nodata

READINGS_TAG = "READINGS_SHA256"
"""Tag of a survey's rasters: the checksum of the file with its readings."""
QUANTITY_TAG = "MAPFILTER_QUANTITY"
"""Tag of a file that states which quantity its bands hold."""
_UNITS: dict[str, Quantity] = {"dbm": "level", "db": "loss"}
_FROM_POWER = "export dBm, or convert powers: dBm = 10 log10(P / 1 mW)"
_FROM_FIELD = "export received levels in dBm: those of a field depend on the frequency"
_OTHER_UNITS = {
    **dict.fromkeys(("w", "mw", "nw", "pw", "watt", "watts", "milliwatt"), _FROM_POWER),
    **dict.fromkeys(("dbw",), "export dBm, or add 30 dB"),
    **dict.fromkeys(("dbuv/m", "dbuv", "v/m", "mv/m", "uv/m", "dbu"), _FROM_FIELD),
}
"""Units of other quantities, and what to do about them."""
_KINDS: tuple[Quantity, ...] = ("level", "loss", "deviation")
_INDEX_ENTRY_BYTES = 4
_MOST_BLOCKS_LOOKED_AT = 20_000
_SQUARE_TOLERANCE = 1e-6


def tag_of(path: Path, name: str) -> str | None:
    """Return a tag of a GeoTIFF; None without it, or where the file cannot be read."""
    try:
        with open_raster(path) as source:
            found = source.tags().get(name)
    except (MapfilterError, RasterioError, UnicodeDecodeError):
        return None
    return None if found is None else str(found)


@dataclass(frozen=True, slots=True)
class GeoTiff(RasterFile):
    """A GeoTIFF or COG with square, north-up pixels."""

    def read(self, bands: Sequence[int], window: Window) -> Floats32:
        """Read bands in a window; see :meth:`RasterFile.read`."""
        row, col, rows, cols = window
        bands, numbers = list(bands), [band + 1 for band in bands]
        try:
            with open_raster(self.path, quiet=False) as source:
                values = _masked(source, numbers, RasterioWindow(col, row, cols, rows))
                scales, offsets = np.array(source.scales)[bands], np.array(source.offsets)[bands]
        except (RasterioError, UnicodeDecodeError) as error:
            got, hint = reason_of(error), "cut off or damaged"
            raise fail(InputError, str(self.path), "readable pixels", got, hint) from error
        values = without_nodata(values, self.nodata)
        if (scales != 1).any() or (offsets != 0).any():
            scaled = values * scales[:, None, None] + offsets[:, None, None]
            values = without_nodata(scaled.astype(np.float32), ())
        return values


def open_geotiff(path: Path, cell_id: str, declared: Declared) -> GeoTiff:
    """Read the header of a GeoTIFF; ``cell_id`` names a single band without a description."""
    faults = Faults()
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", NotGeoreferencedWarning)
            with open_raster(path, quiet=False) as source:
                _check_extent_of_file(path, source)
                names = tuple(str(name or "") for name in source.descriptions)
                described = names != ("",)
                names = names if described else (cell_id,)
                _check_bands(str(path), names, source.dtypes, faults)
                _check_scale(str(path), source, declared.factor, faults)
                _check_units(str(path), source, faults)
                lattice = _lattice(str(path), source, declared.crs, not caught, faults)
                quantity, tagged = _quantity(source), QUANTITY_TAG in source.tags()
                # Those beside it, such as .aux.xml, change what is read.
                beside = sorted(path.with_name(Path(name).name) for name in source.files)
    except (RasterioError, UnicodeDecodeError) as error:
        got, hint = reason_of(error), "cut off, or no raster"
        raise fail(InputError, str(path), "a raster that GDAL can read", got, hint) from error
    faults.raise_if_any(InputError)
    nodata = () if declared.nodata is None else (declared.nodata,)
    place = cast(Lattice, lattice)
    parts = tuple(dict.fromkeys((path, *(file for file in beside if file.is_file()))))
    return GeoTiff(path, names, place, nodata, parts, quantity, tagged, described)


def _masked(source: Any, bands: list[int], window: Any) -> Floats32:
    """Read bands, NaN where the file's own mask or nodata value applies."""
    # Each of these properties asks the file about all of its bands.
    masks, empty = source.mask_flag_enums, source.nodatavals
    flags = {flag.name for band in bands for flag in masks[band - 1]}
    own = {empty[band - 1] for band in bands}
    if flags <= {"all_valid", "nodata"} and all(n is None or math.isnan(n) for n in own):
        return np.asarray(source.read(bands, window=window, out_dtype=np.float32))
    data = source.read(bands, window=window, masked=True)
    return cast(Floats32, data.astype(np.float32).filled(np.nan))


def _quantity(source: Any) -> Quantity | None:
    if tagged := source.tags().get(QUANTITY_TAG):
        return next((kind for kind in _KINDS if kind == tagged), None)
    named = {_UNITS.get((unit or "").strip().lower()) for unit in source.units}
    return named.pop() if len(named) == 1 else None


def _lattice(
    where: str, source: Any, declared: str | None, placed: bool, faults: Faults
) -> Lattice | None:
    """Return the lattice of the pixels, or None; faults of the file are added to ``faults``."""
    crs = None
    try:
        text = source.crs.to_wkt() if source.crs else declared
        crs = projected_crs(text, f"{where}, CRS")
        if declared is not None and not same_crs(crs, declared):
            expected = f"{shown_crs(declared)}, as declared"
            faults.add(f"{where}, CRS", expected, shown_crs(crs), "two systems mixed up")
    except InputError as error:
        faults.found.extend(error.faults)
    t = source.transform
    if not placed or t.is_identity:
        faults.add(f"{where}, transform", "where the pixels lie", "nothing", "exported without it")
    elif not all(map(math.isfinite, (t.a, t.b, t.c, t.d, t.e, t.f))):
        faults.add(f"{where}, transform", "finite numbers", f"{t.a}, {t.c}, {t.f}")
    elif t.b != 0 or t.d != 0:
        faults.add(f"{where}, transform", "rows that run east", "a rotated raster")
    elif t.e >= 0 or t.a <= 0:
        got, hint = (
            f"pixels of {t.a:g} x {t.e:g}",
            "a raster upside down or mirrored; gdalwarp turns it",
        )
        faults.add(f"{where}, transform", "row 0 in the north, column 0 in the west", got, hint)
    elif crs is None:
        # Of degrees the sides of a pixel are of no use.
        return None
    elif abs(t.a + t.e) > _SQUARE_TOLERANCE * t.a:
        side = f"{min(t.a, -t.e):g}"
        hint = f"gdalwarp -tr {side} {side} -r bilinear {Path(where).name} TO.tif makes them square"
        faults.add(f"{where}, transform", "square pixels", f"{t.a:g} m x {-t.e:g} m", hint)
    else:
        return Lattice(crs, t.c, t.f, t.a, source.height, source.width)
    return None


def _check_scale(where: str, source: Any, factor: float, faults: Faults) -> None:
    """Check that numbers are not multiplied twice: by the file's own scale and by a factor."""
    scale = next((scale for scale in source.scales if scale != 1), None)
    if factor != 1 and scale is not None:
        expected = f"no factor, as the file states its own scale, {scale:g}, which is applied"
        hint = "leave the factor out; gdal_translate -unscale writes numbers without a scale"
        faults.add(f"{where}, scale", expected, f"a factor of {factor:g}", hint)


def _check_units(where: str, source: Any, faults: Faults) -> None:
    """Check that the bands' unit is none of another quantity, whatever is declared."""
    for unit in sorted({(unit or "").strip() for unit in source.units}):
        if hint := _OTHER_UNITS.get(unit.lower().replace("\u00b5", "u").replace("\u03bc", "u")):
            expected = "levels in dBm, or losses in dB"
            faults.add(f"{where}, unit", expected, repr(unit), hint)


def _check_bands(where: str, names: tuple[str, ...], dtypes: Sequence[str], faults: Faults) -> None:
    nameless = [str(i) for i, name in enumerate(names, start=1) if not name]
    if nameless:
        bands = ", ".join(nameless[:10])
        faults.add(f"{where}, band {bands}", "a cell id as band description", "none")
    for name in filter(None, names):
        if wrong := id_fault(name):
            faults.add(f"{where}, band {name!r}", *wrong)
    for name, count in Counter(filter(None, names)).items():
        if count > 1:
            faults.add(f"{where}, bands", "each cell once", f"{name!r} {count} times")
    for kind in sorted({kind for kind in dtypes if "complex" in kind}):
        faults.add(f"{where}, bands", "real numbers", kind)


def _check_extent_of_file(path: Path, source: Any) -> None:
    """Compare the size by the header of a TIFF with that of the file."""
    size_bytes = path.stat().st_size
    rows_px, cols_px = source.block_shapes[0]
    down, across = -(-source.height // rows_px), -(-source.width // cols_px)
    by_band = str(source.interleaving).lower().endswith("band")
    planes = source.count if by_band else 1
    hint = "the file is cut off, or its header is damaged"
    if down * across * planes * _INDEX_ENTRY_BYTES > size_bytes:
        got = f"{size_bytes} bytes for {source.height} x {source.width} x {source.count} pixels"
        raise fail(InputError, str(path), "as many bytes as its header needs", got, hint)
    needed, blocks = 0, down * across
    step = max(1, -(-blocks * planes // _MOST_BLOCKS_LOOKED_AT))
    for band in range(1, planes + 1):
        # Backwards, because a file that is cut off lacks its last blocks.
        for number in range(blocks - 1, -1, -step):
            block = f"{number % across}_{number // across}"
            offset = source.get_tag_item(f"BLOCK_OFFSET_{block}", "TIFF", bidx=band)
            length = source.get_tag_item(f"BLOCK_SIZE_{block}", "TIFF", bidx=band)
            needed = max(needed, int(offset or 0) + int(length or 0))
    if needed == 0:
        raise fail(InputError, str(path), "pixels", "a header without any", hint)
    if needed > size_bytes:
        raise fail(InputError, str(path), f"at least {needed} bytes", f"{size_bytes} bytes", hint)
