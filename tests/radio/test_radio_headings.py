"""Headings of cell lists as planning tools show them: units in brackets, words for field names."""

import time
from pathlib import Path

import pytest

from mapfilter.errors import InputError
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plan_files import read_cell_plan

CRS = "EPSG:32635"
DEFAULTS = {"height_m": 25.0, "eirp_dbm": 52.0, "frequency_mhz": 1800.0}
SHOWN = (
    "Site;Transmitter;X;Y;Antenna;Height (m);Azimuth (°);Mechanical Downtilt (°);"
    "Additional Electrical Downtilt (°);EIRP (dBm);Frequency Band\n"
    "Kamppi;K1;385584,61;6671974,34;65deg;32;120;4;2;55,5;GSM 1800\n"
)
OF_BAND = "frequency_mhz of 1 cell is the number in the name of the band ('Frequency Band')"


def read(folder: Path, text: str, **options: object) -> CellPlan:
    path = folder / "list.csv"
    path.write_text(text, encoding="utf-8")
    given = {"defaults": DEFAULTS, "layout": "atoll", **options}
    return read_cell_plan(path, CRS, **given)  # type: ignore[arg-type]


def complaint(folder: Path, text: str, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        read(folder, text, **options)
    return str(caught.value)


def unused(plan: CellPlan) -> list[str]:
    return [note for note in plan.notes if note.startswith("columns not used")]


def test_displayed_headings_are_the_fields(tmp_path):
    plan = read(tmp_path, SHOWN)
    cell = plan["K1"]
    assert (cell.site, cell.antenna, cell.height_m, cell.azimuth_deg) == (
        *("Kamppi", "65deg"),
        *(32.0, 120.0),
    )
    assert (cell.mechanical_downtilt_deg, cell.downtilt_deg, cell.eirp_dbm) == (4.0, 2.0, 55.5)
    assert plan.notes == (OF_BAND,)


@pytest.mark.parametrize(
    "shown",
    [
        *("HEIGHT", "height [m]", "Height(m)", "Height (m AGL)"),
        *("Height (in m)", "Height [m.]", "Height (mAGL)", "Height (m.a.g.l.)", "Height (m, AGL)"),
        *("Height (in metres above ground)", "Height (Meter)", "HEIGHT (m-AGL)"),
    ],
)
def test_spellings_of_a_unit(shown, tmp_path):
    plan = read(tmp_path, SHOWN.replace("Height (m)", shown))
    assert plan["K1"].height_m == 32.0
    assert plan.notes == (OF_BAND,)


@pytest.mark.parametrize(
    "shown",
    ["Azimuth [in deg]", "Azimut (Grad)", "Azimuth (deg.)", "Azimuth (°N)", "Azimuth (° T)"],
)
def test_spellings_of_degrees(shown, tmp_path):
    plan = read(tmp_path, SHOWN.replace("Azimuth (°)", shown))
    assert plan["K1"].azimuth_deg == 120.0
    assert plan.notes == (OF_BAND,)


def test_spellings_of_megahertz(tmp_path):
    text = SHOWN.replace("Frequency Band", "Frequency (in MHz)").replace("GSM 1800", "942,5")
    plan = read(tmp_path, text)
    assert (plan["K1"].frequency_mhz, plan.notes) == (942.5, ())


@pytest.mark.parametrize(
    ("east", "north"), [("E", "N"), ("decimal degrees", "Decimal Degrees"), ("°E", "in °")]
)
def test_spellings_of_positions(east, north, tmp_path):
    text = SHOWN.replace(";X;Y;", f";Longitude ({east});Latitude ({north});")
    cell = read(tmp_path, text.replace("385584,61;6671974,34", "24,94;60,17"))["K1"]
    assert (cell.east_m, cell.north_m) == pytest.approx((385_700, 6_672_100), abs=300)


def test_a_unit_that_does_not_measure_the_field_is_read_and_noted(tmp_path):
    """The W of a longitude is no watt, and an EIRP in "dB" is one in dBm that was cut short."""
    text = SHOWN.replace(";X;Y;", ";Longitude (W);Latitude;").replace("EIRP (dBm)", "EIRP (dB)")
    plan = read(tmp_path, text.replace("385584,61;6671974,34", "24,94;60,17"))
    assert plan["K1"].eirp_dbm == 55.5
    assert plan.notes[-1] == (
        "units that do not belong to fields: 'Longitude (W)' is read as lon in degrees, "
        "'EIRP (dB)' is read as eirp_dbm in dBm"
    )


@pytest.mark.parametrize("shown", ["Höhe (in m)", "Höhe (m ü. G.)", "Höhe (dB)", "Höhe (üNN)"])
def test_a_named_column_is_read_whatever_its_unit_may_mean(shown, tmp_path):
    plan = read(tmp_path, SHOWN.replace("Height (m)", shown), columns={"height_m": shown})
    assert plan["K1"].height_m == 32.0
    assert any(shown in note for note in plan.notes) == (shown == "Höhe (dB)")


def test_a_field_of_the_right_unit_goes_before_another_name_of_another_one(tmp_path):
    text = SHOWN.replace("Additional Electrical Downtilt (°)", "Electrical Tilt (rad);REDT")
    assert read(tmp_path, text.replace(";2;", ";0,03;2;"))["K1"].downtilt_deg == 2.0


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        ("Height (m)", "Height (ft)", "expected height_m in metres, found 'Height (ft)'"),
        ("EIRP (dBm)", "EIRP (W)", "expected eirp_dbm in dBm, found 'EIRP (W)'"),
        ("Azimuth (°)", "Azimuth (rad)", "expected azimuth_deg in degrees, found 'Azimuth (rad)'"),
        ("X;", "X (km);", "expected east in metres, found 'X (km)'"),
        ("Height (m)", "Height (in)", "expected height_m in metres, found 'Height (in)'"),
        ("Height (m)", "Height (in feet)", "expected height_m in metres, found 'Height (in feet)'"),
        ("Azimuth (°)", "Azimuth (gon)", "expected azimuth_deg in degrees, found 'Azimuth (gon)'"),
    ],
)
def test_another_unit_is_refused(right, wrong, told, tmp_path):
    assert told in complaint(tmp_path, SHOWN.replace(right, wrong))
    assert "another unit; convert the column to" in complaint(tmp_path, SHOWN.replace(right, wrong))


