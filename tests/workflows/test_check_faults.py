"""Each planted fault is found under its own name, and nothing else is."""

import numpy as np
import pytest
import rasterio
from check_world import box_deg, make_world, shifted
from command_line import mapfilter
from rasterio.transform import Affine

from mapfilter.check import site_checks as check_peaks
from mapfilter.check.place_fits import place_fits
from mapfilter.lattice import Lattice


@pytest.fixture
def world(tmp_path, levels):
    return make_world(tmp_path, levels)


def check(world):
    world.write()
    outcome = mapfilter("check", "-c", world.toml, "--json", *world.settings)
    assert outcome.err == ""
    found = outcome.json
    assert found["ok"] == all(f["severity"] != "error" for f in found["findings"])
    assert outcome.code == (0 if found["ok"] else 2)
    for finding in found["findings"]:
        assert set(finding) == {"code", "severity", "where", "evidence", "remedy"}
        assert all(finding.values())
    return found["findings"]


def quantised(values):
    return np.clip(np.floor(values + 111), 0, 63)


def transpose(world):
    world.each(lambda v: v.T.copy())
    rows, cols = world.lattice.cols, world.lattice.rows
    world.lattice = Lattice(
        world.lattice.crs, world.lattice.west_m, world.lattice.north_m, 10.0, rows, cols
    )


def loss(world, quantity):
    eirp = {row["cell"]: float(row["eirp_dbm"]) for row in world.rows}
    world.levels = {i: eirp[i] - values for i, values in world.levels.items()}
    world.quantity = quantity


def put(world, cell_id, **values):
    world.row(cell_id).update(values)


def holed(values, number):
    values = values.copy()
    values[:40, :30] = number
    return values


def dotted(values, number):
    """A number in three pixels, at odd places of a lattice that is looked at by samples."""
    values = values.copy()
    values[100:103, 57] = number
    return values


def weakest(levels, number):
    """Levels, a number in place of the weaker half."""
    return np.where(levels < np.median(levels), number, levels)


def whole(losses, top):
    """Whole losses, the weakest third taken for not predicted."""
    return np.where(losses > np.quantile(losses, 0.67), top, np.round(losses))


def swap_degrees(world):
    for row in world.rows:
        row["lat"], row["lon"] = row["lon"], row["lat"]


def swap_metres(world):
    world.in_metres()
    for row in world.rows:
        row["east"], row["north"] = row["north"], row["east"]


def with_zone(world):
    """Write the number of the zone before the eastings, as EPSG:4647 has it."""
    world.in_metres()
    for row in world.rows:
        row["east"] = 35e6 + float(row["east"])


def in_unsigned_bytes(world):
    """Store levels in bytes with a sign, and read them without it."""
    world.each(lambda v: np.round(np.clip(v, -128, -1)) + 256)


def exchange_sites(world):
    """Give the rasters of all sectors of two sites the labels of one another."""
    there = {f"S1{sector}": f"S3{sector}" for sector in "ABC"}
    world.rename(there | {new: old for old, new in there.items()})


def move_site(world, beside=None):
    """Put a site where it is not: in the west, or beside another."""
    lat, lon = 60.1725, 24.9400
    if beside is not None:
        lat, lon = world.row(f"{beside}A")["lat"] + 0.0004, world.row(f"{beside}A")["lon"] + 0.0008
    for sector in "ABC":
        put(world, f"S3{sector}", lat=lat, lon=lon)


def in_feet(world):
    world.in_metres()
    for name in ("east", "north"):
        world.change(name, lambda metres: round(metres / 0.3048, 1))


def drop_cells(world):
    world.rows = [row for row in world.rows if row["cell"] != "S1B"]


def part_of_the_roads(world):
    west, south, east, north = box_deg()
    world.set(f"--set=area.bbox={west - 0.004},{south},{east},{north}")
    world.landuse = None


def in_watts(world):
    world.change("eirp_dbm", lambda eirp: round(10 ** (eirp / 10 - 3), 1))


