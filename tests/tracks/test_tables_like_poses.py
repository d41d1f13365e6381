"""Tables with as many numbers a line as poses have, and poses below headers."""

import pytest

from mapfilter.tracks.readers.formats import read_recording

SENSORS = "0,0,9.8,0.1,0.2,0.3"


@pytest.mark.parametrize(
    ("header", "row", "table"),
    [
        (
            "Time (sec), Latitude (deg), Longitude (deg), Altitude (m), Bearing (deg), "
            "GPS speed (km/h), Vehicle speed (km/h), Engine RPM (RPM)",
            "{}.0, -34.9, -56.{}, 20, 90.0, 30.5, 31, 1500",
            "odometry",
        ),
        (
            '"time","latitude","longitude","accuracy","steps","compass_deg","battery","hdop"',
            "{},-34.9,-56.{},5,1,90,80,1",
            "positions",
        ),
        (
            "# time,latitude,longitude,accuracy,steps,compass_deg,battery,hdop",
            "{},-34.9,-56.{},5,1,90,80,1",
            "positions",
        ),
        ("time,latitude,longitude,steps,qx,qy,qz,qw", "{},-34.9,-56.{},1,0,0,0,1", "orientation"),
        ("time,lat,lon,fix,gyro_x,gyro_y,gyro_z,hdop", "{},-34.9,-56.{},1,0,0,0,0", "gyroscope"),
        ("time,acc x,acc y,acc z,gyro x,gyro y,gyro z,light", f"{{}},{SENSORS},1{{}}", "gyroscope"),
        (
            "Time [s],Lat [deg],Lon [deg],Alt [m],acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,hdop,fix",
            f"{{}},-34.9,-56.{{}},20,{SENSORS},1,1",
            "accelerometer",
        ),
    ],
)
def test_tables_of_eight_or_twelve_numbers_are_no_poses(tmp_path, header, row, table):
    path = tmp_path / "drive.csv"
    rows = (row.format(second, second + 10) for second in range(60))
    path.write_text("\n".join([header, *rows]) + "\n")
    recording = read_recording(path)
    assert recording.program == "CSV"
    assert len(recording.tables[table]) == 60


@pytest.mark.parametrize(
    ("header", "separator"),
    [
        ("# timestamp tx ty tz qx qy qz qw", " "),
        ("time x y z qx qy qz qw", " "),
        ('"time","x","y","z","qx","qy","qz","qw"', ","),
        ("timestamp [s], pos_x [m], pos_y [m], pos_z [m], q_x, q_y, q_z, q_w", ","),
        ("time;tx;ty;tz;qx;qy;qz;qw", ";"),
        ("0.0 0 0 0 0 0 0 0", " "),
    ],
)
def test_poses_below_a_header_are_poses(tmp_path, header, separator):
    path = tmp_path / "poses.txt"
    rows = (f"{second} {second} 0 0 0 0 0 1".replace(" ", separator) for second in range(1, 60))
    path.write_text("\n".join([header, *rows]) + "\n")
    assert len(read_recording(path).tables["poses"]) == 59
