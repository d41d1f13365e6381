"""Google's location history: of a phone, of an iPhone, and of an account (Takeout)."""

import json
import tracemalloc

import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.contained import json_tables
from mapfilter.tracks.readers.formats import format_of, read_recording
from mapfilter.tracks.readers.texts.text import Text

START_S = pd.Timestamp("2026-05-01T07:00:00Z").timestamp()


def stamp(second, day=1):
    return f"2026-05-{day:02d}T10:00:{second:02d}.000+03:00"


def read(folder, content, name="Timeline.json"):
    path = folder / name
    path.write_text(json.dumps(content), encoding="utf-8")
    return read_recording(path)


def position(second, lat):
    found = {"LatLng": f"{lat}°, 24.94°", "accuracyMeters": 13, "altitudeMeters": 20.5}
    return {"position": {**found, "source": "GPS", "timestamp": stamp(second),
                         "speedMetersPerSecond": 1.5}}  # fmt: skip


SCAN = {"deliveryTime": stamp(1), "devicesRecords": [
    {"mac": 187723572702975, "rawRssi": -61}, {"mac": 1, "rawRssi": -80}]}  # fmt: skip
SIGNALS = [
    position(0, 60.17),
    {"wifiScan": SCAN},
    {"activityRecord": {"probableActivities": [{"type": "WALKING", "confidence": 0.9}],
                        "timestamp": stamp(1)}},
    position(2, 60.1701),
]  # fmt: skip
SEGMENTS = [
    {"startTime": stamp(0, 2), "endTime": stamp(9, 2), "timelinePath": [
        {"point": "60.1800°, 24.9400°", "time": stamp(0, 2)},
        {"point": "60.1801000°, 24.9400°", "time": stamp(5, 2)}]},
    {"startTime": stamp(0), "endTime": stamp(9), "timelinePath": [
        {"point": "60.1700°, 24.9400°", "time": stamp(1)}]},
    {"startTime": stamp(10), "endTime": stamp(50), "visit": {"topCandidate": {
        "placeLocation": {"latLng": "60.17°, 24.94°"}}}},
    {"startTime": stamp(0), "endTime": stamp(9), "activity": {
        "start": {"latLng": "60.17°, 24.94°"}, "end": {"latLng": "60.1701°, 24.94°"}}},
]  # fmt: skip


def test_the_timeline_of_a_phone(tmp_path):
    """One of its lists was read as a table of names that mean nothing, or it was refused."""
    content = {"semanticSegments": SEGMENTS, "rawSignals": SIGNALS, "userLocationProfile": {}}
    found = read(tmp_path, content)
    places = found.tables["positions"]
    assert places["time_s"].tolist() == [
        START_S, START_S + 2, START_S + 86_400, START_S + 86_405]  # fmt: skip
    assert places["lat_deg"].tolist() == pytest.approx([60.17, 60.1701, 60.18, 60.1801])
    assert places["accuracy_m"].tolist()[:2] == [13.0, 13.0]
    assert places["speed_mps"].tolist()[:2] == [1.5, 1.5]
    radio = found.tables["radio"]
    assert radio["cell"].tolist() == ["aa:bb:cc:dd:ee:ff", "00:00:00:00:00:01"]
    assert radio["level_dbm"].tolist() == [-61.0, -80.0]
    assert radio["technology"].tolist() == ["WIFI"] * 2
    for note in ("holds no cells", "1 guess of the kind of motion left out", "1 visit left out",
                 "1 point of a path of a day that has positions left out"):  # fmt: skip
        assert any(note in one for one in found.notes), note


def test_the_timeline_of_an_iphone(tmp_path):
    content = [
        {"startTime": stamp(0), "endTime": stamp(59), "timelinePath": [
            {"point": "geo:60.17,24.94", "durationMinutesOffsetFromStartTime": "0"},
            {"point": "geo:60.1701,24.94", "durationMinutesOffsetFromStartTime": "3"}]},
        {"startTime": stamp(0), "endTime": stamp(59), "visit": {"topCandidate": {
            "placeLocation": "geo:60.17,24.94"}}},
    ]  # fmt: skip
    places = read(tmp_path, content, "location-history.json").tables["positions"]
    assert places["time_s"].tolist() == [START_S, START_S + 180]
    assert places["lat_deg"].tolist() == pytest.approx([60.17, 60.1701])


