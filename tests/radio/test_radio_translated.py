"""Headings of transmitters in French and German: read, noted, and never guessed."""

from pathlib import Path

import pytest

from mapfilter.errors import InputError
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plan_files import read_cell_plan

DEFAULTS = {"height_m": 25.0, "eirp_dbm": 52.0, "frequency_mhz": 1800.0}
FRENCH = (
    "Émetteur;Site;X;Y;Antenne;Hauteur (m);Azimut (°);Downtilt mécanique (°);"
    "Downtilt électrique (°);PIRE (dBm);Fréquence (MHz);Actif\n"
    "K1;Kamppi;385584,61;6671974,34;65deg;32;120;4;2;55,5;1825,2;Oui\n"
    "K2;Kamppi;385584,61;6671974,34;65deg;32;240;4;2;55,5;1825,2;Non\n"
)
GERMAN = (
    "Transmitter;Standort;Breitengrad;Längengrad;Antenne;Montagehöhe über Grund (m);"
    "Hauptstrahlrichtung (°);EIRP (dBm);Frequenz (MHz);Aktiv\n"
    "K1;Kamppi;60,1688;24,9392;65deg;32;120;55,5;1825,2;Ja\n"
)


def read(folder: Path, text: str, codec: str = "utf-8", **options: object) -> CellPlan:
    path = folder / "list.csv"
    path.write_bytes(text.encode(codec))
    given = {"defaults": DEFAULTS, "layout": "atoll", **options}
    return read_cell_plan(path, "EPSG:32635", **given)  # type: ignore[arg-type]


def test_a_french_list_is_read_and_says_by_which_names(tmp_path):
    plan = read(tmp_path, FRENCH)
    cell = plan["K1"]
    assert (cell.site, cell.antenna, cell.height_m, cell.azimuth_deg) == (
        *("Kamppi", "65deg"),
        *(32.0, 120.0),
    )
    assert (cell.mechanical_downtilt_deg, cell.downtilt_deg) == (4.0, 2.0)
    assert (cell.eirp_dbm, cell.frequency_mhz) == (55.5, 1825.2)
    assert (plan.ids, plan.inactive) == (("K1",), ("K2",))
    assert plan.notes == (
        "1 row left out: inactive, by 'Actif'",
        "columns read by their French or German names: 'Émetteur' (cell), 'Hauteur (m)' (height_m)"
        ", 'Downtilt électrique (°)' (downtilt_deg), 'Downtilt mécanique (°)' "
        "(mechanical_downtilt_deg), 'Antenne' (antenna), 'PIRE (dBm)' (eirp_dbm), "
        "'Fréquence (MHz)' (frequency_mhz), 'Actif' (active)",
    )


def test_a_german_list_is_read(tmp_path):
    plan = read(tmp_path, GERMAN, "cp1252")
    cell = plan["K1"]
    assert (cell.site, cell.height_m, cell.azimuth_deg) == ("Kamppi", 32.0, 120.0)
    assert (cell.eirp_dbm, cell.frequency_mhz) == (55.5, 1825.2)
    assert plan.inactive == ()


def test_accents_may_be_left_out(tmp_path):
    bare = FRENCH.translate(str.maketrans("Ééè", "Eee"))
    assert read(tmp_path, bare).cells == read(tmp_path, FRENCH).cells


@pytest.mark.parametrize(
    ("heading", "height_m"),
    [
        *(
            ("Höhe (m)", 32.0),
            ("Hoehe", 32.0),
            ("Höhe (m ü. G.)", 32.0),
            ("Antennenhöhe (m)", 32.0),
            ("Hauteur (m au-dessus du niveau du sol)", 32.0),
        ),
        *(("Höhe (m ü. NN)", 25.0), ("Höhe (m NHN)", 25.0), ("Hauteur (m NGF)", 25.0)),
        *(("Höhe (m ü. M.)", 25.0), ("Höhe (m ü. Meer)", 25.0), ("Höhe (m über Meer)", 25.0)),
        *(("Hauteur (m au-dessus de la mer)", 25.0), ("Hauteur (m s.m.)", 25.0)),
        ("Hauteur (m au-dessus du niveau de la mer)", 25.0),
    ],
)
def test_heights_above_the_sea_are_no_heights_of_antennas(heading, height_m, tmp_path):
    plan = read(tmp_path, FRENCH.replace("Hauteur (m)", heading))
    assert plan["K1"].height_m == height_m
    told = any(f"resemble fields: {heading!r} (height_m)" in note for note in plan.notes)
    assert told == (height_m == 25.0)


def test_two_names_of_one_field_are_both_left_out(tmp_path):
    text = FRENCH.replace("Fréquence (MHz)", "Höhe (m)")
    plan = read(tmp_path, text)
    assert plan["K1"].height_m == 25.0
    told = "columns not used that resemble fields: 'Hauteur (m)' (height_m), 'Höhe (m)' (height_m)"
    assert told in plan.notes


@pytest.mark.parametrize("sea_first", [False, True])
def test_a_height_above_the_sea_beside_that_of_the_antenna_is_not_read(sea_first, tmp_path):
    """Where it came first, neither was read."""
    names = ["Hauteur (m)", "Hauteur (m NGF)"]
    text = FRENCH.replace("Hauteur (m);Azimut (°)", ";".join(names[::-1] if sea_first else names))
    plan = read(tmp_path, text)
    assert plan["K1"].height_m == (120.0 if sea_first else 32.0)


def test_an_english_name_goes_before_a_translated_one(tmp_path):
    plan = read(tmp_path, FRENCH.replace("PIRE (dBm)", "Height (m)"))
    assert plan["K1"].height_m == 55.5


@pytest.mark.parametrize(
    ("was", "name", "field"),
    [
        ("PIRE (dBm)", "Puissance (dBm)", "eirp_dbm"),
        ("PIRE (dBm)", "Sendeleistung (dBm)", "eirp_dbm"),
    ],
)
def test_names_of_several_meanings_are_noted_and_not_read(was, name, field, tmp_path):
    plan = read(tmp_path, FRENCH.replace(was, name))
    assert plan["K1"].eirp_dbm == DEFAULTS["eirp_dbm"]
    assert f"columns not used that resemble fields: {name!r} ({field})" in plan.notes


def test_powers_are_told_where_no_eirp_is_given(tmp_path):
    text = FRENCH.replace("PIRE (dBm)", "Puissance (dBm)")
    with pytest.raises(InputError, match=r"the power in dBm plus the antenna gain in dBi less los"):
        read(tmp_path, text, defaults={"frequency_mhz": 1800.0})


def test_a_list_in_french_is_told_its_layout(tmp_path):
    with pytest.raises(InputError, match=r'transmitters of Atoll: set cells.layout = "atoll"'):
        read(tmp_path, FRENCH, layout="plan")


def test_only_columns_that_a_person_names_are_not_noted(tmp_path):
    """Where one was named, all others were read without a word."""
    columns = {"cell": "Émetteur", "height_m": "Hauteur (m)", "eirp_dbm": "PIRE (dBm)"}
    plan = read(tmp_path, FRENCH, columns=columns)
    (note,) = (note for note in plan.notes if "French or German" in note)
    assert "'Antenne' (antenna)" in note
    assert not any(name in note for name in columns.values())
