"""The benchmark's cases with satellites: asked for by name only, over the same walks."""

import numpy as np
import pandas as pd
import pytest
import shapely

from mapfilter.errors import ConfigError
from mapfilter.experiments.benchmarks import journeys as satellites
from mapfilter.experiments.benchmarks.cases import CASES, USUAL
from mapfilter.experiments.benchmarks.journeys import SPOOFED_S, Walk, spoofer_of, with_satellites
from mapfilter.gnss.skyline import Skyline
from mapfilter.simulation.reflections import NlosModel
from mapfilter.simulation.satellites import ReceptionModel
from mapfilter.tracks.log import make_log
from mapfilter.workflows.evaluate import check_cases

CRS = "EPSG:32629"
NAMES = [*(f"satellites-{count}" for count in range(5)), "spoofed"]
TRUTH = pd.DataFrame(
    {"time_s": np.arange(401.0), "east_m": 531_000.0 + 1.4 * np.arange(401.0), "north_m": 4.556e6}
)
WALKED = Walk(TRUTH)


def log_of(name):
    return with_satellites(CASES[name], make_log(CRS, truth=TRUTH), WALKED, None, 1, 2)


def test_they_are_run_only_when_asked_for():
    assert set(NAMES).isdisjoint(USUAL)
    assert check_cases(()) == USUAL
    assert check_cases(NAMES) == tuple(NAMES)
    with pytest.raises(ConfigError, match="satellites-4"):
        check_cases(["satellites-9"])


def test_cases_of_a_walk_see_the_same_sky():
    few, many, none = (log_of(f"satellites-{n}").pseudoranges for n in (2, 4, 0))
    assert none.empty
    keys = ["time_s", "satellite", "pseudorange_m"]
    assert len(few.merge(many, on=keys)) == len(few)
    spoofer, spoofed = spoofer_of(WALKED, 1, 2), log_of("spoofed").pseudoranges
    changed = many["pseudorange_m"].to_numpy() != spoofed["pseudorange_m"].to_numpy()
    times = many["time_s"][changed]
    assert times.min() >= spoofer.from_s
    assert times.max() <= spoofer.from_s + SPOOFED_S
    assert np.hypot(spoofer.east_m, spoofer.north_m) == pytest.approx(500.0)


def test_a_case_without_a_receiver_hears_nothing():
    log = make_log(CRS, truth=TRUTH)
    assert with_satellites(CASES["levels-6"], log, WALKED, None, 1, 2) is log


def test_reflections_are_switched_on_by_a_model_and_change_nothing_else():
    log = make_log(CRS, truth=TRUTH)
    street = Skyline([shapely.box(530_000, 4_556_008, 532_000, 4_556_060)], [25.0])
    case = CASES["satellites-4"]
    models = (None, ReceptionModel(), ReceptionModel(nlos=NlosModel(share=1.0)))
    plain, same, more = (
        with_satellites(case, log, WALKED, street, 1, 2, model).pseudoranges for model in models
    )
    pd.testing.assert_frame_equal(plain, same, check_exact=True)
    assert more.groupby("time_s").size().max() == 4
    assert not more["pseudorange_m"].equals(plain["pseudorange_m"])


class Quarters:
    """Draws a quarter of the way between two ends, or half a deviation above the mean."""

    def uniform(self, low, high):
        return low + 0.25 * (high - low)

    def normal(self, mean, sd):
        return mean + 0.5 * sd


def test_when_and_whither_a_spoofer_leads(monkeypatch):
    monkeypatch.setattr(satellites, "named_rng", lambda *_: Quarters())
    # From 160 s, 40 % of the walk, to two minutes before its end.
    found = spoofer_of(WALKED, 1, 2)
    assert found.from_s == pytest.approx(160.0 + 0.25 * 120.0)
    assert (found.east_m, found.north_m) == pytest.approx((0.0, 500.0), abs=1e-9)
    # A walk that is too short for that is spoofed at once.
    assert spoofer_of(Walk(TRUTH.iloc[:101]), 1, 2).from_s == pytest.approx(40.0)


def test_a_walk_is_at_any_time_of_a_day(monkeypatch):
    given = []

    def received(*arguments):
        given.append(arguments)
        return log_of_none

    log_of_none = make_log(CRS, truth=TRUTH).pseudoranges
    monkeypatch.setattr(satellites, "named_rng", lambda *_: Quarters())
    monkeypatch.setattr(satellites, "receive", received)
    log = log_of("satellites-3")
    assert log.start_utc_s == 1_700_000_000.0 + 21_600.0
    ((truth, crs, skyline, _, start_utc_s, model, _, spoofer),) = given
    assert (truth is TRUTH, crs, skyline, start_utc_s) == (True, CRS, None, log.start_utc_s)
    assert (model.most, model.height_m, spoofer) == (3, 100.0, None)
    log_of("spoofed")
    assert given[1][-1].from_s == pytest.approx(190.0)
