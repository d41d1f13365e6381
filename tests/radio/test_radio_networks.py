"""Plans of networks as they are: technologies, identities in one text, other encodings, Excel."""

from pathlib import Path

import pytest
from made_workbook import workbook

from mapfilter.database.store import read_cells, write_cells
from mapfilter.errors import InputError
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plan_files import read_cell_plan, write_cell_plan

CRS = "EPSG:32635"
PLACE = "60.17,24.94,30,,50,1800"
HEADER = "cell,lat,lon,height_m,azimuth_deg,eirp_dbm,frequency_mhz"


def read(folder: Path, text: str | bytes, name: str = "cells.csv", **options: object) -> CellPlan:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_cell_plan(path, CRS, **options)


def refusal(folder: Path, text: str | bytes, name: str = "cells.csv", **options: object) -> str:
    with pytest.raises(InputError) as caught:
        read(folder, text, name, **options)
    return str(caught.value)


@pytest.mark.parametrize(
    ("technology", "arfcn", "bsic", "ci"),
    [
        ("GSM", 1023, 63, 65_535),
        ("UMTS", 16_383, 511, 2**28 - 1),
        ("LTE", 262_143, 503, 2**28 - 1),
        ("NR", 3_279_165, 1007, 2**36 - 1),
    ],
)
def test_the_largest_values_of_a_technology(technology, arfcn, bsic, ci, tmp_path):
    head = f"{HEADER},technology,arfcn,bsic,ci\n"
    cell = read(tmp_path, f"{head}A,{PLACE},{technology},{arfcn},{bsic},{ci}\n")["A"]
    assert (cell.technology, cell.arfcn, cell.bsic, cell.ci) == (technology, arfcn, bsic, ci)
    values = {"arfcn": arfcn, "bsic": bsic, "ci": ci}
    for name in values:
        wrong = ",".join(str(v + (k == name)) for k, v in values.items())
        said = refusal(tmp_path, f"{head}A,{PLACE},{technology},{wrong}\n")
        assert f"row 2, {name}" in said
        assert str(values[name]) in said


def test_columns_by_technology_side_by_side(tmp_path):
    text = (
        f"{HEADER},arfcn,bsic,earfcn,pci,uarfcn,psc,nr_arfcn\n"
        f"G,{PLACE},612,17,,,,,\n"
        f"L,{PLACE},,,1300,435,,,\n"
        f"U,{PLACE},,,,,10737,101,\n"
        f"N,{PLACE},,,,800,,,640000\n"
    )
    plan = read(tmp_path, text)
    found = {c.id: (c.technology, c.arfcn, c.bsic) for c in plan.cells}
    assert found == {
        "G": (None, 612, 17),
        "L": ("LTE", 1300, 435),
        "U": ("UMTS", 10737, 101),
        "N": ("NR", 640000, 800),
    }
    assert plan.ids_by_carrier[1300, 435] == ("L",)


def test_words_for_technologies(tmp_path):
    text = f"{HEADER},technology\nA,{PLACE},4G\nB,{PLACE},wcdma\nC,{PLACE},\n"
    assert [c.technology for c in read(tmp_path, text).cells] == ["LTE", "UMTS", None]
    said = refusal(tmp_path, f"{HEADER},technology\nA,{PLACE},6G\n")
    assert "row 2, technology: expected one of GSM, UMTS, LTE, NR, or nothing, found '6G'" in said


def test_identities_in_one_text(tmp_path):
    head = HEADER.replace("cell,", "cgi,")
    cells = read(tmp_path, f"{head}\n262-01-1234-5678,{PLACE}\n302:720:9751830,{PLACE}\n").cells
    assert [c.id for c in cells] == ["262-1-1234-5678", "302-720-9751830"]
    assert [(c.mcc, c.mnc, c.lac, c.ci) for c in cells] == [
        (262, 1, 1234, 5678),
        (302, 720, None, 9751830),
    ]
    named = read(tmp_path, f"{HEADER},ecgi\nA,{PLACE},302-720-7\n")["A"]
    assert (named.mcc, named.ci) == (302, 7)


