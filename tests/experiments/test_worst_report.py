"""The worst single report, its causes, its file and its picture."""

from dataclasses import replace

import numpy as np
import pytest

from mapfilter.errors import StoreError
from mapfilter.experiments.recorded.worst_report import (
    causes_of_report,
    read_worst_report,
    worst_report,
    write_worst_report,
)
from mapfilter.positioning.fingerprints.located import LocatedReports
from mapfilter.positioning.fingerprints.options import Neighbours
from mapfilter.positioning.fingerprints.reports import make_reports
from mapfilter.workflows.evaluations.recorded_pictures import draw_report

CRS = "EPSG:32632"


def _reports(rows):
    """Rows of (east, north, {transmitter: level})."""
    triples = [
        (i, name, level) for i, (_, _, heard) in enumerate(rows) for name, level in heard.items()
    ]
    report, cell, level = zip(*triples, strict=True)
    places = np.array([(east, north) for east, north, _ in rows], dtype=float)
    return make_reports(CRS, report, cell, level, count=len(rows), places=places)


def _database():
    """Places every 2 m; others from 50 m on, and ``far`` anywhere, weaker and weaker."""
    return _reports(
        [
            (
                2.0 * i,
                0.0,
                {f"{'a' if i < 25 else 'b'}{k}": -50.0 - k for k in range(4)} | {"far": -40.0 - i},
            )
            for i in range(50)
        ]
    )


def _located(reports, places):
    places = np.array(places, dtype=float)
    count = len(places)
    error_m = np.hypot(reports.east_m - places[:, 0], reports.north_m - places[:, 1])
    zeros = np.zeros(count, dtype=np.int64)
    radii = np.tile([1.0, 2.0, 5.0], (count, 1))
    reason = ("",) * count
    return LocatedReports(
        CRS,
        Neighbours(),
        np.arange(count, dtype=float),
        *places.T,
        radii,
        zeros,
        zeros,
        reason,
        error_m,
    )


def _causes(heard, truth, place):
    reports = _reports([(*truth, heard), (0.0, 0.0, {f"a{k}": -50.0 for k in range(4)})])
    return causes_of_report(reports, 0, np.array(place, dtype=float), _database())


USUAL = {"a0": -50.0, "a1": -51.0, "a2": -52.0, "far": -45.0}


def test_no_transmitter_of_the_database():
    assert _causes({"x": -50.0}, (10, 0), (np.nan, np.nan)) == (
        "the database has none of the 1 transmitters received",
    )


def test_few_readings_and_a_place_off_the_map():
    causes = _causes({"a0": -50.0}, (10, 40), (10, 0))
    assert causes[0].startswith("few readings: 1")
    assert causes[1] == "off the map: its nearest report is 40 m from the true place"
    assert not any("off the map" in one for one in _causes(USUAL, (10, 1), (10, 0)))


def test_other_transmitters_than_at_the_true_place():
    causes = _causes({f"b{k}": -50.0 - k for k in range(4)}, (10, 0), (90, 0))
    assert causes == (
        "other transmitters: the map has 0 % of those received about the true place, and 100 % "
        "about the estimate",
    )


def test_levels_as_they_are_elsewhere():
    causes = _causes({**USUAL, "far": -60.0}, (4, 0), (40, 0))
    assert causes == (
        "levels as elsewhere: 9 dB from the map's at the true place, 0 dB at the estimate "
        "(root mean square)",
    )
    assert _causes({**USUAL, "far": -42.0}, (4, 0), (40, 0)) == ()


def test_the_worst_has_no_position_or_the_largest_error():
    reports = _reports([(0.0, 0.0, USUAL), (10.0, 0.0, USUAL), (20.0, 0.0, USUAL)])
    found = worst_report(reports, _located(reports, [(1, 0), (19, 0), (20, 0)]), _database())
    assert (found.number, found.error_m) == (1, 9.0)
    assert found.what == "9 m off; the 95 % radius of 5 m does not hold it"
    none = worst_report(
        reports, _located(reports, [(1, 0), (19, 0), (np.nan, np.nan)]), _database()
    )
    assert (none.number, none.what) == (2, "no position")
    unknown = replace(reports, east_m=np.full(3, np.nan))
    assert worst_report(unknown, _located(unknown, [(1, 0)] * 3), _database()) is None


@pytest.mark.parametrize("place", [(19.0, 0.0), (np.nan, np.nan)])
def test_file_and_picture(tmp_path, place):
    reports = _reports([(0.0, 0.0, USUAL), (10.0, 0.0, USUAL)])
    found = worst_report(reports, _located(reports, [(1, 0), place]), _database())
    write_worst_report(found, tmp_path / "report.json")
    again = read_worst_report(tmp_path / "report.json")
    assert (again.what, again.causes) == (found.what, found.causes)
    np.testing.assert_array_equal(again.place_m, found.place_m)
    np.testing.assert_array_equal(again.places_m, found.places_m)
    draw_report(again, "made", tmp_path / "report.png")
    assert (tmp_path / "report.png").stat().st_size > 10_000
    assert read_worst_report(tmp_path / "none.json") is None
    text = (tmp_path / "report.json").read_text()
    (tmp_path / "report.json").write_text(text[: len(text) // 2])
    with pytest.raises(StoreError):
        read_worst_report(tmp_path / "report.json")
