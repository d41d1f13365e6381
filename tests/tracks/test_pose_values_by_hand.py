"""Poses, smartLoc and the indoor competition by hand: turns, frames, slots and ages."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.joining.sampling import sampling_sd_m
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.smartloc import _deviation, _geodetic, _satellites

START_S = 1_777_629_600
NAN = np.nan
HALF = 0.5**0.5


@pytest.fixture
def read(tmp_path):
    def of(name, *lines):
        (tmp_path / name).write_text("\n".join(lines) + "\n")
        return read_recording(tmp_path / name)

    return of


def test_rows_of_kitti_are_a_matrix_of_turn_and_place(read):
    """A quarter turn about y, and none; a frame every 0.1 s."""
    found = read("00.txt", "1 0 0 1.5 0 1 0 -2.5 0 0 1 3.5", "0 0 1 10 0 1 0 20 -1 0 0 30",
                 "1 0 0 0 0 1 0 0 0 0 1 1").tables["poses"]  # fmt: skip
    assert found[["x_m", "y_m", "z_m"]].to_numpy().tolist()[:2] == [[1.5, -2.5, 3.5], [10, 20, 30]]
    quaternions = found[["qx", "qy", "qz", "qw"]].to_numpy()
    assert quaternions[:2] == pytest.approx(np.array([[0, 0, 0, 1], [0, HALF, 0, HALF]]))
    assert found["time_s"].tolist() == pytest.approx([0.0, 0.1, 0.2])


def test_a_mirror_image_is_no_pose(read):
    good = "1 0 0 0 0 1 0 0 0 0 1 0"
    found = read("00.txt", good, "1 0 0 0 0 1 0 0 0 0 -1 0", "1.03 0 0 0 0 1 0 0 0 0 1 0", good)
    assert len(found.tables["poses"]) == 2
    assert [one.lines for one in found.unusable] == [(2, 3)]


@pytest.mark.parametrize(
    ("scalar", "is_pose"), [(0.951, True), (1.009, True), (0.949, False), (1.06, False)]
)
def test_quaternions_are_of_length_1(read, scalar, is_pose):
    lines = [f"{i}.0 1 2 3 0 0 0 1" for i in range(3)]
    found = read("a.txt", *lines, f"3.0 4 5 6 0 0 0 {scalar}")
    assert len(found.tables["poses"]) == 3 + is_pose


def test_times_of_tum_above_1e8_are_unix_times(read):
    """Those of 1973 are none of a recording; below they count from an unknown start."""
    pose = " 1 2 3 0 0 0 1"
    found = read("a.txt", *(f"99999999.{i}{pose}" for i in range(5)))
    assert found.clock.kind == "monotonic"
    assert len(found.tables["poses"]) == 5
    with pytest.raises(InputError, match="time: not between 1980 and 2100"):
        read("a.txt", *(f"100000001.{i}{pose}" for i in range(5)))
    assert read("a.txt", *(f"{START_S}.{i}{pose}" for i in range(5))).clock.kind == "utc"


def test_a_header_may_have_the_scalar_first(read):
    found = read("a.txt", "# time x y z qw qx qy qz", f"0.0 1 2 3 {HALF:.7f} 0 0 {HALF:.7f}",
                 "1.0 1 2 3 1 0 0 0").tables["poses"]  # fmt: skip
    quaternions = found[["qx", "qy", "qz", "qw"]].to_numpy()
    assert quaternions == pytest.approx(np.array([[0, 0, HALF, HALF], [0, 0, 0, 1]]), abs=1e-6)


@pytest.mark.parametrize(
    ("system", "number", "name"),
    [
        # Constellations 1, 2, 4, 8, 16 and 32; from 301, and of GLONASS from 65, slots begin anew.
        *((1, 7, "G07"), (2, 120, "S20"), (2, 33, "S33"), (4, 65, "R01"), (4, 24, "R24")),
        *((4, 301, "R01"), (4, 324, "R24"), (8, 311, "E11"), (16, 301, "J01"), (32, 20, "C20")),
        *((1, 0, None), (1, 100, None), (1, 7.5, None), (3, 7, None), (1, 1000, None)),
        *((8, 300, None), (4, 64, "R64")),
    ],
)
def test_names_of_satellites_of_smartloc(system, number, name):
    assert _satellites(np.array([float(system)]), np.array([float(number)])).tolist() == [name]


def test_places_of_smartloc_on_the_ground():
    """Of WGS 84 the equator is at 6378137 m, the pole at 6356752.3 m."""
    place_m = np.array(
        [[6_378_137.0, 0, 6_378_237, 6.1e6, 6.6e6], [0, 0, 0, 0, 0], [0, 6_356_752.3142, 0, 0, 0]]
    )
    lon, lat, altitude = _geodetic(place_m)
    assert lon.tolist()[::2] == pytest.approx([0, 0, NAN], abs=1e-6, nan_ok=True)
    assert lat.tolist() == pytest.approx([0, 90, 0, NAN, NAN], abs=1e-6, nan_ok=True)
    assert altitude.tolist() == pytest.approx([0, 0, 100, NAN, NAN], abs=1e-3, nan_ok=True)
    assert _deviation(np.array([0.0025, 0.0, -1.0])).tolist() == pytest.approx(
        [0.05, 0, NAN], abs=1e-6, nan_ok=True
    )


def test_rows_of_smartloc(read):
    """Speeds and rates with variances; ranges with a variance, C/N0 and the satellite's place."""
    odometry = "odom3 0.5 2.25 0.1 0.2 0.3 0.4 0.05 0.04 1 1 1 1 0.0009"
    place = "pseudorange3 0.5 23653438.8 25 14056711.07 22357508.04 4819715.57 7 1 22.05 38"
    found = read("Input.txt", odometry, place, place.replace(" 25 ", " 0 ").replace("0.5", "1.5"))
    (row,) = found.tables["odometry"].to_dict("records")
    assert (row["speed_mps"], row["yaw_rate_radps"]) == (2.25, 0.05)
    assert (row["speed_sd_mps"], row["yaw_rate_sd_radps"]) == pytest.approx((0.2, 0.03))
    # A variance of 0 states none.
    assert found.ignored == ()
    ranges = found.tables["satellites"]
    assert ranges["satellite"].tolist() == ["G07", "G07"]
    assert ranges["sigma_m"].tolist() == pytest.approx([5, NAN], abs=1e-6, nan_ok=True)
    assert ranges["cn0_dbhz"].tolist() == [38, 38]
    assert ranges["pseudorange_m"].tolist() == [23_653_438.8] * 2
    # The earth turns by 7.292e-5 rad/s while the signal is under way for 78.9 ms.
    turn_rad = 7.2921151467e-5 * 23_653_438.8 / 299_792_458
    east = 14_056_711.07 * np.cos(turn_rad) + 22_357_508.04 * np.sin(turn_rad)
    assert ranges["x_m"].iloc[0] == pytest.approx(east, abs=0.01)
    assert ranges["z_m"].iloc[0] == 4_819_715.57


