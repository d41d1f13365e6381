"""A configuration that says nothing asks for what the libraries do by themselves."""

import inspect
from dataclasses import replace

import pytest
from pydantic import ValidationError

from mapfilter.config.sections import Config, Journeys
from mapfilter.errors import ConfigError
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.roads.buildings import read_buildings
from mapfilter.simulation.layout import lay_out_plan
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.simulate import SimulationSettings
from mapfilter.workflows import simulate
from mapfilter.workflows.inputs.filter_choice import filter_choice

CONFIG = Config()


def test_prediction():
    section = CONFIG.prediction
    assert section.of(PredictionModel) == PredictionModel()
    assert section.ground_truth.of(GroundTruthErrors) == GroundTruthErrors()


def test_simulation():
    settings = simulate.simulation_settings(CONFIG)
    assert replace(settings, start_utc_s=0.0) == replace(SimulationSettings(), start_utc_s=0.0)


def test_filter():
    assert filter_choice(CONFIG.filter) == BayesFilter()
    candidate = CONFIG.filter.model_copy(update={"name": "candidate"})
    assert filter_choice(candidate) == CandidateFilter()


def test_buildings_and_cells():
    buildings = inspect.signature(read_buildings).parameters
    assert CONFIG.buildings.default_height_m == buildings["default_height_m"].default
    assert CONFIG.buildings.storey_m == buildings["storey_height_m"].default
    # A roof of unknown height is as high in the model as on the raster.
    assert CONFIG.buildings.default_height_m == CONFIG.prediction.default_roof_height_m
    cells = inspect.signature(lay_out_plan).parameters
    assert CONFIG.cells.frequency_mhz == cells["frequency_mhz"].default
    assert CONFIG.cells.eirp_dbm == cells["eirp_dbm"].default
    assert CONFIG.cells.height_m == cells["site_height_m"].default


@pytest.mark.parametrize("sensitivity_dbm", [-151.0, -150.0, 0.0, 1.0])
def test_sensitivity_has_the_same_limits(sensitivity_dbm):
    good = -150 <= sensitivity_dbm <= 0
    for make, error in ((Journeys, ValidationError), (ReportModel, ConfigError)):
        if good:
            assert make(sensitivity_dbm=sensitivity_dbm).sensitivity_dbm == sensitivity_dbm
        else:
            with pytest.raises(error):
                make(sensitivity_dbm=sensitivity_dbm)
