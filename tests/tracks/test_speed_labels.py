"""Speeds whose column states another unit than theirs, by the positions of the journey."""

import pytest

import mapfilter as mf

TRUE_MPS, MPH, KMH, KNOTS = 8.0, 0.44704, 1 / 3.6, 0.514444


def drive(tmp_path, column, value, positions="drive.csv"):
    """North for 100 s, then east, at 8 m/s; a yaw rate at the corner."""
    rows = []
    for at in range(200):
        lat, lon = 60.17 + min(at, 100) * 8 / 111_200, 24.94 + max(at - 100, 0) * 8 / 55_400
        time = f"2026-05-13T08:{at // 60:02d}:{at % 60:02d}Z"
        rows.append((time, f"{lat:.7f}", f"{lon:.7f}", f"{value:.3f}", "-90" if at == 100 else "0"))
    files = {positions: ("time,lat,lon", (0, 1, 2)), "drive.csv": (f"time,{column}", (0, 3))}
    if positions == "drive.csv":
        files = {"drive.csv": (f"time,lat,lon,{column}", (0, 1, 2, 3))}
    for name, (head, parts) in files.items():
        lines = [",".join(row[part] for part in parts) for row in rows]
        (tmp_path / name).write_text("\n".join([head, *lines]) + "\n")
    return mf.read_log([tmp_path / name for name in files])


@pytest.mark.parametrize(
    ("column", "unit", "told"),
    [
        ("Speed [km/h]", MPH, "mph in a column of km/h?"),
        ("Speed [mph]", KMH, "km/h in a column of mph?"),
        ("Speed [km/h]", KNOTS, "knots in a column of km/h?"),
        ("Speed [knots]", KMH, "km/h in a column of knots?"),
    ],
)
@pytest.mark.parametrize("positions", ["drive.csv", "phone.csv"])
def test_another_unit_than_the_header_states_is_noted(tmp_path, column, unit, told, positions):
    """Nothing was said, or not what is likely."""
    column = column if positions == "drive.csv" else f"Vehicle {column.lower()}"
    log = drive(tmp_path, column, TRUE_MPS / unit, positions)
    (note,) = [note for note in log.notes if told in note]
    assert note.startswith("drive.csv: ")
    if positions != "drive.csv":
        assert "drive.csv: wheel speed: " in note
        # Nothing is changed.
        stated = {"km/h": KMH, "mph": MPH, "knots": KNOTS}[column.partition("[")[2][:-1]]
        usual_m = TRUE_MPS / unit * stated
        assert log.motion["step_m"].median() == pytest.approx(usual_m, rel=1e-3)
        assert "factors={" in note or "--factor step_m=" in note


@pytest.mark.parametrize("times", [1.0, 0.95, 1.1, 1.3])
def test_speeds_of_worn_wheels_are_not_noted(tmp_path, times):
    log = drive(tmp_path, "Vehicle speed [km/h]", times * TRUE_MPS / KMH)
    assert not [note for note in log.notes if "in a column of" in note]
