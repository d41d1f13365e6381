"""Usual options: of vehicles, satellites, timing, alternatives and methods for single reports."""

from dataclasses import asdict

import pytest

from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules
from mapfilter.positioning.bayes.rivals.mirrored import MirrorRules
from mapfilter.positioning.bayes.state import FIRST_SPACING_M
from mapfilter.positioning.epochs import FIX_SD_M
from mapfilter.positioning.fingerprints.cross_validation import MOST_FOLDS, MOST_VALIDATED
from mapfilter.positioning.fingerprints.options import (
    CANDIDATES,
    LEVEL_ERROR_DB,
    Centroid,
    Neighbours,
    Probabilistic,
    SurveyMaps,
    method_name,
    method_options,
)
from mapfilter.positioning.fingerprints.planned import PATTERN_SHARE, TIMING_CLIP_SD, TIMING_SD_M
from mapfilter.positioning.fingerprints.sources import MOST_POINTS, STRONGEST
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions
from mapfilter.positioning.integrity import DEFAULT_RISK


def test_the_usual_options_of_satellites_and_timing():
    assert asdict(GnssOptions()) == {
        "zenith_m": 2.0, "echo_m": 4.0, "echo_memory_m": 100.0, "echo_memory_s": 120.0,
        "reflection_m": 4.0, "reflection_times": 2.0, "lateness": 1.0, "fix_memory_m": 20.0,
        "fix_memory_s": 0.0, "spacing_m": 10.0, "pause_s": 10.0, "mask_deg": 5.0,
        "height_m": 100.0, "height_sd_m": 200.0, "slope": 0.3, "clock_sd_m": 3e5,
        "drift_sd_mps": 100.0,
        "outliers": 0.05, "gate": 8.0, "search_gate": 16.0, "probation_s": 5.0, "trust": 3.0,
        "trust_grows_s": 120.0, "dispute_s": 10.0, "trial_m": 100.0,
        "agreed_trust": 12.0, "agreed_nats": 2.0,
    }  # fmt: skip
    assert asdict(TimingOptions()) == {
        "step_m": pytest.approx(553.46, abs=0.01), "advance_sd_m": 200.0,
        "advance_memory_m": 500.0, "difference_memory_m": 20.0, "difference_sd_m": 30.0,
        "clip_sd": 3.0, "height_m": 1.5,
    }  # fmt: skip


def test_the_usual_rules_of_alternatives():
    assert asdict(AlternativeRules()) == {
        "start_log_odds": -1.0,
        "search_threshold": 4.0,
        "lost_threshold": 8.0,
        "confirm_mass": 0.9,
        "abandon_threshold": -25.0,
        "abandon_after_m": 800.0,
        "converge_log_odds": -12.0,
        "converge_threshold": 2.0,
        "map_nats_per_m": 0.04,
        "claimed_from": 0.95,
        "takes_over_searching": False,
    }


def test_the_usual_rules_of_phones_that_are_turned_and_of_mirrored_paths():
    assert asdict(HoldRules()) == {
        "watched": True, "jump_deg": 60.0, "around_deg": 150.0, "bend_deg": 35.0,
        "longest_row_m": 3.0, "longest_pause_s": 3.0, "probability": 0.006,
        "around_probability": 0.25, "back_odds": 4.0, "mirrored_odds": 0.25,
        "lost_log_odds": -1.0, "lost_after_m": 7.0, "win_log_odds": 8.0,
        "abandon_threshold": -4.0, "abandon_after_m": 400.0, "abandon_ahead_after_m": 1200.0,
        "max_beliefs": 6, "particles": 1000,
        "misplaced_probability": 0.02, "misplaced_sd_m": 100.0, "confirm_mass": 0.95,
    }  # fmt: skip
    assert asdict(MirrorRules()) == {
        "least_lead": 6.0, "lead_share": 0.4, "usual_nats_per_m": 0.03, "margin_nats": 4.0,
        "least_turned_rad": pytest.approx(3.14159, abs=1e-5),
    }  # fmt: skip


def test_the_usual_options_of_methods_for_single_reports():
    levels = {
        "shared_db": 3.0, "absence_per_db": 0.2, "effective_readings": 8.0, "timing_sd_steps": 0.5,
        "outliers": 0.001,
    }  # fmt: skip
    neighbours = {
        "k": 15, "metric": "sorensen", "representation": "powed", "exponent": 1.5,
        "weight_power": 4.0,
    }  # fmt: skip
    assert asdict(Neighbours()) == neighbours
    assert asdict(Probabilistic()) == {"level_db": 5.0, **levels}
    assert asdict(SurveyMaps()) == {"level_db": 4.0, **levels}
    assert LEVEL_ERROR_DB == 6.0
    # The best of these is taken where none is named.
    assert [asdict(one) for one in CANDIDATES] == [
        neighbours, neighbours | {"representation": "positive"}, {"level_db": 5.0, **levels},
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "method"),
    [("centroid", Centroid()), ("knn", Neighbours()), ("probabilistic", Probabilistic()),
     ("gp", SurveyMaps())],
)  # fmt: skip
def test_a_method_has_a_name_and_its_usual_options(name, method):
    assert method_options(name) == method
    assert method_name(method) == name


def test_numbers_that_no_option_sets():
    assert FIX_SD_M == 10.0
    assert DEFAULT_RISK == 1e-3
    assert FIRST_SPACING_M == 5.0
    assert (MOST_FOLDS, MOST_VALIDATED) == (10, 2000)
    assert (MOST_POINTS, STRONGEST) == (20_000, 7)
    assert (TIMING_SD_M, TIMING_CLIP_SD, PATTERN_SHARE) == (200.0, 3.0, 0.4)
