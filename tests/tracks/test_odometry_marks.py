"""Values that a vehicle's bus sends where it has none: full scale, whatever the unit."""

import gzip

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.tracks.pdr.odometry_rows import usable_rows
from mapfilter.tracks.readers.formats import read_recording

UTM = OpenOptions(combine=CombineOptions(crs="EPSG:32629"))
TIME_S = np.arange(0.0, 60.0, 0.1)
SPEED_MPS = 8.0 + 2.0 * np.sin(TIME_S / 9)
RATE_RADPS = 0.2 * np.sin(TIME_S / 7)
LOST = np.isin(np.arange(TIME_S.size), [100, 101, 102, 250, 251, 400])


def opened(tmp_path, columns):
    path = tmp_path / "bus.csv"
    pd.DataFrame({"time": TIME_S, **columns}).to_csv(path, index=False)
    return open_log([path], options=UTM).log


def good_rows():
    return pd.DataFrame({"time_s": TIME_S, "speed_mps": SPEED_MPS, "yaw_rate_radps": RATE_RADPS})


@pytest.mark.parametrize("mark", [655.35, 6553.5, 999.0, 65535.0, 255.0, 255.996])
def test_speeds_of_full_scale_are_no_motion(tmp_path, mark):
    """Those of 6 rows would be some 30 m and more that were never driven."""
    speed_kmh = np.where(LOST, mark, 3.6 * SPEED_MPS)
    log = opened(tmp_path, {"wheel_speed_kmh": speed_kmh, "yaw_rate_radps": RATE_RADPS})
    assert log.motion["step_m"].sum() == pytest.approx(np.trapezoid(SPEED_MPS, TIME_S), rel=2e-3)
    assert log.motion["turn_rad"].notna().all()
    (note,) = [note for note in log.notes if "has no value" in note]
    assert "6 values are not m/s in -120..120" in note or "6 speeds that come and go" in note


@pytest.mark.parametrize(("name", "mark"), [("degps", 327.67), ("degps", 999.0), ("radps", 4.08)])
def test_yaw_rates_of_full_scale_are_no_turns(tmp_path, name, mark):
    given = np.degrees(RATE_RADPS) if name == "degps" else RATE_RADPS
    rate = np.where(LOST, mark, given)
    log = opened(tmp_path, {"wheel_speed_mps": SPEED_MPS, f"yaw_rate_{name}": rate})
    turned = np.concatenate([[0.0], 0.05 * np.cumsum(RATE_RADPS[1:] + RATE_RADPS[:-1])])
    np.testing.assert_allclose(np.cumsum(log.motion["turn_rad"]), turned, atol=2e-3)
    (note,) = [note for note in log.notes if "has no value" in note]
    assert "6 values are not rad/s in -3.5..3.5, ignored (first in line 102; likely: " in note
    assert any("6 yaw rates taken from the rows around" in note for note in log.notes)


def test_yaw_rates_of_full_scale_in_rows_of_their_own_are_not_joined(tmp_path):
    odd = np.arange(TIME_S.size) % 2 == 1
    rate = np.where(odd, np.nan, np.where(LOST, 327.67, np.degrees(RATE_RADPS)))
    columns = {"wheel_speed_mps": np.where(odd, SPEED_MPS, np.nan), "yaw_rate_degps": rate}
    log = opened(tmp_path, columns)
    turned = np.cumsum(0.1 * RATE_RADPS)[odd]
    np.testing.assert_allclose(np.cumsum(log.motion["turn_rad"]), turned, atol=0.03)
    assert any("4 yaw rates beyond 3.5 rad/s in rows without speeds" in n for n in log.notes)


def test_degrees_for_radians_are_refused_not_thinned_out(tmp_path):
    """A few degrees per second are possible as radians: those beyond tell of all."""
    with pytest.raises(InputError, match=r"yaw_rate_radps.*likely: degrees for radians"):
        opened(tmp_path, {"wheel_speed_mps": SPEED_MPS, "yaw_rate_radps": np.degrees(RATE_RADPS)})


def test_odometry_of_smartloc_is_checked_as_well(shared_data, tmp_path):
    path = shared_data / "gnss-odometry-smartloc" / "Berlin_Potsdamer_Platz_Input.txt.gz"
    data = gzip.decompress(path.read_bytes())
    lines = data.decode().splitlines()
    at = [i for i, line in enumerate(lines) if line.startswith("odom3 ")]
    for i in at[50:55]:
        words = lines[i].split()
        words[2] = "655.35"
        lines[i] = " ".join(words)
    (tmp_path / "Input.txt").write_text("\n".join(lines))
    found = read_recording(tmp_path / "Input.txt")
    assert found.tables["odometry"]["speed_mps"].notna().sum() == len(at) - 5
    assert any("speed_mps: 5 values are not m/s" in loss for loss in found.losses)


def test_speeds_of_vehicles_are_kept():
    rows = good_rows()
    kept, notes = usable_rows(rows)
    assert kept is rows
    assert notes == ()
    # A sensor that drops to zero, by steps of 1 km/h: what stands between is the good part.
    speed = np.where(np.arange(TIME_S.size) % 40 < 3, 0.0, 100 / 3.6)
    assert len(usable_rows(rows.assign(speed_mps=speed))[0]) == len(rows)
    # A fast car comes to its speed, and stays there.
    speed = np.minimum(3.0 * TIME_S, 75.0)
    assert len(usable_rows(rows.assign(speed_mps=speed))[0]) == len(rows)


def test_recordings_may_begin_and_end_without_values():
    early, late = TIME_S < 2.0, TIME_S > 57.0
    speed = np.where(early | late, 71.11, SPEED_MPS)
    kept, notes = usable_rows(good_rows().assign(speed_mps=speed))
    assert len(kept) == len(TIME_S) - int((early | late).sum())
    assert "50 speeds" in notes[0] or "49 speeds" in notes[0]
    assert usable_rows(good_rows().iloc[:2])[1] == ()


def test_yaw_rates_missing_for_longer_stay_missing():
    rate = np.where((TIME_S > 10.0) & (TIME_S < 14.0), np.nan, RATE_RADPS)
    kept, _ = usable_rows(good_rows().assign(yaw_rate_radps=rate))
    missing = kept["yaw_rate_radps"].isna().to_numpy()
    assert missing[120]
    assert not missing[TIME_S < 10.0].any()