def test_readings_of_the_indoor_competition(read):
    """Android's rotation vector has the sines of the half turn; its scalar is what is left to 1."""
    ms = START_S * 1000
    found = read(
        "path.txt",
        f"#\tstartTime:{ms}",
        f"{ms}\tTYPE_ACCELEROMETER\t-1.25\t-0.5\t9.75\t2",
        f"{ms}\tTYPE_ROTATION_VECTOR\t0.0\t0.6\t0.0\t3",
        f"{ms}\tTYPE_WIFI\tshop\t0a:01\t-60\t5765\t{ms - 5000}",
        f"{ms}\tTYPE_WIFI\tshop\t0a:02\t-61\t5765\t{ms - 5001}",
        f"{ms}\tTYPE_BEACON\tABC\t1\t2\t-56\t-76\t9.5\tE0:78\t{ms}",
        f"{ms + 500}\tTYPE_WAYPOINT\t100.25\t50.5",
    )
    tables = found.tables
    forces = tables["accelerometer"][["x_mps2", "y_mps2", "z_mps2"]].to_numpy()
    assert forces.tolist() == [[-1.25, -0.5, 9.75]]
    assert tables["orientation"][["qy", "qw"]].to_numpy() == pytest.approx(np.array([[0.6, 0.8]]))
    radio = tables["radio"]
    assert dict(zip(radio["cell"], radio["level_dbm"], strict=True)) == {"0a:01": -60, "E0:78": -76}
    assert set(radio["technology"]) == {"WIFI", "BLE"}
    (way,) = tables["true_places"].to_dict("records")
    assert (way["time_s"], way["east_m"], way["north_m"]) == (START_S + 0.5, 100.25, 50.5)
    assert [one.lines for one in found.unusable] == [(5,)]


def test_steps_by_velocities_seconds_apart_err_by_their_change():
    """A change of 6 m/s within 10 s: T / (T + 5 s) of T · 6 / √12."""
    found = sampling_sd_m(np.array([0.0, 10.0]), np.array([0.0, 6.0]), np.zeros(2))
    assert found.tolist() == pytest.approx([10 / 15 * 10 * 6 / 12**0.5])
    # Half of its own squared change, and a quarter of each neighbour's.
    north = np.array([0.0, 0.0, 8.0, 8.0, NAN])
    found = sampling_sd_m(np.array([0.0, 1, 2, 3, 4]), np.zeros(5), north)
    squares = np.array([64 / 4, 64 / 2, 64 / 4])
    assert found.tolist() == pytest.approx([*(1 / 6 * np.sqrt(squares / 12)), 0])
