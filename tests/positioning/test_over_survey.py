"""The Bayes map filter over what a survey measured: a few cells by hand."""

import json
from dataclasses import replace

import numpy as np
import pytest

from mapfilter._json_files import sealed
from mapfilter.database.build import build
from mapfilter.database.measured import Deviations, MeasuredParts, Readings
from mapfilter.database.measured_files import read_measured, read_readings, write_readings
from mapfilter.database.merge import merge
from mapfilter.database.store import open_database
from mapfilter.errors import StoreError
from mapfilter.filters.belief_models import Cloud
from mapfilter.lattice import Lattice
from mapfilter.models.measured_map import MeasuredMapOptions
from mapfilter.models.street_motion import EAST, NORTH, STATES
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.bayes.over_survey import (
    SurveyedEvidence,
    filled_field,
    over_survey,
    site_of,
)
from mapfilter.positioning.bayes.sources.measured_model import MeasuredMapModel
from mapfilter.positioning.bayes.sources.radio import RadioSource
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.fingerprints.locating import fit_locator
from mapfilter.positioning.fingerprints.sources import reports_of_database
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.lattice import RouteLattice
from mapfilter.tracks.schema import SERVING

CRS = "EPSG:32618"
WEST, SOUTH, SIDE_M, SIZE = 445_000.0, 5_030_000.0, 10.0, 12
LATTICE = Lattice(CRS, WEST, SOUTH + SIZE * SIDE_M, SIDE_M, SIZE, SIZE)
CELLS = ("1-1-7-65537", "1-1-7-65538", "1-1-7-70000")


def cell(cell_id, **more):
    mcc, mnc, lac, ci = map(int, cell_id.split("-"))
    made = Cell(cell_id, cell_id, WEST, SOUTH, 20.0, None, 50.0, 800.0, "omni")
    return replace(made, mcc=mcc, mnc=mnc, lac=lac, ci=ci, **more)


def routes():
    """A street along row 4 and one along column 6."""
    row = np.array([4] * SIZE + [r for r in range(SIZE) if r != 4], dtype=np.int32)
    col = np.array([*range(SIZE)] + [6] * (SIZE - 1), dtype=np.int32)
    order = np.lexsort((col, row))
    row, col, count = row[order], col[order], len(row)
    return RouteLattice(
        LATTICE, row, col, np.full(count, 5), np.zeros(count, np.int16), ("residential",),
        np.zeros(count, np.float32), np.zeros(count, np.bool_),
    )  # fmt: skip


