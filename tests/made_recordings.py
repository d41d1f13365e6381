"""Made recordings, one of each format: a walk of 60 s in Helsinki, a row every 2 s."""

# ruff: noqa: E501, SIM905

import numpy as np
from made_drive_tests import nemo, tems, tems_lte
from made_satellites import (
    gnsslogger,
    nmea,
    rinex2_obs,
    rinex3_nav,
    rinex_nav,
    rinex_obs,
    rtklib,
    smartloc,
    smartloc_raw,
)
from made_walk import (
    COUNT,
    LAT_DEG,
    LEVEL_DBM,
    LON_DEG,
    SPEED_MPS,
    START_UTC_S,
    STEP_S,
    TIMES_S,
    clock,
)


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
        stamp = clock(i, "%Y.%m.%d_%H.%M.%S", 3 * 3600)
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
        stamp = f'"{clock(i, "%Y-%m-%dT%H:%M:%S.000Z")}"'
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
        f"    <time>{clock(i)}</time>\n   </trkpt>"
        for i in range(COUNT)
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="1.1" creator="Watch" '
        'xmlns="http://www.topografix.com/GPX/1/1">\n <trk><trkseg>\n'
        f"{points}\n </trkseg></trk>\n</gpx>\n"
    )


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
        stamp = clock(i, "%Y-%m-%d %H:%M:%S:500 GMT+03:00", 3 * 3600)
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
        f"{clock(i, '%Y-%m-%dT%H:%M:%S+03:00', 3 * 3600)};{LAT_DEG[i]:.6f};{LON_DEG[i]:.6f};4,5;0,3;"
        f"244;91;3021;117025{i // 15};1300;435;{LEVEL_DBM[i]};LTE;1013,2"
        for i in range(COUNT)
    ]
    return _lines(head, rows)


def wigle() -> str:
    """As the app writes it since 2.80: the names of the columns are in the second line."""
    head = (
        "WigleWifi-1.6,appRelease=2.86,model=Pixel 6,release=13,device=oriole,display=TQ3A,"
        "board=oriole,brand=google,star=Sol,body=3,subBody=0\nMAC,SSID,AuthMode,FirstSeen,Channel,"
        "Frequency,RSSI,CurrentLatitude,CurrentLongitude,AltitudeMeters,AccuracyMeters,RCOIs,"
        "MfgrId,Type"
    )
    rows = []
    for i in range(COUNT):
        stamp = clock(i, "%Y-%m-%d %H:%M:%S", 3 * 3600)
        place = f"{LAT_DEG[i]:.8f},{LON_DEG[i]:.8f},21.5,3.9,,"
        rows.append(
            f"24491_3021_117025{i // 15},Op,LTE;fi,{stamp},1300,0,{LEVEL_DBM[i]},{place},LTE"
        )
        rows.append(
            f"1a:9f:ee:5c:71:{i % 9:02x},Shop,[WPA2][ESS],{stamp},36,5180,{LEVEL_DBM[i] + 20},{place},WIFI"
        )
    return _lines(head, rows)


def car_scanner() -> str:
    """Rows end with a separator, and one header is misspelt, as in the app."""
    rows = []
    for i in range(COUNT):
        place = f'"{LAT_DEG[i]:.7f}";"{LON_DEG[i]:.7f}";'
        for name, value, unit in (
            ("Speed (GPS)", f"{3.6 * SPEED_MPS:.2f}", "km/h"),
            ("Engine RPM", "1500", "rpm"),
            ("Vehicle speed", f"{3.6 * SPEED_MPS:.0f}", "km/h"),
        ):
            rows.append(f'"{TIMES_S[i]:.1f}";"{name}";"{value}";"{unit}";{place}')
    return _lines('"SECONDS";"PID";"VALUE";"UNITS";"LATITUDE";"LONGTITUDE";', rows, "\r\n")