def pattern_files(world):
    for row in world.rows:
        row["antenna"] = "K742215" if row["azimuth_deg"] != "" else "omni"


ERRORS = [
    ("axes-swapped", transpose),
    ("axes-swapped", lambda w: w.each(lambda v: v[::-1].copy())),
    ("axes-swapped", lambda w: w.each(lambda v: v[:, ::-1].copy())),
    ("loss-as-level", lambda w: loss(w, "level")),
    ("level-as-loss", lambda w: setattr(w, "quantity", "loss")),
    ("levels-without-sign", lambda w: w.each(np.negative)),
    ("levels-without-sign", lambda w: (setattr(w, "quantity", "loss"), w.each(np.negative))),
    ("rxlev-as-level", lambda w: w.each(quantised)),
    ("values-implausible", in_unsigned_bytes),
    ("field-strength", lambda w: w.each(lambda v: v + 142.3)),
    ("azimuth-radians", lambda w: w.change("azimuth_deg", lambda a: round(np.radians(a), 4))),
    ("azimuth-gons", lambda w: w.change("azimuth_deg", lambda a: a / 0.9)),
    ("azimuth-counter-clockwise", lambda w: w.change("azimuth_deg", lambda a: -a % 360)),
    ("azimuth-counter-clockwise", lambda w: w.change("azimuth_deg", lambda a: (90 - a) % 360)),
    ("azimuth-off-by-90", lambda w: w.change("azimuth_deg", lambda a: (a + 90) % 360)),
    ("azimuth-off-by-90", lambda w: w.change("azimuth_deg", lambda a: (a - 90) % 360)),
    ("azimuth-off-by-180", lambda w: w.change("azimuth_deg", lambda a: (a + 180) % 360)),
    ("sector-labels-swapped", lambda w: w.rename({"S1A": "S1C", "S1C": "S1A"})),
    ("sector-labels-swapped", lambda w: w.rename({"S2A": "S2B", "S2B": "S2C", "S2C": "S2A"})),
    ("azimuth-off-lobe", lambda w: put(w, "S3A", azimuth_deg=250)),
    ("site-labels-swapped", lambda w: w.rename({"S1A": "S2B", "S2B": "S1A"})),
    ("site-labels-swapped", exchange_sites),
    ("site-off-peak", lambda w: put(w, "I1", lat=60.1755, lon=24.9590)),
    ("site-off-peak", move_site),
    ("site-off-peak", lambda w: move_site(w, "S2")),
    ("cell-without-raster", lambda w: w.levels.pop("S3B")),
    ("raster-without-cell", drop_cells),
    ("duplicate-id", lambda w: put(w, "S1B", cell="S1A")),
    ("crs-mixed", lambda w: setattr(w, "lattice", shifted(0, 0, "EPSG:32634"))),
    ("crs-mixed", lambda w: w.in_metres("EPSG:32634")),
    ("crs-mixed", with_zone),
    ("lon-lat-swapped", swap_degrees),
    ("lon-lat-swapped", lambda w: w.set("--set=area.bbox=60.17,24.93,60.18,24.96")),
    ("east-north-swapped", swap_metres),
    ("feet-for-metres", in_feet),
    ("eirp-watts", lambda w: w.change("eirp_dbm", lambda _: 500)),
    ("eirp-watts", lambda w: (in_watts(w), w.each(lambda v: v + 20))),
    ("frequency-unit", lambda w: w.change("frequency_mhz", lambda f: f / 1000)),
    ("identical-rasters", lambda w: w.levels.update(S2C=w.levels["S2B"])),
    ("nodata-as-level", lambda w: w.each(lambda v: holed(v, -9999))),
    ("nodata-as-level", lambda w: w.each(lambda v: holed(v, 0))),
    ("nodata-as-level", lambda w: w.levels.update(S1C=holed(w.levels["S1C"], 0))),
    ("nodata-as-level", lambda w: w.levels.update(S1C=weakest(w.levels["S1C"], -1))),
    ("nodata-as-level", lambda w: w.each(lambda v: weakest(v, -200))),
    ("nodata-as-level", lambda w: w.levels.update(S1C=dotted(w.levels["S1C"], -1))),
    ("nodata-as-level", lambda w: (loss(w, "loss"), w.each(lambda v: whole(v, 255)))),
    ("nodata-as-level", lambda w: (loss(w, "loss"), w.each(lambda v: whole(v, 65535)))),
    ("nodata-as-level", lambda w: (loss(w, "loss"), w.each(lambda v: holed(v, -9999)))),
    ("raster-constant", lambda w: w.levels.update(I1=np.full_like(w.levels["I1"], -80))),
    ("quantity-unknown", lambda w: setattr(w, "quantity", "")),
    ("roads-outside-rasters", lambda w: setattr(w, "lattice", shifted(9000, 0))),
    ("map-invalid", lambda w: (w.folder / "streets.osm").unlink()),
]


