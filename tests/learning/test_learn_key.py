"""What tracks of ``learn --resume`` depend on: all that their logs hold."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.tracks.log import make_log
from mapfilter.workflows.lessons.key import study_key

DATABASE = SimpleNamespace(generation="first")


def log(**changes):
    motion = pd.DataFrame({"time_s": np.arange(1.0, 5.0), "step_m": 1.0, "heading_rad": 0.5})
    radio = pd.DataFrame({"time_s": [1.0, 2.0], "role": "serving", "cell": ["A", None],
                          "level_dbm": [-80.0, -81.0]})  # fmt: skip
    tables = {"motion": motion, "radio": radio}
    return make_log("EPSG:32629", **{**tables, **changes})


def key(logs=None, names=("a",), choice=None, seed=1, use_truth=True, database=DATABASE):
    return study_key(database, names, logs or [log()], choice or BayesFilter(), seed, use_truth)


def test_it_is_the_same_for_logs_that_were_opened_again():
    assert key() == key([log()])
    assert key() == key([replace(log(), notes=("read from another folder",))])


@pytest.mark.parametrize(
    "other",
    [
        {"names": ("b",)},
        {"choice": BayesFilter(max_particles=9000)},
        {"seed": 2},
        {"use_truth": False},
        {"database": SimpleNamespace(generation="second")},
        {"logs": [log(), log()]},
        {"logs": [log(motion=log().motion.assign(heading_rad=-0.5))]},
        {"logs": [log(motion=log().motion.assign(step_m=0.3048))]},
        {"logs": [log(radio=log().radio.assign(cell=["A", "B"]))]},
        {"logs": [log(radio=log().radio[:1])]},
        {"logs": [replace(log(), vehicle=True)]},
        {"logs": [replace(log(), crs="EPSG:32630")]},
        {"logs": [log(truth=pd.DataFrame({"time_s": [1.0], "east_m": 5e5, "north_m": 4e6}))]},
    ],
)
def test_whatever_changes_a_log_or_a_track_is_another_key(other):
    assert key(**other) != key()
