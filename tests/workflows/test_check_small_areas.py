"""Check of an area cut out of a network: most sites stand beside it, and beams are tilted."""

from dataclasses import fields, replace

import numpy as np
import pytest
from check_world import CRS, LATTICE, CheckWorld, write_map
from command_line import mapfilter

from mapfilter.check.findings import CheckResult, Finding, Findings
from mapfilter.check.samples import RasterSample
from mapfilter.check.site_checks import check_against_sites
from mapfilter.geodesy import unproject
from mapfilter.lattice import Lattice
from mapfilter.propagation.models import PredictionModel
from mapfilter.propagation.predict import predict
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.workflows.checks.places import check_sites

MODEL = PredictionModel(model="log_distance")
WEST_M, SOUTH_M, EAST_M, NORTH_M = LATTICE.bounds_m
INSIDE = Cell("I", "I", EAST_M - 700, SOUTH_M + 700, 30.0, 40.0, 46.0, 1815.0, "3gpp", 4.0)
AHEAD = replace(INSIDE, id="W1", site="W", east_m=WEST_M - 800, azimuth_deg=90.0)
BEHIND = replace(AHEAD, id="W2", azimuth_deg=240.0)
BESIDE = replace(AHEAD, id="W3", azimuth_deg=300.0)


def levels_of(*cells, lattice=LATTICE):
    plan = CellPlan(CRS, cells)
    return {name: np.array(dbm) for name, dbm in predict(plan, lattice, None, MODEL)}


def findings_of(folder, cells, levels, quantity="level"):
    names = [field.name for field in fields(Cell) if field.name not in ("id", "assumed")]
    rows = []
    for cell in cells:
        lon, lat = unproject(CRS, cell.east_m, cell.north_m)
        values = {name: getattr(cell, name) for name in names}
        del values["east_m"], values["north_m"]
        row = {"cell": cell.id, "lat": float(lat), "lon": float(lon)}
        row |= {name: "" if value is None else value for name, value in values.items()}
        rows.append(row | {"indoor": int(cell.indoor)})
    write_map(folder / "streets.osm")
    world = CheckWorld(folder, rows, levels, quantity=quantity)
    world.write()
    outcome = mapfilter("check", "-c", world.toml, "--json")
    assert outcome.err == ""
    found = outcome.json["findings"]
    assert outcome.code == (2 if any(f["severity"] == "error" for f in found) else 0)
    return [f for f in found if f["code"] != "site-outside-area"]


def codes(*given, **options):
    return [finding["code"] for finding in findings_of(*given, **options)]


class TestEqualRasters:
    def test_of_sectors_that_both_look_away_from_the_area(self, tmp_path):
        levels = levels_of(INSIDE, AHEAD, BEHIND, BESIDE)
        assert np.array_equal(levels["W2"], levels["W3"])
        assert codes(tmp_path, (INSIDE, AHEAD, BEHIND, BESIDE), levels) == []

    @pytest.mark.parametrize("antenna", ["3gpp", "omni", "sector"])
    def test_of_two_carriers_of_a_sector(self, antenna, tmp_path):
        one = replace(INSIDE, antenna=antenna)
        cells = (one, replace(one, id="other", frequency_mhz=1820.0, downtilt_deg=4.0))
        levels = levels_of(*cells)
        assert codes(tmp_path, cells, levels | {"other": levels["I"]}) == []

    @pytest.mark.parametrize(
        "other",
        [
            replace(INSIDE, id="other", azimuth_deg=160.0),
            replace(INSIDE, id="other", downtilt_deg=8.0),
            replace(INSIDE, id="other", eirp_dbm=43.0),
            replace(INSIDE, id="other", height_m=40.0),
            replace(INSIDE, id="other", frequency_mhz=806.0),
            replace(INSIDE, id="other", site="J", east_m=INSIDE.east_m - 30.0),
            replace(INSIDE, id="other", antenna="K742215", azimuth_deg=160.0),
            AHEAD,
        ],
        ids=["azimuth", "tilt", "power", "height", "band", "place", "pattern file", "site"],
    )
    def test_of_cells_that_the_plan_tells_apart_are_copies(self, other, tmp_path):
        levels = levels_of(INSIDE)
        levels[other.id] = levels["I"]
        (copied,) = (
            found
            for found in findings_of(tmp_path, (INSIDE, other), levels)
            if found["code"] == "identical-rasters"
        )
        assert copied["severity"] == "error"
        assert f"cells I, {other.id}" in copied["where"]

    def test_that_differ_in_a_corner_of_the_area(self, tmp_path):
        """The sector beside radiates into the area where the other one does not."""
        levels = levels_of(INSIDE, AHEAD, BEHIND)
        beside = replace(BESIDE, azimuth_deg=340.0)
        cells = (INSIDE, AHEAD, BEHIND, beside)
        copied = levels | {"W3": levels["W2"]}
        assert codes(tmp_path, cells, copied) == ["identical-rasters"]
        assert codes(tmp_path, cells, levels_of(*cells)) == []

    def test_of_losses_whatever_the_power(self, tmp_path):
        other = replace(INSIDE, id="other", eirp_dbm=40.0)
        losses = {name: 46.0 - dbm for name, dbm in levels_of(INSIDE).items()}
        losses["other"] = losses["I"]
        assert codes(tmp_path, (INSIDE, other), losses, "loss") == []


