"""Good recordings that resemble mistakes: what can be used of them is read, with a note."""

import numpy as np
import pandas as pd
import pytest
from made_recordings import COUNT, MADE

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.readers.formats import read_recording


@pytest.fixture
def upload(tmp_path):
    """Read the made upload to OpenCellID with other levels and another technology."""

    def of(levels, technology=None):
        head, *rows = MADE["opencellid"][1].splitlines()
        names = head.split(",")
        lines = [row.split(",") for row in rows]
        for line, level in zip(lines, levels, strict=True):
            line[names.index("signal")] = str(level)
            line[names.index("cellid")] = "11702"
            if technology is not None:
                line[names.index("act")] = technology
        path = tmp_path / "upload.csv"
        path.write_text("\n".join([head, *map(",".join, lines)]) + "\n")
        return read_recording(path)

    return of


def asu(low, high):
    return np.arange(COUNT) % (high - low + 1) + low


@pytest.mark.parametrize(
    ("technology", "levels"),
    [("", asu(5, 30)), ("NR", asu(41, 89)), ("NR", asu(60, 120)), ("GSM", asu(32, 59))],
    ids=["unknown", "NR", "NR, strong", "LTE called GSM"],
)
def test_units_that_are_no_levels_lose_only_the_levels(technology, levels, upload):
    found = upload(levels, technology)
    radio = found.tables["radio"]
    assert radio["level_dbm"].isna().all()
    assert radio["cell"].notna().sum() == COUNT
    assert len(found.tables["positions"]) == COUNT
    told = f"radio, level_dbm: {COUNT} levels as ASU of an unknown technology, or beyond its scale"
    assert any(note.startswith(told) for note in found.ignored)


@pytest.mark.parametrize("stray", [127, 120])
@pytest.mark.parametrize("low", [20, 55])
def test_a_stray_value_among_units_costs_its_level_only(stray, low, upload):
    levels = asu(low, low + 39)
    levels[17] = stray
    found = upload(levels)
    level_dbm = found.tables["radio"]["level_dbm"]
    assert level_dbm.isna().sum() == 1
    assert (level_dbm.dropna() == np.delete(levels, 17) - 140).all()
    assert any("1 level as ASU" in note for note in found.ignored)


def test_weak_units_with_many_odd_ones_are_no_levels_without_sign(upload):
    levels = np.where(np.arange(COUNT) % 10 == 0, 127, asu(20, 59))
    assert upload(levels).tables["radio"]["level_dbm"].notna().sum() == COUNT - 3
    with pytest.raises(InputError, match="a lost sign"):
        upload(asu(80, 110))


@pytest.fixture
def drive(tmp_path):
    """Read the table of a drive of 60 rows with other columns."""
    frame = pd.DataFrame({"time": 1_777_629_600 + np.arange(60), "step_m": 8.0, "turn_rad": 0.05})
    levels = {"mcc": 244, "mnc": 91, "lac": 3021, "ci": 11801, "level_dbm": -75}

    def of(**columns):
        path = tmp_path / "drive.csv"
        frame.assign(**(levels | columns)).to_csv(path, index=False)
        return read_recording(path)

    return of


ROW = np.arange(60)
RECEIVED = (-60 - ROW % 30).astype(object)


@pytest.mark.parametrize("mark", [999, 400])
def test_a_compass_without_values_is_noted(mark, drive):
    found = drive(compass_deg=np.where(ROW % 9, mark, 359))
    assert (found.tables["motion"]["turn_rad"] == 0.05).all()
    assert any("compass_deg: 53 values are not degrees" in note for note in found.ignored)
    with pytest.raises(InputError, match="compass_deg"):
        drive(compass_deg=370 + ROW)


@pytest.mark.parametrize("mark", [32767, -999, 70, "unknown", "n/a", "?", "no signal", "1.#QNAN"])
def test_levels_that_are_mostly_unavailable_are_noted(mark, drive):
    found = drive(level_dbm=np.where(ROW % 3, mark, RECEIVED))
    levels = found.tables["radio"]["level_dbm"]
    assert levels.dropna().tolist() == RECEIVED[ROW % 3 == 0].tolist()
    assert any("level_dbm: 40 values are" in note for note in found.ignored)


