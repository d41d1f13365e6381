"""Single reports of published data: accuracy, coverage, and damaged files."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import ConfigError, InputError
from mapfilter.experiments.benchmarks.ottawa import FOLDER
from mapfilter.experiments.benchmarks.single_reports import read_wifi
from mapfilter.workflows.evaluations.single_reports import run_single_reports


def test_published_data_are_located_better_than_by_three_neighbours(shared_data, tmp_path):
    sets = ("LIB1", "TUT1", "uottawa")
    result = run_single_reports(
        shared_data, tmp_path, sets=sets, methods=("auto", "probabilistic", "centroid", "3-nn")
    )
    rows = {(row.data, row.method): row for row in result.rows}
    for name in sets:
        assert rows[name, "auto"].mean_m < rows[name, "3-nn"].mean_m
        assert 0.9 < rows[name, "auto"].within_95 < 0.99
        assert (tmp_path / f"{name}.png").is_file()
    assert rows["TUT1", "auto"].mean_m == pytest.approx(5.86, abs=0.05)
    assert rows["uottawa", "auto"].median_m < 85 < 105 < rows["uottawa", "centroid"].median_m
    assert 0.93 < rows["uottawa", "probabilistic"].within_95 < 0.97
    assert rows["uottawa", "auto"].located == 330


def test_training_and_test_reports_share_no_row(shared_data):
    training, test = read_wifi(shared_data / "fingerprint-wifi", "TUT1")
    assert (len(training), len(test)) == (1476, 490)
    assert np.isfinite(training.level_dbm).all()
    assert training.level_dbm.max() <= 0


def test_a_missing_or_damaged_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"UJI1\.mat"):
        read_wifi(tmp_path, "UJI1")
    (tmp_path / "UJI1.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(200))
    with pytest.raises(InputError, match="fingerprints"):
        read_wifi(tmp_path, "UJI1")


def test_sessions_without_a_cell_in_common_are_not_located(tmp_path):
    folder = tmp_path / FOLDER / "carling"
    folder.mkdir(parents=True)
    for number in range(2):
        rows = pd.DataFrame({"measured_at": 1000 * np.arange(20), "cellid": 7 + number})
        rows["lat"], rows["lon"] = 45.4 + 1e-4 * np.arange(20), -75.6
        others = {"mcc": 302, "mnc": 720, "lac": 1, "rating": 5, "speed": 1, "direction": 0}
        rows.assign(**others, signal=-90, ta=-1).to_csv(folder / f"s{number}.csv", index=False)
    result = run_single_reports(
        tmp_path, tmp_path / "out", sets=("carling", "carling"), methods=("centroid",)
    )
    (row,) = result.rows
    assert (row.reports, row.located) == (40, 0)
    figures = (row.mean_m, row.median_m, row.error_95_m, row.within_50, row.within_95)
    assert np.isnan(figures).all()
    assert not (tmp_path / "out" / "carling.png").exists()


def test_an_unknown_set_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="UJI1, TUT1"):
        run_single_reports(tmp_path, tmp_path, sets=("UJI2",))
