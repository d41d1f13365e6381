"""Files of recordings: tables written as CSV and read as one log, and one of each format."""

import pandas as pd
import pytest
from made_recordings import MADE

import mapfilter as mf


@pytest.fixture
def read(tmp_path):
    """Read tables, each written as a CSV file of its name, as the recordings of one journey."""

    def of(**files):
        for name, columns in files.items():
            pd.DataFrame(columns).to_csv(tmp_path / f"{name}.csv", index=False)
        return mf.read_log([tmp_path / f"{name}.csv" for name in files])

    return of


@pytest.fixture
def written(tmp_path):
    """Write the made recording of a format, or other data under its name; return its path."""

    def write(name, data=None):
        file, text = MADE[name]
        path = tmp_path / file
        content = text if data is None else data
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write
