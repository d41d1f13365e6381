"""Made recordings of satellite receivers, of the walk of the others."""

from made_walk import COUNT, LAT_DEG, LON_DEG, STEP_S, TIMES_S, clock


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
        stamp, day = clock(i, "%H%M%S.00"), clock(i, "%d%m%y")
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
        rows.append(f"> {clock(i, '%Y %m %d %H %M', 18)} {clock(i, '%S', 18)}.0000000  0  2")
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
        rows.append(f" {clock(i, '%y %m %d %H %M', 18)} {clock(i, '%S', 18)}.0000000  0  2G07G12")
        rows += [f"{21_300_000.5 + i:14.3f}  {38.5:14.3f}" for _ in range(2)]
    return "\n".join([*head, *rows]) + "\n"


def rtklib() -> str:
    head = [
        "% program   : RTKPOST ver.2.4.3 b34",
        "% obs start : 2026/05/01 10:00:18.0 GPST (week2416 468018.0s)",
        "%",
        "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,5:single,ns=# of satellites)",
        "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)"
        "   sdu(m)  sdne(m)  sdeu(m)  sdun(m) age(s)  ratio    vn(m/s)    ve(m/s)    vu(m/s)",
    ]
    rows = [
        f"{clock(i, '%Y/%m/%d %H:%M:%S', 18)}.000   {LAT_DEG[i]:.9f}   {LON_DEG[i]:.9f}    20.1000 "
        "  5   9   3.0000   1.0000   4.0000   0.1000   0.1000  -0.1000   0.00    0.0    "
        "2.20000    0.00000    0.00000"
        for i in range(COUNT)
    ]
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


def rinex3_nav() -> str:
    head = [
        f"{'     3.04           NAVIGATION DATA     M':<60}RINEX VERSION / TYPE",
        f"{'Maker':<60}PGM / RUN BY / DATE",
        f"{'GPSA   4.6570D-09  1.4900D-08 -5.9600D-08 -1.1920D-07':<60}IONOSPHERIC CORR",
        f"{'GPSB   8.1920D+04  8.1920D+04 -6.5540D+04 -5.2430D+05':<60}IONOSPHERIC CORR",
        f"{'':<60}END OF HEADER",
    ]

    def number(value: float) -> str:
        return f"{value:19.12E}"

    rows = []
    # BeiDou counts weeks from 2006, and its seconds are 14 behind those of GPS.
    for name, week, second in (("G07", 2416.0, 468_000.0), ("E12", 2416.0, 468_000.0),
                               ("C20", 1060.0, 467_986.0)):  # fmt: skip
        minute = "10 00 00" if name != "C20" else "09 59 46"
        rows.append(f"{name} 2026 05 01 {minute}" + "".join(map(number, (1e-5, 1e-12, 0.0))))
        axis = {"G": 5153.6, "E": 5440.6, "C": 5282.6}[name[0]]
        values = (
            (29.0, 8.0, 4.8e-9, -3.0), (3e-7, 0.005, 7e-6, axis),
            (second, -1e-7, -2.8, -8e-8), (0.96, 250.0, 0.48, -8e-9),
            (3.7e-10, 1.0, week, 0.0), (2.0, 0.0, 5e-9, 29.0), (466_200.0, 4.0, 0.0, 0.0),
        )  # fmt: skip
        rows += ["    " + "".join(map(number, line)) for line in values]
    rows += ["R05 2026 05 01 10 15 00" + "".join(map(number, (1e-5, 1e-12, 0.0)))]
    rows += ["    " + "".join(map(number, (1e4, 1.0, 0.0, 0.0))) for _ in range(3)]
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
    return "\n".join([head, *rows]) + "\n"
