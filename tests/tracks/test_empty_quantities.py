"""Plain CSV in which a quantity has several columns, and the first one of them is empty."""

import pytest

from mapfilter.tracks.readers.formats import read_recording


def read(tmp_path, header, row, count=20):
    path = tmp_path / "log.csv"
    rows = [f"2026-05-01T10:00:{i:02d}Z,{row.format(i=i, m=10 * i)}" for i in range(count)]
    path.write_text("\n".join([f"time,{header}", *rows]) + "\n")
    return read_recording(path)


@pytest.mark.parametrize(
    ("header", "row", "table", "column", "value"),
    [
        ("steps,turn_deg,turn_rad", "{i},,0.1", "turns", "turn_rad", 0.1),
        ("steps,yaw_rate_degps,yaw_rate_radps", "{i},,0.1", "turns", "yaw_rate_radps", 0.1),
        ("wheel_speed_kmh,wheel_speed_mps,yaw_rate_radps", ",10,0.1", "odometry", "speed_mps", 10),
        ("wheel_speed_mps,odometer_m,yaw_rate_radps", ",{m},0.1", "odometry", "speed_mps", 10),
        ("odometer_m,odometer_km,yaw_rate_radps", ",0.{i:02d},0.1", "odometry", "speed_mps", 10),
        ("wheel_speed_mps,speed_mps,yaw_rate_radps", ",10,0.1", "odometry", "speed_mps", 10),
        ("lat_deg,lon_deg,speed_kmh,speed_mps", "50.12{i},8.12,,10", "positions", "speed_mps", 10),
    ],
)
def test_an_empty_column_leaves_a_quantity_to_the_next(tmp_path, header, row, table, column, value):
    """Turns and speeds were lost."""
    found = read(tmp_path, header, row).tables[table]
    assert found[column].tolist()[2:-2] == pytest.approx([value] * (len(found) - 4))


def test_a_speed_beside_positions_and_an_empty_one_of_wheels_is_the_receivers(tmp_path):
    header = "lat_deg,lon_deg,speed_mps,wheel_speed_mps,yaw_rate_radps"
    assert set(read(tmp_path, header, "50.12{i},8.12,10,,0.1").tables) == {"positions"}


def test_steps_beside_places_are_noted_as_not_used(tmp_path):
    found = read(tmp_path, "east_m,north_m,step_m", "{i},0,1")
    assert set(found.tables) == {"places"}
    assert any("columns not used: step_m" in note for note in found.ignored)


def test_a_sensor_without_its_first_axis_is_noted(tmp_path):
    found = read(tmp_path, "steps,acc_x,acc_y,acc_z", "{i},,0.1,9.8")
    assert [str(one).partition(" (")[0] for one in found.unusable] == [
        "20 rows: x_mps2: missing, or no number"
    ]