def test_a_column_of_the_right_unit_goes_before_one_of_another(tmp_path):
    text = SHOWN.replace("Site;", "Height (ft);").replace("Kamppi;", "105;")
    assert read(tmp_path, text)["K1"].height_m == 32.0


def test_a_named_column_has_its_unit_checked_and_needs_none_in_its_name(tmp_path):
    text = SHOWN.replace("EIRP (dBm)", "Power total (dBm)")
    assert read(tmp_path, text, columns={"eirp_dbm": "Power total"})["K1"].eirp_dbm == 55.5
    told = complaint(
        tmp_path, text.replace("(dBm)", "(W)"), columns={"eirp_dbm": "Power total (W)"}
    )
    assert "expected eirp_dbm in dBm, found 'Power total (W)'" in told


def test_what_stands_in_brackets_and_is_no_unit_leaves_a_named_column_as_it_is(tmp_path):
    text = SHOWN.replace("Height (m)", "Height (AGL)")
    assert read(tmp_path, text, columns={"height_m": "Height (AGL)"})["K1"].height_m == 32.0


def test_ignored_columns_that_resemble_a_field_are_noted(tmp_path):
    text = SHOWN.replace("Height (m)", "Height (AGL)").replace("EIRP", "Max EIRP")
    text = text.replace("Azimuth (°)", "Antenna Azimuth (°)")
    assert unused(read(tmp_path, text)) == [
        "columns not used that resemble fields: 'Height (AGL)' (height_m), 'Antenna Azimuth (°)' "
        "(azimuth_deg), 'Max EIRP (dBm)' (eirp_dbm)"
    ]


