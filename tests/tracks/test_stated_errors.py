"""Accuracies that are a dilution of precision (HDOP) for metres."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.tracks.readers.formats import read_recording

COUNT = 400
TIME_S = 1_777_629_600 + np.arange(float(COUNT))
METRES_PER_DEGREE = 111_195.0
EAST_M, NORTH_M = 8.0 * np.arange(COUNT), 300 * np.sin(np.arange(COUNT) / 40)


def positions(path, sd_m, seed, **columns):
    """Write positions whose errors last for half a minute, as those of a receiver do."""
    rng = np.random.default_rng(seed)
    off_m = rng.normal(0, sd_m, (2, COUNT))
    keep = np.exp(-1 / 30)
    for at in range(1, COUNT):
        off_m[:, at] = keep * off_m[:, at - 1] + (1 - keep**2) ** 0.5 * off_m[:, at]
    lat = 60 + (NORTH_M + off_m[1]) / METRES_PER_DEGREE
    lon = 25 + 2 * (EAST_M + off_m[0]) / METRES_PER_DEGREE
    pd.DataFrame({"time": TIME_S, "lat": lat, "lon": lon, **columns}).to_csv(path, index=False)
    return path


def hdop(seed):
    return np.random.default_rng(seed).choice([0.7, 0.8, 0.9, 1.1, 1.3], COUNT)


def told(files, **options):
    return [note for note in mf.read_log(files, **options).notes if "HDOP" in note]


@pytest.mark.parametrize("column", ["satellites", "num_sats", "sats_used", "nsat"])
def test_tenths_beside_satellites_are_hdop(tmp_path, column):
    path = positions(tmp_path / "a.csv", 3.0, 1, accuracy=hdop(1), **{column: 9})
    (note,) = told(path)
    assert note.endswith('columns={"hdop": "accuracy"} reads HDOP')
    log = mf.read_log(path, columns={"hdop": "accuracy"})
    assert not any("HDOP" in note for note in log.notes)
    # As those of GPX and NMEA: 4 m times HDOP hold 68 %.
    expected_m = 4.0 * hdop(1) / (-2 * np.log(0.32)) ** 0.5
    assert np.sqrt(log.gnss["var_east_m2"].to_numpy()) == pytest.approx(expected_m, rel=0.01)
    # The person says that they are metres.
    assert told(path, columns={"accuracy_m": "accuracy"}) == []


@pytest.mark.parametrize(
    "columns",
    [
        {"accuracy": hdop(1)},
        {"accuracy_m": hdop(1), "satellites": 9},
        {"accuracy": hdop(1) + 0.013, "satellites": 9},
        {"accuracy": hdop(1) + 0.4, "satellites": 9},
        {"accuracy": np.round(3 * hdop(1), 1), "satellites": 9},
        {"accuracy": 0.1 * hdop(1).round(), "satellites": 20},
        {"accuracy": 0.9, "satellites": 9},
        {"accuracy": hdop(1), "satisfaction": 9},
    ],
    ids=["alone", "in metres", "no tenths", "above 1", "phone", "RTK", "constant", "others"],
)
def test_metres_are_no_hdop(tmp_path, columns):
    assert told(positions(tmp_path / "a.csv", 1.0, 1, **columns)) == []


def test_a_column_of_hdop_gives_the_accuracy(tmp_path):
    log = mf.read_log(positions(tmp_path / "a.csv", 3.0, 1, hdop=hdop(1)))
    assert log.gnss["var_east_m2"].notna().all()
    assert log.notes == ()


def test_hdop_serves_where_an_accuracy_is_missing(tmp_path):
    """As in GPX; beside a column of accuracies, even an empty one, HDOP was not used at all."""
    given_m = np.where(np.arange(COUNT) % 2, 5.0, np.nan)
    path = positions(tmp_path / "a.csv", 3.0, 1, accuracy=given_m, hdop=2.0)
    stated_m = np.where(np.arange(COUNT) % 2, 5.0, 4.0 * 2.0)
    assert read_recording(path).tables["positions"]["accuracy_m"].tolist() == stated_m.tolist()


@pytest.mark.parametrize("seed", range(5))
def test_errors_several_times_as_large_as_stated_are_noted_beside_others(tmp_path, seed):
    fixes = positions(tmp_path / "fixes.csv", 5.0, seed, accuracy=hdop(seed))
    other = positions(tmp_path / "other.csv", 0.5, seed + 100, accuracy=1.0)
    for files, options, of in (
        ([fixes, other], {"truth": other}, "the truth"),
        ([fixes, other], {}, "other.csv"),
    ):
        (note, *_) = told(files, **options)
        assert f"from those of {of}, " in note
        assert 'columns={"hdop": "COLUMN"}' in note
    assert told([fixes, other], truth=other, columns={"hdop": "accuracy"}) == []


@pytest.mark.parametrize("seed", range(10))
def test_honest_accuracies_are_not_noted(tmp_path, seed):
    """Those of a good phone, and of RTK, beside the truth, and beside a file that states none."""
    truth = positions(tmp_path / "truth.csv", 0.02, seed + 100)
    for sd_m, accuracy in ((1.0, 1.5), (0.7, 1.0), (0.02, 0.03), (3.0, 4.5), (1.0, 0.8)):
        fixes = positions(tmp_path / "fixes.csv", sd_m, seed, accuracy=accuracy)
        assert told([fixes, truth], truth=truth) == []
    network = positions(tmp_path / "truth.csv", 30.0, seed + 100)
    assert told([positions(fixes, 0.7, seed, accuracy=1.0), network]) == []