def served(count=40):
    """The first cell serves in the west, the third in the east."""
    east_m = WEST + np.linspace(5, 115, count)
    which = np.where(np.arange(count) < count // 2, 0, 2).astype(np.int32)
    advance = np.where(which == 0, 2.0, np.nan)
    number = np.arange(count, dtype=np.int32)
    return Readings(
        CELLS, which, number, number % 2, east_m, np.full(count, SOUTH + 75.0),
        -60.0 - number % 20, advance, np.ones(count, np.bool_),
    )  # fmt: skip


def rasters(folder, *, filled):
    """Cells 0 and 2 are measured in one half of the area each, cell 1 nowhere."""
    col = np.arange(SIZE)[None, :] + np.zeros((SIZE, 1))
    level = np.stack([-60 - col, np.full_like(col, -90.0), -80 + col])
    deviation = np.stack([np.where(col < 6, 4.0, np.nan), np.full_like(col, np.nan),
                          np.where(col >= 6, 2.5, np.nan)])  # fmt: skip
    if not filled:
        level[np.isnan(deviation)] = np.nan
    made = []
    for name, bands, quantity in (("level", level, "level"), ("sd", deviation, "deviation")):
        path = folder / f"{name}.tif"
        named = zip(CELLS, bands.astype(np.float32), strict=True)
        write_rasters(path, LATTICE, named, CELLS, {}, quantity=quantity)
        made.append(open_rasters(path))
    return made


@pytest.fixture(params=[True, False], ids=["filled", "gaps"])
def surveyed(request, tmp_path):
    levels, deviation = rasters(tmp_path, filled=request.param)
    plan = CellPlan(CRS, tuple(map(cell, CELLS)))
    made = build(levels, plan, routes(), tmp_path / "db", measured=(served(), deviation))
    return made, deviation, request.param


def test_a_database_keeps_what_its_survey_measured(surveyed):
    database, deviation, _ = surveyed
    parts = open_database(database.path, verify="full").measured()
    given = served()
    for name in ("report", "session", "east_m", "level_dbm", "timing_advance", "serving"):
        np.testing.assert_array_equal(getattr(parts.readings, name), getattr(given, name))
    names = np.array(parts.readings.cell_ids)[parts.readings.cell]
    assert names.tolist() == np.array(given.cell_ids)[given.cell].tolist()
    points = database.points()
    want = deviation.read()[:, points.row, points.col]
    found = parts.deviations
    assert len(found) == np.isfinite(want).sum()
    got = np.full_like(want, np.nan)
    at = np.searchsorted(points.point, found.row.astype(int) * SIZE + found.col)
    index = [CELLS.index(found.cell_ids[n]) for n in found.cell]
    got[index, at] = found.deviation_db
    np.testing.assert_array_equal(got, want)
    assert database.manifest["version"] == 2
    assert database.without_cells().measured() is None


@pytest.mark.parametrize("name", ["readings.parquet", "deviations.parquet"])
def test_parts_of_a_survey_are_compared_with_their_checksums(surveyed, name):
    database, _, _ = surveyed
    part = database.path / name
    content = bytearray(part.read_bytes())
    content[len(content) // 2] ^= 1
    part.write_bytes(bytes(content))
    with pytest.raises(StoreError, match=rf"{name}.*SHA-256"):
        database.measured()
    with pytest.raises(StoreError, match=rf"{name}.*SHA-256"):
        open_database(database.path, verify="full")


def test_a_database_that_replaced_the_opened_one_does_not_lend_its_survey(surveyed, tmp_path):
    database, deviation, filled = surveyed
    levels, _ = rasters(tmp_path, filled=filled)
    plan = CellPlan(CRS, tuple(map(cell, CELLS)))
    # A folder with parts of a survey is a database, so it may be replaced.
    build(levels, plan, routes(), database.path, measured=(served(30), deviation))
    with pytest.raises(StoreError, match="replaced while in use"):
        database.measured()
    assert len(open_database(database.path).measured().readings) == 30


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda part: part["path"] != "readings.parquet", r"deviations\.parquet alone"),
        (lambda part: part["path"] != "deviations.parquet", r"readings\.parquet alone"),
    ],
)
def test_one_part_of_a_survey_without_the_other(surveyed, change, why):
    database, _, _ = surveyed
    file = database.path / "manifest.json"
    manifest = json.loads(file.read_text())
    manifest["parts"] = list(filter(change, manifest["parts"]))
    file.write_text(json.dumps(sealed(manifest)))
    with pytest.raises(StoreError, match=why):
        open_database(database.path)


def test_cells_received_too_rarely_for_a_map_stay_in_the_readings(tmp_path):
    """The first cell, which serves in the west, has no map; the third one's serving stays rare."""
    levels, deviation = rasters(tmp_path, filled=True)
    mapped = CELLS[1:]
    some = []
    for name, raster in (("level", levels), ("sd", deviation)):
        bands = zip(mapped, raster.read(cells=mapped), strict=True)
        path = tmp_path / f"{name}-some.tif"
        quantity = "level" if name == "level" else "deviation"
        write_rasters(path, LATTICE, bands, mapped, {}, quantity=quantity)
        some.append(open_rasters(path))
    plan = CellPlan(CRS, tuple(map(cell, mapped)))
    made = build(some[0], plan, routes(), tmp_path / "db", measured=(served(), some[1]))
    parts = open_database(made.path, verify="full").measured()
    assert len(parts.readings) == len(served())
    read = parts.readings
    assert {read.cell_ids[n] for n in np.unique(read.cell)} == {CELLS[0], CELLS[2]}
    assert BayesFilter().over(made).model is not None


def test_readings_of_cells_of_another_database(surveyed, tmp_path):
    database, _, _ = surveyed
    others = tuple(f"1-1-8-{number}" for number in range(3))
    write_readings(replace(served(), cell_ids=others), tmp_path / "others.parquet")
    parts = (tmp_path / "others.parquet", database.path / "deviations.parquet")
    with pytest.raises(StoreError, match="cells of the database, found others"):
        read_measured(*parts, LATTICE, CELLS)


