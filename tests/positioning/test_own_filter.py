# ruff: noqa: ARG002
"""Custom filters: imported by name, refused at the door, run over a log."""

import sys
from dataclasses import dataclass
from math import isnan, nan

import numpy as np
import pytest
from cross_world import CROSSING, make_database, walk_log
from sky_world import sky_log

from mapfilter.errors import ConfigError
from mapfilter.filters.contract import Estimate, MotionStep, Reason, Status, UpdateInfo
from mapfilter.positioning.custom_filter import CustomFilter, adapted, custom_filter
from mapfilter.positioning.loop import locate
from mapfilter.tracks.log import make_log

HERE = __name__


@dataclass(frozen=True)
class Counting:
    """Counts what it is given; is where the last fix was."""

    database: object
    east_m: float = nan

    def init(self, first, rng):
        return ("init", first.time_s), 0

    def predict(self, belief, motion, rng):
        return (belief[0], belief[1] + 1), Reason.USED

    def update(self, belief, epoch, rng):
        status = Status.SEARCHING if epoch.time_s < 10 else Status.CONVERGED
        status = status if epoch.time_s <= 10 else Status.TRACKING
        return belief, UpdateInfo(Reason.USED, status, 7)

    def locate(self, belief):
        return Estimate(*CROSSING, np.eye(2) * belief[1], np.arange(3.0))


class Half:
    def __init__(self, database):
        pass

    def init(self, first, rng):
        return None

    def predict(self, belief, motion, rng):
        return belief, Reason.USED


class Failing(Counting):
    def update(self, belief, epoch, rng):
        raise ValueError("the idea\nwas wrong")


class Talking(Counting):
    def update(self, belief, epoch, rng):
        return belief, "all is well"


class Naming(Counting):
    def update(self, belief, epoch, rng):
        return belief, UpdateInfo(Reason.USED, "TRACKING", 7)


class Reasoning(Counting):
    def update(self, belief, epoch, rng):
        return belief, UpdateInfo("used", Status.TRACKING, 7)


class Floating(Counting):
    def locate(self, belief):
        return CROSSING


def half_made(database):
    return Half(database)


NOT_CALLED = 3.0


def test_a_filter_follows_a_log_from_its_first_known_cell(tmp_path):
    database = make_database(tmp_path)
    log = walk_log()
    radio = log.radio.assign(cell=log.radio["cell"].where(log.radio["time_s"] > 3, "elsewhere"))
    log = make_log(log.crs, motion=log.motion, radio=radio, truth=log.truth)
    choice = custom_filter(f"{HERE}:Counting")
    found = locate(log, choice.over(database), np.random.default_rng(0)).estimate
    assert found.filter == choice.name == f"{HERE}:Counting"
    assert [isnan(east) for east in found.east_m[:6]] == [True] * 4 + [False] * 2
    assert found.reason[0] is Reason.UNKNOWN_CELL
    assert found.status[9:13] == (Status.SEARCHING, Status.CONVERGED, *[Status.TRACKING] * 2)
    assert found.hypotheses[-1] == 7
    assert found.covariance_m2[-1, 0, 0] == len(log.motion) - 4
    told = {(one.kind, one.reason) for one in found.unused}
    assert told == {("motion", Reason.NOT_STARTED), ("serving", Reason.UNKNOWN_CELL)}
    assert found.way_id[-1] > 0
    bound = choice.over(database, ways=False)
    without = locate(log, bound, np.random.default_rng(0)).estimate
    assert not without.way_id.any()