@pytest.mark.parametrize(
    ("code", "plant"), ERRORS, ids=[f"{n}-{code}" for n, (code, _) in enumerate(ERRORS)]
)
def test_planted_faults(code, plant, world):
    plant(world)
    found = check(world)
    if code == "identical-rasters":
        # A copy goes against its azimuth, too.
        found = [f for f in found if f["code"] != "azimuth-off-lobe"]
    assert {f["code"] for f in found} == {code}, found
    assert {f["severity"] for f in found} == {"error"}


WARNINGS = [
    ("half-pixel-shift", lambda w: setattr(w, "lattice", shifted(5, -5))),
    ("half-pixel-shift", lambda w: setattr(w, "landuse_shift_m", 5.0)),
    ("eirp-watts", lambda w: in_watts(w)),
    ("levels-above-eirp", lambda w: w.each(lambda v: v + 40)),
    ("antenna-missing", pattern_files),
    ("raster-empty", lambda w: w.levels.update(I1=np.full_like(w.levels["I1"], np.nan))),
    ("rasters-missing", lambda w: w.levels.clear()),
    ("roads-outside-rasters", part_of_the_roads),
]


@pytest.mark.parametrize(
    ("code", "plant"), WARNINGS, ids=[f"{n}-{code}" for n, (code, _) in enumerate(WARNINGS)]
)
def test_planted_doubts(code, plant, world):
    plant(world)
    found = check(world)
    assert {(f["code"], f["severity"]) for f in found} == {(code, "warning")}, found


def test_a_site_beside_the_area_is_a_note(world):
    put(world, "I1", lat=60.1700, lon=24.9180)
    (found,) = check(world)
    assert (found["code"], found["severity"]) == ("site-outside-area", "note")


def test_of_many_sites_only_those_about_the_best_place_are_tried(world, monkeypatch):
    tried = []
    monkeypatch.setattr(check_peaks, "_SITES", 1)
    monkeypatch.setattr(
        check_peaks,
        "place_fits",
        lambda squares, places_m: tried.extend(places_m) or place_fits(squares, places_m),
    )
    exchange_sites(world)
    assert [f["code"] for f in check(world)] == ["site-labels-swapped"]
    on_a_grid_and_at_the_peak = 10 * 10 + 1
    assert len(tried) == (on_a_grid_and_at_the_peak + 2) * len(world.rows)


def test_nothing_is_found_in_a_clean_world(world):
    assert check(world) == []


def test_nothing_is_found_in_clean_streets(world):
    world.landuse = None
    assert check(world) == []


def test_nothing_is_found_in_clean_losses(world):
    loss(world, "loss")
    assert check(world) == []


def test_text_is_a_paragraph_for_each_finding(world):
    world.rename({"S1A": "S1C", "S1C": "S1A"})
    world.levels.pop("S3B")
    world.write()
    outcome = mapfilter("check", "-c", world.toml)
    assert outcome.code == 2
    first, second = outcome.out.rstrip("\n").split("\n\n")
    assert first.startswith("error cell-without-raster: ")
    assert "1 of 10 cells have no raster: S3B." in first
    assert "S1A is of S1C, S1C is of S1A" in second
    assert second.endswith("Exchange the labels of the rasters, or the azimuths in the plan.")


