"""Columns of the serving cell as drive test tools name them."""

import pytest

from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.plain.served_names import served_name, with_served_names

QUALIPOC = (
    "Time;Latitude;Longitude;LTE PCell EARFCN;LTE PCell PCI;LTE PCell RSRP;LTE SCell1 RSRP;"
    "LTE eNodeB ID;LTE Cell ID;LTE TAC;MCC;MNC"
)


def read(tmp_path, *lines):
    path = tmp_path / "drive.csv"
    path.write_text("\n".join(lines) + "\n")
    return read_recording(path)


def test_columns_of_the_primary_cell_are_read(tmp_path):
    """Positions alone were, and the note on columns that are not used suggested nothing."""
    rows = [
        f"13.05.2026 11:00:0{at};60,17000{at};24,94;1300;100;-80,{at};-99,0;48225;78;3021;244;91"
        for at in range(3)
    ]
    found = read(tmp_path, QUALIPOC, *rows)
    radio = found.tables["radio"]
    assert radio["cell"].unique().tolist() == ["244-91-3021-12345678"]
    assert radio["level_dbm"].tolist() == [-80.0, -80.1, -80.2]
    assert (radio["arfcn"].iloc[0], radio["bsic"].iloc[0]) == (1300, 100)
    assert set(radio["technology"]) == {"LTE"}
    told = "taken for those of the serving cell: lte pcell earfcn, lte pcell pci, lte pcell rsrp"
    assert any(told in note for note in found.notes)
    assert found.unread == ("lte scell1 rsrp",)


def test_of_several_carriers_none_is_taken(tmp_path):
    found = read(
        tmp_path,
        "time,lat,lon,LTE RSRP,NR RSRP",
        "2026-05-13T08:00:00Z,60.17,24.94,-80,-90",
    )
    assert "radio" not in found.tables
    assert found.unread == ("lte rsrp (level_dbm?)", "nr rsrp (level_dbm?)")


@pytest.mark.parametrize(
    ("column", "usual"),
    [
        ("rsrp (serving)", "level [dbm]"),
        ("serving cell rsrp [dbm]", "level [dbm]"),
        ("serving rsrp (dbm)", "level [dbm]"),
        ("nr ss-rsrp", "level [dbm]"),
        ("lte_pci", "pci"),
        ("wcdma rscp", "level [dbm]"),
        ("wcdma primary scrambling code", "psc"),
        ("5g nr-arfcn", "nr_arfcn"),
        ("serving cell identity", ""),
        ("lte pcell rsrp [db]", ""),
        ("lte rsrq", ""),
        ("lte neighbor rsrp", ""),
        ("lte scell1 pci", ""),
        ("servingcell", ""),
        ("technology", ""),
    ],
)
def test_names_of_columns(column, usual):
    assert served_name(column) == usual


def test_columns_that_a_user_names_or_that_are_there_stay():
    names = ["time", "lte rsrp", "lte pci"]
    assert with_served_names(names, {"lte rsrp"}) == ("time", "lte rsrp", "pci")
    assert with_served_names([*names, "rsrp"]) == ("time", "lte rsrp", "pci", "rsrp")


@pytest.mark.parametrize(
    ("names", "role"), [("PCell RSRP,PCell PCI", "serving"), ("LTE RSRP,LTE PCI", "neighbour")]
)
def test_cells_without_an_identity_serve_where_their_columns_say_so(tmp_path, names, role):
    found = read(tmp_path, f"time,lat,lon,{names}", "2026-05-13T08:00:00Z,60.17,24.94,-80,100")
    assert found.tables["radio"]["role"].tolist() == [role]
