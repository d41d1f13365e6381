"""Sentences of NMEA 0183 by hand: degrees, knots, dilutions, modes, dates and checksums."""

import numpy as np
import pytest
from made_satellites import sentence

from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.nmea import _of_day, _year

START_S = 1_777_629_600
"""2026-05-01 10:00:00 UTC."""


@pytest.fixture
def read(tmp_path):
    def of(lines):
        (tmp_path / "made.nmea").write_text("\n".join(lines) + "\n")
        return read_recording(tmp_path / "made.nmea")

    return of


def rmc(place="6010.20000,N,02456.40000,E", rest="A", mode="A", clock="100000.00", speed="36.0"):
    return sentence(f"GPRMC,{clock},{rest},{place},{speed},30.5,010526,,,{mode}")


@pytest.mark.parametrize(
    ("place", "lat_deg", "lon_deg"),
    [
        ("6010.20000,N,02456.40000,E", 60.17, 24.94),
        ("3359.99990,S,07059.40000,W", -33.999998333, -70.99),
        ("0000.60000,S,00000.60000,W", -0.01, -0.01),
        ("8959.99000,N,17959.99000,E", 89.999833333, 179.999833333),
    ],
)
def test_degrees_and_minutes_of_nmea(read, place, lat_deg, lon_deg):
    (row,) = read([rmc(place)]).tables["positions"].to_dict("records")
    assert (row["lat_deg"], row["lon_deg"]) == pytest.approx((lat_deg, lon_deg), abs=1e-9)
    # A knot is 1852 m an hour.
    assert row["speed_mps"] == pytest.approx(36 * 1852 / 3600)
    assert (row["course_deg"], row["time_s"]) == (30.5, START_S)


def test_sixty_minutes_are_no_degree(read):
    found = read([rmc(), rmc("6060.00000,N,02456.40000,E", clock="100001.00")])
    assert len(found.tables["positions"]) == 1


@pytest.mark.parametrize("mode", list("ADFPRCT"))
def test_measured_modes_of_rmc(read, mode):
    assert len(read([rmc(mode=mode)]).tables["positions"]) == 1


@pytest.mark.parametrize(
    ("rest", "mode"), [("V", "A"), ("A", "E"), ("A", "M"), ("A", "S"), ("A", "N")]
)
def test_modes_of_rmc_without_a_measured_position(read, rest, mode):
    found = read([rmc(), rmc(rest=rest, mode=mode, clock="100001.00")])
    assert found.tables["positions"]["time_s"].tolist() == [START_S]


@pytest.mark.parametrize("quality", list("0123456789"))
def test_qualities_of_gga(read, quality):
    """0 is no fix, 6 to 8 are dead reckoning, entered and simulated positions."""
    is_measured = quality not in "0678"
    place = "6010.20000,N,02456.40000,E"
    gga = sentence(f"GPGGA,100001.00,{place},{quality},12,0.8,12.5,M,17.0,M,,")
    rows = read([rmc(), gga]).tables["positions"]
    assert (rows["time_s"] - START_S).tolist() == ([0, 1] if is_measured else [0])
    if is_measured:
        # Of the errors of a dilution of 1 68 % lie within 4 m.
        assert rows["accuracy_m"].iloc[1] == pytest.approx(0.8 * 4.0)
        assert rows["altitude_m"].iloc[1] == 12.5


def test_deviations_of_gst_go_before_the_dilution(read):
    place = "6010.20000,N,02456.40000,E"
    gga = sentence(f"GPGGA,100000.00,{place},1,12,0.8,12.5,M,17.0,M,,")
    gst = sentence("GPGST,100000.00,9.9,8.0,1.0,45.0,6.0,8.0,20.0")
    (accuracy,) = read([rmc(), gga, gst]).tables["positions"]["accuracy_m"]
    # The radius of 68 % is 1.515 deviations of an axis: the root of (36 + 64) / 2.
    assert accuracy == pytest.approx(1.515 * 50**0.5)


@pytest.mark.parametrize(("word", "year"), [("010179", 2079), ("010180", 1980), ("010199", 1999)])
def test_years_of_two_digits(word, year):
    assert _year(word) == year
    assert np.isnan(_year(word[:-1]))


def test_times_of_day_of_sentences():
    texts = ["000000", "235959.75", "235960", "235961", "236000", "240000", "", "-1", "95.5"]
    expected = [0, 86_399.75, 86_400, *[np.nan] * 5, np.nan]
    assert _of_day(np.array(texts, dtype=object)).tolist() == pytest.approx(
        expected, abs=1e-6, nan_ok=True
    )


@pytest.mark.parametrize(
    ("star", "is_read"), [("*hh", True), ("*HH", True), ("", True), ("*00", False), ("*xx", False)]
)
def test_checksums_are_the_exclusive_or_of_all_between_dollar_and_star(read, star, is_read):
    body = "GPRMC,100001.00,A,6010.20000,N,02456.40000,E,4.2,30.0,010526,,,A"
    total = np.bitwise_xor.reduce(np.frombuffer(body.encode(), dtype=np.uint8))
    mark = star.replace("hh", f"{total:02x}").replace("HH", f"{total:02X}")
    rows = read([rmc(), f"${body}{mark}"]).tables["positions"]
    assert len(rows) == 1 + is_read


def test_hemispheres_of_gga(read):
    rows = [
        sentence(f"GPGGA,10000{i}.00,3330.60000,{ns},07059.40000,{ew},1,12,1.0,12.5,M,17.0,M,,")
        for i, (ns, ew) in enumerate(["NE", "SE", "NW", "SW"])
    ]
    places = read([rmc(clock="100009.00"), *rows]).tables["positions"]
    signs = np.sign(places[["lat_deg", "lon_deg"]].to_numpy()[:4]).tolist()
    assert signs == [[1, 1], [-1, 1], [1, -1], [-1, -1]]
    assert np.abs(places["lat_deg"].to_numpy()[:4]) == pytest.approx(33.51)
    assert np.abs(places["lon_deg"].to_numpy()[:4]) == pytest.approx(70.99)


def test_sentences_with_cells_are_noted(read):
    """They were left out without a word; those of makers are of the receiver."""
    lines = [rmc(), "$PCELL,LTE,244,91,3021,12345678,-80", "$PUBX,00,x"]
    (note,) = read(lines).notes
    assert note.startswith("1 sentence, perhaps of cells, not used: $PCELL (write them as CSV")
