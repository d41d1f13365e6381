"""Positions of two recordings, of which one falls silent on the way."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.tracks.joining.position_shift import median_apart_m

TIME_S = 1_778_666_400.0 + np.arange(600.0)
METRES_PER_DEGREE = 111_195.0


@pytest.mark.parametrize("jammed_s", [(120, 520), (0, 0)])
def test_positions_in_the_gap_of_a_jammed_receiver_are_not_compared(tmp_path, jammed_s):
    """A truth that is known there lies far from the straight line across the gap."""
    angle = np.linspace(0, 4 * np.pi, TIME_S.size)
    lat = 60 + 400 * np.sin(angle) / METRES_PER_DEGREE
    lon = 25 + 800 * np.cos(angle) / METRES_PER_DEGREE
    off = np.random.default_rng(0).normal(0, 3 / METRES_PER_DEGREE, TIME_S.size)
    table = pd.DataFrame({"time": TIME_S, "lat": lat, "lon": lon})
    table.to_csv(tmp_path / "truth.csv", index=False)
    received = table.assign(lat=lat + off).drop(index=range(*jammed_s))
    received.to_csv(tmp_path / "receiver.csv", index=False)
    log = mf.read_log([tmp_path / "receiver.csv"], truth=[tmp_path / "truth.csv"])
    (note,) = (note for note in log.notes if "positions agree" in note)
    assert float(note.partition(" within ")[2].split()[0]) < 4


def test_ends_of_a_gap_are_known():
    zero = np.zeros(6)
    one = np.array([0.0, 1, 2, 100, 101, 102]), zero, np.array([0, 0, 0, 1.0, 1, 1])
    other = np.array([2.0, 50, 100]), np.zeros(3), np.array([0.0, 9, 1])
    assert np.isnan(median_apart_m(one, other, 0.0, 0.1))
    inside = np.array([1.0, 2, 50, 100, 101]), np.zeros(5), np.array([0.0, 0, 9, 1, 1])
    assert median_apart_m(one, inside, 0.0, 0.1) == 0
    slow = np.array([0.0, 40, 80]), np.zeros(3), np.array([0.0, 1, 2])
    between = np.array([10.0, 20, 30]), np.zeros(3), np.array([0.25, 0.5, 0.75])
    assert median_apart_m(slow, between, 0.0, 0.1) == pytest.approx(0, abs=1e-6)


def test_a_track_of_one_place_has_no_gaps():
    once = np.array([10.0]), np.array([8.0]), np.array([50.0])
    stood = np.full(9, 10.0), np.full(9, 8.0), np.full(9, 50.0)
    assert median_apart_m(once, stood, 0.0, 0.1) == 0.0
    assert np.isnan(median_apart_m(once, stood, 1.0, 0.1))