def long_axes() -> str:
    rows = []
    for i in range(COUNT):
        rows.append(f"{int(TIMES_S[i])}000,accelerometer,0.1,0.2,{9.8 + i % 3 / 10:.1f}")
        rows.append(f"{int(TIMES_S[i])}000,LSM6DSO Gyroscope,0.01,0.02,0.03")
        rows.append(f"{int(TIMES_S[i])}000,pressure,1013.2,,")
    return _lines("timestamp,sensor,x,y,z", rows)


def candump() -> str:
    rows = []
    for i in range(COUNT):
        rows.append(f"({TIMES_S[i]:.6f}) can0 7DF#02010D0000000000")
        rows.append(f"({TIMES_S[i] + 0.01:.6f}) can0 7E8#03410D{20 + i % 5:02X}AAAAAAAA")
        rows.append(f"({TIMES_S[i] + 0.02:.6f}) can0 1A6#0011223344556677")
    return _lines(rows[0], rows[1:])


def vector_asc() -> str:
    head = (
        "date Fri May 1 10:00:00.000 am 2026\nbase hex  timestamps absolute\ninternal events logged"
    )
    rows = [
        f"{STEP_S * i:11.6f} 1  7E8             Rx   d 8 03 41 0D {20 + i % 5:02X} AA AA AA AA"
        for i in range(COUNT)
    ]
    return _lines(head, rows)


def sensorlog() -> str:
    """Accelerations are in g, and those of gravity: -1 in z where the screen is up."""
    head = (
        "loggingTime(txt),locationTimestamp_since1970(s),locationLatitude(WGS84),"
        "locationLongitude(WGS84),locationAltitude(m),locationSpeed(m/s),locationCourse(°),"
        "locationHorizontalAccuracy(m),accelerometerAccelerationX(G),accelerometerAccelerationY(G),"
        "accelerometerAccelerationZ(G),motionRotationRateX(rad/s),motionRotationRateY(rad/s),"
        "motionRotationRateZ(rad/s),motionMagneticFieldX(µT),motionMagneticFieldY(µT),"
        "motionMagneticFieldZ(µT),pedometerNumberofSteps(N),altimeterPressure(kPa)"
    )
    rows = [
        f"{clock(i, '%Y-%m-%d %H:%M:%S', 3 * 3600)}.000 +0300,{TIMES_S[i]:.3f},{LAT_DEG[i]:.6f},"
        f"{LON_DEG[i]:.6f},12.5,2.2,-1.0,4.5,0.01,0.02,{-1 - i % 3 / 10:.1f},0.01,0.02,0.03,"
        f"0,{20 + i % 2},-43,{3 * i},101.3"
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
    "rinex-nav/3": ("brdc.26p", rinex3_nav()),
    "rtklib": ("rover.pos", rtklib()),
    "smartloc": ("Input.txt", smartloc()),
    "smartloc-raw": ("RXM-RAWX.csv", smartloc_raw()),
    "indoor": ("path.txt", indoor()),
    "phyphox": ("Accelerometer.csv", phyphox()),
    "sensorlogger": ("TotalAcceleration.csv", sensorlogger()),
    "antennas": ("antennas.log", antennas()),
    "kitti": ("00.txt", kitti()),
    "tum": ("trajectory.txt", tum()),
    "nemo": ("drive.1.nmf", nemo()),
    "tems": ("drive.txt", tems()),
    "tems/lte": ("drive_lte.txt", tems_lte()),
    "wigle": ("WigleWifi_20260501.csv", wigle()),
    "can": ("candump.log", candump()),
    "can/asc": ("drive.asc", vector_asc()),
    "sensorlog": ("sensorlog.csv", sensorlog()),
    "long": ("2026-05-01 13-00-00.csv", car_scanner()),
    "long/axes": ("sensors.csv", long_axes()),
    "csv": ("drive.csv", plain_csv()),
}
"""File name and content by format; after a slash the dialect."""
