"""Solutions of RTKLIB: systems of time, layouts, errors and velocities."""

import numpy as np
import pytest
from made_recordings import COUNT, LAT_DEG, MADE, START_UTC_S

from mapfilter.errors import InputError
from mapfilter.tracks.readers.formats import read_recording

TEXT = MADE["rtklib"][1]


def read(tmp_path, text):
    path = tmp_path / "rover.pos"
    path.write_text(text)
    return read_recording(path)


def with_weeks(text):
    """Return the same with GPS weeks and seconds of the week: 18 s after 10:00:00 UTC."""
    head, rows = text.split("vu(m/s)\n")
    lines = [line.split(maxsplit=2)[2] for line in rows.splitlines()]
    return f"{head}vu(m/s)\n" + "\n".join(
        f"2416 {468018 + 2 * i:.3f}   {line}" for i, line in enumerate(lines)
    )


@pytest.mark.parametrize("system", ["GPST", "UTC", "JST"])
@pytest.mark.parametrize("weeks", [False, True])
def test_times_are_those_of_the_stated_system(tmp_path, system, weeks):
    text = with_weeks(TEXT) if weeks else TEXT
    found = read(tmp_path, text.replace("%  GPST", f"%  {system}"))
    late_s = {"GPST": 0, "UTC": 18, "JST": 18 - 9 * 3600}[system]
    time_s = found.tables["positions"]["time_s"]
    np.testing.assert_allclose(time_s, START_UTC_S + late_s + 2.0 * np.arange(COUNT))
    assert found.clock.kind == ("gps" if system == "GPST" else "utc")


def test_errors_speeds_and_courses_are_read(tmp_path):
    rows = read(tmp_path, TEXT).tables["positions"]
    assert rows["accuracy_m"].to_numpy() == pytest.approx(1.515 * 5**0.5)
    assert rows["speed_mps"].to_numpy() == pytest.approx(2.2)
    assert (rows["course_deg"] == 0).all()


def test_rows_may_end_after_the_height_or_have_commas(tmp_path):
    head, rows = TEXT.split("vu(m/s)\n")
    short = "\n".join(" ".join(line.split()[:7]) for line in rows.splitlines())
    for text in (f"{head}vu(m/s)\n{short}", f"{head}vu(m/s)\n" + short.replace(" ", ",")):
        found = read(tmp_path, text).tables["positions"]
        assert found["lat_deg"].to_numpy() == pytest.approx(LAT_DEG)
        assert found["speed_mps"].isna().all()


@pytest.mark.parametrize(
    "names", ["x-ecef(m) y-ecef(m) z-ecef(m)", "e-baseline(m) n-baseline(m)", "latitude(d'\")"]
)
def test_positions_that_are_no_decimal_degrees_are_refused(tmp_path, names):
    given = TEXT.replace("latitude(deg) longitude(deg)", names)
    with pytest.raises(InputError, match=r"decimal degrees \(solution format"):
        read(tmp_path, given)


def test_degrees_minutes_and_seconds(tmp_path):
    """They were refused."""
    head, rows = TEXT.split("latitude(deg) longitude(deg)")
    title, rows = rows.split("vu(m/s)\n")
    lines = []
    for line in rows.splitlines():
        date, clock, _, _, *rest = line.split()
        lines.append(" ".join([date, clock, "60", "10", "12.6", "-0", "30", "36.0", *rest]))
    names = "latitude(d'\") longitude(d'\")"
    found = read(tmp_path, head + names + title + "vu(m/s)\n" + "\n".join(lines))
    positions = found.tables["positions"]
    assert positions["lat_deg"].to_numpy() == pytest.approx(60 + 10 / 60 + 12.6 / 3600)
    assert positions["lon_deg"].to_numpy() == pytest.approx(-0.51)
    assert positions["accuracy_m"].to_numpy() == pytest.approx(1.515 * 5**0.5)
    assert positions["speed_mps"].to_numpy() == pytest.approx(2.2)
