"""Antennas that a planning tool places beside their site: metres along east and north."""

import pytest

from mapfilter.errors import InputError
from mapfilter.radio.plan_files import read_cell_plan, write_cell_plan

CRS = "EPSG:32635"
HEADER = "TX_ID;SITE_NAME;X;Y;DX;DY;HEIGHT;AZIMUT;EIRP;FREQUENCY\n"
ROWS = (
    "A;S;385500;6672000;3,5;-4,5;30;0;50;1800\n"
    "B;S;385500;6672000;;;30;120;50;1800\n"
    "C;S;385500;6672000;0;-12;30;240;50;1800\n"
)


def read(folder, text, **options):
    (folder / "cells.csv").write_text(text, encoding="utf-8")
    return read_cell_plan(folder / "cells.csv", CRS, **{"layout": "atoll", **options})


def test_cells_lie_beside_their_site(tmp_path):
    plan = read(tmp_path, HEADER + ROWS)
    assert [(cell.east_m, cell.north_m) for cell in plan.cells] == [
        (385503.5, 6671995.5),
        (385500.0, 6672000.0),
        (385500.0, 6671988.0),
    ]
    assert plan.notes == (
        "2 cells lie beside the place of the site, by DX (east_offset_m) and DY (north_offset_m), "
        "up to 12 m",
    )


def test_one_of_both_is_enough_and_degrees_are_moved_by_metres_too(tmp_path):
    text = "TX_ID,LONGITUDE,LATITUDE,DY (m),HEIGHT,AZIMUT,EIRP,FREQUENCY\n"
    row = "A,24.94,60.17,{},30,0,50,1800\n"
    still, moved = (read(tmp_path, text + row.format(north)).cells[0] for north in (0, 7))
    assert moved.east_m == still.east_m
    assert moved.north_m - still.north_m == pytest.approx(7.0)


def test_their_columns_may_be_named(tmp_path):
    text = "cell,east,north,right,height_m,eirp_dbm,frequency_mhz\nA,385500,6672000,-2,30,50,1800\n"
    columns = {"east_offset_m": "right"}
    (cell,) = read(tmp_path, text, layout="plan", columns=columns).cells
    assert (cell.east_m, cell.north_m) == (385498.0, 6672000.0)
    # Without that the plan's own layout has no such column.
    with pytest.raises(InputError, match="'right'"):
        read(tmp_path, text, layout="plan")


@pytest.mark.parametrize("columns", [None, {"cell": "cell"}])
def test_they_are_columns_of_an_own_plan(tmp_path, columns):
    text = "cell,east,north,east_offset_m,north_offset_m,height_m,eirp_dbm,frequency_mhz\n"
    rows = "A,385500,6672000,3.5,-4.5,30,50,1800\nB,385500,6672000,,,30,50,1800\n"
    plan = read(tmp_path, text + rows, layout="plan", columns=columns)
    assert [(cell.east_m, cell.north_m) for cell in plan.cells] == [
        (385503.5, 6671995.5),
        (385500.0, 6672000.0),
    ]
    assert plan.notes == (
        "1 cell lies beside the place of the site, by east_offset_m and north_offset_m, "
        "up to 5.7 m",
    )
    write_cell_plan(plan, tmp_path / "again.csv")
    assert "offset" not in (tmp_path / "again.csv").read_text()
    again = read_cell_plan(tmp_path / "again.csv", CRS)
    assert again["A"].east_m == pytest.approx(385503.5, abs=1e-3)
    with pytest.raises(InputError, match=r"row 2, east_offset_m: expected metres in -1000\.\.1000"):
        read(tmp_path, text + rows.replace("3.5", "3500"), layout="plan", columns=columns)


def test_what_cannot_be_such_an_offset_is_refused(tmp_path):
    rows = ROWS.replace(";3,5;-4,5;", ";385503;-4,5;").replace(";0;-12;", ";left;-12;")
    with pytest.raises(InputError) as caught:
        read(tmp_path, HEADER + rows)
    assert [(one.where.rpartition("row ")[2], one.expected) for one in caught.value.faults] == [
        ("2, DX (east_offset_m)", "metres in -1000..1000"),
        ("4, DX (east_offset_m)", "metres in -1000..1000"),
    ]
    with pytest.raises(InputError, match="another unit; convert the column to metres"):
        read(tmp_path, HEADER.replace("DX", "DX (ft)") + ROWS)