def test_a_pixel_beside_the_points_has_the_deviation_of_the_nearest(surveyed):
    database, _, _ = surveyed
    spread = database.measured().deviations.spread(CELLS, database.field().on_way)
    spread = spread.reshape(3, SIZE, SIZE)
    points = database.points()
    own = np.full((SIZE, SIZE), np.nan)
    for row in range(SIZE):
        for col in range(SIZE):
            away = (points.row - row) ** 2 + (points.col - col) ** 2
            near = np.flatnonzero(away == away.min())
            values = {2.5 if points.col[n] >= 6 else np.nan for n in near}
            if len(values) == 1:
                own[row, col] = values.pop()
                np.testing.assert_array_equal(spread[2, row, col], np.float32(own[row, col]))
    assert np.isnan(spread[1]).all()


def test_the_filter_compares_with_what_was_measured(surveyed):
    database, _, filled = surveyed
    bound = BayesFilter().over(database)
    model = bound.model
    assert isinstance(model, MeasuredMapModel)
    levels = model.evidence.levels
    # The usual deviation of the survey is that of white noise and lasting errors together.
    values = database.measured().deviations.deviation_db
    assert levels.total_db == pytest.approx(max(np.median(values) ** 2, 10.0) ** 0.5, rel=1e-3)
    assert (levels.slow_m, levels.device_db, levels.weight) == (100.0, 2.0, 0.5)
    assert model.evidence.serving.weight_per_m == 1 / 150
    sd_db = model.level_sd_db.reshape(-1, SIZE, SIZE)
    first = model.area.band_of[CELLS[0]]
    assert (sd_db[first][4, :6] == 4.0).all()
    assert (sd_db[first][4, 6:] == 8.0).all()
    share = np.exp(model.serving_model.log_share[first].reshape(SIZE, SIZE))
    assert share[4, 1] > 0.8 > 0.2 > share[4, 10]
    # Not measured is not the same as not received.
    quiet_dbm = database.floor_dbm
    level = model.area.level_dbm[..., first]
    assert (level[4, 6:] > quiet_dbm).all()
    if not filled:
        np.testing.assert_allclose(level[4, 6:], level[4:5, :6].mean())
    assert not model.timed_by_sites


@pytest.mark.parametrize("steps", [np.nan, 2.0, 9.0])
def test_a_place_that_is_as_good_as_any_is_no_evidence_against_the_map(surveyed, steps):
    """The null hypothesis has the mean likelihood of all ways, by hand from the statistics."""
    bound = BayesFilter().over(surveyed[0])
    model, area = bound.model, bound.model.area
    serving = area.band_of[CELLS[0]]
    pixels = np.flatnonzero(area.on_way)
    statistics = model.serving_model
    likelihood = np.exp(statistics.log_share[serving, pixels].astype(float))
    if np.isfinite(steps):
        sd = statistics.deviation_steps[serving, pixels].astype(float)
        off = np.minimum(abs(steps - statistics.advance_steps[serving, pixels]) / sd, 4.0)
        likelihood *= np.exp(-0.5 * off**2) / sd
    usual = model.usual_serving(serving, steps)
    assert usual == pytest.approx(np.log(likelihood.mean()), rel=1e-4)
    row = ReportRow(SERVING, CELLS[0], None, None, np.nan, 0, steps)
    source = RadioSource(area, model.evidence, model.usual_serving)
    reading = source.first(Epoch(0.0, radio=(row,))).radio
    assert reading.radio_under_null(0.0) == pytest.approx(usual * reading.serving_weight)
    state = np.zeros((STATES, len(pixels)), dtype=np.float32)
    row_, col = np.divmod(pixels, SIZE)
    state[EAST], state[NORTH] = (col + 0.5) * SIDE_M, (SIZE - row_ - 0.5) * SIDE_M
    log_weight = np.zeros(len(pixels))
    model.weigh(Cloud(state, np.empty((0, len(pixels)), np.float32)), log_weight, reading)
    mean = np.exp(log_weight / reading.serving_weight).mean()
    assert np.log(mean) == pytest.approx(usual, rel=1e-3)


