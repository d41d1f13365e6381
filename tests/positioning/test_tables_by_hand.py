"""Columns, rows and frames of fingerprint tables at their limits."""

import numpy as np
import pytest

from mapfilter.errors import ConfigError, InputError
from mapfilter.positioning.fingerprints import tables
from mapfilter.positioning.fingerprints.tables import read_fingerprint_table

FRAME = "EPSG:32630"


def read(tmp_path, text, crs=None):
    path = tmp_path / "table.csv"
    path.write_text(text)
    return read_fingerprint_table(path, crs)


def test_what_is_no_path_is_told():
    with pytest.raises(ConfigError, match="path"):
        read_fingerprint_table(5)


def test_tables_have_a_gigabyte_at_most(tmp_path, monkeypatch):
    asked = []

    def read_input(path, most, what):
        asked.append((path.name, most, what))
        return b"x,y,ap\n1,2,-70\n"

    monkeypatch.setattr(tables, "read_input", read_input)
    assert len(read(tmp_path, "", FRAME)) == 1
    assert asked == [("table.csv", 2**30, "a table")]


def test_a_table_of_positions_alone_has_no_transmitter(tmp_path):
    with pytest.raises(InputError, match="a column for each transmitter"):
        read(tmp_path, "x,y\n1,2\n", FRAME)


def test_only_columns_that_stand_there_twice_are_told(tmp_path):
    with pytest.raises(InputError, match="each column once") as told:
        read(tmp_path, "x,y,one,two,ONE\n1,2,-70,-71,-72\n")
    (fault,) = told.value.faults
    assert "one" in fault.got
    assert not {"x", "y", "two"} & set(fault.got.replace("'", "").split())


def test_a_table_without_faults_has_no_notes(tmp_path):
    assert read(tmp_path, "x,y,ap\n1,2,-70\n3,4,-71\n", FRAME).notes == ()
    one = read(tmp_path, "x,y,ap\n1,2,-70\n3,4,-71,5\n", FRAME)
    assert one.notes == ("table.csv: 1 row left out: too many fields",)


def test_a_separator_between_quotes_separates_nothing(tmp_path):
    found = read(tmp_path, 'x,y,ap,session\n1,2,-70,"a,b"\n3,4,-71,c\n', FRAME)
    assert found.level_dbm.tolist() == [-70.0, -71.0]


def test_whole_numbers_of_hundreds_of_digits_are_those_of_their_first_forty(tmp_path):
    digits = "12345678" * 50
    found = read(tmp_path, f"x,y,ap\n{digits},2,-70\n3,4,-71\n", FRAME)
    assert found.places[0].tolist() == [float(digits[:40]), 2.0]
    assert found.places[1].tolist() == [3.0, 4.0]


def test_the_ends_of_levels_are_levels(tmp_path):
    found = read(tmp_path, "x,y,ap\n1,2,-200\n1,2,0\n1,2,-200.5\n1,2,0.5\n", FRAME)
    assert found.level_dbm.tolist() == [-200.0, 0.0]
    assert found.notes == ("table.csv: 2 levels left out: not in -200..0 dBm",)


def test_half_a_position_is_none(tmp_path):
    found = read(tmp_path, "x,y,ap\n1,,-70\n,2,-70\n3,4,-70\n", FRAME)
    assert np.isnan(found.places[:2]).all()
    assert found.places[2].tolist() == [3.0, 4.0]


def test_degrees_of_which_one_is_missing_are_degrees(tmp_path):
    found = read(tmp_path, "lon,lat,ap\n-3.0,50.0,-70\n,,-71\n-3.0,51.0,-72\n")
    assert found.crs == "EPSG:32630"
    assert found.east_m[0] == pytest.approx(500_000.0)
    assert np.isnan(found.places[1]).all()


def test_the_last_degrees_are_degrees(tmp_path):
    found = read(tmp_path, "lon,lat,ap\n180.0,10.0,-70\n179.0,10.0,-71\n")
    assert found.crs == "EPSG:32660"


@pytest.mark.parametrize("place", ["181.0,50.0", "50.0,91.0", "-181.0,-50.0", "50.0,-170.0"])
def test_what_cannot_be_degrees_are_metres_of_web_mercator(tmp_path, place):
    found = read(tmp_path, f"longitude,latitude,ap\n{place},-70\n1.0,2.0,-71\n")
    assert found.crs == "EPSG:3857"
    assert found.places[1].tolist() == [1.0, 2.0]


def test_metres_of_no_frame_are_told(tmp_path):
    for columns in ("x,y,ap", "ap,other,third"):
        with pytest.raises(InputError, match="a CRS of the metres"):
            read(tmp_path, f"{columns}\n-1,-2,-70\n")
