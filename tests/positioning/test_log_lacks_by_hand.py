"""What is said of logs that a filter did not locate, by their tables."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.positioning.log_lacks import (
    advice_of,
    coarse_pixels_note,
    follows_positions,
    has_reports_alone,
    is_of_reports_alone,
    lack_of_log,
    lacking,
)

CRS, NAN = "EPSG:32635", np.nan
HEADED = {"step_m": [1.0, 1.0, 1.0], "heading_rad": [NAN, 0.2, NAN]}
TURNED = {"step_m": [1.0, 1.0, NAN], "turn_rad": [0.0, 0.1, 0.1]}
TURNED_ONCE = {"step_m": [1.0, 1.0, 1.0], "turn_rad": [0.0, NAN, NAN]}
PLAIN = {"step_m": [1.0, NAN, 1.0]}
REPORTS = {"time_s": [0.0, 1.0, 2.0], "role": ["serving", "neighbour", "serving"]}
NAMED = REPORTS | {"cell": ["a", "c", None]}
FIXES = {"time_s": [0.0], "east_m": [385_000.0], "north_m": [6_672_000.0]}
BY_TURNS = "no heading (turns alone do not give one; the filter bayes needs none)"


def log_of(motion=None, radio=None, **tables):
    if motion is not None:
        tables["motion"] = {"time_s": [0.0, 1.0, 2.0], **motion}
    if radio is not None:
        tables["radio"] = radio
    return mf.make_log(CRS, **{name: pd.DataFrame(table) for name, table in tables.items()})


def estimate(*hypotheses, converged_at=None):
    return SimpleNamespace(converged_at=converged_at, hypotheses=np.array(hypotheses or (0, 0)))


SOME = estimate(0, 7)
"""Positions that were tried after the first epoch."""


@pytest.mark.parametrize(
    ("motion", "radio", "found", "lack"),
    [
        (HEADED, NAMED, SOME, ""),
        (HEADED, REPORTS, SOME, ""),
        (HEADED, REPORTS, estimate(), "no serving cell"),
        (HEADED, None, estimate(), "no serving cell"),
        # A neighbour has a name, the serving cell has none.
        (HEADED, REPORTS | {"cell": [None, "c", None]}, estimate(), "no serving cell"),
        (HEADED, NAMED, estimate(), "no serving cell of which the database has points"),
        (TURNED, NAMED, SOME, BY_TURNS),
        (TURNED, None, estimate(), f"no serving cell and {BY_TURNS}"),
        (PLAIN, NAMED, SOME, "no heading"),
        (None, NAMED, SOME, "no motion"),
        (None, None, estimate(), "no serving cell and no motion"),
        # A direction of a row that has no length is none.
        ({"step_m": [NAN, 1.0, 1.0], "heading_rad": [0.1, NAN, NAN]}, NAMED, SOME, "no heading"),
        (
            {"step_m": [NAN, 1.0, 1.0], "heading_rad": [0.1, NAN, NAN], "turn_rad": [0, 0.1, NAN]},
            NAMED, SOME, BY_TURNS,
        ),
    ],
)  # fmt: skip
def test_what_a_log_lacks_over_cells(motion, radio, found, lack):
    log = log_of(motion, radio)
    assert lacking(log, found) == lack
    assert lacking(log, estimate(converged_at=3)) == ""
    # A filter that needs no headings does with turns.
    by_turns = lack.replace(f" and {BY_TURNS}", "").replace(BY_TURNS, "")
    assert lacking(log, found, turns=True) == by_turns


@pytest.mark.parametrize(
    ("motion", "found", "lack"),
    [
        (HEADED, SOME, "no headings and no turns"),
        (TURNED_ONCE, SOME, "no headings and no turns"),
        (PLAIN, SOME, "no headings and no turns"),
        (TURNED, SOME, ""),
        (HEADED | {"heading_rad": [0.2, 0.2, NAN]}, SOME, ""),
        (TURNED, estimate(), "too short a way with steps and headings, or turns"),
        (None, SOME, "no motion"),
        ({"step_m": [NAN, NAN, NAN]}, SOME, "no motion"),
    ],
)
def test_what_a_log_lacks_over_ways_alone(motion, found, lack):
    assert lacking(log_of(motion, NAMED), found, cells=False) == lack


def test_the_cells_of_a_log_are_named_beside_those_of_a_database():
    served = {"time_s": np.arange(7.0), "role": "serving", "cell": list("abbcccd")}
    lack = "no serving cell of which the database has points"
    given = log_of(HEADED, served)
    assert lacking(given, estimate(), known=("P", "Q")) == (
        f"{lack} (the log has c, b, a and 1 more; the database has P, Q)"
    )
    assert lacking(given, estimate(), known=("P", "A")) == (
        f"{lack} (the log has c, b, a and 1 more; the database has P, A; some differ by capitals "
        "alone)"
    )


CELLS, WAYS = SimpleNamespace(cell_ids=("a", "b")), SimpleNamespace(cell_ids=())
BY_STREETS = "the filter bayes starts by the streets alone"


@pytest.mark.parametrize(
    ("motion", "radio", "options", "database", "found", "lack"),
    [
        (TURNED, NAMED, mf.BayesFilter(), CELLS, SOME, ""),
        (TURNED, NAMED, mf.CandidateFilter(), CELLS, SOME, BY_TURNS),
        (TURNED, NAMED, mf.CandidateFilter(), None, SOME, BY_TURNS),
        (PLAIN, NAMED, mf.GridFilter(), CELLS, SOME, "no heading"),
        (PLAIN, NAMED, mf.GridFilter(), WAYS, SOME,
         f"the filter grid needs cells to start, the database has none ({BY_STREETS})"),
        (PLAIN, NAMED, mf.CandidateFilter(), WAYS, SOME,
         f"the filter candidate needs cells to start, the database has none ({BY_STREETS})"),
        (PLAIN, NAMED, mf.BayesFilter(), WAYS, SOME, "no headings and no turns"),
        # Without reports a database's cells tell nothing.
        (PLAIN, None, mf.BayesFilter(), CELLS, SOME, "no headings and no turns"),
        (TURNED, None, mf.BayesFilter(), CELLS, SOME, ""),
        (HEADED, None, mf.CandidateFilter(), CELLS, estimate(), f"no serving cell ({BY_STREETS})"),
        (HEADED, None, mf.CandidateFilter(), None, estimate(), "no serving cell"),
        (HEADED, NAMED, mf.CandidateFilter(), CELLS, estimate(),
         "no serving cell of which the database has points (the log has a; the database has a, b; "
         "some differ by capitals alone)"),
        (HEADED, NAMED, mf.KalmanFilter(), None, estimate(), "too little was measured"),
        (HEADED, None, mf.KalmanFilter(), None, estimate(),
         "no positions and no radio to start from"),
    ],
)  # fmt: skip
def test_what_a_log_lacks_for_a_filter(motion, radio, options, database, found, lack):
    log = log_of(motion, radio)
    assert lack_of_log(log, options, found, database) == lack
    assert lack_of_log(log, options, estimate(0, 7, converged_at=0), database) == ""


@pytest.mark.parametrize(
    ("tables", "lack"),
    [
        ({"gnss": FIXES}, "too little was measured"),
        ({"truth": FIXES},
         "no positions and no radio to start from (those of the truth serve for scores only)"),
    ],
)  # fmt: skip
def test_what_starts_a_filter_without_a_map(tables, lack):
    assert lack_of_log(log_of(HEADED, **tables), mf.KalmanFilter(), estimate(), None) == lack


@pytest.mark.parametrize("known", [0, 1, 2])
def test_pseudoranges_start_no_filter_without_a_map(known):
    """Whose satellites have places, or have none."""
    places = {f"{axis}_m": [1.5e7] * known + [NAN] * (2 - known) for axis in "xyz"}
    ranges = {"time_s": [0.0, 1.0], "satellite": "G01", "pseudorange_m": 2.1e7, **places}
    lack = lack_of_log(log_of(HEADED, pseudoranges=ranges), mf.KalmanFilter(), estimate(), None)
    assert lack.startswith("no positions and no radio to start from (2 pseudoranges: ")
    assert ("their satellites have no places" in lack) is (known == 0)
    assert ("only the filter bayes uses them, over a map" in lack) is (known > 0)


def test_logs_of_positions_or_reports_alone():
    found = estimate(0, 7, converged_at=1)
    placed, reported = log_of(None, NAMED, gnss=FIXES), log_of(None, NAMED)
    unmeasured = log_of({"step_m": [NAN, NAN, NAN]}, NAMED)
    assert [has_reports_alone(one) for one in (placed, reported, unmeasured)] == [False, True, True]
    assert not has_reports_alone(log_of(PLAIN, NAMED))
    assert not has_reports_alone(log_of(None, None, gnss=FIXES))
    assert follows_positions(placed, mf.BayesFilter(), found)
    assert not follows_positions(placed, mf.BayesFilter(), estimate())
    assert not follows_positions(placed, mf.KalmanFilter(), found)
    assert not follows_positions(reported, mf.BayesFilter(), found)
    assert not follows_positions(log_of(PLAIN, NAMED, gnss=FIXES), mf.BayesFilter(), found)
    for options, by_map in (
        (mf.BayesFilter(), True), (mf.CandidateFilter(), True), (mf.KalmanFilter(), False),
    ):  # fmt: skip
        assert is_of_reports_alone(reported, options, found) is by_map
        assert not is_of_reports_alone(reported, options, estimate())
        assert not is_of_reports_alone(placed, options, found)


def test_advice_on_a_way_that_streets_did_not_locate():
    back = {"step_m": [30.0, -12.4, NAN]}
    never = (
        "never converged in 42 m: by streets alone it takes about a kilometre, with turns, all of "
        "it on the map"
    )
    notes = advice_of(log_of(back), mf.BayesFilter(), estimate())
    assert notes[0] == never
    assert notes[1].startswith("motion taken for a walker's; ")
    assert notes[1].endswith("set filter.bayes.vehicle = true")
    assert advice_of(log_of(back), mf.BayesFilter(vehicle=True), estimate()) == (never,)
    assert advice_of(log_of(back), mf.BayesFilter(), estimate(converged_at=0)) == ()
    assert advice_of(log_of(back), mf.GridFilter(), estimate()) == ()
    assert advice_of(log_of(back), mf.KalmanFilter(), estimate()) == ()
    assert advice_of(log_of({"step_m": [0.0, NAN, 0.0]}), mf.BayesFilter(), estimate()) == ()


@pytest.mark.parametrize(("lost", "noted"), [(2, False), (3, True)])
def test_coarse_pixels_are_named_where_more_than_half_is_lost(lost, noted):
    status = [mf.Status.LOST] * lost + [mf.Status.TRACKING] * (4 - lost)
    database = SimpleNamespace(lattice=SimpleNamespace(resolution_m=10.1))
    notes = coarse_pixels_note(mf.BayesFilter(), SimpleNamespace(status=status), database)
    assert (len(notes) == 1) is noted
