"""Pseudoranges and ephemerides of receivers, by hand from the definitions of formats."""

from datetime import UTC, datetime

import numpy as np
import pytest

from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.gnsslogger import satellite_names
from mapfilter.tracks.readers.rinex import fixed_number, gps_seconds

LIGHT_MPS = 299_792_458.0
START_S = 1_777_629_600
"""2026-05-01 10:00:00 UTC: GPS week 2416, second 468018, as GPS time is 18 s ahead."""
GPS_NS = (2416 * 604_800 + 468_018) * 10**9
WEEK_NS, DAY_NS = 604_800 * 10**9, 86_400 * 10**9
RAW = (
    "utcTimeMillis,TimeNanos,FullBiasNanos,BiasNanos,TimeOffsetNanos,Svid,State,"
    "ReceivedSvTimeNanos,ReceivedSvTimeUncertaintyNanos,Cn0DbHz,PseudorangeRateMetersPerSecond,"
    "CarrierFrequencyHz,ConstellationType"
)
GPS, SBAS, GLONASS, QZSS, BEIDOU, GALILEO, NAVIC = range(1, 8)
"""Constellations of android.location.GnssStatus."""


@pytest.fixture
def read(tmp_path):
    def of(lines, name="made.txt"):
        (tmp_path / name).write_text("\n".join(lines) + "\n")
        return read_recording(tmp_path / name)

    return of


def raw(system, svid, sent_ns, state=8, gps_ns=GPS_NS, bias="0.0", offset="0.0", hz="1575420000"):
    """Return a measurement at a time of GPS, of a phone's clock of a minute."""
    clock_ns = 60 * 10**9
    return (
        f"Raw,0,{clock_ns},{clock_ns - gps_ns},{bias},{offset},{svid},{state},{sent_ns},20,35.5,"
        f"-12.5,{hz},{system}"
    )


# GnssMeasurement.getReceivedSvTimeNanos: seconds of the GPS week; of GLONASS those of the day in
# Moscow (UTC + 3 h), of BeiDou those of its week, 14 s behind GPS.
@pytest.mark.parametrize(
    ("system", "svid", "name", "sent_s", "state"),
    [
        (GPS, 7, "G07", 468_018, 8),
        (GALILEO, 36, "E36", 468_018, 16_384),
        (QZSS, 193, "J01", 468_018, 8),
        (SBAS, 120, "S20", 468_018, 8),
        (NAVIC, 3, "I03", 468_018, 8),
        (BEIDOU, 20, "C20", 468_004, 8),
        (GLONASS, 24, "R24", 13 * 3600, 128),
        (GLONASS, 1, "R01", 13 * 3600, 32_768),
    ],
)
def test_pseudoranges_by_the_time_of_each_constellation(read, system, svid, name, sent_s, state):
    way_ns = 75_000_000
    found = read([f"# Raw,{RAW}", raw(system, svid, sent_s * 10**9 - way_ns, state)])
    (row,) = found.tables["satellites"].to_dict("records")
    assert row["satellite"] == name
    assert row["pseudorange_m"] == pytest.approx(0.075 * LIGHT_MPS, abs=1e-6)
    assert row["sigma_m"] == pytest.approx(20e-9 * LIGHT_MPS)
    assert (row["rate_mps"], row["cn0_dbhz"]) == (-12.5, 35.5)
    assert row["time_s"] == START_S


@pytest.mark.parametrize(
    ("system", "state"), [(GPS, 128), (GPS, 32_768), (GPS, 7), (GLONASS, 8), (GLONASS, 16_384)]
)
def test_the_state_of_another_constellation_decodes_no_time(read, system, state):
    good = raw(GPS, 9, 468_018 * 10**9 - 75_000_000)
    bad = raw(system, 7, 468_018 * 10**9 - 75_000_000, state)
    found = read([f"# Raw,{RAW}", good, bad])
    assert found.tables["satellites"]["satellite"].tolist() == ["G09"]
    (refused,) = found.unusable
    assert (refused.reason, refused.lines) == ("Raw: the satellite's time is not decoded", (3,))


def test_signals_are_under_way_over_the_end_of_a_week_and_of_a_day(read):
    """Week 2417 of GPS, and a day in Moscow, begin between sending and reception."""
    rows = [
        raw(GPS, 7, WEEK_NS - 40_000_000, gps_ns=2417 * WEEK_NS + 30_000_000),
        # 21:00:00.03 UTC of 1 May is midnight in Moscow.
        raw(
            GLONASS, 7, DAY_NS - 40_000_000, 128,
            gps_ns=GPS_NS + 11 * 3600 * 10**9 + 30_000_000,
        ),
    ]  # fmt: skip
    found = read([f"# Raw,{RAW}", *rows]).tables["satellites"]
    expected = {"G07": 0.07 * LIGHT_MPS, "R07": 0.07 * LIGHT_MPS}
    assert dict(zip(found["satellite"], found["pseudorange_m"], strict=True)) == pytest.approx(
        expected, abs=1e-6
    )


