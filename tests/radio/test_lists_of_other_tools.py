"""Lists of cells as tools and public databases hand them out: packed, in XML, with other names."""

import gzip

import pytest

from mapfilter.errors import InputError
from mapfilter.radio.plan_files import read_cell_plan

CRS = "EPSG:32635"
OPENCELLID = (
    "radio,mcc,net,area,cell,unit,lon,lat,range,samples,changeable,created,updated,averageSignal\n"
    "LTE,244,91,7,1280001,,24.94,60.17,1000,5,1,1459743588,1459743588,0\n"
)
USUAL = {"height_m": 30.0, "eirp_dbm": 30.0, "frequency_mhz": 1800.0}
TEMS = "Cell\tARFCN\tBSIC\tLat\tLon\tMCC\tMNC\tLAC\tCI\tANT_DIRECTION\tANT_BEAM_WIDTH"
ICS = "Callsign;Coord. X;Coord. Y;Antenna height (m);Azimuth;Radiated power (W);Frequency (MHz)"


def written(folder, content, name="list.csv"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_a_packed_list_as_opencellid_has_it(tmp_path):
    """It was said to be no text file."""
    path = written(tmp_path, gzip.compress(OPENCELLID.encode()), "244.csv.gz")
    plan = read_cell_plan(path, CRS, layout="opencellid", defaults=USUAL)
    assert plan.ids == ("244-91-7-1280001",)
    whole = path.read_bytes()
    for content, hint in ((whole[:-20], "cut off"), (whole[:10] + b"xx" + whole[12:], "damaged")):
        with pytest.raises(InputError, match=hint):
            read_cell_plan(written(tmp_path, content, "a.gz"), CRS, layout="opencellid")


@pytest.mark.parametrize("content", ['<?xml version="1.0"?><list>,</list>', '{"a": 1, "b": 2}'])
def test_xml_and_json_are_named(tmp_path, content):
    """Each part between two commas was refused as an unknown column."""
    with pytest.raises(InputError, match=r"found (XML|JSON).*export the list as CSV"):
        read_cell_plan(written(tmp_path, content), CRS)


@pytest.mark.parametrize(
    ("header", "settings"),
    [
        (TEMS, ('cell = "Cell", arfcn = "ARFCN"', 'or set cells.layout = "atoll"')),
        (ICS, ('height_m = "Antenna height (m)", azimuth_deg = "Azimuth"', "others are ignored")),
    ],
)
def test_the_columns_of_another_tool_are_one_fault(tmp_path, header, settings):
    """Each column was a fault of its own, thirteen of them, most of which hid the others."""
    with pytest.raises(InputError) as caught:
        read_cell_plan(written(tmp_path, f"{header}\n"), CRS)
    (fault,) = caught.value.faults
    assert all(one in fault.hint for one in settings)
    assert 'antenna = "Antenna' not in fault.hint
