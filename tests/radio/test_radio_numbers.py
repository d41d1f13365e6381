"""Numbers in tables, antenna patterns and almanacs have ASCII digits."""

import pytest
from msi_files import panel

from mapfilter.errors import InputError
from mapfilter.gnss.almanacs import read_yuma
from mapfilter.radio.msi import read_msi
from mapfilter.radio.plan_files import read_cell_plan
from mapfilter.radio.tables import number

OTHER = ["٦٠", "６０", "1_0", "६0", "6٫5"]


@pytest.mark.parametrize("text", OTHER)
def test_digits_of_other_scripts_are_no_numbers(text):
    assert number(text) is None
    assert number(text, decimal_comma=True) is None


@pytest.mark.parametrize("text", [" 60", "60\t", "60\N{NO-BREAK SPACE}", "6e1", "+60.0", "60"])
def test_blanks_about_a_number_do_no_harm(text):
    assert number(text) == 60.0


def test_a_plan_with_digits_of_another_script_is_refused(tmp_path):
    path = tmp_path / "plan.csv"
    head = "cell,lat,lon,height_m,eirp_dbm,frequency_mhz,azimuth_deg\n"
    path.write_text(f"{head}A,60.17,24.94,٣٠,55,950,60\n", encoding="utf-8")
    with pytest.raises(InputError, match="row 2, height_m"):
        read_cell_plan(path, "EPSG:32635")


@pytest.mark.parametrize(
    ("given", "changed", "where"),
    [
        ("1855", "١855", "FREQUENCY"),
        ("15.5 dBd", "１5.5 dBd", "GAIN"),
        ("0\t0.00", "0\t٠.00", "row"),
    ],
)
def test_so_is_an_antenna_pattern(tmp_path, given, changed, where):
    path = tmp_path / "a.msi"
    path.write_text(panel().replace(given, changed, 1), encoding="utf-8")
    with pytest.raises(InputError, match=where):
        read_msi(path)


def test_so_is_an_almanac(tmp_path):
    path = tmp_path / "yuma.txt"
    path.write_text("******** Week 1 almanac for PRN-01 ********\nHealth: ٠\n", encoding="utf-8")
    with pytest.raises(InputError, match="line 2, Health: expected a finite number"):
        read_yuma(path)
