"""The cell plan: checks, reading, writing."""

import contextlib
import pickle
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import InputError
from mapfilter.geodesy import project, unproject
from mapfilter.radio.cell_places import ZONE_IN_FRONT
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.plan_files import read_cell_plan, write_cell_plan

CRS = "EPSG:32635"
HEADER = "cell,site,lat,lon,height_m,azimuth_deg,eirp_dbm,frequency_mhz,arfcn,bsic\n"
ROW = "A,S,60.17,24.94,30,120,50,1800,600,7\n"

CELL = Cell("A", "S", 385000.0, 6672000.0, 30.0, 120.0, 50.0, 1800.0)


def _read(folder: Path, text: str | bytes) -> CellPlan:
    path = folder / "cells.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_cell_plan(path, CRS)


def _complaint(folder: Path, text: str | bytes) -> str:
    with pytest.raises(InputError) as caught:
        _read(folder, text)
    return str(caught.value)


def test_reads_what_it_should(tmp_path: Path) -> None:
    cell = _read(tmp_path, HEADER + ROW)["A"]
    east_m, north_m = project(CRS, 24.94, 60.17)
    assert (cell.east_m, cell.north_m) == (east_m, north_m)
    assert (cell.site, cell.antenna, cell.azimuth_deg) == ("S", "sector", 120.0)
    assert (cell.arfcn, cell.bsic, cell.mcc, cell.indoor) == (600, 7, None, False)
    assert cell.beamwidth_deg == 65.0


def test_semicolons_byte_order_mark_and_blank_lines(tmp_path: Path) -> None:
    text = "\ufeff" + (HEADER + "\n" + ROW).replace(",", ";").replace("\n", "\r\n")
    assert _read(tmp_path, text).ids == ("A",)


def test_without_azimuth_the_antenna_is_omni_and_without_site_the_site_is_the_cell(
    tmp_path: Path,
) -> None:
    cell = _read(tmp_path, HEADER + "A,,60.17,24.94,30,,50,1800,,\n")["A"]
    assert (cell.antenna, cell.azimuth_deg, cell.site, cell.arfcn) == ("omni", None, "A", None)


def test_east_and_north_are_taken_as_they_are_or_moved_from_their_own_crs(tmp_path: Path) -> None:
    header = "cell,east,north,crs,height_m,eirp_dbm,frequency_mhz\n"
    own = _read(tmp_path, header + "A,385500,6672000,,30,50,1800\n")["A"]
    assert (own.east_m, own.north_m) == (385500.0, 6672000.0)
    lon, lat = unproject(CRS, 385500.0, 6672000.0)
    east_m, north_m = project("EPSG:3067", lon, lat)
    moved = _read(tmp_path, header + f"A,{east_m},{north_m},EPSG:3067,30,50,1800\n")["A"]
    assert abs(moved.east_m - 385500.0) < 1e-3
    assert abs(moved.north_m - 6672000.0) < 1e-3


