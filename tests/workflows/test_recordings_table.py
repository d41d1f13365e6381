"""Every example of the table of formats runs, on made files of the names that it gives."""

import re
import shlex
from pathlib import Path

import pytest
from command_line import mapfilter
from made_recordings import MADE

from mapfilter.tracks.log_folders import is_log

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "recordings.rst"
EXAMPLES = dict(
    re.findall(
        r"^   \* - ``([\w-]+)``\n(?:     .+\n)+?     - ``(convert .+)``$",
        PAGE.read_text(encoding="utf-8"),
        flags=re.MULTILINE,
    )
)


def text(name):
    return MADE[name][1]


def german_csv():
    """Return the made CSV with German names of columns, longitudes by their usual one."""
    return text("csv").replace("time;lat;", "Zeit;Breite;", 1)


def points(lines):
    return "\n".join(line for line in lines.splitlines() if line.startswith("point3")) + "\n"


FILES = {
    "walk.txt": text("gnettrack"),
    "towers.csv": text("towercollector"),
    "OpenCellID_1.csv": text("opencellid"),
    "ride.csv": text("opencellid"),
    "cells.csv": text("opencellid-cells"),
    "watch.gpx": text("gpx"),
    "ublox.nmea": text("nmea"),
    "reference.nmea": text("nmea"),
    "gnss_log.txt": text("gnsslogger"),
    "hour1820.16n": text("rinex-nav"),
    "brdc.16n": text("rinex-nav"),
    "brdc.23n": text("rinex-nav"),
    "phone.23o": text("rinex-obs"),
    "rover.pos": text("rtklib"),
    "Input.txt": text("smartloc"),
    "GT.txt": points(text("smartloc")),
    "RXM-RAWX.csv": text("smartloc-raw"),
    "path.txt": text("indoor"),
    "Accelerometer.csv": text("phyphox"),
    "Gyroscope.csv": text("phyphox").replace("Acceleration", "Gyroscope").replace("m/s^2", "rad/s"),
    "Location.csv": (
        '"Time (s)","Latitude (°)","Longitude (°)"\n0.0,60.17,24.94\n10.0,60.1701,24.94\n'
    ),
    "export/TotalAcceleration.csv": text("sensorlogger"),
    "20140924.log": text("antennas"),
    "00.txt": text("kitti"),
    "trajectory.txt": text("tum"),
    "drive.1.nmf": text("nemo"),
    "tems.txt": text("tems"),
    "sensorlog.csv": text("sensorlog"),
    "WigleWifi_20260501.csv.gz": text("wigle"),
    "candump.log": text("can"),
    "phone.csv": text("long/axes"),
    "2026-05-01 10-00-00.csv": text("long"),
    "drive.csv": german_csv(),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_of_a_format_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = shlex.split(EXAMPLES[name])
    for word in words[1:]:
        for file in (file for file in FILES if word in (file, file.partition("/")[0])):
            Path(file).parent.mkdir(exist_ok=True)
            Path(file).write_text(FILES[file], encoding="utf-8")
    done = mapfilter(*words)
    assert done.code == 0, done.err
    assert is_log(tmp_path / words[words.index("--out") + 1])


def test_there_is_an_example_of_each_format():
    assert EXAMPLES.keys() == {name.partition("/")[0] for name in MADE}