def test_marks_of_several_kinds_are_no_levels(drive):
    found = drive(level_dbm=np.choose(ROW % 4, [RECEIVED, 999, -9999, 32767]))
    assert found.tables["radio"]["level_dbm"].notna().sum() == 15


def test_units_beside_words_are_refused(drive):
    levels = np.where(ROW % 3, [f"{level} dB" for level in RECEIVED], "unknown")
    with pytest.raises(InputError, match=r"found 40 of 40 values .* '-61 dB' .*unit in each"):
        drive(level_dbm=levels)


def test_where_a_file_is_cut_into_parts_does_not_matter(drive, monkeypatch):
    levels = np.where(ROW < 20, [f"{level} dB" for level in RECEIVED], RECEIVED)
    levels[32:] = "NaN"
    for part_bytes in (1 << 24, 700):
        monkeypatch.setattr("mapfilter.tracks.readers.texts.text._PART_BYTES", part_bytes)
        with pytest.raises(InputError, match="found 20 of 32 values"):
            drive(level_dbm=levels)


def test_unwrapped_headings_are_wrapped(drive, monkeypatch):
    heading = np.linspace(0.0, 19.8, 60)
    told = "motion, heading_rad: 41 values beyond a turn, wrapped (unwrapped)"
    for part_bytes in (1 << 24, 700):
        monkeypatch.setattr("mapfilter.tracks.readers.texts.text._PART_BYTES", part_bytes)
        found = drive(heading_rad=heading)
        kept = found.tables["motion"]["heading_rad"].to_numpy()
        assert np.cos(kept - heading) == pytest.approx(1.0)
        assert np.abs(kept).max() <= 6.3
        assert not found.ignored
        assert told in found.notes or part_bytes == 700
    # Strays are left out, and cut off files stay in doubt.
    heading[[20, 50]] = 999.0
    found = drive(heading_rad=heading)
    assert found.tables["motion"]["heading_rad"].isna().sum() == 2
    found = drive(heading_rad=12.0 + heading)
    assert found.tables["motion"]["heading_rad"].isna().all()
    told = "likely: unwrapped headings that begin beyond a turn, or degrees given for radians"
    assert all("values are not radians" in note and told in note for note in found.ignored)
    assert found.ignored


@pytest.mark.parametrize("begin", [-3000.0, -100.0, 0.0, 939.05])
@pytest.mark.parametrize("part_bytes", [1 << 24, 700])
def test_unwrapped_azimuths_are_wrapped(begin, part_bytes, drive, monkeypatch):
    """Such columns were refused."""
    azimuth = begin + np.linspace(0.0, 500.3, 60)
    monkeypatch.setattr("mapfilter.tracks.readers.texts.text._PART_BYTES", part_bytes)
    found = drive(compass_deg=azimuth)
    kept = found.tables["motion"]["compass_deg"].to_numpy()
    np.testing.assert_allclose(np.exp(1j * np.radians(kept - azimuth)), 1.0)
    assert (np.abs(kept) <= 360).all()
    assert any("beyond a turn, wrapped (unwrapped)" in note for note in found.notes)
    assert not found.ignored


@pytest.mark.parametrize("step", [0.5, 170.0])
def test_azimuths_too_large_to_be_unwrapped_are_refused(step, drive):
    with pytest.raises(InputError, match=r"compass_deg: expected degrees in -180\.\.360"):
        drive(compass_deg=3700.25 + step * ROW)


def test_azimuths_that_jump_beyond_a_turn_are_refused(drive):
    with pytest.raises(InputError, match=r"compass_deg: expected degrees in -180\.\.360"):
        drive(compass_deg=400.5 + 200 * (ROW % 2))


@pytest.mark.parametrize(
    "degrees",
    [ROW + 1, (7.3 * ROW) % 360, np.repeat([30.4, 120.2, 211.9, 300.3], 15) + 4 * np.sin(5 * ROW)],
    ids=["whole", "circle", "block"],
)
def test_degrees_that_can_be_no_radians_are_refused(degrees, drive):
    with pytest.raises(InputError, match=r"heading_rad: expected radians .*degrees given for"):
        drive(heading_rad=degrees)


