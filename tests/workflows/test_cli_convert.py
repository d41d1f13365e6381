"""The command ``convert``."""

import pytest
from command_line import mapfilter
from made_recordings import COUNT, MADE, START_UTC_S

from mapfilter.errors import InputError
from mapfilter.tracks.store import read_log


@pytest.fixture
def walk(tmp_path):
    for name in ("gnettrack", "gpx", "csv"):
        file, text = MADE[name]
        (tmp_path / file).write_text(text)
    return tmp_path


def test_convert_prints_what_was_found(walk):
    done = mapfilter(
        "convert", walk / "walk.txt", "--truth", walk / "watch.gpx", "--out", walk / "log"
    )
    assert done.code == 0
    assert "walk.txt: G-NetTrack 19.7, local time (zone unknown)" in done.out
    assert "  positions: 30 rows, every 2 s" in done.out
    assert "local time is UTC+03:00" in done.out
    assert "truth 30" in done.out.splitlines()[-1]
    assert len(read_log(walk / "log").truth) == COUNT


def test_convert_prints_json(walk):
    args = ("--zone", "Europe/Helsinki", "--out", walk / "log", "--json")
    found = mapfilter("convert", walk / "walk.txt", *args).json
    assert found["rows"]["radio"] == 2 * COUNT
    assert found["rows"]["truth"] == 0
    assert found["files"][0]["used"][0]["rate_hz"] == 0.5
    assert read_log(walk / "log").start_utc_s == START_UTC_S


def test_options_are_checked(walk):
    path, out = walk / "drive.csv", walk / "log"
    for args, said in (
        (("--origin", "60"), "2 numbers"),
        (("--origin", "100,20"), "a latitude and a longitude"),
        (("--column", "time"), "NAME=VALUE"),
        (("--column", "time=Uhr"), "a column Uhr for time"),
        (("--offset", "walk.txt=5"), "the name of one of the recordings (drive.csv)"),
        (("--offset", "drive.csv=five"), "1 numbers"),
        (("--zone", "Mars"), "Europe/Brussels"),
        (("--format", "kml"), "one of gnettrack"),
        (("--crs", "EPSG:4326"), "degrees given for metres"),
    ):
        done = mapfilter("convert", path, "--out", out, *args)
        assert done.code == 2, args
        assert said in done.err, args
        assert not out.exists()
    assert mapfilter("convert", path, "--out", out, "--offset", "drive.csv=5").code == 0
    assert read_log(out).start_utc_s == START_UTC_S + 5


def test_info_describes_a_recording(walk):
    found = mapfilter("info", walk / "walk.txt", "--json").json
    assert (found["kind"], found["format"]) == ("recording", "gnettrack")
    assert found["rows"] == {"positions": COUNT, "radio": 2 * COUNT}
    assert found["clock"] == "local time (zone unknown)"
    with pytest.raises(InputError, match=r"mapfilter convert drive\.csv --out LOG"):
        read_log(walk / "drive.csv")


def test_formats_that_are_not_read_are_named(walk):
    for name, told in (("drive.dt1", "Nemo"), ("drive.trp", "TEMS"), ("walk.kml", "KML")):
        (walk / name).write_text('FF,,,"1.86"\nsomething\n')
        done = mapfilter("convert", walk / name, "--out", walk / "log")
        assert done.code == 2
        assert told in done.err


def test_a_tab_delimited_export_with_a_map_of_columns(tmp_path):
    head = ["Timestamp", "All-Latitude Decimal Degree", "All-Longitude Decimal Degree"]
    head += ["MS1-Serving Cell RSRP (dBm)", "MS1-Serving Cell Identity"]
    rows = [
        ["2026-05-01 12:00:00.250", "60.17", "24.94", "-80.5", "435"],
        ["2026-05-01 12:00:00.750", "", "", "-81.5", ""],
        ["2026-05-01 12:00:01.250", "60.171", "24.94", "", "435"],
    ]
    path = tmp_path / "tems.txt"
    path.write_text("\n".join("\t".join(row) for row in [head, *rows]))
    names = zip(("time", "lat_deg", "lon_deg", "level_dbm", "bsic"), head, strict=True)
    columns = [f"--column={field}={name}" for field, name in names]
    args = ("--format", "csv", "--zone", "+02:00", "--out", tmp_path / "log", "--json")
    found = mapfilter("convert", path, *columns, *args).json
    assert found["rows"]["gnss"] == 2
    radio = read_log(tmp_path / "log").radio
    assert radio["bsic"].dropna().unique().tolist() == [435]
    assert radio["level_dbm"].dropna().tolist() == [-80.5, -81.5]


@pytest.mark.parametrize(
    ("name", "title", "rows"),
    [
        ("nemo", "Nemo Outdoor 7.8.0.8", {"radio": 110, "gnss": COUNT}),
        ("tems", "TEMS Investigation", {"radio": 2 * COUNT, "gnss": COUNT}),
    ],
)
def test_a_drive_test_becomes_a_log(name, title, rows, tmp_path):
    file, text = MADE[name]
    path = tmp_path / file
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    done = mapfilter("convert", path, "--zone", "+03:00", "--out", tmp_path / "log")
    assert done.code == 0
    assert title in done.out
    log = read_log(tmp_path / "log")
    assert {table: len(getattr(log, table)) for table in rows} == rows
    assert set(log.radio["role"]) == {"serving", "neighbour"}
    assert log.start_utc_s == pytest.approx(START_UTC_S, abs=1.0)


def test_a_drive_test_without_dates_takes_those_of_another_recording(tmp_path):
    paths = []
    for name in ("tems/lte", "gpx"):
        file, text = MADE[name]
        paths.append(tmp_path / file)
        paths[-1].write_text(text)
    done = mapfilter("convert", paths[0], "--truth", paths[1], "--out", tmp_path / "log")
    assert done.code == 0
    log = read_log(tmp_path / "log")
    assert len(log.truth) == COUNT
    apart_s = log.gnss["time_s"].to_numpy() - log.truth["time_s"].to_numpy()
    assert abs(apart_s).max() < 1.0
