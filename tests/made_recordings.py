"""Made recordings, one of each format: a walk of 60 s in Helsinki, a row every 2 s."""

# ruff: noqa: E501, SIM905

import numpy as np

START_UTC_S = 1_777_629_600
"""2026-05-01 10:00:00 UTC."""


COUNT = 30
STEP_S = 2.0
TIMES_S = START_UTC_S + STEP_S * np.arange(COUNT)
# 3 m a second along a street, with a bend.
LAT_DEG = 60.1700 + 4.0e-5 * np.arange(COUNT)
LON_DEG = 24.9400 + 6.0e-5 * np.maximum(0, np.arange(COUNT) - 12)
LEVEL_DBM = -80 - np.arange(COUNT) % 7
SPEED_MPS = 2.2


def _clock(index: int, layout: str = "%Y-%m-%dT%H:%M:%SZ", shift_s: float = 0.0) -> str:
    moment = np.datetime64(int(TIMES_S[index] + shift_s), "s").item()
    return str(moment.strftime(layout))


def _lines(header: str, rows: list[str], end: str = "\n") -> str:
    return end.join([header, *rows]) + end


def gnettrack() -> str:
    head = (
        "Timestamp Longitude Latitude Speed Operatorname Operator CGI Cellname Node CellID LAC "
        "NetworkTech NetworkMode Level Qual SNR CQI LTERSSI ARFCN DL_bitrate UL_bitrate PSC "
        "Altitude Height Accuracy TA RAWCELLID VERSION_NAME"
    ).split()
    for i in (1, 2):
        head += [f"{name}{i}" for name in ("NTech", "NCell", "NARFCN", "NRxLev")]
    rows = []
    for i in range(COUNT):
        stamp = _clock(i, "%Y.%m.%d_%H.%M.%S", 3 * 3600)
        row = [stamp, f"{LON_DEG[i]:.6f}", f"{LAT_DEG[i]:.6f}", "8", "Op", "24491", "x", "", "401"]
        row += ["141", "2124", "4G", "LTE", str(LEVEL_DBM[i]), "-10", "1.0", "-", "-51", "1300"]
        row += ["0", "0", "435", "20", "20", "4", "2", "102764173", "19.7"]
        row += ["4G", "436", "2850", str(LEVEL_DBM[i] - 9)]
        row += [] if i % 3 else ["2G", "7fffffff mMcc=null", "61", "-113"]
        rows.append("\t".join(row) + "\t")
    return _lines("\t".join(head) + "\t", rows)


def towercollector() -> str:
    head = "mcc,mnc,lac,cell_id,psc,asu,dbm,ta,lat,lon,accuracy,speed,bearing,altitude,"
    rows = []
    for i in range(COUNT):
        place = f"{LAT_DEG[i]:.6f},{LON_DEG[i]:.6f},6.4,2.2,30,12.5"
        stamp = f'"{_clock(i, "%Y-%m-%dT%H:%M:%S.000Z")}"'
        rows.append(
            f'244,91,3021,1170{i // 10},101,,{LEVEL_DBM[i]},1,{place},{stamp},LTE,false,"P"'
        )
        rows.append(f',,,,202,,{LEVEL_DBM[i] - 8},,{place},{stamp},LTE,true,"P"')
    return _lines(head + "measured_at,net_type,neighboring,device", rows, "\r\n")


def opencellid() -> str:
    head = "mcc,mnc,lac,cellid,lat,lon,signal,measured_at,rating,speed,direction,act,ta,psc,tac,pci"
    rows = [
        f"244,91,3021,117025{i // 15},{LAT_DEG[i]:.6f},{LON_DEG[i]:.6f},{LEVEL_DBM[i]},"
        f"{int(TIMES_S[i])}000,6.5,2.2,30.5,LTE+,1,,3021,269"
        for i in range(COUNT)
    ]
    return _lines(head, rows)