AZIMUTH_DEG = np.repeat([20.0, 110.0, 65.0, 160.0, 20.0], 12)


def log_notes(folder, azimuth_deg, east_m, north_m):
    """Return the notes of a log of steps with a compass, and of a truth in metres."""
    time_s = 1_777_629_600 + np.arange(60)
    steps = pd.DataFrame({"time": time_s, "step_m": 1.4, "compass_deg": azimuth_deg})
    truth = pd.DataFrame({"time": time_s, "east_m": east_m, "north_m": north_m})
    steps.to_csv(folder / "steps.csv", index=False)
    truth.to_csv(folder / "truth.csv", index=False)
    paths = [folder / "steps.csv", folder / "truth.csv"]
    return mf.read_log(paths, crs="EPSG:32635", truth=paths[1]).notes


def test_azimuths_that_run_the_other_way_round_are_told(tmp_path):
    east, north = (np.cumsum(1.4 * way(np.radians(AZIMUTH_DEG))) for way in (np.sin, np.cos))
    place = 385_900.0 + east, 6_671_900.0 + north
    told = "motion, heading_rad: headings run clockwise"
    assert any(n.startswith(told) for n in log_notes(tmp_path, -AZIMUTH_DEG % 360, *place))
    assert any(n.startswith(told) for n in log_notes(tmp_path, (40 - AZIMUTH_DEG) % 360, *place))
    assert not any(n.startswith(told) for n in log_notes(tmp_path, AZIMUTH_DEG, *place))


@pytest.fixture
def copied(tmp_path):
    """Read positions of which a copy ends otherwise."""

    def of(end):
        rows = "".join(f"{1_777_629_600 + n},24.93{n:05d},60.17{n:05d}\n" for n in range(30))
        path = tmp_path / "track.csv"
        path.write_bytes(b"timestamp,lon,lat\n" + rows.encode() + end)
        found = read_recording(path)
        return len(found.tables["positions"]), list(found.remarks)

    return of


@pytest.mark.parametrize(
    ("end", "count", "what"),
    [
        (b"1777629630,24.9300030,60.1700030", 31, None),
        (b"1777629630,24.9300030,60", 30, "cut off within its last number (60, without a line end"),
        (bytes(5000), 30, "5000 zero bytes at the end (line 32) left out"),
        (b"1777629630,24.9300030,60\0", 30, "left out, with the unfinished row before them"),
    ],
)
def test_a_copy_that_was_cut_off_loses_its_last_row_only(copied, end, count, what):
    found, notes = copied(end)
    assert found == count
    assert len(notes) == (what is not None)
    assert what is None or what in notes[0]


@pytest.mark.parametrize("cut", [b"\n", b""])
def test_of_a_large_table_read_in_parts_the_end_is_cut(copied, cut, monkeypatch):
    monkeypatch.setattr("mapfilter.tracks.readers.texts.text._PART_BYTES", 600)
    found, notes = copied(b"1777629630,24.9300030,60" + cut)
    assert found == 30 + bool(cut)
    assert [note.endswith("without a line end) (line 32)") for note in notes] == [True] * (not cut)


def test_units_behind_values_do_not_depend_on_the_parts_of_a_file(drive, monkeypatch):
    levels = np.where(ROW < 20, [f"{level} dBm" for level in RECEIVED], RECEIVED)
    for part_bytes in (1 << 24, 700):
        monkeypatch.setattr("mapfilter.tracks.readers.texts.text._PART_BYTES", part_bytes)
        found = drive(level_dbm=levels).tables["radio"]["level_dbm"]
        assert found.tolist() == RECEIVED.tolist()
        turned = drive(level_dbm=levels[::-1])
        assert turned.tables["radio"]["level_dbm"].notna().sum() == 40
        assert "level_dbm: 20 values are no numbers" in " ".join(turned.ignored)
