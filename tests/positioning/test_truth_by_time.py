"""Ground truth whose index holds the times is scored as that with a column of them."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.filters.contract import Reason
from mapfilter.positioning.estimate import TrackEstimate

TRUTH = pd.DataFrame({"time_s": np.arange(5.0), "east_m": np.arange(5.0) * 30, "north_m": 0.0})


def test_times_in_the_index_are_times():
    fixes = [mf.Fix.nowhere(float(n), mf.Status.SEARCHING, Reason.USED) for n in range(5)]
    estimate = TrackEstimate.of_fixes("EPSG:32632", "made", fixes)
    found = mf.score(estimate, TRUTH.set_index("time_s"))
    assert found.to_dataframe().equals(mf.score(estimate, TRUTH).to_dataframe())
    with pytest.raises(mf.MapfilterError, match="expected columns time_s, east_m and north_m"):
        mf.score(estimate, TRUTH.set_index("time_s").rename_axis("logged"))
