"""Logs without positions over the sites of a plan: headings are turned to the grid at its cells."""

import math

import numpy as np
import pandas as pd
import pytest
from command_line import assert_refused, mapfilter

from mapfilter.config.load import load_config
from mapfilter.tracks.checks.placeless import is_local_frame
from mapfilter.workflows.convert import run_convert
from mapfilter.workflows.replays.logs import ReplayLogs

CRS, LAT, LON = "EPSG:32635", 60.17, 24.94
# Of the meridian of zone 35, 27 degrees east: by the sine of the latitude.
CONVERGENCE_RAD = math.radians((LON - 27.0) * math.sin(math.radians(LAT)))
PLAN = "cell,lat,lon,height_m,eirp_dbm,frequency_mhz\n"
IN_METRES = "cell,east,north,height_m,eirp_dbm,frequency_mhz\nA,400,300,30,50,1800\n"


@pytest.fixture
def walk(tmp_path):
    """Steps to the north-east by a compass; a cell north and one south of the place."""
    rows = {"time_s": np.arange(40.0), "step_m": 1.4, "compass_deg": 30.0}
    rows |= {"cell": "A", "level_dbm": -80.0 - np.arange(40) % 3}
    pd.DataFrame(rows).to_csv(tmp_path / "walk.csv", index=False)
    cells = [f"{name},{LAT + by},{LON},30,50,1800\n" for name, by in (("A", 0.01), ("B", -0.01))]
    (tmp_path / "cells.csv").write_text(PLAN + "".join(cells))
    run_convert([tmp_path / "walk.csv"], tmp_path / "log")
    return tmp_path


def opened(walk, log, crs=""):
    given = [f"track.path='{walk / log}'", f"cells.plan='{walk / 'cells.csv'}'"]
    config = load_config(None, [*given, *([f"area.crs='{crs}'"] if crs else [])])
    logs = ReplayLogs(config, None)
    logs.check(None)
    return logs.open(walk / log).log


@pytest.mark.parametrize("log", ["walk.csv", "log"])
@pytest.mark.parametrize("crs", ["", CRS])
def test_headings_of_a_compass_are_turned_as_at_the_cells(walk, log, crs):
    """They stayed as from true north; without a CRS, in a frame whose north is 21 degrees off."""
    found = opened(walk, log, crs)
    assert found.crs == CRS
    expected = math.radians(60.0) + CONVERGENCE_RAD
    np.testing.assert_allclose(found.motion["heading_rad"], expected, atol=2e-4)


def test_a_plan_in_metres_of_its_own_frame_turns_nothing(walk):
    (walk / "cells.csv").write_text(IN_METRES)
    found = opened(walk, "log")
    assert is_local_frame(found.crs)
    np.testing.assert_allclose(found.motion["heading_rad"], math.radians(60.0), atol=1e-9)


def test_a_wrong_plan_is_refused_once_for_all_logs(walk):
    run_convert([walk / "walk.csv"], walk / "logs" / "one")
    run_convert([walk / "walk.csv"], walk / "logs" / "two")
    (walk / "cells.csv").write_text(PLAN + f"A,{LAT},{LON},30,50,none\n")
    given = ("replay", "--filter", "ekf", "--log", walk / "logs", "--out", walk / "out")
    done = mapfilter(*given, f"--set=cells.plan={walk / 'cells.csv'}")
    assert_refused(done, "frequency_mhz")
    assert done.err.count("mapfilter: error") == 1
