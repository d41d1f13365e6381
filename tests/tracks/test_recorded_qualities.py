"""Recordings whose levels are qualities."""

import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording


def recorded(tmp_path, levels):
    path = tmp_path / "walk.csv"
    columns = {"time": range(len(levels)), "cell": "A", "q": levels}
    pd.DataFrame(columns).to_csv(path, index=False)
    return read_recording(path, options=ReadOptions(columns={"level_dbm": "q"}))


def test_rsrq_mapped_as_a_level_is_refused(tmp_path):
    told = r"column q \(level_dbm\): expected levels in dBm.*found 30 of 30 values from -17.5 to -3"
    with pytest.raises(InputError, match=told):
        recorded(tmp_path, [-3 - i / 2 for i in range(30)])


def test_levels_and_few_values_are_read(tmp_path):
    for levels in ([-25 - i for i in range(60)], [-12.0, -14.0]):
        assert len(recorded(tmp_path, levels).tables["radio"]) == len(levels)