def mls() -> str:
    head = "radio,lat,lon,mcc,net,area,cell,unit,measured_at,signal"
    rows = [
        f"GSM,{LAT_DEG[i]:.6f},{LON_DEG[i]:.6f},244,91,3021,1170{i // 15},,{int(TIMES_S[i])},15"
        for i in range(COUNT)
    ]
    return _lines(head, rows)


def cell_list() -> str:
    head = "radio,mcc,net,area,cell,unit,lon,lat,range,samples,changeable,created,updated"
    rows = [
        f"LTE,244,91,3021,{117025 + i},,{LON_DEG[i]:.6f},{LAT_DEG[i]:.6f},900,12,1,1500000000,1600000000"
        for i in range(COUNT)
    ]
    return _lines(head, rows)


def gpx() -> str:
    points = "\n".join(
        f'   <trkpt lat="{LAT_DEG[i]:.6f}" lon="{LON_DEG[i]:.6f}">\n    <ele>12.5</ele>\n'
        f"    <time>{_clock(i)}</time>\n   </trkpt>"
        for i in range(COUNT)
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="1.1" creator="Watch" '
        'xmlns="http://www.topografix.com/GPX/1/1">\n <trk><trkseg>\n'
        f"{points}\n </trkseg></trk>\n</gpx>\n"
    )


def sentence(body: str) -> str:
    """Return an NMEA sentence with its checksum."""
    total = 0
    for byte in body.encode():
        total ^= byte
    return f"${body}*{total:02X}"


def _minutes(degrees: float, width: int) -> str:
    whole = int(degrees)
    return f"{whole:0{width}d}{60 * (degrees - whole):08.5f}"


def nmea() -> str:
    rows = []
    for i in range(COUNT):
        stamp, day = _clock(i, "%H%M%S.00"), _clock(i, "%d%m%y")
        place = f"{_minutes(LAT_DEG[i], 2)},N,{_minutes(LON_DEG[i], 3)},E"
        rows.append(sentence(f"GNRMC,{stamp},A,{place},4.276,30.1,{day},,,A"))
        rows.append(sentence(f"GNGGA,{stamp},{place},1,12,0.8,12.5,M,17.0,M,,"))
        rows.append(sentence(f"GNGST,{stamp},,,,,3.0,4.0,5.0"))
        rows.append(sentence("GPGSV,1,1,01,02,25,181,42"))
    return "\r\n".join(rows) + "\r\n"


def gnsslogger() -> str:
    head = [
        "# Header Description:", "#", "# Version: v3.0.6.4 Platform: 14", "#",
        "# Raw,utcTimeMillis,TimeNanos,LeapSecond,TimeUncertaintyNanos,FullBiasNanos,BiasNanos,"
        "BiasUncertaintyNanos,DriftNanosPerSecond,DriftUncertaintyNanosPerSecond,"
        "HardwareClockDiscontinuityCount,Svid,TimeOffsetNanos,State,ReceivedSvTimeNanos,"
        "ReceivedSvTimeUncertaintyNanos,Cn0DbHz,PseudorangeRateMetersPerSecond,"
        "PseudorangeRateUncertaintyMetersPerSecond,AccumulatedDeltaRangeState,"
        "AccumulatedDeltaRangeMeters,AccumulatedDeltaRangeUncertaintyMeters,CarrierFrequencyHz,"
        "ConstellationType",
        "# UncalAccel,utcTimeMillis,elapsedRealtimeNanos,UncalAccelXMps2,UncalAccelYMps2,"
        "UncalAccelZMps2,BiasXMps2,BiasYMps2,BiasZMps2",
        "# Gyro,utcTimeMillis,elapsedRealtimeNanos,GyroXRadPerSec,GyroYRadPerSec,GyroZRadPerSec",
        "# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,AccuracyMeters,"
        "BearingDegrees,UnixTimeMillis", "#",
    ]  # fmt: skip
    rows = []
    for i in range(COUNT):
        ms = int(TIMES_S[i]) * 1000
        gps_ns = (int(TIMES_S[i]) - 315_964_800 + 18) * 10**9
        rows.append(f"Fix,GPS,{LAT_DEG[i]:.7f},{LON_DEG[i]:.7f},12.5,2.2,4.5,30.0,{ms}")
        if i % 5 == 0:
            rows.append(f"Fix,NLP,{LAT_DEG[i] + 0.001:.7f},{LON_DEG[i]:.7f},,,25.0,,{ms}")
        for svid, way_ns in ((7, 71_000_000), (12, 75_500_000)):
            sent = gps_ns % (604_800 * 10**9) - way_ns
            rows.append(
                f"Raw,{ms},61000000000,,,{61_000_000_000 - gps_ns},0.0,5.0,1.0,1.0,0,{svid},0.0,"
                f"16431,{sent},20,35.0,12.5,0.2,16,0.0,0.0,1575420030,1"
            )
        rows.append(f"UncalAccel,{ms},1,0.16,0.2,9.9,0.06,0.0,0.1")
        rows.append(f"Gyro,{ms},1,0.01,-0.02,0.03")
        rows.append(f"Agc,{ms},1,,,-1,0.0,1,1,1,22,43.9,1575420000,1")
    return "\n".join([*head, *rows]) + "\n"


