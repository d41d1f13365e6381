"""How much satellites as a whole may say for or against an alternative: by time since its start."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest

from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.gnss.trail import Contradiction

OPTIONS = replace(GnssOptions(), trust=3.0, trust_grows_s=10.0)


@dataclass(frozen=True)
class Alternative:
    start_s: float = 100.0
    gnss_log_bayes_factor: float = 0.0


@pytest.mark.parametrize(
    ("time_s", "before", "step", "after"),
    [
        (100.0, 1.0, 1.0, 2.0),
        (100.0, 2.5, 1.0, 3.0),
        (100.0, -2.5, -1.0, -3.0),
        # One more after each ten seconds, on both sides.
        (120.0, 4.5, 1.0, 5.0),
        (120.0, -4.5, -1.0, -5.0),
        (120.0, -4.5, 0.25, -4.25),
        # A time before the start takes nothing away.
        (50.0, 2.5, 1.0, 3.0),
    ],
)
def test_trust_grows_with_time(time_s, before, step, after):
    source = SimpleNamespace(options=OPTIONS)
    given = Alternative(gnss_log_bayes_factor=before)
    found = GnssSource._supported(source, given, step, time_s, None)
    assert found == replace(given, gnss_log_bayes_factor=pytest.approx(after))


@pytest.mark.parametrize(
    ("before", "step", "nats", "after"),
    [(1.0, 1.0, 6.0, 3.0), (11.5, 1.0, 6.0, 12.0), (1.0, -1.0, 6.0, -1.0), (1.0, 1.0, 0.0, 2.0)],
)
def test_fixes_that_contradict_a_belief_count_twice_and_up_to_twelve(before, step, nats, after):
    source = SimpleNamespace(options=replace(OPTIONS, agreed_nats=2.0, agreed_trust=12.0))
    found = Contradiction(0.0, 0.1, 3, goes_on=True, nats=nats)
    given = Alternative(gnss_log_bayes_factor=before)
    made = GnssSource._supported(source, given, step, 100.0, found)
    assert made.gnss_log_bayes_factor == after