def test_own_settings_stay(surveyed):
    database, _, _ = surveyed
    given = BayesFilter(level_weight=0.2, device_error_db=4.0, level_correlation_m=50.0)
    levels = given.over(database).model.evidence.levels
    assert (levels.weight, levels.device_db, levels.slow_m) == (0.2, 4.0, 50.0)
    usual = BayesFilter().over(database).options
    assert (usual.switch_mass, usual.switch_hold_m) == (0.95, 60.0)
    assert BayesFilter(switch_mass=0.9).over(database).options.switch_mass == 0.9
    assert isinstance(GridFilter().over(database).model, MeasuredMapModel)


@pytest.mark.parametrize(
    ("roles", "sd_m"),
    [(("tracks",), 16.0), (("tracks", "map"), 3.0), (("roads", "tracks"), 3.0), (("map",), 3.0)],
)
def test_where_tracks_alone_are_the_ways_they_are_wider(surveyed, roles, sd_m):
    database, _, _ = surveyed
    database.manifest["inputs"] = [{"role": role} for role in roles]
    assert BayesFilter().over(database).model.weights.sd_m == sd_m
    # As they were asked for.
    assert BayesFilter(map_sd_m=5.0).over(database).model.weights.sd_m == 5.0


def test_without_serving_cells_the_levels_remain(tmp_path):
    levels, deviation = rasters(tmp_path, filled=True)
    plan = CellPlan(CRS, tuple(map(cell, CELLS)))
    few = served().some(np.arange(40) < 3)
    database = build(levels, plan, routes(), tmp_path / "db", measured=(few, deviation))
    model = BayesFilter().over(database).model
    assert model.serving_model is None
    assert model.timed_by_sites
    assert (model.level_sd_db == 8.0).any()


def test_predicted_levels_stay_as_they_were(tmp_path):
    levels, _ = rasters(tmp_path, filled=True)
    plan = CellPlan(CRS, tuple(map(cell, CELLS)))
    database = build(levels, plan, routes(), tmp_path / "db")
    assert database.measured() is None
    assert not (database.path / "readings.parquet").exists()
    model = BayesFilter().over(database).model
    assert not isinstance(model, MeasuredMapModel)
    assert model.evidence.levels.weight == BayesFilter().level_weight


def test_merged_surveys_keep_what_was_measured(tmp_path):
    levels, deviation = rasters(tmp_path, filled=True)
    plan = CellPlan(CRS, tuple(map(cell, CELLS)))
    whole = build(levels, plan, routes(), tmp_path / "db", measured=(served(), deviation))
    again = merge([whole, whole], tmp_path / "merged", without=[CELLS[1]])
    parts, before = again.measured(), whole.measured()
    assert len(parts.readings) == 2 * len(before.readings)
    field = again.field().on_way
    np.testing.assert_array_equal(
        parts.deviations.spread(CELLS, field), before.deviations.spread(CELLS, field)
    )
    plain = build(levels, plan, routes(), tmp_path / "plain")
    assert merge([whole, plain], tmp_path / "mixed").measured() is None


def test_damaged_parts_are_refused(surveyed, tmp_path):
    database, _, _ = surveyed
    part = database.path / "deviations.parquet"
    part.write_bytes(part.read_bytes()[:-20])
    with pytest.raises(StoreError, match="deviations"):
        open_database(database.path)
    path = tmp_path / "readings.parquet"
    write_readings(served(), path)
    assert len(read_readings(path)) == 40
    path.write_bytes(b"nothing")
    with pytest.raises(StoreError, match="readings"):
        read_readings(path)


def test_fields_without_gaps_are_the_same(surveyed):
    database, _, filled = surveyed
    field = database.field()
    given = filled_field(field, database.measured())
    assert np.array_equal(given.level_dbm, field.level_dbm, equal_nan=True) == filled
    nothing = Deviations((), np.empty(0, np.int32), *([np.empty(0, np.int32)] * 3))
    same = filled_field(field, MeasuredParts(served(), nothing))
    np.testing.assert_array_equal(same.level_dbm, field.level_dbm)


def test_sites_are_those_of_identities():
    assert site_of(cell(CELLS[0])) == site_of(cell(CELLS[1])) == "1-1-256"
    assert site_of(cell(CELLS[2])) == "1-1-273"
    assert site_of(cell("1-1-7-500")) == "1-1-7-500"
    assert site_of(cell(CELLS[0], technology="UMTS")) == CELLS[0]
    assert site_of(replace(cell(CELLS[0]), ci=1 << 30)) == CELLS[0]
    assert MeasuredMapOptions().site_part == 0.1


