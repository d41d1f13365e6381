"""Values in recordings that are digits to Python and numbers to nobody, or far too many."""

import time
from datetime import datetime
from zoneinfo import ZoneInfo

import numpy as np
import pandas as pd
import pytest
from made_recordings import MADE

from mapfilter.clocks import times
from mapfilter.errors import Faults, InputError
from mapfilter.tracks.checks.log_checks import check_steps
from mapfilter.tracks.readers import gnettrack, smartloc
from mapfilter.tracks.readers.formats import read_recording

DIGITS = "²³٣７"
"""Two raised ones, which Python counts among the digits but takes for no number; two of scripts."""


@pytest.mark.parametrize("digit", DIGITS)
@pytest.mark.parametrize("name", sorted(MADE))
def test_other_digits_anywhere_are_read_or_refused(tmp_path, name, digit):
    """In each place where a one stands, all at once, and at the ends of the file."""
    file, text, *_ = MADE[name]
    path = tmp_path / file
    for changed in (text.replace("1", digit), text.replace("0", digit), digit + text, text + digit):
        path.write_text(changed, encoding="utf-8")
        try:
            recording = read_recording(path)
        except InputError:
            continue
        assert recording.tables


@pytest.mark.parametrize("digit", DIGITS)
def test_a_date_with_other_digits_is_none(tmp_path, digit):
    file, text, *_ = MADE["nmea"]
    lines = text.splitlines()
    at = next(i for i, line in enumerate(lines) if "RMC" in line)
    fields = lines[at].split("*")[0].split(",")
    fields[9] = fields[9][:4] + 2 * digit
    path = tmp_path / file
    path.write_text("\n".join([",".join(fields), *lines[:at], *lines[at + 1 :]]), encoding="utf-8")
    assert read_recording(path).tables


def test_codes_of_neighbours_are_digits_of_ascii():
    found = gnettrack._codes(np.array(["7", *DIGITS, "-1", ""], dtype=object))
    np.testing.assert_array_equal(found, [7, *[np.nan] * 6])


def test_numbers_of_satellites_are_whole_and_few():
    system = np.array([1.0, 1.5, np.nan, 4.0, 2.0, 1.0, 1.0, 0.0])
    number = np.array([7.0, 7.0, 7.0, 70.0, 120.0, 7.5, np.inf, 3.0])
    found = smartloc._satellites(system, number).tolist()
    assert found == ["G07", None, None, "R06", "S20", None, None, None]
    began_s = time.process_time()
    rng = np.random.default_rng(1)
    smartloc._satellites(rng.choice([1.0, 4.0], 200_000), rng.uniform(0, 99, 200_000))
    assert time.process_time() - began_s < 2


def test_local_times_of_many_days_take_one_look_each():
    rng = np.random.default_rng(2)
    local_s = rng.uniform(0, 2e9, 200_000)
    began_s = time.process_time()
    found = times.utc_from_local_s(local_s, "Europe/Brussels")
    assert time.process_time() - began_s < 5
    zone = ZoneInfo("Europe/Brussels")
    for i in range(200):
        ahead_s = datetime.fromtimestamp(found[i], zone).utcoffset().total_seconds()
        assert found[i] + ahead_s == pytest.approx(local_s[i], abs=1e-3)


def test_local_times_beyond_all_calendars_stay_numbers():
    far = np.array([[0.0, 1e300], [-1e300, np.nan]])
    found = times.utc_from_local_s(far, "+01:00")
    assert found[0].tolist() == [-3600.0, 1e300]
    assert found[1, 0] == -1e300
    assert np.isnan(found[1, 1])


def test_speeds_beyond_all_numbers_are_no_warning():
    count = 40
    motion = pd.DataFrame(
        {"time_s": 1e-9 * np.arange(count), "step_m": 1e303, "heading_rad": 0.0, "turn_rad": 0.0}
    )
    none = pd.DataFrame({"time_s": [], "east_m": [], "north_m": []})
    tables = {"motion": motion, "truth": none, "gnss": none}
    check_steps(tables, "motion.csv", Faults())