def rinex_obs() -> str:
    head = [
        f"{'     3.03           OBSERVATION DATA    M':<60}RINEX VERSION / TYPE",
        f"{'Maker':<60}PGM / RUN BY / DATE",
        f"{'G    4 C1C L1C D1C S1C':<60}SYS / # / OBS TYPES",
        f"{'E    4 C1C L1C D1C S1C':<60}SYS / # / OBS TYPES",
        f"{'  2026     5     1    10     0   18.0000000     GPS':<60}TIME OF FIRST OBS",
        f"{'':<60}END OF HEADER",
    ]
    rows = []
    for i in range(COUNT):
        rows.append(f"> {_clock(i, '%Y %m %d %H %M', 18)} {_clock(i, '%S', 18)}.0000000  0  2")
        for name, range_m in (("G07", 21_300_000.5), ("E12", 24_500_000.25)):
            values = (range_m + i, 1000.0, -12.5, 38.5)
            rows.append(name + "".join(f"{value:14.3f}  " for value in values))
    return "\n".join([*head, *rows]) + "\n"


def rinex2_obs() -> str:
    head = [
        f"{'     2.11           OBSERVATION DATA    G (GPS)':<60}RINEX VERSION / TYPE",
        f"{'     2    C1    S1':<60}# / TYPES OF OBSERV",
        f"{'  2026     5     1    10     0   18.0000000     GPS':<60}TIME OF FIRST OBS",
        f"{'':<60}END OF HEADER",
    ]
    rows = []
    for i in range(COUNT):
        rows.append(f" {_clock(i, '%y %m %d %H %M', 18)} {_clock(i, '%S', 18)}.0000000  0  2G07G12")
        rows += [f"{21_300_000.5 + i:14.3f}  {38.5:14.3f}" for _ in range(2)]
    return "\n".join([*head, *rows]) + "\n"


def rinex_nav() -> str:
    head = [
        f"{'     2              NAVIGATION DATA':<60}RINEX VERSION / TYPE",
        f"{'Maker':<60}PGM / RUN BY / DATE",
        f"{'':<60}END OF HEADER",
    ]

    def number(value: float) -> str:
        return f"{value:19.12E}".replace("E", "D")

    rows = []
    for svid in (7, 12):
        clock = "".join(map(number, (1e-5, 1e-12, 0.0)))
        rows.append(f"{svid:2d} 26  5  1 10  0  0.0{clock}")
        # Week 2416 begins on 26 April 2026: Friday 10 h is second 468 000.
        values = (
            (29.0, 8.0, 4.8e-9, -3.0), (3e-7, 0.005, 7e-6, 5153.6),
            (468_000.0, -1e-7, -2.8 + svid / 10, -8e-8), (0.96, 250.0, 0.48, -8e-9),
            (3.7e-10, 1.0, 2416.0, 0.0), (2.0, 0.0, 5e-9, 29.0), (466_200.0, 4.0, 0.0, 0.0),
        )  # fmt: skip
        rows += ["   " + "".join(map(number, line)) for line in values]
    return "\n".join([*head, *rows]) + "\n"