@pytest.mark.parametrize(
    ("east", "north", "likely"),
    [
        (6672000, 385500, "east and north swapped"),
        (35385500, 6672000, ZONE_IN_FRONT),
        (3385500, 6672000, ZONE_IN_FRONT),
        (1264764, 21889763, "feet given for metres"),
        (9e6, 9.9e6, "another CRS"),
    ],
)
def test_metres_of_another_kind_are_told_by_what_they_are(
    tmp_path: Path, east: float, north: float, likely: str
) -> None:
    header = "cell,east,north,height_m,eirp_dbm,frequency_mhz\n"
    complaint = _complaint(tmp_path, header + f"A,{east},{north},30,50,1800\n")
    assert complaint.endswith(f"(likely: {likely})")


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("A,S,24.94,60.17,30,120,50,1800,600,7", "longitude and latitude swapped"),
        ("A,S,6672000,385000,30,120,50,1800,600,7", "metres given for degrees"),
        ("A,S,120,24.94,30,120,50,1800,600,7", "longitude and latitude swapped"),
        ("A,S,41.1,-8.6,30,120,50,1800,600,7", "another place, or another CRS"),
        ("A,S,nan,24.94,30,120,50,1800,600,7", "row 2, lat"),
        ("A,S,60.17,inf,30,120,50,1800,600,7", "row 2, lon"),
        ("A,S,60.17,24.94,0,120,50,1800,600,7", "row 2, height_m"),
        ("A,S,60.17,24.94,,120,50,1800,600,7", "row 2, height_m"),
        ("A,S,60.17,24.94,30,361,50,1800,600,7", "row 2, azimuth_deg"),
        ("A,S,60.17,24.94,30,120,20000,1800,600,7", "watts or milliwatts"),
        ("A,S,60.17,24.94,30,120,50,1.8,600,7", "GHz given for MHz"),
        ("A,S,60.17,24.94,30,120,50,1.8e9,600,7", "Hz given for MHz"),
        ("A,S,60.17,24.94,30,120,50,1800,1.8e9,7", "Hz given for a carrier"),
        ("A,S,60.17,24.94,30,120,50,1800,600,1008", "row 2, bsic"),
        ("A,S,60.17,24.94,30,-90,50,1800,600,7", "counted from -180; add 360"),
        ("A,S,60.17,24.94,30,120,50,1800,600.5,7", "row 2, arfcn"),
        ("A,S,60.17,24.94,30,east,50,1800,600,7", "'east'"),
        ("A,S,60.17,24.94,30,120,50,1800,600", "the line is cut off"),
        ("A,S,60.17,24.94,30,120,50,1800,600,7,8", "expected 10, found 11"),
        ("../A,S,60.17,24.94,30,120,50,1800,600,7", "row 2, cell"),
        ("a/b,S,60.17,24.94,30,120,50,1800,600,7", "row 2, cell"),
        ("a\\b,S,60.17,24.94,30,120,50,1800,600,7", "row 2, cell"),
        (",S,60.17,24.94,30,120,50,1800,600,7", "row 2, cell"),
        ("A\x07,S,60.17,24.94,30,120,50,1800,600,7", "row 2, cell"),
    ],
)
def test_a_wrong_row_is_told_by_file_row_and_field(tmp_path: Path, row: str, said: str) -> None:
    complaint = _complaint(tmp_path, HEADER + row + "\n")
    assert said in complaint
    assert "cells.csv row 2" in complaint
    assert "\n" not in complaint


def test_all_faults_are_told_together(tmp_path: Path) -> None:
    rows = "A,S,60.17,24.94,-1,400,50,1800,600,7\nB,S,nan,24.94,30,0,50,1800,x,7\n"
    complaint = _complaint(tmp_path, HEADER + rows)
    for field in ("row 2, height_m", "row 2, azimuth_deg", "row 3, lat", "row 3, arfcn"):
        assert field in complaint


def test_duplicate_ids_are_told_by_row(tmp_path: Path) -> None:
    complaint = _complaint(tmp_path, HEADER + ROW + ROW)
    assert "cells.csv row 3, cell: expected an id used once, found 'A'" in complaint


def test_azimuths_in_radians_are_told(tmp_path: Path) -> None:
    rows = "".join(f"C{i},S,60.17,24.94,30,{a},50,1800,600,7\n" for i, a in enumerate((0.52, 4.71)))
    assert "radians given for degrees" in _complaint(tmp_path, HEADER + rows)


def test_small_azimuths_in_whole_degrees_are_no_radians(tmp_path: Path) -> None:
    rows = "".join(f"C{i},S,60.17,24.94,30,{a},50,1800,600,7\n" for i, a in enumerate((0, 5)))
    assert len(_read(tmp_path, HEADER + rows)) == 2


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("cell,lat,lon,height,eirp_dbm,frequency_mhz\n", "height_m meant"),
        ("Cells,lat,lon,height_m,eirp_dbm\n", "cell meant; else name what it holds in [cells.col"),
        ("cell,Latitude,lon,height_m,eirp_dbm\n", "'Latitude' (likely: lat meant, in degrees;"),
        ("cell,lat,Long,height_m,eirp_dbm\n", "'Long' (likely: lon meant, in degrees;"),
        ("cell,X,north,height_m,eirp_dbm\n", "'X' (likely: east meant, in metres;"),
        ("cell,lat,lon,Height (ft),eirp_dbm\n", "height_m meant, in metres;"),
        ("CellName,lat,lon,height_m,eirp_dbm\n", "cell meant;"),
        ("cell,lat,lon,height_m,eirp_dbm,PCI\n", "pci meant;"),
        ("cell,lat,height_m,eirp_dbm,frequency_mhz\n", "a column lon"),
        ("cell,lat,lat,lon,height_m,eirp_dbm,frequency_mhz\n", "lat 2 times"),
        ("cell,lat,lon,east,north,height_m,eirp_dbm,frequency_mhz\n", "found both"),
    ],
)
def test_wrong_headers_are_told(tmp_path: Path, header: str, said: str) -> None:
    assert said in _complaint(tmp_path, header + "A,1,2,3,4,5\n")


