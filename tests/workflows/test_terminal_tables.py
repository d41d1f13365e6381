"""Results as people read them: a short table in place of a line for each cell of a grid."""

from mapfilter.evaluation.success_cells import SuccessCell
from mapfilter.workflows.outputs.result_text import text_lines
from mapfilter.workflows.sweeps.tables import brief


def cell(**place):
    return SuccessCell(
        **{**dict.fromkeys(SuccessCell.__dataclass_fields__, 0.0), "varied": {}, **place}
    )


def test_heading_noises_stand_side_by_side_and_what_belongs_to_a_name_is_left_out():
    cells = [
        cell(reading=name, update_length_m=length_m, sigma_trans_m=step_m, sigma_orient_deg=deg,
             runs=10, success=deg / 10)
        for name, length_m in (("set", 5.0), ("list", 22.0))
        for step_m in (0.0, 0.2)
        for deg in (3.0, 6.0)
    ]  # fmt: skip
    rows = brief(cells)
    assert len(rows) == 4
    assert list(rows[0]) == ["reading", "sigma_trans_m", "runs", "success at 3°", "6°"]
    assert rows[-1] == {
        "reading": "list", "sigma_trans_m": 0.2, "runs": 10, "success at 3°": 0.3, "6°": 0.6,
    }  # fmt: skip
    lines = list(text_lines({"cells": rows}))
    assert lines[1:3] == [
        "  reading  sigma_trans_m  runs  success at 3°   6°",
        "  set                  0    10            0.3  0.6",
    ]


def test_a_cell_that_is_missing_is_empty():
    rows = brief([cell(reading="a"), cell(reading="b", sigma_orient_deg=3.0, success=1.0)])
    assert [row["3°"] for row in rows] == [None, 1.0]
    assert next(text_lines({"x": rows})) == "x:"


def test_rows_of_other_figures_and_of_long_texts_are_lines():
    mixed = [{"code": "a"}, {"kind": "b"}]
    assert list(text_lines({"found": mixed})) == ["found:", "  code a", "  kind b"]
    long = [{"code": "a", "remedy": "x" * 300}, {"code": "b", "remedy": "y"}]
    assert list(text_lines({"found": long}))[2] == "  code b, remedy y"
    assert list(text_lines({"found": [{"code": "a", "n": 1}]})) == ["found:", "  code a, n 1"]


def test_columns_without_anything_are_left_out():
    rows = [{"a": 1, "b": None, "c": ""}, {"a": 20, "b": None, "c": ""}]
    assert list(text_lines({"rows": rows})) == ["rows:", "   a", "   1", "  20"]


def test_numbers_are_to_the_right_also_where_some_are_missing():
    rows = [
        {"filter": "ekf", "above_db": None, "error_m": 12.34567},
        {"filter": "p_f", "above_db": -17.0, "error_m": None},
    ]
    assert list(text_lines({"rows": rows}))[2:] == [
        "  ekf            -    12.35",
        "  p_f          -17        -",
    ]


def test_bounds_in_degrees_are_printed_to_decimetres():
    box = {"west": -56.1942492, "south": -34.9128812}
    lines = list(text_lines({"bounds_deg": box, "shares": box}))
    assert lines[:3] == ["bounds_deg:", "  west: -56.194249", "  south: -34.912881"]
    assert lines[3:] == ["shares:", "  west: -56.19", "  south: -34.91"]
    assert list(text_lines({"bounds_deg": [139.6917001]})) == ["bounds_deg:", "  139.691700"]