def test_it_may_start_from_a_fix(tmp_path):
    log = walk_log()
    gnss = log.truth.iloc[[5]].assign(var_east_m2=4.0, var_north_m2=4.0)
    log = make_log(log.crs, motion=log.motion, gnss=gnss)
    database = make_database(tmp_path)
    own = adapted(Counting(database), database, "a:b")
    assert own.ways
    found = locate(log, own, np.random.default_rng(0)).estimate
    assert np.flatnonzero(np.isfinite(found.east_m))[0] == np.searchsorted(found.time_s, 5.0)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        (
            "no_such_module:F",
            r"ModuleNotFoundError: No module named 'no_such_module' \(likely: its",
        ),
        (f"{HERE}:Missing", "has no attribute 'Missing'"),
        (f"{HERE}:NOT_CALLED", "expected a class, or a function .+ found float"),
        (f"{HERE}:Half", "init, predict, update, locate \\(or begin and step\\), found no update"),
    ],
)
def test_what_is_no_filter_is_refused_at_the_door(name, told):
    with pytest.raises(ConfigError, match=told):
        custom_filter(name)


@pytest.mark.parametrize("text", ["raise RuntimeError('no')", "import sys; sys.exit(3)", "def f(:"])
def test_a_module_that_cannot_be_imported_is_told(text, tmp_path, monkeypatch):
    name = f"broken_{abs(hash(text))}"
    (tmp_path / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ConfigError, match=r"imported as package\.module:Name") as caught:
        custom_filter(f"{name}:F")
    assert len(str(caught.value).splitlines()) == 1


def test_what_a_function_makes_is_looked_at_too(tmp_path):
    made = custom_filter(f"{HERE}:half_made")
    with pytest.raises(ConfigError, match="found no update, locate"):
        made.over(make_database(tmp_path))


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("Failing", r"test_own_filter.py line \d+, in update: .*ValueError: the idea was wrong"),
        ("Talking", r"Talking, update: expected it to return \(belief, UpdateInfo\), found"),
        ("Naming", "Naming, update: expected it to return a Status, found 'TRACKING'$"),
        ("Reasoning", "Reasoning, update: expected it to return a Reason, found 'used'$"),
        ("Floating", "Floating, locate: expected it to return Estimate, found tuple$"),
    ],
)
def test_what_goes_wrong_in_it_is_told_with_its_place(name, told, tmp_path):
    bound = CustomFilter(f"{HERE}:{name}").over(make_database(tmp_path))
    with pytest.raises(ConfigError, match=told) as caught:
        locate(walk_log(), bound, np.random.default_rng(0))
    assert isinstance(caught.value.__cause__, ValueError | TypeError)


def test_a_changed_text_is_another_filter(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    file = tmp_path / "changing_filter.py"
    found = []
    for bound in (1, 2):
        file.write_text(f"from {HERE} import Counting\nclass F(Counting):\n    bound = {bound}\n")
        found.append(custom_filter("changing_filter:F"))
        del sys.modules["changing_filter"]
    assert found[0].name == found[1].name
    assert found[0] != found[1]


def test_steps_reach_it_as_they_were_logged(tmp_path):
    seen = []

    class Watching(Counting):
        def predict(self, belief, motion, rng):
            seen.append(motion)
            return super().predict(belief, motion, rng)

    log = walk_log()
    log = make_log(log.crs, motion=log.motion.assign(heading_rad=nan), radio=log.radio)
    database = make_database(tmp_path)
    locate(log, adapted(Watching(database), database, "a:b"), np.random.default_rng(0))
    assert len(seen) == len(log.motion)
    assert all(isinstance(step, MotionStep) and isnan(step.heading_rad) for step in seen)


def test_satellites_alone_reach_it(tmp_path):
    seen = []

    class Watching(Counting):
        def update(self, belief, epoch, rng):
            seen.append((len(epoch.radio), len(epoch.pseudoranges)))
            return super().update(belief, epoch, rng)

    log = sky_log(legs=((0.0, 30.0),), most=2)
    first = log.radio[log.radio["time_s"] == 0]
    log = make_log(log.crs, motion=log.motion, radio=first, pseudoranges=log.pseudoranges)
    database = make_database(tmp_path)
    locate(log, adapted(Watching(database), database, "a:b"), np.random.default_rng(0))
    assert len(seen) > 10
    assert seen[0] == (1, 2)
    assert set(seen[1:]) == {(0, 2)}