def test_a_column_that_is_there_is_not_what_another_one_meant(tmp_path: Path) -> None:
    said = _complaint(
        tmp_path, "cell,site,breite,lon,height_m,eirp_dbm,frequency_mhz\nA,1,2,3,4,5,6\n"
    )
    assert "found 'breite' (likely: name what it holds in [cells.columns])" in said


@pytest.mark.parametrize(
    "name", ["Vendor", "Region", "RAT", "RAC", "state", "call", "bandwidth_mhz", "Altitude", "X"]
)
def test_a_column_of_something_else_resembles_no_column(tmp_path: Path, name: str) -> None:
    lacking = "lat" if name != "X" else "site"
    header = ",".join(one for one in ("cell", "site", "lat", "lon") if one != lacking)
    said = _complaint(tmp_path, f"{header},{name}\nA,1,2,3\n")
    assert f"found {name!r} (likely: name what it holds in [cells.columns])" in said


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "an empty file"),
        (b"\n\n", "an empty file"),
        (HEADER.encode(), "a header without rows"),
        (HEADER.encode() + b"\x81\xe4,S,60.17,24.94,30,120,50,1800,600,7\n", "no text file"),
        (b"PK\x03\x04" + b"A" * 200, "a workbook that can be read"),
        (HEADER.encode() + b"A\x00,S,60.17,24.94,30,120,50,1800,600,7\n", "NUL"),
        (HEADER.encode() + b'"' + b"A" * 200_000, "row"),
    ],
)
def test_files_that_are_no_plan(tmp_path: Path, content: bytes, said: str) -> None:
    assert said in _complaint(tmp_path, content)


@given(st.text(st.sampled_from('A,;"\n60.17 -24e9x'), max_size=120))
def test_any_rows_are_read_or_told(tmp_path_factory: pytest.TempPathFactory, rows: str) -> None:
    with contextlib.suppress(InputError):
        _read(tmp_path_factory.mktemp("rows"), HEADER + rows)


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        read_cell_plan(tmp_path / "none.csv", CRS)
    with pytest.raises(InputError, match="readable file"):
        read_cell_plan(tmp_path, CRS)


def test_decimal_commas_are_read_where_they_separate_nothing(tmp_path: Path) -> None:
    for separator in (";", "\t"):
        text = HEADER.replace(",", separator) + "A;S;60,17;24.94;30,5;120;50;1800;600;7\n".replace(
            ";", separator
        )
        cell = _read(tmp_path, text)["A"]
        assert (cell.height_m, cell.east_m) == (30.5, project(CRS, 24.94, 60.17)[0])
    assert "row 2, lat" in _complaint(tmp_path, text.replace("60,17", "60,17,1"))


def test_decimal_comma_is_told(tmp_path: Path) -> None:
    text = HEADER + 'A,S,"60,17",24.94,30,120,50,1800,600,7\n'
    assert "found '60,17' (likely: a decimal comma)" in _complaint(tmp_path, text)


def test_degrees_given_for_metres_are_told(tmp_path: Path) -> None:
    text = "cell,east,north,height_m,eirp_dbm,frequency_mhz\nA,24.94,60.17,30,50,1800\n"
    assert "degrees given for metres" in _complaint(tmp_path, text)


def test_rows_of_different_crs_are_refused(tmp_path: Path) -> None:
    text = (
        "cell,east,north,crs,height_m,eirp_dbm,frequency_mhz\n"
        "A,385500,6672000,EPSG:32635,30,50,1800\nB,385500,6672000,EPSG:3067,30,50,1800\n"
    )
    assert "one CRS in all rows" in _complaint(tmp_path, text)


