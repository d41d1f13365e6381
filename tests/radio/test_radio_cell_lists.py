"""Cell lists of planning tools and of public databases."""

from pathlib import Path

import numpy as np
import pytest
from fuzz import fuzz

from mapfilter.errors import ConfigError, InputError
from mapfilter.geodesy import project
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plan_files import read_cell_plan, write_cell_plan

CRS = "EPSG:32635"
DEFAULTS = {"height_m": 25.0, "eirp_dbm": 52.0, "frequency_mhz": 1800.0}

ATOLL = """TX_ID;SITE_NAME;ANTENNA_NAME;HEIGHT;AZIMUT;TILT;LONGITUDE;LATITUDE;EIRP;BCCH;BSIC;COMMENT
S1_1;S1;65deg_18dBi;32,5;120;2;24,9430;60,1669;50,3;612;17;"rooftop; north"
S1_2;S1;;32,5;240;4;24,9430;60,1669;;618;;
"""
MLS = """radio,mcc,net,area,cell,unit,lon,lat,range,samples,changeable,created,updated,averageSignal
GSM,244,91,801,1001,,24.943,60.1669,1200,4,1,1200000000,1300000000,0
LTE,244,5,33,70657,,24.9501,60.1702,700,9,1,1200000000,1300000000,-97
"""
OLDER = """lat,lon,mcc,mnc,lac,cellid,averageSignalStrength,range,samples,changeable,radio
60.1669,24.943,244,91,801,1001,-80,1200,4,1,GSM
"""
PLAN = """cell,site,lat,lon,height_m,azimuth_deg,eirp_dbm,frequency_mhz,antenna,mcc,arfcn,bsic
A,S,60.1669,24.943,30,60,50,1825.2,sector,244,612,17
B,S,60.1669,24.943,30,,50,1825.2,omni,244,613,17
"""


def _read(folder: Path, text: str, **options: object) -> CellPlan:
    path = folder / "list.csv"
    path.write_text(text, encoding="utf-8")
    return read_cell_plan(path, CRS, **{"defaults": DEFAULTS, **options})  # type: ignore[arg-type]


