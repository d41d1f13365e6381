"""Cell plans as people write them: degrees and minutes, titles, units, several carriers."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.geodesy import project
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plan_files import read_cell_plan
from mapfilter.radio.sexagesimal import sexagesimal_deg

CRS = "EPSG:32635"
HEADER = "cell;lat;lon;height_m;azimuth_deg;eirp_dbm;frequency_mhz"
ROW = {
    "cell": "A", "lat": "60.17", "lon": "24.94", "height_m": "30", "azimuth_deg": "120",
    "eirp_dbm": "50", "frequency_mhz": "1800",
}  # fmt: skip


def plan(tmp_path, *rows, title="", separator=";", header=HEADER):
    path = tmp_path / "cells.csv"
    lines = [header, *(";".join((ROW | row).values()) for row in rows or ({},))]
    path.write_text(title + "\n".join(lines).replace(";", separator), encoding="utf-8")
    return read_cell_plan(path, CRS)


def refused(tmp_path, *rows, **more):
    with pytest.raises(InputError) as caught:
        plan(tmp_path, *rows, **more)
    return str(caught.value)


@pytest.mark.parametrize("text", ["26201-1234-5678", "262-01-1234-5678", "262 01 1234 5678"])
def test_a_column_of_identities_may_join_both_numbers_of_the_network(tmp_path, text):
    (cell,) = plan(tmp_path, {"cgi": text}, header=f"{HEADER};cgi").cells
    assert (cell.mcc, cell.mnc, cell.lac, cell.ci) == (262, 1, 1234, 5678)


@pytest.mark.parametrize(
    ("lat", "lon"),
    [
        ("60°10'12\"N", "24°56'24\"E"), ("60° 10′ 12″ N", "24° 56′ 24″ E"),
        ("60d10m12sN", "24d56m24sE"), ("N 60:10:12.0", "E 24:56:24.0"), ("60 10,2", "24 56,4"),
        ("60.17 N", "24,94E"),
    ],
)  # fmt: skip
def test_degrees_and_minutes(tmp_path, lat, lon):
    cell = plan(tmp_path, {"lat": lat, "lon": lon}).cells[0]
    place = np.ravel(project(CRS, [24.94], [60.17]))
    np.testing.assert_allclose((cell.east_m, cell.north_m), place, atol=0.01)


@pytest.mark.parametrize("sign", [1, -1])
def test_angles_are_those_of_their_parts(sign):
    """To the south and west by a sign or a letter, never by both."""
    rng = np.random.default_rng(8)
    for deg, minute, second in zip(*rng.integers(0, 60, (3, 50)).tolist(), strict=True):
        wanted = sign * (3600 * deg + 60 * minute + second) / 3600
        signed = f"{'-' if sign < 0 else ''}{deg}:{minute}:{second}"
        letter = "E" if sign > 0 else "W"
        for text in (
            signed,
            f"{deg}°{minute}'{second}\"{letter}",
            f"{letter}{deg} {minute} {second}",
        ):
            assert sexagesimal_deg(text, "EW") == pytest.approx(wanted, abs=1e-9)
    for wrong in ("-8 30 W", "8 60", "8 30 60", "8.5 30", "8 30 N", "1 2 3 4", "8°", "W", "",
                  "8--3", "8,30,0 W", "٨ ٣٠", "8 30" + " " * 50 + "1"):  # fmt: skip
        assert sexagesimal_deg(wrong, "EW") is None


@pytest.mark.parametrize("wrong", ["60°10'72\"N", "60°10'12\"E", "sixty"])
def test_what_is_no_angle_is_refused(tmp_path, wrong):
    assert f"row 2, lat: expected degrees, found {wrong!r}" in refused(tmp_path, {"lat": wrong})


def test_a_title_that_holds_the_separator_is_refused_once(tmp_path):
    refusal = refused(tmp_path, {}, title="Cell plan, Helsinki, 2026\n", separator=",")
    assert refusal.count("expected") == 1
    assert "found Cell plan, Helsinki, 2026 (likely: a title above it: delete the" in refusal
    assert "above row 2)" in refusal


@pytest.mark.parametrize("separator", [";", "\t"])
def test_a_title_may_hold_commas_where_they_are_not_the_separator(tmp_path, separator):
    found = plan(tmp_path, title="Cell plan, Helsinki, 2026\n", separator=separator)
    assert found.ids == ("A",)
    note = "cells.csv: 1 line above the header left out: 'Cell plan, Helsinki, 2026'"
    assert found.notes == (note,)


@pytest.mark.parametrize("separator", [";", ",", "\t"])
def test_lines_of_a_title_are_left_out_and_noted(tmp_path, separator):
    found = plan(tmp_path, title="Cells of the north\n\n# of 2026\n", separator=separator)
    assert found.ids == ("A",)
    assert found.notes == ("cells.csv: 2 lines above the header left out: 'Cells of the north'",)
    told = refused(tmp_path, {"height_m": "x"}, title="Cells\n", separator=separator)
    assert "cells.csv row 3, height_m" in told


def test_a_table_of_one_column_keeps_its_header(tmp_path):
    path = tmp_path / "cells.csv"
    path.write_text("cell\nA\nB\n", encoding="utf-8")
    with pytest.raises(
        InputError, match=r"expected a column height_m, found none \(columns: cell\)"
    ):
        read_cell_plan(path, CRS)


def test_rows_of_one_cell_that_differ_are_not_called_the_same(tmp_path):
    assert "(likely: a row given twice)" in refused(tmp_path, {}, {})
    told = refused(tmp_path, {}, {"frequency_mhz": "900"})
    assert (
        "row 3, cell: expected an id used once, found 'A' (likely: a cell of several carr" in told
    )


@pytest.mark.parametrize(
    ("field", "text", "hint"),
    [
        ("height_m", "30 m", "a unit beside the number"),
        ("eirp_dbm", "50dBm", "a unit beside the number"),
        ("azimuth_deg", "120°", "a unit beside the number"),
        ("azimuth_deg", "omni", "to be left empty where the antenna is omnidirectional"),
        ("azimuth_deg", "-", "to be left empty where the antenna is omnidirectional"),
        ("frequency_mhz", "1.800,0", "marks between thousands"),
    ],
)
def test_the_likely_mistake_in_a_number(tmp_path, field, text, hint):
    told = refused(tmp_path, {field: text})
    assert f"row 2, {field}: expected" in told
    assert f"found {text!r} (likely: {hint}" in told


def test_power_and_gain_are_named_where_there_is_no_eirp(tmp_path):
    told = refused(tmp_path, header=HEADER.replace("eirp_dbm", "power_dbm"))
    assert "the power in dBm plus the antenna gain in dBi less losses belongs in it" in told
    assert "belongs in it" not in refused(tmp_path, header=HEADER.replace("eirp_dbm", "other"))


@pytest.mark.parametrize(
    ("cells", "found"),
    [
        (
            pd.DataFrame({"id": ["a"]}),
            "DataFrame (likely: a table; read_cell_plan reads it)",
        ),
        (["a"], "'a'"),
        (None, "None"),
        ({"a": 1}, "'a'"),
        (5, "5"),
    ],
)
def test_a_plan_is_made_of_cells(cells, found):
    with pytest.raises(InputError) as caught:
        CellPlan("EPSG:32632", cells)
    assert str(caught.value) == f"cell plan: expected cells, each a Cell, found {found}"
