"""Tables of far too many columns, and UTF-16 without its mark."""

import pytest

from mapfilter.errors import InputError
from mapfilter.radio.plan_files import read_cell_plan
from mapfilter.tracks.table_files import read_table

NAMES = ",".join(f"c{i}" for i in range(20_000))


def test_a_log_of_far_too_many_columns_is_refused(tmp_path):
    path = tmp_path / "motion.csv"
    path.write_text(f"time_s,{NAMES}\n1.0{',' * 20_000}\n")
    with pytest.raises(InputError, match="header: expected at most 1000 columns, found 20001"):
        read_table("motion", path)


def test_a_plan_of_far_too_many_columns_is_refused(tmp_path):
    path = tmp_path / "cells.csv"
    path.write_text(f"cell,{NAMES}\nA{',' * 20_000}\n")
    with pytest.raises(InputError, match="a cell plan of at most 1000 columns, found 20001"):
        read_cell_plan(path, "EPSG:32635")


@pytest.mark.parametrize("codec", ["utf-16-le", "utf-16-be"])
def test_a_plan_in_utf_16_without_its_mark_is_named(tmp_path, codec):
    path = tmp_path / "cells.csv"
    path.write_bytes("cell,site,lat,lon\nA,S,60.1,24.9\n".encode(codec))
    with pytest.raises(InputError, match="UTF-16 text without a byte order mark"):
        read_cell_plan(path, "EPSG:32635")
