"""Tables written as CSV files and read as one log."""

import pandas as pd
import pytest

import mapfilter as mf


@pytest.fixture
def read(tmp_path):
    """Read tables, each written as a CSV file of its name, as the recordings of one journey."""

    def of(**files):
        for name, columns in files.items():
            pd.DataFrame(columns).to_csv(tmp_path / f"{name}.csv", index=False)
        return mf.read_log([tmp_path / f"{name}.csv" for name in files])

    return of
