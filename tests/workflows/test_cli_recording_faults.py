"""What a person gets wrong in the table of a phone, and what replay and locate say of it."""

import json

import numpy as np
import pandas as pd
import pytest
from command_line import IDENTITIES, ONE, assert_done, assert_refused, mapfilter, settings

from mapfilter.angles import azimuth_from_heading_deg
from mapfilter.geodesy import unproject
from mapfilter.tracks.store import read_log

START_UTC_S = 1_777_629_600


@pytest.fixture
def phone(world):
    """A journey of the small world as the table of a phone that counts steps of 0.7 m."""
    log = read_log(world.journeys / ONE)
    motion, truth = log.motion, log.truth
    radio = log.radio[log.radio["role"] == "serving"]
    time_s = motion["time_s"].to_numpy()
    at = np.clip(np.searchsorted(radio["time_s"], time_s, side="right") - 1, 0, None)
    place = [np.interp(time_s, truth["time_s"], truth[name]) for name in ("east_m", "north_m")]
    lon, lat = unproject(log.crs, *place)
    lac, ci = zip(*(IDENTITIES[cell] for cell in radio["cell"].iloc[at]), strict=True)
    return pd.DataFrame({
        "time": START_UTC_S + time_s,
        "steps": (motion["step_m"].fillna(0.0).cumsum() / 0.7).round().astype(int),
        "compass_deg": azimuth_from_heading_deg(motion["heading_rad"]) % 360,
        "mcc": 244, "mnc": 91, "lac": lac, "ci": ci,
        "level_dbm": radio["level_dbm"].to_numpy()[at],
        "latitude": lat, "longitude": lon,
    })  # fmt: skip


@pytest.fixture
def replay(database, tmp_path):
    def of(table, *more, encoding="utf-8"):
        path, out = tmp_path / "phone.csv", tmp_path / "out"
        path.write_bytes(table.to_csv(index=False).encode(encoding))
        given = ["--db", database, "--log", path, "--out", out]
        return mapfilter("replay", *given, *settings(output__pictures="none"), *more, "--json")

    return of


def test_rows_and_values_that_are_not_used_are_told(phone, replay, tmp_path):
    assert not [note for note in assert_done(replay(phone)).json["notes"] if "not used" in note]
    phone.loc[3, "level_dbm"] = 70
    phone.loc[5, "latitude"] = 95.0
    done = replay(phone)
    assert done.code == 0, done.err
    told = (
        "phone.csv: not used: 1 row: lat_deg: not degrees in -90..90 (likely: latitude and "
        "longitude swapped) (line 7; first 95)",
        "phone.csv: radio, level_dbm: 1 value is not dBm in -200..0, ignored (first in line 5)",
    )
    assert done.err.splitlines() == [f"mapfilter: note: {note}" for note in done.json["notes"]]
    figures = json.loads((tmp_path / "out" / "figures.json").read_text())
    assert set(told) <= set(done.json["notes"])
    assert figures["notes"] == done.json["notes"]


def test_levels_without_their_sign_are_refused(phone, replay, tmp_path):
    told = "phone.csv, level_dbm: expected dBm in -200..0, found", "a lost sign (70 for -70 dBm)"
    assert_refused(replay(phone.assign(level_dbm=-phone["level_dbm"])), *told)
    assert not (tmp_path / "out").exists()