def test_fine_times_of_clock_and_measurement_add_to_the_way(read):
    """GnssClock.getBiasNanos goes with FullBias, getTimeOffsetNanos with TimeNanos."""
    sent_ns = 468_018 * 10**9 - 75_000_000
    rows = [
        raw(GPS, 1, sent_ns, bias="0.25", offset="0.0"),
        raw(GPS, 2, sent_ns, bias="0.0", offset="100.0"),
        raw(GPS, 3, sent_ns, bias="", offset=""),
    ]
    found = read([f"# Raw,{RAW}", *rows]).tables["satellites"].sort_values("satellite")
    way_ns = np.array([75_000_000 - 0.25, 75_000_000 + 100, 75_000_000])
    expected = way_ns * 1e-9 * LIGHT_MPS
    assert found["pseudorange_m"].to_numpy() == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("hz", "signal"),
    [
        *(("1575420000", "L1"), ("1561098000", "L1"), ("", "L1")),
        # GLONASS 1602 MHz and 562.5 kHz for each channel of -7 to 6; GPS L5 and L2.
        *(("1598062500", "L1"), ("1605375000", "L1"), ("1176450000", "L5"), ("1227600000", "L5")),
    ],
)
def test_signals_by_their_carrier(read, hz, signal):
    found = read([f"# Raw,{RAW}", raw(GPS, 7, 468_018 * 10**9 - 75_000_000, hz=hz)])
    assert found.tables["satellites"]["signal"].tolist() == [signal]


@pytest.mark.parametrize(
    ("system", "svid", "name"),
    [
        *((GPS, 1, "G01"), (GPS, 32, "G32"), (GPS, 33, ""), (GPS, 0, "")),
        *((SBAS, 101, "S01"), (SBAS, 151, "S51"), (SBAS, 192, "S92"), (SBAS, 100, "")),
        # GLONASS by its slot, or by its channel, 93 to 106, which names none.
        *((GLONASS, 24, "R24"), (GLONASS, 93, ""), (GLONASS, 106, "")),
        *((QZSS, 193, "J01"), (QZSS, 202, "J10"), (QZSS, 192, "")),
        *((BEIDOU, 63, "C63"), (GALILEO, 36, "E36"), (NAVIC, 14, "I14"), (0, 7, ""), (8, 7, "")),
    ],
)
def test_names_of_satellites_by_androids_numbers(system, svid, name):
    assert satellite_names(np.array([system]), np.array([svid])).tolist() == [name]


@pytest.mark.parametrize(
    ("words", "moment"),
    [
        ("2026 5 1 10 0 0.5", (2026, 5, 1, 10, 0, 0, 500_000)),
        ("80 1 6 0 0 0.0", (1980, 1, 6)),
        ("79 1 1 0 0 0.0", (2079, 1, 1)),
        ("99 12 31 23 59 59.0", (1999, 12, 31, 23, 59, 59)),
        ("00 1 1 0 0 0.0", (2000, 1, 1)),
        ("2016 12 31 23 59 60.9", (2017, 1, 1, 0, 0, 0, 900_000)),
        ("2026 13 1 0 0 0.0", None),
        ("2026 1 1 0 0 61.0", None),
        ("2026 1 1 0 0", None),
    ],
)
def test_dates_of_rinex(words, moment):
    expected = np.nan
    if moment is not None:
        expected = (
            datetime(*moment, tzinfo=UTC) - datetime(1980, 1, 6, tzinfo=UTC)
        ).total_seconds()
    assert gps_seconds(words.split()) == pytest.approx(expected, abs=1e-6, nan_ok=True)


@pytest.mark.parametrize(
    ("text", "number"),
    [(" 1.25D-05 ", 1.25e-5), ("-.5d+01", -5.0), ("7", 7.0), ("", np.nan), ("1.2*D1", np.nan)],
)
def test_numbers_of_fortran(text, number):
    assert fixed_number(text) == pytest.approx(number, abs=1e-6, nan_ok=True)


def observations(types, lines, epoch="> 2026 05 01 10 00 18.0000000  0  1"):
    head = [f"{'     3.03           OBSERVATION DATA    M':<60}RINEX VERSION / TYPE"]
    head += [f"{one:<60}SYS / # / OBS TYPES" for one in types]
    return [*head, f"{'':<60}END OF HEADER", epoch, *lines]


