"""Lists of cells as placemarks of KML and KMZ."""

import io
import struct
import tracemalloc
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


def test_metres_of_the_data_come_first(written):
    """A layer of QGIS has its own east and north beside its points; it was refused for both."""
    cell = read_cell_plan(written(mark(data(east=385_000, north=6_672_000), POINT)), CRS)["S1A"]
    assert (cell.east_m, cell.north_m) == (385_000, 6_672_000)


def test_empty_data_give_way_to_the_placemark(written):
    cell = read_cell_plan(written(mark(data(cell="", lat="", lon=""), POINT)), CRS)["S1A"]
    assert (cell.east_m, cell.north_m) == near(24.94, 60.17)


def test_a_page_in_a_description_is_no_entity(written):
    """It was refused for its own DOCTYPE, which is text here."""
    page = "<description><![CDATA[<!DOCTYPE html><b>North</b>]]></description>"
    assert read_cell_plan(written(mark(page, data(), POINT)), CRS).ids == ("S1A",)


@pytest.mark.parametrize("comment", ["", "<!-- <kml> -->"])
def test_entities_are_refused(tmp_path, comment):
    path, (begin, rest) = tmp_path / "cells.kml", HEAD.format("utf-8").split("?>")
    many = "".join(f'<!ENTITY a{n + 1} "{f"&a{n};" * 10}">' for n in range(9))
    doctype = f'{comment}<!DOCTYPE kml [<!ENTITY a0 "x">{many}]>'
    path.write_text(f"{begin}?>{doctype}{rest}{mark(data(site='&a9;'), POINT)}{END}")
    with pytest.raises(InputError, match="KML without entities, found a DOCTYPE"):
        read_cell_plan(path, CRS)


def test_names_that_differ_in_each_placemark_do_not_fill_the_memory(written):
    """Fields grew with the square of the placemarks before their number was looked at."""
    path = written(*(mark(data(**{f"u{n}": n}), POINT, name=f"S{n}") for n in range(1500)))
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="at most 1000 columns, found 1507"):
            read_cell_plan(path, CRS)
        assert tracemalloc.get_traced_memory()[1] < 12e6
    finally:
        tracemalloc.stop()


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
        (["<!DOCTYPE kml>", mark(data(), POINT)], END, "whole KML"),
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


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_damaged_document_is_told_as_such(tmp_path, method):
    """A damaged KMZ was called a workbook, and one packed by LZMA ended in a traceback."""
    path, packed = tmp_path / "cells.kmz", io.BytesIO()
    with zipfile.ZipFile(packed, "w", method) as archive:
        archive.writestr("doc.kml", f"{HEAD}{mark(data(), POINT) * 30}{END}")
    whole = packed.getvalue()
    at = whole.index(b"doc.kml") + len("doc.kml")
    path.write_bytes(whole[:at] + bytes(20) + whole[at + 20 :])
    with pytest.raises(InputError, match="a KMZ that can be read"):
        read_cell_plan(path, CRS)


def test_a_document_beyond_the_end_of_any_file_is_told_as_damage(written):
    """Its place is in a field of 64 bits, and no file is as long: that ended in a traceback."""
    path = written(mark(data(), POINT), packed=True)
    whole = path.read_bytes()
    begin, at = whole.index(b"PK\x01\x02"), whole.rindex(b"PK\x01\x02")
    end = whole.rindex(b"PK\x05\x06")
    extra = struct.pack("<HHQ", 1, 8, 2**63)
    entry = bytearray(whole[at:end] + extra)
    entry[30:32], entry[42:46] = struct.pack("<H", len(extra)), b"\xff" * 4
    size = struct.pack("<I", end + len(extra) - begin)
    path.write_bytes(whole[:at] + entry + whole[end : end + 12] + size + whole[end + 16 :])
    with pytest.raises(InputError, match="a KMZ that can be read"):
        read_cell_plan(path, CRS)


def test_a_large_document_is_not_passed_over(tmp_path):
    """The next KML of the archive, such as a legend, was taken for the document."""
    path = tmp_path / "cells.kmz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("doc.kml", bytes((1 << 26) + 1))
        archive.writestr("legend.kml", f"{HEAD.format('utf-8')}{mark(data(), POINT)}{END}")
    with pytest.raises(InputError, match=r"KML of at most 67108864 bytes.*67108865 in 'doc.kml'"):
        read_cell_plan(path, CRS)