def test_they_are_noted_with_a_map_of_columns_too(tmp_path):
    text = "Name,E,N,Antenna Height (m),EIRP\nA,385500,6672000,30,50\n"
    columns = {"cell": "Name", "east": "E", "north": "N"}
    assert unused(read(tmp_path, text, layout="plan", columns=columns)) == [
        "columns not used that resemble fields: 'Antenna Height (m)' (height_m), 'EIRP' (eirp_dbm)"
    ]


def test_a_band_that_is_named_for_the_frequency_states_it(tmp_path):
    text = SHOWN.replace("Frequency Band", "Frequenzband")
    plan = read(tmp_path, text, columns={"frequency_mhz": "Frequenzband"})
    assert plan["K1"].frequency_mhz == 1800.0
    assert OF_BAND.replace("Frequency Band", "Frequenzband") in plan.notes
    named = {"columns": {"frequency_mhz": "Frequenzband"}}
    assert "expected MHz" in complaint(tmp_path, text.replace("GSM 1800", "E-UTRA 3"), **named)


def test_a_frequency_that_a_band_repeats_is_that_of_its_own_column(tmp_path):
    text = SHOWN.replace("Frequency Band", "Frequency (MHz);Band").replace("GSM 1800", "1800;1800")
    plan = read(tmp_path, text)
    assert (plan["K1"].frequency_mhz, plan.notes) == (1800.0, ())


def test_a_name_of_a_site_becomes_no_file(tmp_path):
    named = SHOWN.replace("Kamppi", "Kamppi / Nord..1")
    assert read(tmp_path, named)["K1"].site == "Kamppi / Nord..1"
    assert "row 2, Site (site): expected" in complaint(tmp_path, named.replace(" / ", "\x07"))
    assert "no file can have this name" in complaint(tmp_path, SHOWN.replace("K1", "K/1"))


@pytest.mark.parametrize("more", ["Comments", "Losses (dB)", "Active", "Cell type", "Y2"])
def test_other_columns_are_ignored_without_a_word(more, tmp_path):
    text = SHOWN.replace("Frequency Band", more)
    assert not unused(read(tmp_path, text))


CARRIER = "Frequency Band;EARFCN;PCI;TAC;eNodeB ID;Cell ID;MCC;MNC"


@pytest.mark.parametrize(
    ("names", "texts", "identity", "carrier"),
    [
        (CARRIER, "LTE 800;6200;17;91;4001;7;244;91", (244, 91, 91, 1024263), (6200, 17)),
        ("UARFCN;Scrambling Code;CGI", "10700;100;244-91-7-30", (244, 91, 7, 30), (10700, 100)),
        ("nr_arfcn;Physical Cell ID;NCI", "633984;900;5", (None, None, None, 5), (633984, 900)),
        ("BCCH;BSIC;LAC;Cell ID", "612;17;801;30417", (None, None, 801, 30417), (612, 17)),
    ],
)
def test_identities_have_the_names_of_their_technologies(names, texts, identity, carrier, tmp_path):
    text = SHOWN.replace("Frequency Band", names).replace("GSM 1800", texts)
    plan = read(tmp_path, text)
    cell = plan["K1"]
    assert (cell.mcc, cell.mnc, cell.lac, cell.ci) == identity
    assert (cell.arfcn, cell.bsic) == carrier
    assert cell.frequency_mhz == (800.0 if "LTE 800" in texts else 1800.0)
    assert not unused(plan)
    of_default = f"frequency_mhz is not taken from {names.split(';')[0]!r}; set cells.frequency_mhz"
    assert (of_default in plan.notes) == ("LTE 800" not in texts)


