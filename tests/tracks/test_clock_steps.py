"""Clocks that are set back while a log is recorded."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.clock_steps import told_clock_steps
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"


def motion(time_s):
    return pd.DataFrame({"time_s": time_s, "step_m": 1.4, "heading_rad": 0.5 + 0.01 * time_s})


@pytest.mark.parametrize("back_s", [5.5, 30.5])
def test_a_clock_that_is_set_back_is_noted_with_when_and_by_how_much(back_s):
    time_s = np.arange(120.0)
    time_s[60:] -= back_s
    log = make_log(CRS, motion=motion(time_s))
    assert len(log.motion) == 120
    # The first row after the step comes a second after the last one before it.
    said = [note for note in log.notes if "as when a clock is set back" in note]
    assert len(said) == 1
    assert f"goes back by {back_s - 1:g} s after 59 s" in said[0]


def test_two_rows_out_of_order_are_no_clock():
    time_s = np.arange(120.0)
    time_s[[60, 61]] = time_s[[61, 60]]
    notes = make_log(CRS, motion=motion(time_s)).notes
    assert not any("clock" in note for note in notes)
    assert any("out of order in 1 places, sorted by time" in note for note in notes)


def test_every_step_of_a_few_is_named_and_many_are_none():
    def stepped(steps):
        time_s = np.arange(50.0 * (steps + 1))
        for step in range(steps):
            time_s[50 * (step + 1) :] -= 10.5
        return told_clock_steps(time_s)

    assert stepped(2).count("by 9.5 s after") == 2
    assert stepped(0) is None
