"""The page on live use: its code runs, and gives what a replay gives."""

import re
import textwrap
from pathlib import Path

import numpy as np
import pytest
from cross_world import SPEED_MPS, make_database, walk_log

from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.loop import locate
from mapfilter.tracks.log import make_log

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "live.rst"


def test_a_live_application_gets_what_a_replay_gets(tmp_path, monkeypatch):
    (tmp_path / "out").mkdir()
    database = make_database(tmp_path / "out")
    monkeypatch.chdir(tmp_path)
    code, stated = re.findall(r"code-block:: python\n\n((?:   .*\n|\n)+)", PAGE.read_text("utf-8"))
    names = {}
    exec(textwrap.dedent(code), names)
    walked = walk_log()
    radio = walked.radio.iloc[1:].assign(level_dbm=-70.0)
    log = make_log(walked.crs, motion=walked.motion, radio=radio)
    seconds = zip(log.motion.itertuples(), log.radio.itertuples(), strict=True)
    live = [
        names["on_second"](step.time_s, SPEED_MPS, step.heading_rad, row.cell, row.level_dbm)
        for step, row in seconds
    ]
    positioner = BayesFilter(level_error_db=8.0).over(database)
    replayed = locate(log, positioner, np.random.default_rng(0)).estimate
    assert [status for status, *_ in live] == list(replayed.status)
    places = np.array([row[1:] for row in live], dtype=np.float64)
    np.testing.assert_array_equal(places[:, 0], replayed.east_m)
    np.testing.assert_array_equal(places[:, 1], replayed.north_m)
    np.testing.assert_array_equal(places[:, 2], replayed.radii_m[:, 2])
    # The second block is of a log that states more, with the names of the first.
    exec(textwrap.dedent(stated), names)
    assert names["notes"]
    assert names["bayes"].timing.step_m == pytest.approx(78.07, abs=0.01)