@pytest.mark.parametrize(
    ("name", "text", "field"),
    [
        *(("Channel", "6200", "arfcn"), ("Carriers", "1", "arfcn"), ("gNodeB ID", "4001", "ci")),
        *(("Cell ID", "K1-a", "ci"), ("eNodeB ID", "4001", "ci")),
        ("Frequency Band", "E-UTRA 3", "frequency_mhz"),
    ],
)
def test_columns_that_may_state_a_carrier_are_noted_where_they_do_not(name, text, field, tmp_path):
    plan = read(tmp_path, SHOWN.replace("Frequency Band", name).replace("GSM 1800", text))
    assert unused(plan) == [f"columns not used that resemble fields: {name!r} ({field})"]


def test_inactive_transmitters_are_left_out_and_noted(tmp_path):
    text = SHOWN.replace("Frequency Band", "Active").replace("GSM 1800", "Yes")
    row = text.splitlines()[1]
    plan = read(tmp_path, f"{text}{row.replace('K1', 'K2').replace('Yes', 'No')}\n")
    assert plan.ids == ("K1",)
    assert "1 row left out: inactive, by 'Active'" in plan.notes
    told = complaint(tmp_path, text.replace("Yes", "No"))
    assert "expected at least one active transmitter, found 1 row, all of them inactive" in told


def test_a_list_of_atoll_without_positions_is_told_where_they_are(tmp_path):
    text = "TX_ID,SITE_NAME,HEIGHT,AZIMUT,EIRP\nA,S,30,0,50\n"
    told = complaint(tmp_path, text)
    assert told.count("\n") == 0
    assert "expected a position: X and Y, or LATITUDE and LONGITUDE, found none (columns:" in told
    assert "Atoll keeps positions in the table Sites" in told


@pytest.mark.parametrize(
    ("text", "layout"),
    [
        (SHOWN, "atoll"),
        ("TX_ID,SITE_NAME,HEIGHT,AZIMUT,EIRP\nA,S,30,0,50\n", "atoll"),
        ("radio,mcc,net,area,cell,lon,lat\nGSM,244,91,801,1001,24.9,60.1\n", "opencellid"),
    ],
)
def test_a_list_of_another_layout_is_named_in_one_line(text, layout, tmp_path):
    told = complaint(tmp_path, text, layout="plan")
    assert told.count("\n") == 0
    assert f'set cells.layout = "{layout}"' in told


def test_misspelt_columns_of_a_plan_are_told_one_by_one(tmp_path):
    text = "cell,lat,lon,height,azimuth,eirp\nA,60.1,24.9,30,0,50\n"
    told = complaint(tmp_path, text, layout="plan")
    assert "'height' (likely: height_m meant" in told
    assert "cells.layout" not in told


def test_metres_under_the_names_of_degrees_are_named(tmp_path):
    text = SHOWN.replace(";X;Y;", ";Longitude (m);Latitude (m);")
    columns = {"east": "Longitude (m)", "north": "Latitude (m)"}
    assert read(tmp_path, text, columns=columns)["K1"].east_m == 385584.61
    assert "expected lat in degrees, found 'Latitude (m)'" in complaint(tmp_path, text)


def test_a_displayed_carrier_gives_the_technology_that_it_implies(tmp_path):
    text = SHOWN.replace("Frequency Band", "NR ARFCN").replace("GSM 1800", "633984")
    columns = {"cell": "Transmitter", "east": "X", "north": "Y"}
    cell = read(tmp_path, text, layout="plan", columns=columns)["K1"]
    assert (cell.technology, cell.arfcn) == ("NR", 633984)


def test_long_headings_and_many_of_them_take_no_time(tmp_path):
    more = ";".join([*("(" * 10_000, " " * 10_000 + ")"), *(f"height{n:03}" for n in range(900))])
    text = SHOWN.replace("Height (m)", "AGL").replace("\n", f";{more}\n", 1)
    text = text.rstrip("\n") + ";" * 902 + "\n"
    began_s = time.process_time()
    assert len(read(tmp_path, text).cells) == 1
    assert time.process_time() - began_s < 5