def test_single_reports_are_compared_with_the_readings(surveyed):
    database, _, _ = surveyed
    reports, given = reports_of_database(database), served()
    assert not reports.predicted
    assert len(reports) == len(given)
    assert reports.block.tolist() == given.session.tolist()
    np.testing.assert_allclose(reports.places, np.column_stack([given.east_m, given.north_m]))
    np.testing.assert_array_equal(reports.level_dbm, given.level_dbm)
    np.testing.assert_array_equal(reports.timing_advance, given.timing_advance)
    names = [reports.cell_ids[n] for n in reports.serving]
    assert names == [CELLS[n] for n in given.cell]
    fitted = fit_locator(reports, "probabilistic", validated=30)
    assert fitted.validations[0].blocks == "logs"
    assert fitted.validations[0].reports <= 30


@pytest.mark.parametrize(("usual_db", "lasting_db"), [(5.0, 4.0), (7.0, 40**0.5), (2.0, 1.0)])
def test_the_lasting_errors_are_what_the_usual_deviation_leaves(surveyed, usual_db, lasting_db):
    """Besides white noise of 3 dB, at least 1 dB; slow and fast ones keep their ratio."""
    database, _, _ = surveyed
    parts, bound = database.measured(), BayesFilter().over(database)
    count = len(parts.deviations)
    spread = np.linspace(-1.0, 1.0, count) ** 3
    values = (usual_db + spread - np.median(spread)).astype(np.float32)
    given = replace(parts, deviations=replace(parts.deviations, deviation_db=values))
    before = bound.model.evidence.levels
    found = over_survey(bound, database, given).model.evidence.levels
    assert found.white_db == 3.0
    assert np.hypot(found.slow_db, found.fast_db) == pytest.approx(lasting_db, rel=1e-5)
    assert found.slow_db / found.fast_db == pytest.approx(before.slow_db / before.fast_db)
    quieter = SurveyedEvidence(measurement_db=1.5, unmeasured_db=6.5, serving_weight_per_m=0.02)
    model = over_survey(bound, database, given, quieter).model
    assert model.evidence.levels.white_db == 1.5
    lasting_db = max(usual_db**2 - 1.5**2, 1.0) ** 0.5
    levels = model.evidence.levels
    assert np.hypot(levels.slow_db, levels.fast_db) == pytest.approx(lasting_db, rel=1e-5)
    assert model.evidence.serving.weight_per_m == 0.02
    assert set(np.unique(model.level_sd_db)) <= {*values.tolist(), 6.5}
    none = replace(
        parts, deviations=Deviations((), *[np.empty(0, np.int32)] * 3, np.empty(0, "f4"))
    )
    kept = over_survey(bound, database, none).model
    assert (kept.evidence.levels.slow_db, kept.evidence.levels.fast_db) == (
        before.slow_db, before.fast_db,
    )  # fmt: skip
    assert (kept.level_sd_db == 8.0).all()


@pytest.mark.parametrize(("count", "told"), [(19, False), (20, True)])
def test_twenty_reports_of_serving_cells_are_enough_for_statistics(surveyed, count, told):
    database, _, _ = surveyed
    parts, bound = database.measured(), BayesFilter().over(database)
    serving = np.flatnonzero(parts.readings.serving)
    kept = np.isin(np.arange(len(parts.readings)), serving[:count])
    assert kept.sum() == count
    given = replace(parts, readings=parts.readings.some(kept))
    model = over_survey(bound, database, given).model
    assert (model.serving_model is not None) == told
    others = replace(parts.readings, serving=kept)
    model = over_survey(bound, database, replace(parts, readings=others)).model
    assert (model.serving_model is not None) == told


def test_other_options_of_a_filter_are_over_the_same_survey(surveyed):
    database, _, _ = surveyed
    options = BayesFilter(timing_step_m=78.0, step_sd_m=0.4)
    found, plain = BayesFilter().over(database).with_options(options), options.over(database)
    assert found.made_of == options
    assert isinstance(found.model, MeasuredMapModel)
    assert (found.timing, found.options) == (plain.timing, plain.options)
    assert (found.model.motion, found.model.evidence, found.model.weights) == (
        plain.model.motion,
        plain.model.evidence,
        plain.model.weights,
    )
