"""Lists of cells as placemarks of KML and KMZ."""

import io
import zipfile

import pytest

from mapfilter.errors import InputError
from mapfilter.geodesy import project
from mapfilter.radio.plan_files import read_cell_plan
from mapfilter.radio.tables import read_table

CRS = "EPSG:32635"
HEAD = '<?xml version="1.0" encoding="{}"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document>'
END = "</Document></kml>"
POINT = "<Point><coordinates> 24.94,60.17,0 </coordinates></Point>"
VALUES = {"height_m": 30, "azimuth_deg": 120, "eirp_dbm": 52, "frequency_mhz": 1800}


def data(values=VALUES, **more):
    some = (f'<Data name="{n}"><value>{v}</value></Data>' for n, v in {**values, **more}.items())
    return f"<ExtendedData>{''.join(some)}</ExtendedData>"


def simple(values=VALUES):
    some = (f'<SimpleData name="{n}">{v}</SimpleData>' for n, v in values.items())
    return f'<ExtendedData><SchemaData schemaUrl="#s">{"".join(some)}</SchemaData></ExtendedData>'


def mark(*parts, name="S1A"):
    return f"<Placemark><name>{name}</name>{''.join(parts)}</Placemark>"


def near(lon, lat):
    return pytest.approx(tuple(map(float, project(CRS, lon, lat))), abs=1e-3)


@pytest.fixture
def written(tmp_path):
    def write(*marks, packed=False, encoding="utf-8", end=END):
        content = f"{HEAD.format(encoding)}{''.join(marks)}{end}".encode(encoding)
        path = tmp_path / ("cells.kmz" if packed else "cells.kml")
        if packed:
            with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
                archive.writestr("files/icon.png", b"")
                archive.writestr("doc.kml", content)
        else:
            path.write_bytes(content)
        return path

    return write


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("of", [data, simple])
def test_a_plan_of_placemarks(written, packed, of):
    """It was refused, with the advice to export another file."""
    plan = read_cell_plan(written(mark(of(), POINT), packed=packed), CRS)
    cell = plan["S1A"]
    assert (cell.east_m, cell.north_m) == near(24.94, 60.17)
    assert (cell.height_m, cell.azimuth_deg, cell.eirp_dbm) == (30, 120, 52)
    assert any("KML read as a table of 1 placemark" in note for note in plan.notes)


def test_names_and_places_of_the_data_come_first(written):
    own = data(cell="B7", lat=60.18, lon=24.95)
    cell = read_cell_plan(written(mark(own, POINT)), CRS)["B7"]
    assert (cell.east_m, cell.north_m) == near(24.95, 60.18)


def test_columns_of_a_planning_tool(written):
    values = {"Transmitter": "N1", "Site": "N", "Height (m)": 30, "EIRP (dBm)": 52,
              "Azimuth (°)": 40, "Frequency Band": "GSM 1800"}  # fmt: skip
    path = written(mark(data(values), POINT, name="North"))
    assert read_cell_plan(path, CRS, layout="atoll")["N1"].azimuth_deg == 40


def test_areas_and_pins_are_left_out_with_a_note(written):
    area = mark(data(), "<Polygon/>", name="sector")
    plan = read_cell_plan(written(mark(data(), POINT), area, mark(POINT, name="pin")), CRS)
    assert plan.ids == ("S1A",)
    assert any("2 placemarks without a point or without data left out" in n for n in plan.notes)


@pytest.mark.parametrize("encoding", ["iso-8859-1", "utf-8", "utf-16"])
def test_encodings(written, encoding):
    table = read_table(written(mark(data(site="Köln"), POINT), encoding=encoding), "a cell plan")
    assert table.rows[0][1][table.header.index("site")] == "Köln"


@pytest.mark.parametrize(
    ("marks", "end", "told"),
    [
        (
            [mark(POINT)],
            END,
            "a point and data, found 1 placemark without.*ExtendedData",
        ),
        ([], END, "placemarks with a point and data, found none.*export the list as CSV"),
        ([mark(data(), POINT)], "", "whole KML.*cut off, or damaged"),
        (["<!DOCTYPE kml>", mark(data(), POINT)], END, "KML without entities"),
    ],
)
def test_what_holds_none_is_refused(written, marks, end, told):
    with pytest.raises(InputError, match=told):
        read_cell_plan(written(*marks, end=end), CRS)


def test_a_damaged_kmz_is_refused(written):
    path = written(mark(data(), POINT), packed=True)
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(InputError):
        read_cell_plan(path, CRS)
    whole = written(mark(data(), POINT), packed=True).read_bytes()
    at = whole.index(b"doc.kml") + 20
    path.write_bytes(whole[:at] + bytes(20) + whole[at + 20 :])
    with pytest.raises(InputError):
        read_cell_plan(path, CRS)
    # A directory before the begin of the file.
    end = whole.rindex(b"PK\x05\x06")
    path.write_bytes(whole[: end + 16] + (2**31).to_bytes(4, "little") + whole[end + 20 :])
    with pytest.raises(InputError):
        read_cell_plan(path, CRS)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("a.txt", "no list")
    path.write_bytes(packed.getvalue())
    with pytest.raises(InputError):
        read_cell_plan(path, CRS)