def smartloc() -> str:
    rows = []
    for i in range(COUNT):
        t = STEP_S * i
        rows.append(f"odom3 {t} 2.2 0 0 0 0 0.01 0.0025 0.0009 0.0009 4e-06 4e-06 4e-06   ")
        rows.append(
            f"pseudorange3 {t} {23653438.8 + i} 25 14056711.07 22357508.04 4819715.57 2 1 22.05 38 "
        )
        rows.append(
            f"pseudorange3 {t} {22904986.1 + i} 25 1566745.89 20769397.64 16492059.1 306 4 27.3 43 "
        )
        rows.append(f"point3 {t} {2884500 + i} {1341500 + 2 * i} {5509900 + i} 0 0 0 0 0 0 0 0 0")
    return "\n".join(rows) + "\n"


def smartloc_raw() -> str:
    head = (
        "GPSWeek [weeks];GPSSecondsOfWeek [s];Longitude (GT Lon) [deg];Latitude (GT Lat) [deg];"
        "Height above ellipsoid (GT Height) [m];Measurement time of week (rcvTow) [s];"
        "GPS week number (week) [weeks];Pseudorange measurement (prMes) [m];"
        "GNSS identifier (gnssId) [];Satellite identifier (svId) [];"
        "Carrier-to-noise density ratio (cno) [dbHz];"
        "Estimated pseudorange measurement standard deviation (prStdev) [m]"
    )
    rows = [
        f"2416;{468_018 + STEP_S * i};{LON_DEG[i]:.7f};{LAT_DEG[i]:.7f};20.0;"
        f"{468_018 + STEP_S * i};2416;{21_300_000 + i}.5;GPS;{svid};45;0.5"
        for i in range(COUNT)
        for svid in (7, 12)
    ]
    return _lines(head, rows)


def indoor() -> str:
    rows = [f"#\tstartTime:{START_UTC_S}000", "#\tBrand:OPPO\tModel:P", "#\tVersionName:v1"]
    for i in range(COUNT):
        ms = int(TIMES_S[i]) * 1000
        rows.append(f"{ms}\tTYPE_ACCELEROMETER\t-1.2\t-0.4\t9.7\t2")
        rows.append(f"{ms}\tTYPE_GYROSCOPE\t0.01\t-0.02\t0.03\t3")
        rows.append(f"{ms}\tTYPE_MAGNETIC_FIELD\t-17.2\t18.1\t-26.3\t3")
        rows.append(f"{ms}\tTYPE_ROTATION_VECTOR\t0.01\t0.03\t-0.39\t3")
        rows.append(
            f"{ms}\tTYPE_WIFI\tshop\t0a:74:9c:2e:af:0{i % 9}\t{LEVEL_DBM[i]}\t5765\t{ms - 700}"
        )
        rows.append(f"{ms}\tTYPE_BEACON\tABC\t1\t{i}\t-56\t-76\t9.5\tE0:78:A3:3E:97:B{i % 9}\t{ms}")
        if i % 5 == 0:
            rows.append(f"{ms}\tTYPE_WAYPOINT\t{100 + 2.2 * i:.3f}\t{50 + i / 10:.3f}")
    return "\n".join(rows) + "\n"


def phyphox() -> str:
    names = [f"Acceleration {axis} (m/s^2)" for axis in "xyz"]
    head = ";".join(f'"{name}"' for name in ["Time (s)", *names])
    rows = [f"{STEP_S * i:.3E};0,1;{i / 100:.4E};9,81".replace(".", ",") for i in range(COUNT)]
    return _lines(head, rows)