def test_records_of_an_account(tmp_path):
    """Access points were taken for levels of cells, and guesses of motion for rows."""
    record = {"latitudeE7": 601700000, "longitudeE7": 249400000, "accuracy": 20, "source": "WIFI"}
    guesses = [{"activity": [{"type": "WALKING", "confidence": 90}], "timestamp": stamp(0)}]
    points = [{"mac": "187723572702975", "strength": -65, "frequencyMhz": 0}]
    content = {"locations": [
        {**record, "timestamp": "2026-05-01T07:00:00.000Z", "activity": guesses,
         "wifiScan": {"accessPoints": points}},
        {**record, "timestampMs": f"{1000 * START_S + 5000:.0f}", "velocity": 2},
    ]}  # fmt: skip
    found = read(tmp_path, content, "Records.json")
    assert found.tables["positions"]["time_s"].tolist() == [START_S, START_S + 5]
    assert found.tables["positions"]["accuracy_m"].tolist() == [20.0, 20.0]
    assert found.tables["radio"]["cell"].tolist() == ["aa:bb:cc:dd:ee:ff"]
    assert found.tables["radio"]["level_dbm"].tolist() == [-65.0]
    assert any("1 guess of the kind of motion left out" in note for note in found.notes)


def test_semantic_history_of_an_account(tmp_path):
    way = {"points": [{"latE7": 601700000 + 1000 * at, "lngE7": 249400000, "accuracyMeters": 5,
                       "timestamp": stamp(at)} for at in range(3)]}  # fmt: skip
    span = {"startTimestamp": stamp(0), "endTimestamp": stamp(9)}
    ends = {f"{end}Location": {"latitudeE7": 601700000, "longitudeE7": 249400000}
            for end in ("start", "end")}  # fmt: skip
    segment = {**ends, "duration": span, "waypointPath": {"waypoints": [{"latE7": 1, "lngE7": 1}]}}
    visit = {"placeVisit": {"location": {"latitudeE7": 1, "longitudeE7": 2}, "duration": span}}
    content = {
        "timelineObjects": [{"activitySegment": {**segment, "simplifiedRawPath": way}}, visit]
    }
    found = read(tmp_path, content, "2026_MAY.json")
    assert found.tables["positions"]["time_s"].tolist() == [START_S + at for at in range(3)]
    assert any("1 waypoint without a time left out" in note for note in found.notes)
    found = read(tmp_path, {"timelineObjects": [{"activitySegment": segment}, visit]})
    assert found.tables["positions"]["time_s"].tolist() == [START_S, START_S + 9]
    assert any("2 positions: ends of segments, as Google inferred" in one for one in found.notes)
    with pytest.raises(InputError, match=r"Wi-Fi with times, found 1 visit \(Google's"):
        read(tmp_path, {"timelineObjects": [visit]})
    assert format_of(tmp_path / "Timeline.json") is None


def test_a_timeline_that_was_cut_off(tmp_path):
    whole = json.dumps({"rawSignals": [position(at, 60.17) for at in range(9)]})
    path = tmp_path / "Timeline.json"
    path.write_text(whole[:-100], encoding="utf-8")
    found = read_recording(path)
    assert len(found.tables["positions"]) == 8
    assert any("cut off or damaged" in note for note in found.notes)


def test_json_of_too_many_values_is_refused_before_it_is_read(tmp_path, monkeypatch):
    """A file of 256 MiB took some 6 GB."""
    monkeypatch.setattr(json_tables, "_MOST_BYTES", 1 << 20)
    with pytest.raises(InputError, match=r"take up at most 0 GiB.*million values.*export CSV"):
        read(tmp_path, [{"lat": 60, "lon": 24, "time": at} for at in range(3000)])


def test_objects_within_a_record_take_little_memory(tmp_path):
    """Each held the record's values once more: half a kilobyte of memory for three letters."""
    content = f'[{{"time":1,"lat":2,"lon":3,"c":[{",".join(["{}"] * 20_000)}]}}]'
    path = tmp_path / "a.json"
    tracemalloc.start()
    table = json_tables.json_table(Text(path, content.encode()))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert table is not None
    assert len(table.data.splitlines()) == 20_001
    assert peak < 100 * len(content)
