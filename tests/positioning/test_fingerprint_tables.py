"""Tables of fingerprints: as published, with separators and frames, and damaged."""

import numpy as np
import pytest
from fuzz import fuzz

from mapfilter.errors import InputError
from mapfilter.positioning.fingerprints.tables import read_fingerprint_table

UJI = """WAP001,WAP002,WAP003,LONGITUDE,LATITUDE,FLOOR,BUILDINGID,SPACEID,USERID,PHONEID,TIMESTAMP
100,-97,100,-7541.2643,4864920.7782,2,1,106,2,23,1371713733
-80,100,0,-7536.6212,4864934.2252,2,1,106,2,23,1371713691
100,100,100,-7519.1524,4864949.5322,2,1,103,2,23,1371713690
"""


def read(tmp_path, text, crs=None):
    path = tmp_path / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_fingerprint_table(path, crs)


def test_a_table_as_published(tmp_path):
    reports = read(tmp_path, UJI)
    assert reports.crs == "EPSG:3857"
    assert reports.cell_ids == ("WAP001", "WAP002", "WAP003")
    assert reports.first.tolist() == [0, 1, 3, 3]
    assert reports.level_dbm.tolist() == [-97, -80, 0]
    np.testing.assert_allclose(reports.places[0], [-7541.2643, 4864920.7782])
    assert (reports.block == -1).all()


def test_degrees_are_projected(tmp_path):
    reports = read(tmp_path, "lat;lon;02:00:00:00:00:01\n60.17;24.94;-70\n60.18;24.95;\n")
    assert reports.crs == "EPSG:32635"
    assert 385_000 < reports.east_m[0] < 387_000
    assert np.diff(reports.first).tolist() == [1, 0]


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas_are_read_where_they_separate_nothing(tmp_path, separator):
    text = "lon;lat;a;b\n24,94;60,17;-70,5;-81\n24,95;60,18;100;-64.25\n;;-64;\n"
    reports = read(tmp_path, text.replace(";", separator))
    assert reports.crs == "EPSG:32635"
    assert np.isfinite(reports.east_m).tolist() == [True, True, False]
    assert reports.level_dbm.tolist() == [-70.5, -81, -64.25, -64]
    assert reports.places[0] == pytest.approx(
        read(tmp_path, "lon,lat,a\n24.94,60.17,-70\n").places[0]
    )


@pytest.mark.parametrize("header", ["x,y,lon,lat", "east_m,north_m,longitude,latitude"])
def test_degrees_beside_metres_are_no_levels(tmp_path, header):
    """West of Greenwich a longitude could be a level in dBm."""
    reports = read(tmp_path, f"{header},AP1\n440000,4474000,-3.7,40.4,-60\n", "EPSG:32630")
    assert reports.cell_ids == ("AP1",)
    assert reports.notes == ()
    assert reports.places.tolist() == [[440_000.0, 4_474_000.0]]


def test_metres_of_a_frame_of_its_own_need_a_crs(tmp_path):
    text = "x,y,ap\n1,2,-70\n"
    with pytest.raises(InputError, match="--crs"):
        read(tmp_path, text)
    assert read(tmp_path, text, "EPSG:32630").places.tolist() == [[1, 2]]


def test_a_table_without_positions_can_be_located(tmp_path):
    reports = read(tmp_path, "ap-1,ap-2\n-70,100\n", "EPSG:32630")
    assert np.isnan(reports.places).all()
    assert len(reports.cell) == 1


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "an empty file"),
        ("x,y,ap\n", "no rows"),
        ("x,y,ap,ap\n1,2,-70,-71\n", "each column once"),
        ("longitude,latitude,floor\n1,2,3\n", "a column for each transmitter"),
        ("longitude,latitude,ap\n1,2,100\n", "levels in dBm"),
        ("longitude,latitude,ap\n1,2,55\n", "levels in dBm"),
        ("longitude,latitude,ap\n1,2,abc\n", "levels in dBm"),
        (UJI.encode("utf-16"), "UTF-16 text"),
    ],
)
def test_what_is_no_table_is_named(tmp_path, text, expected):
    with pytest.raises(InputError, match=expected):
        read(tmp_path, text)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match="a readable file"):
        read_fingerprint_table(tmp_path / "none.csv")


def test_bad_rows_and_levels_are_counted_and_lose_nothing_else(tmp_path):
    text = UJI + "1,2,3,4,5,6,7,8,9,10,11,12,13\n-300,-60,nan,-7541,4864920\n"
    reports = read(tmp_path, text)
    assert len(reports) == 4
    assert [reports.cell_ids[c] for c in reports.readings(3)[0]] == ["WAP002"]
    assert any("1 row left out: too many fields" in note for note in reports.notes)
    assert any("1 level left out: not in -200..0 dBm" in note for note in reports.notes)


def test_damaged_tables_are_read_or_refused(tmp_path, mutation_count):
    path = tmp_path / "table.csv"

    def reader(data):
        path.write_bytes(data)
        return read_fingerprint_table(path)

    tally = fuzz(UJI.encode(), reader, mutation_count)
    assert tally.read > 0
    assert tally.refused > 0


def test_a_table_cut_off_at_any_byte_is_read_or_refused(tmp_path):
    data = UJI.encode()
    for end in range(0, len(data), 7):
        try:
            assert len(read(tmp_path, data[:end])) <= 3
        except InputError:
            assert end < 140


def test_degrees_far_outside_of_a_crs_are_named_with_their_row(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("lon,lat,AP1\n25.0,60.2,-70\n-100.0,60.2,-71\n")
    with pytest.raises(InputError, match=r"a\.csv, row 2: expected a position that .* covers"):
        read_fingerprint_table(path, "EPSG:3067")


def test_degrees_across_180_are_of_one_side(tmp_path):
    """The zone was that of their middle, 0, which does not cover them."""
    rows = [f"{lon},-17.0,-50,-60" for lon in (179.98, 179.99, -179.99, -179.98)]
    table = tmp_path / "survey.csv"
    table.write_text("lon,lat,WAP1,WAP2\n" + "\n".join(rows) + "\n")
    found = read_fingerprint_table(table)
    assert found.crs in ("EPSG:32760", "EPSG:32701")
    assert np.ptp(found.east_m) == pytest.approx(4260, rel=0.01)
