"""Python users are told arguments of Python, not options of the commands."""

import ast
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from cross_world import walk_log

import mapfilter as mf
from mapfilter.api.python_words import in_python, python_words
from mapfilter.errors import InputError, fail, noted, notes_of

OPTION = re.compile(r"(?<![\w-])--[a-z]")
COMMAND = re.compile(r"mapfilter [a-z]+ (--)?[^;)]*")
ROOMS = ("tracks", "positioning", "evaluation", "radio", "geodesy.py")


def texts_of(file):
    """Return the texts of a module that are no docstrings, formatted ones with · for values."""
    nodes = [*ast.walk(ast.parse(file.read_text(encoding="utf-8")))]
    formatted = [node for node in nodes if isinstance(node, ast.JoinedStr)]
    taken = {id(part) for node in formatted for part in node.values}
    taken |= {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    plain = [
        node.value
        for node in nodes
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in taken
    ]
    return plain + [
        "".join(part.value if isinstance(part, ast.Constant) else "·" for part in node.values)
        for node in formatted
    ]


def test_every_option_that_these_rooms_name_has_words_of_python():
    package = Path(mf.__file__).parent
    files = [one for room in ROOMS for one in [*(package / room).rglob("*.py")] or [package / room]]
    found = [text for file in files for text in texts_of(file) if OPTION.search(text)]
    assert len(found) > 20
    left = [text for text in found if OPTION.search(COMMAND.sub("", in_python(text)))]
    assert not left


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("(likely: --column speed_mps=speed)", '(likely: columns={"speed_mps": "speed"})'),
        ("--column FIELD=COLUMN, such as", 'columns={"FIELD": "COLUMN"}, such as'),
        ("not used: acc; see --column", "not used: acc; see columns"),
        ("--offset a.csv=18 for", 'offsets_s={"a.csv": 18} for'),
        ("--offset b.csv=SECONDS, the", 'offsets_s={"b.csv": SECONDS}, the'),
        ("give --zone or --offset", "give zone or offsets_s"),
        ("and --origin LAT,LON of its", "and origin_deg=(LAT, LON) of its"),
        ("use --format gpx, or none", 'use format="gpx", or none'),
        ("--format: expected one of", "format: expected one of"),
        ("drive, --factor step_m", "drive, factors step_m"),
        ("see --origin and --crs", "see origin_deg and crs"),
        ("step_m = 0.8 (--step-length) has", "step_m = 0.8 (walk=WalkOptions(step_m=…)) has"),
        ("leave out --course-motion", "leave out course_motion"),
        ("moved, set filter.bayes.vehicle = true", "moved, set BayesFilter(vehicle=True)"),
        ("assumed (filter.kalman.fix_sd_m; in", "assumed (fix_sd_m of KalmanFilter; in"),
        (
            'with rasters.resolution_m and rasters.resampling = "bilinear", or',
            'with mf.open_rasters(…, resolution_m=…, resampling="bilinear"), or',
        ),
        ("/data/my--zone/a.csv", "/data/my--zone/a.csv"),
    ],
)
def test_options_become_arguments(text, expected):
    assert in_python(text) == expected
    assert in_python(expected) == expected


def test_faults_and_notes_of_an_error_are_put_in_these_words():
    with pytest.raises(InputError) as refused, python_words(), noted(["see --zone"]):
        raise fail(InputError, "--crs", "a CRS", "--crs", "give --crs EPSG:32635")
    fault = 'crs: expected a CRS, found --crs (likely: give crs="EPSG:32635")'
    assert str(refused.value) == fault
    assert refused.value.args == (refused.value.faults,)
    assert notes_of(refused.value) == ["see zone"]


def test_notes_of_a_located_log_name_options_of_python(database):
    walk = walk_log()
    motion = walk.motion.assign(heading_rad=np.nan, turn_rad=0.0)
    fixes = walk.truth[["time_s", "east_m", "north_m"]].iloc[::10]
    alone = mf.locate(mf.make_log(walk.crs, motion=motion), database).log.notes
    assert any("set BayesFilter(vehicle=True)" in note for note in alone), alone
    placed = mf.locate(mf.make_log(walk.crs, gnss=fixes), filter="ekf").log.notes
    assert any("fix_sd_m of KalmanFilter" in note for note in placed), placed
    assert not any("filter." in note for note in (*alone, *placed))


def test_errors_and_notes_of_read_log(tmp_path):
    path = tmp_path / "walk.csv"
    rows = pd.DataFrame({"timestamp": 1_777_629_600 + np.arange(30.0), "lat": 60.17, "lon": 24.93})
    rows.assign(velocity=1.2).to_csv(path, index=False)
    assert any('columns={"speed_mps": "velocity"}' in note for note in mf.read_log(path).notes)
    with pytest.raises(mf.MapfilterError, match=r"^zone: expected"):
        mf.read_log(path, zone="Helsinki")
    with pytest.raises(mf.MapfilterError, match=r"^crs: expected") as refused:
        mf.read_log(path, crs="nowhere")
    assert "--" not in str(refused.value)