def test_levels_that_a_build_refuses_in_one_tile_are_an_error(world):
    world.levels.update(S1A=world.levels["S1A"] + 75)
    given = "--set=database.tile_px=32"
    world.set(given)
    assert {(f["code"], f["severity"]) for f in check(world)} == {("values-implausible", "error")}


def test_text_of_a_clean_world(world):
    world.write()
    outcome = mapfilter("check", "-c", world.toml)
    assert (outcome.code, outcome.out) == (0, "Nothing found that looks wrong.\n")


def test_a_missing_antenna_is_an_error_where_rasters_are_to_be_predicted(world):
    pattern_files(world)
    world.levels.clear()
    (world.folder / "antennas").mkdir()
    world.set(f"--set=cells.antennas={world.folder / 'antennas'}")
    world.set(f"--set=output.dir={world.folder / 'out'}")
    world.write()
    text = world.toml.read_text(encoding="utf-8").replace('[rasters]\npath = "rxlev.tif"\n', "")
    world.toml.write_text(text, encoding="utf-8")
    outcome = mapfilter("check", "-c", world.toml, "--json", *world.settings)
    codes = {(f["code"], f["severity"]) for f in outcome.json["findings"]}
    assert (outcome.code, codes) == (2, {("antenna-missing", "error")})


def test_heights_in_feet(world):
    """They passed without a word."""
    for row in world.rows:
        row["height_m"] = round(float(row["height_m"]) / 0.3048)
    world.write()
    (finding,) = mapfilter("check", "-c", world.toml, "--json").json["findings"]
    assert (finding["code"], finding["severity"]) == ("feet-for-metres", "warning")
    assert "0.3048" in finding["remedy"]


def test_tilts_that_are_counted_upwards(world):
    for row in world.rows:
        row["downtilt_deg"] = -6
    world.write()
    (finding,) = mapfilter("check", "-c", world.toml, "--json").json["findings"]
    assert (finding["code"], finding["severity"]) == ("tilts-upwards", "warning")
    assert "9 cells" in finding["evidence"]
    assert "sign" in finding["remedy"]


def test_landuse_colours_that_the_table_does_not_have(world):
    world.landuse[20:23] = 7
    (found,) = check(world)
    assert found["code"] == "landuse-classes"
    assert "value 7 at " in found["evidence"]


@pytest.mark.parametrize(
    ("name", "code"),
    [("rxlev.tif", "rasters-invalid"), ("cells.csv", "plan-invalid"), ("landuse.tif", None)],
)
@pytest.mark.parametrize("share", [0, 0.3, 0.9])
def test_damaged_files_are_findings(name, code, share, world):
    world.write()
    whole = (world.folder / name).read_bytes()
    (world.folder / name).write_bytes(whole[: int(share * len(whole))])
    outcome = mapfilter("check", "-c", world.toml, "--json")
    assert (outcome.code, outcome.err) == (2, "")
    codes = {f["code"] for f in outcome.json["findings"]}
    assert (code or "landuse-invalid") in codes
    assert all(str(name) in f["where"] for f in outcome.json["findings"] if f["code"] == code)


def test_rasters_upside_down(world):
    world.write()
    with rasterio.open(world.rasters, "r+") as target:
        t = target.transform
        target.transform = Affine(t.a, 0, t.c, 0, -t.e, t.f + t.e * target.height)
    outcome = mapfilter("check", "-c", world.toml, "--json")
    assert [f["code"] for f in outcome.json["findings"]] == ["raster-upside-down"]


def test_a_configuration_that_cannot_be_read_is_an_error_as_everywhere(world):
    world.write()
    outcome = mapfilter("check", "-c", world.toml, "--set=area.box=1")
    assert (outcome.code, outcome.out) == (2, "")
    assert "found 'box'" in outcome.err