_TEXTS = st.text(
    st.characters(exclude_categories=("Cc", "Cs"), exclude_characters="/\\"), min_size=1
).filter(lambda text: ".." not in text and text == text.strip() and len(text) <= 128)


@st.composite
def _cells(draw: st.DrawFn) -> Cell:
    omni = draw(st.booleans())
    optional = st.none() | st.integers(0, 63)
    return Cell(
        id=draw(_TEXTS),
        site=draw(_TEXTS),
        east_m=draw(st.floats(400000, 600000)),
        north_m=draw(st.floats(6000000, 7500000)),
        height_m=draw(st.floats(0.5, 300)),
        azimuth_deg=None if omni else draw(st.floats(7, 360)),
        antenna="omni" if omni else "sector",
        eirp_dbm=draw(st.floats(-30, 80)),
        frequency_mhz=draw(st.floats(400, 6000)),
        downtilt_deg=draw(st.floats(-10, 10)),
        vertical_beamwidth_deg=draw(st.none() | st.floats(1, 90)),
        indoor=draw(st.booleans()),
        penetration_loss_db=draw(st.floats(0, 40)),
        arfcn=draw(optional),
        bsic=draw(optional),
    )


@given(cells=st.lists(_cells(), min_size=1, max_size=4, unique_by=lambda cell: cell.id))
def test_round_trip(tmp_path_factory: pytest.TempPathFactory, cells: list[Cell]) -> None:
    plan = CellPlan(CRS, tuple(cells))
    path = tmp_path_factory.mktemp("plan") / "cells.csv"
    write_cell_plan(plan, path)
    again = read_cell_plan(path, CRS)
    for old, new in zip(plan.cells, again.cells, strict=True):
        assert abs(old.east_m - new.east_m) < 1e-3
        assert abs(old.north_m - new.north_m) < 1e-3
        assert replace(new, east_m=old.east_m, north_m=old.north_m) == old


def test_names_with_semicolons_are_no_other_separator(tmp_path: Path) -> None:
    ids = ("262;1;1234;1", "262;1;1234;2")
    plan = CellPlan(CRS, tuple(replace(CELL, id=one, site="North, S1") for one in ids))
    write_cell_plan(plan, tmp_path / "a.csv")
    again = read_cell_plan(tmp_path / "a.csv", CRS)
    assert [(cell.id, cell.site) for cell in again.cells] == [(one, "North, S1") for one in ids]


