"""Whether check finds factors and bands that propagation contradicts, and leaves others alone."""

from dataclasses import replace

import numpy as np
import pytest
from check_world import CRS

from mapfilter.check.band_law import check_bands
from mapfilter.check.findings import Findings
from mapfilter.check.level_law import check_factor, level_law
from mapfilter.check.samples import RasterSample
from mapfilter.lattice import Lattice
from mapfilter.propagation.models import PredictionModel
from mapfilter.propagation.predict import predict
from mapfilter.radio.cells import Cell, CellPlan

LATTICE = Lattice(CRS, 382_500.0, 6_677_500.0, 50.0, 100, 100)
BASE = Cell("A", "A", 385_000.0, 6_675_000.0, 30.0, 40.0, 30.0, 806.0, technology="LTE")
LOW = [replace(BASE, id=f"8-{a:g}", azimuth_deg=a) for a in (0.0, 120.0, 240.0)]
HIGH = [replace(cell, id=f"1{cell.id}", frequency_mhz=1850.0, eirp_dbm=31.0) for cell in LOW]


def samples_of(cells, model="okumura_hata", environment="suburban", times=1.0):
    plan = CellPlan(CRS, tuple(cells))
    made = PredictionModel(model=model, environment=environment, shadowing_db=6.0)
    levels = predict(plan, LATTICE, None, made)
    return plan, [
        RasterSample(name, LATTICE, np.asarray(dbm * times, np.float32), name)
        for name, dbm in levels
    ]


def factor_found(plan, samples, factor, quantity="level"):
    findings = Findings()
    check_factor(samples, plan, factor, quantity, "ras", findings)
    return findings.found


def bands_found(plan, samples):
    findings = Findings()
    check_bands(samples, plan, "level", "ras", findings)
    return findings.found


class TestFactor:
    def test_of_the_law_of_free_space(self):
        plan, samples = samples_of(LOW, "friis")
        law = level_law(samples[0], plan.cells[0])
        assert law.slope_db() == pytest.approx(20, abs=3)
        assert law.slope_db(2.0) == pytest.approx(40, abs=6)
        assert np.abs(law.below_free_space_db()).max() < 8

    def test_a_tenth_for_a_sixteenth(self):
        plan, samples = samples_of([replace(c, antenna="3gpp") for c in LOW], "tr38901_uma")
        wrong = [replace(s, values=s.values * np.float32(1.6)) for s in samples]
        (found,) = factor_found(plan, wrong, 0.1)
        assert (found.code, found.where) == ("raster-factor", "ras")
        assert "With 0.0625 it is " in found.evidence

    def test_levels_that_no_propagation_explains_are_an_error(self):
        """Among hills levels fall by 50 dB per tenfold distance."""
        plan = CellPlan(CRS, tuple(LOW))
        made = PredictionModel(model="log_distance", path_loss_exponent=5.0)
        levels = [(i, dbm + 50) for i, dbm in predict(plan, LATTICE, None, made)]
        samples = [RasterSample(i, LATTICE, dbm.astype(np.float32), i) for i, dbm in levels]
        assert factor_found(plan, samples, 1 / 16) == []
        wrong = [replace(s, values=s.values * np.float32(1.6)) for s in samples]
        (found,) = factor_found(plan, wrong, 0.1)
        assert found.severity == "error"
        assert "fall by 8" in found.evidence

    @pytest.mark.parametrize("sign", [1, -1])
    def test_one_twentieth_is_no_usual_unit(self, sign):
        plan, samples = samples_of(LOW, times=0.8)
        (found,) = factor_found(plan, samples, sign * 0.05)
        assert found.severity == "warning"
        assert found.evidence.startswith(f"rasters.factor = {sign * 0.05:g} is no usual unit.")
        assert f"With {sign * 0.0625:g} it is " in found.evidence
        likely = f"Likely {sign * 0.0625:g}, sixteenths of a dB as Atoll stores them. Set "
        assert found.remedy.startswith(likely)

    @pytest.mark.parametrize("factor", [1.0, 1 / 16, 0.063, 0.1, 0.01, -1.0])
    @pytest.mark.parametrize(
        "model", ["friis", "okumura_hata", "cost231_walfisch_ikegami", "tr38901_umi"]
    )
    def test_right_levels_are_left_alone(self, model, factor):
        plan, samples = samples_of(LOW, model)
        assert factor_found(plan, samples, factor) == []

    @pytest.mark.parametrize("environment", ["open", "suburban", "city"])
    def test_and_in_all_environments_with_tilts_and_powers_of_carriers(self, environment):
        tilted = replace(BASE, antenna="3gpp", downtilt_deg=10.0, vertical_beamwidth_deg=7.0)
        cells = [replace(tilted, id=c.id, azimuth_deg=c.azimuth_deg) for c in LOW]
        plan, samples = samples_of(cells, environment=environment)
        assert factor_found(plan, samples, 1 / 16) == []
        carriers = CellPlan(CRS, tuple(replace(c, eirp_dbm=c.eirp_dbm + 30) for c in cells))
        assert factor_found(carriers, samples, 1 / 16) == []

    def test_losses_need_no_power(self):
        _, samples = samples_of(LOW)
        lost = [replace(s, values=s.values - np.float32(30)) for s in samples]
        unknown = CellPlan(CRS, tuple(replace(c, eirp_dbm=50, assumed="eirp_dbm") for c in LOW))
        assert factor_found(unknown, lost, 1 / 16, "loss") == []
        strong = [replace(s, values=s.values * np.float32(1.6)) for s in lost]
        assert [f.code for f in factor_found(unknown, strong, 0.1, "loss")] == ["raster-factor"]
        assert factor_found(unknown, strong, 0.1) == []


class TestBands:
    def test_of_a_sector_exchanged(self):
        plan, samples = samples_of([*LOW, *HIGH])
        assert bands_found(plan, samples) == []
        other = {low.id: high.id for low, high in zip(LOW, HIGH, strict=True)}
        other |= {high: low for low, high in other.items()}
        (found,) = bands_found(plan, [replace(s, cell_id=other[s.cell_id]) for s in samples])
        assert (found.code, found.severity) == ("band-labels-swapped", "warning")
        assert "In 3 of 3 pairs" in found.evidence

    @pytest.mark.parametrize(
        "change",
        [{"technology": "GSM"}, {"assumed": "eirp_dbm"}, {"eirp_dbm": 60.0}, {"site": "B"}],
    )
    def test_of_cells_that_cannot_be_compared(self, change):
        """Such as RxLev of GSM beside RSRP with the power of a carrier."""
        plan, samples = samples_of([*LOW, *HIGH])
        other = {low.id: high.id for low, high in zip(LOW, HIGH, strict=True)}
        other |= {high: low for low, high in other.items()}
        swapped = [replace(s, cell_id=other[s.cell_id]) for s in samples]
        ids = {cell.id for cell in HIGH}
        cells = [replace(c, **change) if c.id in ids else c for c in plan.cells]
        assert bands_found(CellPlan(CRS, tuple(cells)), swapped) == []