def _complaint(folder: Path, text: str, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        _read(folder, text, **options)
    return str(caught.value)


def test_transmitters_of_a_planning_tool(tmp_path: Path) -> None:
    plan = _read(tmp_path, ATOLL, layout="atoll")
    first, second = plan.cells
    east_m, north_m = project(CRS, 24.943, 60.1669)
    assert (first.id, first.site, first.antenna) == ("S1_1", "S1", "65deg_18dBi")
    assert (first.east_m, first.north_m) == (east_m, north_m)
    assert (first.height_m, first.azimuth_deg, first.mechanical_downtilt_deg) == (32.5, 120, 2)
    assert (first.eirp_dbm, first.arfcn, first.bsic) == (50.3, 612, 17)
    assert (second.antenna, second.eirp_dbm, second.bsic) == ("sector", 52.0, None)
    assert plan.notes == (
        "eirp_dbm = 52 for 1 of 2 cells without one",
        "frequency_mhz = 1800 for 2 of 2 cells without one",
        "frequency_mhz is not taken from 'BCCH'; set cells.frequency_mhz",
    )


@pytest.mark.parametrize("kind", [int, np.int64, np.float32, np.float64])
def test_defaults_may_be_numbers_of_numpy(tmp_path: Path, kind: type) -> None:
    usual = {"height_m": kind(25), "eirp_dbm": kind(52), "frequency_mhz": kind(1800)}
    plan = _read(tmp_path, ATOLL, layout="atoll", defaults=usual)
    assert plan == _read(tmp_path, ATOLL, layout="atoll")
    identity = {"mcc": kind(244), "mnc": kind(91), "lac": kind(801), "ci": kind(7), **usual}
    text = "east,north\n385500,6672000\n"
    assert _read(tmp_path, text, columns={"east": "east"}, defaults=identity).ids == (
        "244-91-801-7",
    )


def test_names_that_are_no_fields_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        _read(tmp_path, PLAN, columns={"hieght_m": "height_m"}, defaults={"hieght": 3, "east": 0})
    first, second, third = map(str, caught.value.faults)
    assert first == (
        "read_cell_plan, columns: expected fields of a cell, found 'hieght_m' "
        "(likely: height_m meant)"
    )
    assert second.startswith("read_cell_plan, defaults: expected fields of a cell, found 'hieght'")
    assert third.startswith(
        "read_cell_plan, defaults: expected fields of a cell (height_m, azimuth"
    )


def test_what_is_filled_in_joins_what_a_row_assumes(tmp_path: Path) -> None:
    text = "cell,east,north,height_m,azimuth_deg,eirp_dbm,frequency_mhz,antenna,assumed\n"
    rows = (
        "A,385500,6672000,30,,,1800,omni,azimuth_deg\n"
        "B,385500,6672000,,,50,1800,omni,eirp_dbm  azimuth_deg\n"
        "C,385500,6672000,30,,50,1800,omni,eirp_dbm azimuth_deg\n"
        "D,385500,6672000,30,,50,,omni,\n"
    )
    assert [cell.assumed for cell in _read(tmp_path, text + rows).cells] == [
        "azimuth_deg eirp_dbm",
        "height_m azimuth_deg eirp_dbm",
        "eirp_dbm azimuth_deg",
        "",
    ]
    said = _complaint(tmp_path, text + "A,385500,6672000,30,,,1800,omni,indoor\n")
    assert "row 2, assumed: expected nothing, or some of" in said


def test_without_defaults_what_is_missing_is_told(tmp_path: Path) -> None:
    assert "a column frequency_mhz" in _complaint(tmp_path, ATOLL, layout="atoll", defaults=None)


def test_faults_name_the_files_own_column(tmp_path: Path) -> None:
    said = _complaint(tmp_path, ATOLL.replace(";120;", ";400;"), layout="atoll")
    assert "list.csv row 2, AZIMUT (azimuth_deg): expected degrees" in said
    said = _complaint(tmp_path, ATOLL.replace('"rooftop; north"', "rooftop; north"), layout="atoll")
    assert "row 2, fields: expected 12, found 13" in said


def test_projected_positions_of_a_planning_tool(tmp_path: Path) -> None:
    text = "tx_id,X,Y,Height\nA,385500,6672000,30\n"
    cell = _read(tmp_path, text, layout="atoll")["A"]
    assert (cell.east_m, cell.north_m, cell.antenna) == (385500.0, 6672000.0, "omni")


def test_a_map_of_columns(tmp_path: Path) -> None:
    text = "Name,E,N,AGL,dBm,MHz,Remark\nA,385500,6672000,30,50,1800,x\n"
    columns = {
        "cell": "Name",
        "east": "E",
        "north": "N",
        "height_m": "AGL",
        "eirp_dbm": "dBm",
        "frequency_mhz": "MHz",
    }
    plan = _read(tmp_path, text, columns=columns)
    assert (plan["A"].height_m, plan["A"].eirp_dbm, plan.notes) == (30.0, 50.0, ())
    said = _complaint(tmp_path, text, columns={**columns, "height_m": "AGI"})
    assert "expected a column AGI (height_m), found none (columns: Name, E, N, AGL, " in said
    assert "(likely: AGL meant)" in said
    said = _complaint(tmp_path, text, columns={**columns, "cell": "E", "east": "Name"})
    assert "row 2, Name (east): expected a number, found 'A'" in said


def test_columns_with_the_plans_own_names_need_no_map(tmp_path: Path) -> None:
    text = PLAN.replace("height_m", "AGL").replace("cell,", "Cell ID,")
    plan = _read(tmp_path, text, columns={"height_m": "AGL", "cell": "Cell ID"})
    assert (plan["A"].azimuth_deg, plan["B"].arfcn, plan.notes) == (60.0, 613, ())


def test_a_map_goes_before_the_layout(tmp_path: Path) -> None:
    plan = _read(tmp_path, ATOLL, layout="atoll", columns={"cell": "BCCH", "antenna": "TX_ID"})
    assert plan.ids == ("612", "618")
    assert plan["612"].antenna == "S1_1"
    text = "TX_ID,LATITUDE,LONGITUDE,x_m,y_m\nA,60.2,24.9,385500,6672000\n"
    plan = _read(tmp_path, text, layout="atoll", columns={"east": "x_m", "north": "y_m"})
    assert plan["A"].east_m == 385500.0


@pytest.mark.parametrize("text", [MLS, MLS.partition("\n")[2], OLDER])
def test_public_cell_lists(tmp_path: Path, text: str) -> None:
    cell = _read(tmp_path, text, layout="opencellid")["244-91-801-1001"]
    assert (cell.mcc, cell.mnc, cell.lac, cell.ci) == (244, 91, 801, 1001)
    assert (cell.east_m, cell.north_m) == project(CRS, 24.943, 60.1669)
    assert (cell.antenna, cell.height_m, cell.eirp_dbm) == ("omni", 25.0, 52.0)


def test_bad_rows_of_public_lists_are_told_and_lose_nothing_else(tmp_path: Path) -> None:
    bad = (
        "GSM,244,91,801,x,,24.9,north,1,1,1,1,1,0\nGSM,244,91\nGSM,1,1,1,1,,24.9,120,1,1,1,1,1,0\n"
    )
    again = MLS.splitlines()[1] + "\n"
    plan = _read(tmp_path, MLS + bad + again, layout="opencellid")
    assert plan.ids == ("244-91-801-1001", "244-5-33-70657")
    assert "3 faulty rows left out, such as" in plan.notes[-2]
    assert plan.notes[-1] == "1 row left out: cells listed already"
    said = _complaint(tmp_path, MLS.splitlines()[0] + "\n" + bad, layout="opencellid")
    assert "cell (ci): expected a whole number" in said


def test_one_identity_beyond_its_technology_costs_no_list(tmp_path: Path) -> None:
    rows = [f"LTE,262,1,33,{70_000 + i},,24.95,60.17,9,9,1,1,1,0" for i in range(50)]
    rows += ["GSM,262,1,100,123456,,24.95,60.17,9,9,1,1,1,0"]
    rows += ["GSM,262,1,100,x,,24.95,60.17,9,9,1,1,1,0"]
    plan = _read(tmp_path, "\n".join([MLS.splitlines()[0], *rows, ""]), layout="opencellid")
    assert len(plan) == 51
    odd = plan["262-1-100-123456"]
    # Neither what it is nor which part of its power phones report is known.
    assert (odd.technology, odd.ci, odd.eirp_dbm) == (None, 123456, 52.0)
    assert {cell.technology for cell in plan.cells} == {"LTE", None}
    assert any(
        note.startswith("technology of 1 cell left out")
        and note.endswith("such as row 52, ci: expected 0..65535 in GSM, found 123456")
        for note in plan.notes
    )
    write_cell_plan(plan, tmp_path / "again.csv")
    assert len(read_cell_plan(tmp_path / "again.csv", CRS)) == 51


def test_an_identity_beyond_its_technology_is_a_fault_of_an_own_plan(tmp_path: Path) -> None:
    own = PLAN.replace("bsic\n", "bsic,ci,technology\n").replace(",17\n", ",17,123456,GSM\n")
    assert "row 2, ci: expected 0..65535 in GSM, found 123456" in _complaint(tmp_path, own)


def test_cells_far_from_the_area_are_left_out_and_told(tmp_path: Path) -> None:
    east_m, north_m = (float(value) for value in project(CRS, 24.943, 60.1669))
    box = (east_m - 10, north_m - 10, east_m + 10, north_m + 10)
    plan = _read(tmp_path, MLS, layout="opencellid", bounds_m=box)
    assert plan.ids == ("244-91-801-1001",)
    assert plan.notes[-1] == "1 of 2 cells left out: far from the area"
    far = (0.0, 0.0, 1.0, 1.0)
    assert "cells of another area" in _complaint(tmp_path, MLS, layout="opencellid", bounds_m=far)


@pytest.mark.parametrize(
    ("text", "layout"),
    [(ATOLL, "atoll"), (MLS, "opencellid"), (PLAN, "plan")],
)
def test_damaged_lists(tmp_path: Path, text: str, layout: str, mutation_count: int) -> None:
    path = tmp_path / "list.csv"

    def read(data: bytes) -> None:
        path.write_bytes(data)
        read_cell_plan(path, CRS, layout=layout, defaults=DEFAULTS)  # type: ignore[arg-type]

    tally = fuzz(text.encode(), read, mutation_count)
    print(f"{layout}: {tally}")  # noqa: T201
    assert tally.refused > 0.2 * mutation_count


def test_usual_values_of_public_lists_are_marked(tmp_path: Path) -> None:
    plan = _read(tmp_path, MLS, layout="opencellid")
    gsm, lte = plan.cells
    # RSRP is the power of one subcarrier.
    assert (gsm.eirp_dbm, lte.eirp_dbm) == (52.0, 22.5)
    assert gsm.assumes == lte.assumes == {"height_m", "azimuth_deg", "eirp_dbm"}
    assert "eirp_dbm of 1 cell is lowered to the reported power (LTE 29.5 dB)" in plan.notes
    write_cell_plan(plan, tmp_path / "again.csv")
    assert read_cell_plan(tmp_path / "again.csv", CRS).cells[1].assumes == lte.assumes


def test_a_plan_of_ones_own_assumes_nothing(tmp_path: Path) -> None:
    assert not _read(tmp_path, PLAN)["A"].assumes
    said = _complaint(
        tmp_path, PLAN.replace("bsic\n", "bsic,assumed\n").replace(",17\n", ",17,x\n")
    )
    assert "assumed: expected nothing, or some of height_m, azimuth_deg, eirp_dbm" in said