def test_written_bytes_depend_on_the_plan_alone(tmp_path: Path) -> None:
    plan = CellPlan(CRS, (CELL,))
    write_cell_plan(plan, tmp_path / "a.csv")
    write_cell_plan(read_cell_plan(tmp_path / "a.csv", CRS), tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_plan_is_checked_when_made() -> None:
    wrong = replace(CELL, id="a/b", height_m=0, east_m=float("nan"), eirp_dbm=float("inf"))
    with pytest.raises(InputError) as caught:
        CellPlan("EPSG:4326", (wrong, CELL, CELL))
    text = str(caught.value)
    for part in (
        "degrees given for metres",
        "'a/b'",
        "height_m",
        "east_m",
        "eirp_dbm",
        "used once",
    ):
        assert part in text


def test_numpy_numbers_are_written_as_numbers_and_texts_are_refused(tmp_path: Path) -> None:
    numbers = replace(CELL, height_m=np.float64(30.5), bsic=np.int64(7), indoor=np.True_)
    write_cell_plan(CellPlan(CRS, (numbers,)), tmp_path / "a.csv")
    again = read_cell_plan(tmp_path / "a.csv", CRS)["A"]
    assert (again.height_m, again.bsic, again.indoor) == (30.5, 7, True)
    with pytest.raises(InputError, match="height_m: expected metres > 0"):
        CellPlan(CRS, (replace(CELL, height_m="30"),))  # type: ignore[arg-type]


def test_empty_plan_sector_without_azimuth_and_unknown_cell() -> None:
    assert len(CellPlan(CRS, ())) == 0
    with pytest.raises(InputError, match="azimuth left out"):
        CellPlan(CRS, (replace(CELL, azimuth_deg=None),))
    plan = CellPlan(CRS, (CELL,))
    assert "A" in plan
    assert plan.index("A") == 0
    with pytest.raises(InputError, match="'B'"):
        plan["B"]


def test_another_crs_moves_positions_only() -> None:
    plan = CellPlan(CRS, (CELL,))
    moved = plan.to_crs("EPSG:3067")
    assert moved.crs == "EPSG:3067"
    assert replace(moved["A"], east_m=CELL.east_m, north_m=CELL.north_m) == CELL
    back = moved.to_crs(CRS)["A"]
    np.testing.assert_allclose([back.east_m, back.north_m], [CELL.east_m, CELL.north_m], atol=1e-3)


def test_plans_travel_to_worker_processes() -> None:
    plan = CellPlan(CRS, (CELL,))
    assert plan.index("A") == 0
    assert pickle.loads(pickle.dumps(plan)) == plan


def test_the_plan_that_ships_is_sound() -> None:
    with resources.as_file(resources.files("mapfilter.data") / "helsinki-cells.csv") as path:
        plan = read_cell_plan(path, CRS)
    assert len({cell.site for cell in plan.cells if not cell.indoor}) == 3
    assert sum(not cell.indoor for cell in plan.cells) == 9
    assert sum(cell.indoor for cell in plan.cells) == 4
    assert len(plan.ids_by_carrier) == len(plan)
    lon, lat = unproject(CRS, [c.east_m for c in plan.cells], [c.north_m for c in plan.cells])
    assert ((lon > 24.9352) & (lon < 24.9534)).all()
    assert ((lat > 60.1642) & (lat < 60.1791)).all()


def test_a_plan_is_gone_over_by_its_ids():
    plan = CellPlan(CRS, (CELL, replace(CELL, id="B")))
    assert list(plan) == ["A", "B"]
    assert [plan[cell_id].id for cell_id in plan if cell_id in plan] == list(plan.ids)
    assert dict.fromkeys(plan, 0) == {"A": 0, "B": 0}


FEET = "EPSG:2263"
"""New York Long Island, in US survey feet."""


def _plan_in(crs: str, rows: int, folder: Path) -> CellPlan:
    lon, lat = -73.98 + 0.001 * np.arange(rows), np.full(rows, 40.75)
    east, north = project(crs, lon, lat)
    lines = ["cell,east,north,crs,height_m,eirp_dbm,frequency_mhz"]
    lines += [f"A{n},{east[n]:.4f},{north[n]:.4f},{crs},30,50,1800" for n in range(rows)]
    (folder / "cells.csv").write_text("\n".join([*lines, ""]))
    return read_cell_plan(folder / "cells.csv", "EPSG:32618")


def test_a_plan_in_feet_is_converted_and_says_so(tmp_path: Path) -> None:
    plan = _plan_in(FEET, 5, tmp_path)
    lon, lat = unproject(
        "EPSG:32618", [c.east_m for c in plan.cells], [c.north_m for c in plan.cells]
    )
    np.testing.assert_allclose(lon, -73.98 + 0.001 * np.arange(5), atol=1e-8)
    np.testing.assert_allclose(lat, 40.75, atol=1e-8)
    told = "positions in US survey feet, the unit of EPSG:2263, are converted to metres"
    assert plan.notes == (told,)


def test_metres_in_a_crs_of_feet_are_told(tmp_path: Path) -> None:
    east, north = (0.3048 * float(one) for one in project("EPSG:2225", -122.0, 41.0))
    (tmp_path / "cells.csv").write_text(
        "cell,east,north,crs,height_m,eirp_dbm,frequency_mhz\n"
        f"A,{east},{north},EPSG:2225,30,50,1800\n"
    )
    told = "expected US survey feet where EPSG:2225 is used, .* (likely: metres given for US"
    with pytest.raises(InputError, match=told.replace("(", r"\(")):
        read_cell_plan(tmp_path / "cells.csv", "EPSG:32610")


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:99999", "EPSG:2053"])
def test_a_crs_that_cannot_be_used_is_told_once(tmp_path: Path, crs: str) -> None:
    rows = "".join(f"A{n},1,1,{crs},30,50,1800\n" for n in range(40))
    said = _complaint(tmp_path, "cell,east,north,crs,height_m,eirp_dbm,frequency_mhz\n" + rows)
    assert said.count("\n") == 0
    assert "cells.csv, crs (40 rows): expected" in said