def sensorlogger() -> str:
    rows = [f"{int(TIMES_S[i])}000000000,{STEP_S * i},9.7{i % 10},0.1,0.2" for i in range(COUNT)]
    return _lines("time,seconds_elapsed,z,y,x", rows)


def antennas() -> str:
    rows = ["BEGIN,2026-05-01 13:00:00:887 GMT+03:00", "Antennas,  Build=0105, API=2", ""]
    for i in range(COUNT):
        stamp = _clock(i, "%Y-%m-%d %H:%M:%S:500 GMT+03:00", 3 * 3600)
        rows += [
            f'Record, Time="{stamp}", Phone Type=GSM, Network Type=EDGE, Country=fi, Operator=24491',
            "ACTIVE GSM, LAC=1377, CID=36393, Signal= >-52dBm",
            f"GSM, LAC=1377, CID=36392, PSC=-1, TYP=1, Signal= {LEVEL_DBM[i]}dBm",
            f"Best Location, Provider=N, Lat={LAT_DEG[i]:.5f}, Lon={LON_DEG[i]:.5f}",
            "",
        ]
    return "\n".join(rows) + "\n"


def kitti() -> str:
    rows = []
    for i in range(COUNT):
        turn = 0.02 * i
        c, s = np.cos(turn), np.sin(turn)
        place = (0.1 * i, 0.0, 2.2 * i)
        matrix = (c, 0, s, place[0], 0, 1, 0, place[1], -s, 0, c, place[2])
        rows.append(" ".join(f"{value:.6e}" for value in matrix))
    return "\n".join(rows) + "\n"


def tum() -> str:
    rows = ["# timestamp tx ty tz qx qy qz qw"]
    for i in range(COUNT):
        half = 0.01 * i
        rows.append(
            f"{TIMES_S[i]:.6f} {2.2 * i:.4f} {0.1 * i:.4f} 0.0 0 0 {np.sin(half):.7f} {np.cos(half):.7f}"
        )
    return "\n".join(rows) + "\n"


def plain_csv() -> str:
    head = "time;lat;lon;step_m;heading_rad;mcc;mnc;lac;ci;earfcn;pci;rsrp;technology;pressure"
    rows = [
        f"{_clock(i, '%Y-%m-%dT%H:%M:%S+03:00', 3 * 3600)};{LAT_DEG[i]:.6f};{LON_DEG[i]:.6f};4,5;0,3;"
        f"244;91;3021;117025{i // 15};1300;435;{LEVEL_DBM[i]};LTE;1013,2"
        for i in range(COUNT)
    ]
    return _lines(head, rows)


MADE: dict[str, tuple[str, str]] = {
    "gnettrack": ("walk.txt", gnettrack()),
    "towercollector": ("towers.csv", towercollector()),
    "opencellid": ("upload.csv", opencellid()),
    "opencellid/mls": ("mls.csv", mls()),
    "opencellid-cells": ("cells.csv", cell_list()),
    "gpx": ("watch.gpx", gpx()),
    "nmea": ("receiver.nmea", nmea()),
    "gnsslogger": ("gnss_log.txt", gnsslogger()),
    "rinex-obs": ("phone.26o", rinex_obs()),
    "rinex-obs/2": ("phone2.26o", rinex2_obs()),
    "rinex-nav": ("hour.26n", rinex_nav()),
    "smartloc": ("Input.txt", smartloc()),
    "smartloc-raw": ("RXM-RAWX.csv", smartloc_raw()),
    "indoor": ("path.txt", indoor()),
    "phyphox": ("Accelerometer.csv", phyphox()),
    "sensorlogger": ("TotalAcceleration.csv", sensorlogger()),
    "antennas": ("antennas.log", antennas()),
    "kitti": ("00.txt", kitti()),
    "tum": ("trajectory.txt", tum()),
    "csv": ("drive.csv", plain_csv()),
}
"""File name and content by format; after a slash the dialect."""
