"""Motion that the positions of its log disprove is refused, and mended by a factor."""

import numpy as np
import pandas as pd
import pytest
from command_line import assert_done, assert_refused, mapfilter, settings

import mapfilter as mf
from mapfilter.errors import ConfigError, InputError
from mapfilter.positioning.estimate_store import read_estimate

COUNT, JAMMED = 340, 220
METRES_PER_DEGREE = 111_195.0
EKF = ["--filter", "ekf", *settings(output__pictures="none")]


@pytest.fixture
def drive(tmp_path):
    """Seconds at 10 m/s with corners to both sides; positions end. Returns its true way."""
    time_s = np.arange(float(COUNT))
    side = np.resize([1, 1, -1, -1, 1, -1], COUNT // 25 + 1)[(time_s // 25).astype(int)]
    turn = np.where(time_s % 25 >= 16, np.pi / 18, 0.0) * side
    heading = np.cumsum(turn) - turn / 2
    east_m, north_m = np.cumsum(10 * np.cos(heading)), np.cumsum(10 * np.sin(heading))
    scatter = np.random.default_rng(3).normal(0, 2 / METRES_PER_DEGREE, (2, COUNT))
    places = pd.DataFrame(
        {
            "time": 1.78e9 + time_s,
            "latitude": 60 + north_m / METRES_PER_DEGREE,
            "longitude": 25 + 2 * east_m / METRES_PER_DEGREE,
        }
    )
    places.to_csv(tmp_path / "truth.csv", index=False)
    places[["latitude", "longitude"]] += scatter.T
    places[:JAMMED].to_csv(tmp_path / "fixes.csv", index=False)
    rows = {"time": 1.78e9 + time_s, "speed_mps": 10.0, "yaw_rate_radps": turn}
    return pd.DataFrame(rows)


@pytest.fixture
def replay(tmp_path):
    def of(rows, *more):
        rows.to_csv(tmp_path / "odometry.csv", index=False)
        names = ["--log", tmp_path / "fixes.csv", "--log", tmp_path / "odometry.csv"]
        names += ["--truth", tmp_path / "truth.csv", "--out", tmp_path / "out"]
        return mapfilter("replay", *EKF, *names, "--json", *more)

    return of


def test_turns_the_other_way_round_are_refused_and_mended(drive, replay, tmp_path):
    right = assert_done(replay(drive)).json
    wrong = drive.assign(yaw_rate_radps=-drive["yaw_rate_radps"])
    outcome = replay(wrong)
    assert_refused(
        outcome, "odometry.csv, motion, turn_rad", "turns run clockwise", "--factor turn_rad=-1"
    )
    assert outcome.err.count("mapfilter: error: ") == 1
    mended = assert_done(replay(wrong, "--factor", "turn_rad=-1")).json
    assert mended["error_95_m"] == pytest.approx(right["error_95_m"], abs=1.0)
    assert "motion, turn_rad: times -1, as given" in mended["notes"]
    taken = assert_done(replay(wrong, "--factor", "turn_rad=1")).json
    assert any("turns run clockwise" in note for note in taken["notes"])
    assert len(read_estimate(tmp_path / "out" / "estimate.parquet")) == COUNT


def test_the_front_door_refuses_what_replay_does(drive, replay, tmp_path):
    wrong = drive.assign(yaw_rate_radps=-drive["yaw_rate_radps"])
    outcome = replay(wrong)
    told = "turns run clockwise by the course of the positions (likely: {}"
    assert_refused(outcome, told.format("--factor turn_rad=-1 mends it; --factor turn_rad=1"))
    names = [tmp_path / "fixes.csv", tmp_path / "odometry.csv"]
    log = mf.read_log(names, truth=tmp_path / "truth.csv")
    mf.write_log(log, tmp_path / "log")
    cause = told.format('factors={"turn_rad": -1} mends it; factors={"turn_rad": 1} takes it as')
    for given, where in ((log, "log"), (tmp_path / "log", str(tmp_path / "log"))):
        with pytest.raises(InputError) as refused:
            mf.locate(given, filter="ekf")
        assert str(refused.value).startswith(f"{where}, motion, turn_rad: expected radians")
        assert cause in str(refused.value)
        mended = mf.locate(given, filter="ekf", factors={"turn_rad": -1})
        assert mf.score(mended, log.truth).error_95_m < 20
        kept = mf.locate(given, filter="ekf", factors={"turn_rad": 1})
        assert mf.score(kept, log.truth).error_95_m > 100
    with pytest.raises(ConfigError, match=r"^factors: expected one of heading_rad"):
        mf.locate(log, filter="ekf", factors={"turn": -1})
    with pytest.raises(ConfigError, match="locate, factors"):
        mf.locate(log, filter="ekf", factors=-1)


def test_the_front_door_names_the_column_of_compass_degrees(drive, replay, tmp_path):
    heading = np.cumsum(drive["yaw_rate_radps"])
    replay(drive[["time"]].assign(step_m=10.0, heading_rad=np.pi / 2 - heading))
    names = [tmp_path / "fixes.csv", tmp_path / "odometry.csv"]
    with pytest.raises(InputError, match="headings run clockwise") as refused:
        mf.locate(mf.read_log(names), filter="ekf")
    assert 'columns={"compass_deg": "COLUMN"}) of the recording mends it' in str(refused.value)
    mended = mf.read_log(names, columns={"compass_deg": "heading_rad"})
    assert len(mf.locate(mended, filter="ekf")) == COUNT


def test_steps_in_another_unit_are_refused_and_mended(drive, replay):
    wrong = drive.assign(speed_mps=36.0)
    outcome = replay(wrong)
    assert_refused(outcome, "motion, step_m", "3.59 times as long", "--factor step_m=0.2778")
    assert_done(replay(wrong, "--factor", "step_m=0.2778"))


def test_a_track_log_is_mended_when_it_is_converted_or_replayed(drive, tmp_path):
    wrong = drive.assign(yaw_rate_radps=-drive["yaw_rate_radps"])
    wrong.to_csv(tmp_path / "odometry.csv", index=False)
    names = [tmp_path / "fixes.csv", tmp_path / "odometry.csv"]
    noted = assert_done(mapfilter("convert", *names, "--out", tmp_path / "wrong"))
    assert "(--factor turn_rad=-1 mends it)" in noted.out
    given = ["--factor", "turn_rad=-1"]
    mended = assert_done(mapfilter("convert", *names, *given, "--out", tmp_path / "mended"))
    assert "turns run" not in mended.out
    ekf = [*EKF, "--out", tmp_path / "out"]
    assert_refused(mapfilter("replay", "--log", tmp_path / "wrong", *ekf), "turns run clockwise")
    assert_done(mapfilter("replay", "--log", tmp_path / "mended", *ekf))
    assert_done(mapfilter("replay", "--log", tmp_path / "wrong", *given, *ekf))
    log = mf.read_log(tmp_path / "wrong", factors={"turn_rad": -1})
    expected = mf.read_log(tmp_path / "mended").motion["turn_rad"]
    assert np.allclose(log.motion["turn_rad"], expected, equal_nan=True)
    assert not any("turns run" in note for note in log.notes)


def test_headings_by_a_compass_are_refused_with_the_column_that_mends_them(drive, replay, tmp_path):
    heading = np.cumsum(drive["yaw_rate_radps"])
    rows = drive[["time"]].assign(step_m=10.0, heading_rad=np.pi / 2 - heading)
    outcome = replay(rows)
    assert_refused(outcome, "headings run clockwise from north", "--column compass_deg=COLUMN")
    assert_done(replay(rows, "--column", "compass_deg=heading_rad"))
    # A log that was made of it takes no columns of a recording.
    names = [tmp_path / "fixes.csv", tmp_path / "odometry.csv"]
    assert_done(mapfilter("convert", *names, "--out", tmp_path / "log"))
    ekf = [*EKF, "--out", tmp_path / "of-log"]
    outcome = mapfilter("replay", "--log", tmp_path / "log", *ekf)
    remedy = "convert the recording again with --column compass_deg=COLUMN, or write heading_rad as"
    assert_refused(outcome, remedy)


def test_azimuths_counter_clockwise_are_refused_unless_they_are_given_as_right(
    drive, replay, tmp_path
):
    fixes = pd.read_csv(tmp_path / "fixes.csv")
    fixes.drop(range(70, 160)).to_csv(tmp_path / "fixes.csv", index=False)
    heading = np.cumsum(drive["yaw_rate_radps"])
    azimuth_deg = 90 - np.degrees(heading)
    right = drive[["time"]].assign(step_m=10.0, compass_deg=azimuth_deg % 360)
    assert_done(replay(right))
    wrong = right.assign(compass_deg=-azimuth_deg % 360)
    told = (
        "odometry.csv, motion, heading_rad: expected courses of the positions, found headings of a "
        "compass that are their mirror image (likely: a lost sign of longitude, or azimuths that "
        "run counter-clockwise; --factor heading_rad=1 takes it as it is)"
    )
    assert_refused(replay(wrong), told)
    taken = assert_done(replay(wrong, "--factor", "heading_rad=1")).json
    assert any("positions are a mirror image of the way" in note for note in taken["notes"])
    log = mf.read_log([tmp_path / "fixes.csv", tmp_path / "odometry.csv"])
    with pytest.raises(InputError, match=r'clockwise; factors=\{"heading_rad": 1\} takes it'):
        mf.locate(log, filter="ekf")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("turn_rad", "expected NAME=VALUE"),
        ("turn=-1", "expected one of heading_rad, turn_rad, step_m"),
        ("turn_rad=0", "expected a number other than 0"),
        ("turn_rad=left", "expected 1 numbers"),
    ],
)
def test_factors_that_are_none(replay, drive, text, told):
    assert_refused(replay(drive, "--factor", text), told)


def test_a_factor_of_motion_that_is_not_there(drive, replay, tmp_path):
    outcome = replay(drive, "--factor", "heading_rad=-1")
    assert_refused(outcome, "expected motion with heading_rad, found none")
    with pytest.raises(ConfigError, match=r"^factors turn_rad: expected a number other than 0"):
        mf.read_log(tmp_path / "fixes.csv", factors={"turn_rad": 0})


def test_what_ground_truth_alone_shows_is_noted(drive, replay, tmp_path):
    """A filter is judged by it, also with faults that are meant."""
    few = pd.read_csv(tmp_path / "fixes.csv")[:60]
    few.to_csv(tmp_path / "fixes.csv", index=False)
    outcome = replay(drive.assign(yaw_rate_radps=-drive["yaw_rate_radps"]))
    notes = assert_done(outcome).json["notes"]
    assert any("turns run clockwise" in note for note in notes)