def test_technologies_are_written_and_read_back(tmp_path):
    text = f"{HEADER},technology,arfcn,bsic\nA,{PLACE},LTE,1300,435\nB,{PLACE},,,\n"
    plan = read(tmp_path, text)
    write_cell_plan(plan, tmp_path / "again.csv")
    again = read_cell_plan(tmp_path / "again.csv", CRS)
    assert [(c.technology, c.arfcn) for c in again.cells] == [("LTE", 1300), (None, None)]
    write_cells(plan, tmp_path / "cells.parquet")
    assert read_cells(tmp_path / "cells.parquet", CRS) == plan
    plain = read(tmp_path, f"{HEADER}\nA,{PLACE}\n")
    write_cell_plan(plain, tmp_path / "plain.csv")
    assert "technology" not in (tmp_path / "plain.csv").read_text()


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings(encoding, tmp_path):
    text = f"{HEADER},site\nZ\u00fcrich \u2013 1,{PLACE},\u00d6rlikon\n"
    plan = read(tmp_path, text.encode(encoding))
    assert plan.cells[0].id == "Z\u00fcrich \u2013 1"
    assert plan.cells[0].site == "\u00d6rlikon"
    assert any("Windows-1252" in note for note in plan.notes) == (encoding == "cp1252")


ROWS: list[list[object]] = [
    ["TX_ID", "LATITUDE", "LONGITUDE", "HEIGHT", "AZIMUTH", "EIRP", "FREQUENCY", "CI"],
    ["S\u00fcd_1", 60.17, 24.94, 30, 120, 50.5, 1800, 9751830],
]


def test_workbooks_of_excel(tmp_path):
    plan = read(tmp_path, workbook(ROWS, [["other"]]), "cells.xlsx", layout="atoll")
    cell = plan["S\u00fcd_1"]
    assert (cell.height_m, cell.eirp_dbm, cell.ci, cell.azimuth_deg) == (30.0, 50.5, 9751830, 120)
    assert plan.notes == ("cells.xlsx: sheet 'S1' of a workbook; 1 more not read",)


@pytest.mark.parametrize("name", ["cells.xlsx", "cells.csv"])
def test_lines_of_a_title_above_the_header_are_left_out(tmp_path, name):
    """Those of a workbook, and of a CSV file with its separators, were taken for the header."""
    rows = [["Export of 12 March"], [""], *ROWS]
    data = "".join(";".join([*map(str, row), *[""] * (8 - len(row))]) + "\n" for row in rows)
    given = workbook(rows) if name.endswith("xlsx") else data
    plan = read(tmp_path, given, name, layout="atoll")
    assert plan["S\u00fcd_1"].height_m == 30.0
    assert plan.notes[-1] == f"{name}: 1 line above the header left out: 'Export of 12 March'"


def test_names_that_no_file_can_have_say_what_to_write(tmp_path):
    rows = [ROWS[0], ["Nord/1", *ROWS[1][1:]]]
    said = refusal(tmp_path, workbook(rows), "cells.xlsx", layout="atoll")
    assert "give the cell that of its raster" in said
    # No file is named by a site.
    rows = [[*ROWS[0], "SITE_NAME"], [*ROWS[1], "Nord/1"]]
    found = read(tmp_path, workbook(rows), "cells.xlsx", layout="atoll")
    assert [cell.site for cell in found.cells] == ["Nord/1"]


def test_faults_of_workbooks(tmp_path):
    rows = [ROWS[0], [*ROWS[1][:3], "high", *ROWS[1][4:]]]
    said = refusal(tmp_path, workbook(rows), "cells.xlsx", layout="atoll")
    assert "cells.xlsx row 2, HEIGHT (height_m): expected metres > 0" in said
    assert "found 'high'" in said
    data = workbook(ROWS)
    for end in range(10, len(data), 37):
        said = refusal(tmp_path, data[:end], "cells.xlsx", layout="atoll")
        assert "a workbook that can be read" in said
    # The version that its directory asks for, beyond those that there are.
    at = data.index(b"PK\x01\x02") + 6
    said = refusal(tmp_path, data[:at] + b"\xf0" + data[at + 1 :], "cells.xlsx", layout="atoll")
    assert "a workbook that can be read, found zip file version 24.0" in said
    assert "an empty sheet" in refusal(tmp_path, workbook([[""]]), "cells.xlsx")
    said = refusal(tmp_path, workbook(ROWS), "cells.xlsx")
    assert "expected columns of a cell plan (cell, site, lat, lon, …), found TX_ID, " in said
    assert said.endswith('(likely: transmitters of Atoll: set cells.layout = "atoll")')


def test_a_missing_column_lists_the_columns_and_the_map(tmp_path):
    text = "Sender,lat,lon,Hoehe,eirp_dbm,frequency_mhz\nA,60.17,24.94,30,50,1800\n"
    said = refusal(tmp_path, text, columns={"cell": "Sender"})
    assert "expected a column height_m, found none (columns: Sender, lat, lon, Hoehe, " in said
    assert "cells.columns.height_m names a column called otherwise" in said