def values(name, *numbers):
    return name + "".join(" " * 16 if n is None else f"{n:14.3f} 7" for n in numbers)


def test_the_first_code_of_a_satellite_with_the_level_of_its_own_signal(read):
    types = ["G    4 C1W S1W C1C S1C", "E    2 C1X S1X", "C    3 C2I S2I C1P"]
    lines = [
        values("G07", 2.1e7, 31.5, 2.2e7, 42.25),
        values("G 8", 2.1e7 + 1, 30.0, None, 41.0),
        values("G09", 2.1e7 + 2, 30.0, 0.0, 41.0),
        values("E36", 2.5e7, 38.0),
        values("C20", 2.3e7, 37.0, 2.4e7),
        values("R01", 2.3e7),
    ]
    found = read(observations(types, lines)).tables["satellites"]
    names = ["satellite", "signal", "pseudorange_m", "cn0_dbhz"]
    rows = sorted(found[names].to_numpy().tolist())
    assert rows == [
        ["C20", "C2I", 2.3e7, 37.0],
        ["E36", "C1X", 2.5e7, 38.0],
        ["G07", "C1C", 2.2e7, 42.25],
        ["G08", "C1W", 2.1e7 + 1, 30.0],
        ["G09", "C1W", 2.1e7 + 2, 30.0],
    ]
    assert found["time_s"].unique().tolist() == [START_S]


def navigation(version, name, clock, toe_s, week, **of):
    """Return a message of an orbit of 26 560 km whose elements are as a receiver has them."""
    numbers = [
        *(1.0, of.get("crs", 8.0), 4.8e-9, -3.0, 3e-7, 0.005, 7e-6, 5153.6),
        *(toe_s, -1e-7, -2.8, -8e-8, 0.96, 250.0, 0.48, -8e-9),
        *(3.7e-10, 1.0, week, 0.0, 2.0, of.get("health", 0.0), of.get("tgd", 5e-9), 29.0),
    ]
    blank = " " * (4 if version == 3 else 3)
    lines = ["".join(f"{n:19.12E}" for n in numbers[i : i + 4]) for i in range(0, 24, 4)]
    first = f"{name} {clock}" + "".join(f"{n:19.12E}" for n in (1e-5, 2e-12, 3e-15))
    head = f"{f'     {version}.00           NAVIGATION DATA':<60}RINEX VERSION / TYPE"
    return [head, f"{'':<60}END OF HEADER", first, *(blank + line for line in lines)]


@pytest.mark.parametrize(
    ("version", "name", "clock", "toe_s", "week"),
    [
        (3, "G07", "2026 05 01 10 00 00", 468_000, 2416),
        # Weeks of 10 bits, and a year of two digits, of version 2.
        (2, " 7", "26  5  1 10  0  0.0", 468_000, 368),
        (3, "E12", "2026 05 01 10 00 00", 468_000, 2416),
        # BeiDou's week 0 is GPS week 1356, its time 14 s behind.
        (3, "C20", "2026 05 01 09 59 46", 467_986, 1060),
    ],
)
def test_times_of_ephemerides_are_gps_time(read, version, name, clock, toe_s, week):
    found = read(navigation(version, name, clock, toe_s, week, tgd=7e-9, health=63.0), "hour.26n")
    (row,) = found.tables["ephemerides"].to_dict("records")
    assert row["toe_s"] == row["toc_s"] == 2416 * 604_800 + 468_000
    assert row["time_s"] == START_S - 18
    assert (row["af0"], row["af1"], row["af2"]) == (1e-5, 2e-12, 3e-15)
    assert (row["sqrt_a"], row["eccentricity"], row["i0"]) == (5153.6, 0.005, 0.96)
    assert (row["crs"], row["crc"], row["omega0"], row["omega"]) == (8.0, 250.0, -2.8, 0.48)
    assert (row["cuc"], row["cus"], row["cic"], row["cis"]) == (3e-7, 7e-6, -1e-7, -8e-8)
    assert (row["tgd"], row["health"], row["idot"]) == (7e-9, 63.0, 3.7e-10)
    assert (row["delta_n"], row["m0"], row["omega_dot"]) == (4.8e-9, -3.0, -8e-9)


@pytest.mark.parametrize(("toe_s", "is_used"), [(554_399.0, True), (554_400.0, False)])
def test_ephemerides_a_day_from_their_clocks_time_are_damaged(read, toe_s, is_used):
    whole = navigation(3, "G07", "2026 05 01 10 00 00", 468_000, 2416)
    other = navigation(3, "G08", "2026 05 01 10 00 00", toe_s, 2416)[2:]
    found = read([*whole, *other], "hour.26n")
    assert found.tables["ephemerides"]["satellite"].tolist() == ["G07", "G08"][: 1 + is_used]