def test_columns_are_named_in_windows_1252(phone, replay, database, tmp_path):
    names = {"time": "Zeit", "steps": "Schritte", "compass_deg": "Richtung"}
    german = phone.rename(columns=names | {"latitude": "Breite", "longitude": "Länge"})
    assert_refused(replay(german, encoding="cp1252"), "--column FIELD=COLUMN", "track.columns")
    own = ["time=Zeit", "steps=Schritte", "compass_deg=Richtung", "lat_deg=Breite", "lon_deg=Länge"]
    given = [word for pair in own for word in ("--column", pair)]
    done = replay(german, *given, encoding="cp1252")
    assert done.code == 0, done.err
    assert any("read as Windows-1252" in note for note in done.json["notes"])
    assert done.json["epochs"] == replay(phone).json["epochs"]
    for pair, told in (
        ("tme=Zeit", "--column tme: expected a field such as time"),
        ("Zeit", "NAME=VALUE"),
    ):
        assert_refused(replay(german, "--column", pair), told)
    path = tmp_path / "phone.csv"
    path.write_bytes(german.to_csv(index=False).encode("cp1252"))
    out = tmp_path / "reports"
    done = mapfilter("locate", "--db", database, "--log", path, *given, "--out", out, "--json")
    assert done.code == 0, done.err
    assert done.json["reports"] == len(phone)


@pytest.mark.parametrize(
    ("lon", "lat", "cause"),
    [
        ("latitude", "longitude", "latitude and longitude swapped"),
        ("-longitude", "latitude", "a lost sign of longitude"),
        ("longitude", "-latitude", "a lost sign of latitude"),
        ("-latitude", "longitude", "latitude and longitude swapped, with a lost sign"),
        ("longitude + 2", "latitude", "log of another area or zone"),
    ],
)
def test_the_mistake_that_fits_the_area_is_named(lon, lat, cause, phone, replay):
    wrong = phone.assign(longitude=phone.eval(lon), latitude=phone.eval(lat))
    # Those of most mistakes are beyond the region of the zone.
    told = " covers, found " if "longitude" in cause else "positions near the database's"
    assert_refused(replay(wrong), told, f"(likely: {cause})")


@pytest.mark.parametrize(
    ("scale", "cause"),
    [(1.0, "degrees given for metres"), (1e6, "degrees times 1e6 given for metres")],
)
def test_degrees_in_columns_of_metres_are_named(scale, cause, phone, replay):
    places = {"east_m": scale * phone.pop("longitude"), "north_m": scale * phone.pop("latitude")}
    assert_refused(replay(phone.assign(**places)), "phone.csv, gnss", f"(likely: {cause})")


def test_columns_of_motion_that_were_looked_for(phone, replay):
    done = replay(phone.rename(columns={"steps": "stps", "compass_deg": "compas"}))
    assert done.code == 0
    assert "note: no motion: positions alone are followed (--course-motion" in done.err
    assert "; looked for columns step_m, steps (with compass_deg, turn_rad," in done.err
    assert "phone.csv has none of them, columns not used: stps (steps?), compas (compass" in (
        done.err
    )
    done = replay(phone.drop(columns="steps"))
    assert "; phone.csv has compass_deg\n" in done.err


def test_positions_that_are_taken_for_fixes_are_told(phone, replay, tmp_path):
    told = f"gnss: {len(phone)} of {len(phone)} positions of phone.csv used as GNSS fixes"

    def said(*more):
        done = replay(phone, *more)
        assert done.code == 0, done.err
        return [note for note in done.json["notes"] if "used as GNSS fixes" in note]

    assert said() == [f"{told}; --without gnss leaves them out, --truth phone.csv scores by them"]
    assert said("--without", "gnss") == []
    assert said("--truth", tmp_path / "phone.csv") == []


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"lac": "ci", "ci": "lac"}, "of them would be with lac (tac) and ci exchanged"),
        ({"mnc": "mnc - 86"}, "they are of network 244-05, the database holds 244-91"),
    ],
)
def test_cells_of_another_network_and_exchanged_columns(change, told, phone, replay):
    done = replay(phone.assign(**{name: phone.eval(of) for name, of in change.items()}))
    assert done.code == 3
    assert "unknown to the database" in done.err
    assert "mapfilter: unknown cells: " in done.err
    assert told in done.err


def test_what_is_left_out_is_an_option(phone, replay):
    assert_refused(replay(phone, "--without", "gsm"), "error: --without, setting track.without.0:")
    refused = replay(phone, "--set", 'track.without=["gsm"]')
    assert_refused(refused, "error: setting track.without.0:")
