"""What info says of the lists of cells that planning tools and databases hand out."""

import gzip
import zipfile

import pytest

from mapfilter.errors import InputError
from mapfilter.workflows.info import run_info

ATOLL = "TX_ID;SITE_NAME;X;Y;HEIGHT;AZIMUT;TILT;EIRP\nA1;S;385000;6672000;30;120;2;60\n"
OTHER = "Cell Name,Latitude,Longitude,Azimuth,Height,Mechanical Tilt\nA1,60.1,24.9,120,30,2\n"
OWN = "cell,lat,lon,height_m,azimuth_deg,eirp_dbm,frequency_mhz\nA1,60.1,24.9,30,120,60,900\n"
DRIVE = "Latitude,Longitude,Altitude,Signal,Cell ID\n60.1,24.9,30,-80,1\n"
CELLS = (
    "radio,mcc,net,area,cell,unit,lon,lat,range,samples,changeable,created,updated,averageSignal\n"
    "LTE,244,91,7,1280001,,24.9,60.1,1000,5,1,1459743588,1459743588,0\n"
)


def info_of(folder, content, name="list.csv"):
    (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return run_info(folder / name)


@pytest.mark.parametrize("content", [ATOLL, OTHER])
def test_lists_of_tools_with_the_layout_that_reads_them(tmp_path, content):
    """The layout was not named, or the list was a table of which nothing is known."""
    found = info_of(tmp_path, content)
    assert found["kind"] == "cell plan"
    assert found["use"] == 'cells.plan, with cells.layout = "atoll"'


def test_other_tables_stay_what_they_are(tmp_path):
    assert info_of(tmp_path, OWN)["use"] == "cells.plan"
    assert info_of(tmp_path, DRIVE)["kind"] == "table"
    packed = info_of(tmp_path, gzip.compress(CELLS.encode()), "244.csv.gz")
    assert packed["use"] == 'cells.plan, with cells.layout = "opencellid"'


def test_kml_of_places_is_no_raster(tmp_path):
    """It was taken for a raster that leads to other places."""
    place = (
        "<Placemark><name>A</name><Point><coordinates>24.9,60.1</coordinates></Point></Placemark>"
    )
    with pytest.raises(InputError, match="found KML without times"):
        info_of(tmp_path, f"<?xml version='1.0'?><kml>{place}</kml>", "a.kml")


def test_a_plan_in_kml_is_known(tmp_path):
    data = "".join(f'<Data name="{name}"><value>1</value></Data>' for name in
                   ("height_m", "azimuth_deg", "eirp_dbm", "frequency_mhz"))  # fmt: skip
    mark = f"<name>A</name><ExtendedData>{data}</ExtendedData>"
    mark += "<Point><coordinates>24.9,60.2</coordinates></Point>"
    kml = f"<kml><Placemark>{mark}</Placemark></kml>"
    (tmp_path / "cells.kml").write_text(kml)
    with zipfile.ZipFile(tmp_path / "cells.kmz", "w") as archive:
        archive.writestr("doc.kml", kml)
    # Styles come first, and there may be more of them than what is looked at.
    (tmp_path / "styled.kml").write_text(kml.replace("<kml>", f"<kml>{'<Style/>' * 20_000}"))
    for name in ("cells.kml", "cells.kmz", "styled.kml"):
        found = run_info(tmp_path / name)
        assert (found["kind"], found["use"], found["rows"]) == ("cell plan", "cells.plan", 1)


def test_pins_in_kmz_are_told_as_those_in_kml(tmp_path):
    place = "<Placemark><Point><coordinates>24.9,60.1</coordinates></Point></Placemark>"
    with zipfile.ZipFile(tmp_path / "pins.kmz", "w") as archive:
        archive.writestr("doc.kml", f"<kml>{place}</kml>")
    with pytest.raises(InputError, match="found KML without times"):
        run_info(tmp_path / "pins.kmz")
