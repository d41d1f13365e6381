"""``mapfilter predict`` with each propagation model and with antennas from files."""

from typing import get_args

import numpy as np
import pytest
import rasterio
from command_line import assert_done, assert_refused, mapfilter, settings

from mapfilter.config.prediction import Prediction
from mapfilter.propagation import models as _models
from mapfilter.propagation.models import PredictionModel

BOX = "[area]\nbbox = [24.9445, 60.1672, 24.9470, 60.1684]\n"
MODELS = {
    "friis": {},
    "log_distance": {
        "path_loss_exponent": 3.5,
        "reference_distance_m": 50.0,
        "reference_loss_db": 75.0,
    },
    "okumura_hata": {"environment": "large_city"},
    "cost231_hata": {"metropolitan": "true"},
    "cost231_walfisch_ikegami": {"street_orientation_deg": 30.0},
    "tr38901_uma": {},
    "tr38901_umi": {"line_of_sight": "probability"},
}


@pytest.fixture
def small(tmp_path):
    """Write a configuration and a plan with these antennas; return the configuration."""

    def write(*antennas: str, folder: str = ""):
        header = "cell,lat,lon,height_m,azimuth_deg,antenna,eirp_dbm,frequency_mhz\n"
        rows = [f"C{i},60.1678,24.9457,25,90,{a},50,1800\n" for i, a in enumerate(antennas)]
        (tmp_path / "cells.csv").write_text(header + "".join(rows), encoding="utf-8")
        file = tmp_path / "small.toml"
        file.write_text(
            f'{BOX}[cells]\nplan = "cells.csv"\n{folder}[prediction]\nshadowing_db = 0.0\n'
            '[prediction.ground_truth]\nwrite = false\n[output]\ndir = "out"\n',
            encoding="utf-8",
        )
        return file

    return write


def levels(config):
    with rasterio.open(config.parent / "out" / "rxlev.tif") as source:
        assert source.tags()["MODEL"]
        return source.read()


def test_every_model_predicts_finite_levels_of_its_own(small):
    file = small("omni")
    seen = []
    for model, keys in MODELS.items():
        given = {f"prediction__{key}": value for key, value in keys.items()}
        assert_done(mapfilter("predict", "-c", file, *settings(prediction__model=model, **given)))
        level = levels(file)
        assert np.isfinite(level).all()
        assert -140 < level.min() < level.max() < 10
        seen.append(level.mean())
    assert len(np.unique(np.round(seen, 3))) == len(MODELS)


def test_the_configuration_knows_every_choice_of_a_prediction():
    choices = {
        "model": _models.ModelName,
        "line_of_sight": _models.LineOfSight,
        "environment": _models.Environment,
    }
    for key, choice in choices.items():
        for value in get_args(choice):
            sight = {"model": "tr38901_uma"} if key == "line_of_sight" else {}
            assert getattr(Prediction(**sight | {key: value}).of(PredictionModel), key) == value


def test_a_probability_is_refused_where_the_model_has_none(small):
    file = small("omni")
    refused = mapfilter("predict", "-c", file, *settings(prediction__line_of_sight="probability"))
    assert_refused(refused, "prediction, line_of_sight", "tr38901_uma")


def test_antennas_come_from_their_folder(small, tmp_path):
    rows = "".join(f"{a} {0 if a in range(300, 360) else 20}\n" for a in range(360))
    flat = "".join(f"{a} 20\n" for a in range(360))
    (tmp_path / "patterns").mkdir()
    (tmp_path / "patterns" / "Left.msi").write_text(
        f"NAME left\nFREQUENCY 900\nHORIZONTAL 360\n{rows}VERTICAL 360\n{flat}", encoding="utf-8"
    )
    file = small("omni", "left", folder='antennas = "patterns"\n')
    done = assert_done(mapfilter("predict", "-c", file, "--json"))
    assert any("'left' was measured at 900 MHz" in note for note in done.json["notes"])
    omni, left = levels(file)
    # The lobe is left of an antenna that looks east: in the north.
    rows_north = omni.shape[0] // 4
    assert (left - omni)[:rows_north].max() == 0
    assert (left - omni)[-rows_north:].max() < -15


def test_antennas_that_are_not_there_are_refused(small, tmp_path):
    (tmp_path / "patterns").mkdir()
    file = small("gone.msi", "omni", folder='antennas = "patterns"\n')
    assert_refused(mapfilter("predict", "-c", file), "a pattern file gone.msi")
    assert_refused(mapfilter("predict", "-c", small("gone.msi")), "no folder of antennas")
    refused = mapfilter("predict", "-c", small("../gone.msi", folder='antennas = "patterns"\n'))
    assert_refused(refused, "row 2, antenna", "in one folder")
    file = small("gone.msi", folder='antennas = "nowhere"\n')
    assert_refused(mapfilter("predict", "-c", file), "nowhere", "a folder")
    assert not (tmp_path / "out" / "rxlev.tif").exists()


def test_rasters_of_another_program_are_not_overwritten(small, tmp_path):
    file = small("omni")
    assert_done(mapfilter("predict", "-c", file))
    export = tmp_path / "export.tif"
    with rasterio.open(tmp_path / "out" / "rxlev.tif") as source:
        profile, values = source.profile, source.read()
    with rasterio.open(export, "w", **profile) as target:
        target.write(values)
    before = export.read_bytes()
    text = file.read_text(encoding="utf-8")
    for key, write in (("path", "false"), ("ground_truth", "true")):
        changed = text.replace("write = false", f"write = {write}")
        file.write_text(f'{changed}[rasters]\n{key} = "export.tif"\n', encoding="utf-8")
        expected = "export.tif: expected nothing yet, or rasters that mapfilter predicted"
        outcome = mapfilter("predict", "-c", file)
        assert_refused(outcome, expected, "[rasters] names your own export")
        assert export.read_bytes() == before


def test_own_rasters_are_predicted_anew(small, tmp_path):
    file = small("omni")
    text = file.read_text(encoding="utf-8")
    file.write_text(f'{text}[rasters]\npath = "mine.tif"\n', encoding="utf-8")
    for _ in range(2):
        assert_done(mapfilter("predict", "-c", file))
        assert (tmp_path / "mine.tif").is_file()