def seen_outside(plan, strongest_dbm=None):
    findings = Findings()
    ids = check_sites(plan, LATTICE, "cells.csv", findings, strongest_dbm)
    (finding,) = findings.found
    assert finding.code == "site-outside-area"
    return ids, finding


class TestSitesBesideTheArea:
    around = CellPlan(CRS, (INSIDE, *(replace(AHEAD, id=f"W{n}") for n in range(40))))

    def test_are_a_note_of_one_line(self):
        ids, note = seen_outside(self.around, {f"W{n}": -90.0 for n in range(30)})
        assert len(ids) == 40
        assert note.severity == "note"
        assert note.where == "cells.csv, cells W0, W1, W2 and 37 more"
        assert note.evidence == (
            "40 of 41 cells lie up to 800 m outside the area, 30 of them received in it."
        )
        assert seen_outside(self.around)[1].severity == "note"

    @pytest.mark.parametrize(
        ("away_m", "level_dbm", "severity"),
        [
            (9_000.0, None, "note"),
            (9_000.0, -140.0, "note"),
            (12_000.0, -100.0, "note"),
            (12_000.0, -110.0, "warning"),
            (12_000.0, None, "warning"),
            (40_000.0, -80.0, "warning"),
        ],
    )
    def test_are_a_warning_where_they_cannot_be_received(self, away_m, level_dbm, severity):
        far = replace(INSIDE, id="far", east_m=EAST_M + away_m)
        plan = CellPlan(CRS, (*self.around.cells, far))
        _, finding = seen_outside(plan, {} if level_dbm is None else {"far": level_dbm})
        assert finding.severity == severity
        assert (finding.where == "cells.csv, cells far") == (severity == "warning")

    def test_levels_of_rasters_count(self, tmp_path):
        far = replace(INSIDE, id="far", east_m=EAST_M + 12_000.0, antenna="omni", eirp_dbm=60.0)
        for folder, weaker_db, severity in (("a", 0.0, "note"), ("b", 60.0, "warning")):
            (tmp_path / folder).mkdir()
            levels = levels_of(INSIDE, replace(far, eirp_dbm=60.0 - weaker_db))
            for quantity in ("level", "loss"):
                eirp_dbm = {"I": 46.0, "far": 60.0}
                given = levels
                if quantity == "loss":
                    given = {name: eirp_dbm[name] - dbm for name, dbm in levels.items()}
                findings_of(tmp_path / folder, (INSIDE, far), given, quantity)
                outcome = mapfilter("check", "-c", tmp_path / folder / "world.toml", "--json")
                found = {f["code"]: f["severity"] for f in outcome.json["findings"]}
                assert found["site-outside-area"] == severity, (folder, quantity)


SMALL = Lattice(CRS, 385_000.0, 6_673_600.0, 10.0, 60, 60)


def sites_found(plan, levels):
    findings = Findings()
    samples = [RasterSample(i, SMALL, dbm.astype(np.float32), i) for i, dbm in levels.items()]
    check_against_sites(samples, plan, frozenset(), "rxlev.tif", findings)
    return [finding.code for finding in findings.found]


class TestNarrowBeamsBelowTheHorizon:
    mast = Cell(
        "A",
        "A",
        SMALL.west_m + 514.0,
        SMALL.north_m - 580.0,
        49.0,
        63.0,
        46.0,
        1815.0,
        antenna="3gpp",
        downtilt_deg=2.0,
        vertical_beamwidth_deg=5.0,
    )
    sectors = (
        mast,
        replace(mast, id="B", azimuth_deg=183.0),
        replace(mast, id="C", azimuth_deg=303.0),
    )

    def test_are_strong_away_from_their_mast(self):
        levels = levels_of(*self.sectors, lattice=SMALL)
        assert sites_found(CellPlan(CRS, self.sectors), levels) == []

    def test_their_sites_are_found_to_be_wrong_all_the_same(self):
        middle = {"east_m": SMALL.west_m + 220.0, "north_m": SMALL.north_m - 240.0}
        others = [replace(c, id=f"T{c.id}", site="T", **middle) for c in self.sectors]
        levels = levels_of(*self.sectors, *others, lattice=SMALL)
        moved = [replace(cell, north_m=self.mast.north_m + 350) for cell in self.sectors]
        assert sites_found(CellPlan(CRS, (*moved, *others)), levels) == ["site-off-peak"]

    def test_pattern_files_are_judged_without_their_gain(self):
        levels = levels_of(*self.sectors, lattice=SMALL)
        named = tuple(replace(cell, antenna="K742215") for cell in self.sectors)
        assert sites_found(CellPlan(CRS, named), levels) == ["site-off-peak"]


def test_the_worst_findings_come_first():
    order = ("note", "warning", "error", "note")
    found = [Finding("c", one, str(n), "e", "r") for n, one in enumerate(order)]
    result = CheckResult.of(found)
    assert [finding.where for finding in result.findings] == ["2", "1", "0", "3"]
    assert not result.ok
    assert CheckResult.of(found[:2]).ok
