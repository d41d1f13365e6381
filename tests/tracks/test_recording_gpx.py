"""GPX as other programs write it, and damaged: points are lost one by one."""

import pytest
from made_recordings import COUNT, LAT_DEG, MADE

from mapfilter.errors import InputError
from mapfilter.tracks.readers import gpx
from mapfilter.tracks.readers.formats import read_recording

TEXT = MADE["gpx"][1]


@pytest.fixture
def read(tmp_path):
    def of(text):
        path = tmp_path / "watch.gpx"
        path.write_text(text)
        return read_recording(path)

    return of


def one(body, attributes="lat='60.1' lon = \"24.9\""):
    head = '<?xml version="1.0"?>\n<gpx creator="A &amp; B"><trk><trkseg>\n'
    return f"{head}<trkpt {attributes}>\n{body}\n</trkpt>\n</trkseg></trk></gpx>\n"


def test_elements_in_any_order_with_prefixes_and_attributes(read):
    body = (
        "<ns3:extra><ns3:x/></ns3:extra><time>2026-05-01T10:00:00Z</time>\n<ele >12.5</ele>"
        "<extensions><gpxtpx:speed>2.5</gpxtpx:speed><gpxtpx:course>90</gpxtpx:course></extensions>"
        "<hdop>1.5</hdop>"
    )
    recording = read(one(body))
    row = recording.tables["positions"].iloc[0]
    assert recording.program == "A & B"
    assert (row["lat_deg"], row["lon_deg"], row["altitude_m"]) == (60.1, 24.9, 12.5)
    assert (row["speed_mps"], row["course_deg"], row["accuracy_m"]) == (2.5, 90.0, 6.0)
    assert recording.notes == ()


def test_accuracies_as_a_watch_states_them(read):
    body = (
        "<ele>19.396494</ele><time>2026-05-01T10:00:00Z</time>"
        "<extensions><speed>1.500479</speed><course>139.218750</course>"
        "<hAcc>2.281494</hAcc><vAcc>1.575096</vAcc></extensions>"
    )
    row = read(one(body)).tables["positions"].iloc[0]
    assert row["accuracy_m"] == pytest.approx(2.281494)
    assert row["speed_mps"] == pytest.approx(1.500479)


def test_a_prefix_on_every_tag(read):
    plain = read(TEXT).tables["positions"]
    prefixed = TEXT.replace("</", "</g:").replace("<", "<g:")
    prefixed = prefixed.replace("<g:?", "<?").replace("<g:/g:", "</g:")
    recording = read(prefixed.replace("<g:gpx ", "<gpx ").replace("</g:gpx>", "</gpx>"))
    assert recording.tables["positions"].equals(plain)


def test_decimal_commas(read):
    commas = TEXT.replace('lat="60.', 'lat="60,').replace('lon="24.', 'lon="24,')
    assert read(commas).tables["positions"].equals(read(TEXT).tables["positions"])


def test_damage_loses_the_points_that_it_hits(read):
    lines = TEXT.splitlines()
    point = [i for i, line in enumerate(lines) if "<trkpt" in line]
    lines[point[4]] = lines[point[4]].replace('" lon', " lon")
    lines[point[9] + 3] = "   </trkp"
    lines[point[12] + 1] = "    <ele>12.5</el"
    recording = read("\n".join(lines))
    rows = recording.tables["positions"]
    left = [i for i in range(COUNT) if i not in (4, 9)]
    assert rows["lat_deg"].to_numpy() == pytest.approx(LAT_DEG[left], abs=1e-6)
    found = {line: unusable.reason for unusable in recording.unusable for line in unusable.lines}
    assert set(found) == {point[i] + 1 for i in (4, 9)}
    assert "no end" in found[point[9] + 1]


def test_a_file_cut_off_is_told(read):
    recording = read(TEXT[: len(TEXT) // 2])
    assert len(recording.tables["positions"]) == COUNT // 2 - 1
    assert any("cut off" in note for note in recording.notes)
    assert "no end" in recording.unusable[0].reason


def test_points_in_comments_are_none(read):
    head, point, tail = TEXT.partition("   <trkpt")
    first = point + tail[: tail.index("</trkpt>") + 8]
    recording = read(head + f"<!-- {first}\n -->\n" + point + tail)
    assert recording.tables["positions"].equals(read(TEXT).tables["positions"])


def test_waypoints_serve_where_there_is_no_track(read):
    assert len(read(TEXT.replace("trkpt", "wpt")).tables["positions"]) == COUNT
    both = read(TEXT.replace("<trk>", '<wpt lat="1" lon="2"><name>x</name></wpt><trk>'))
    assert len(both.tables["positions"]) == COUNT
    assert "1 wpt not used" in both.notes


def test_points_without_times_are_refused(read):
    with pytest.raises(InputError, match="time_s: missing"):
        read('<gpx><trk><trkseg><trkpt lat="1" lon="2"/></trkseg></trk></gpx>')


def test_a_large_file_is_read_part_by_part(read, monkeypatch):
    whole = read(TEXT)
    damaged = TEXT.replace("</trkpt>", "", 1)
    expected = read(damaged)
    monkeypatch.setattr(gpx, "_PART_BYTES", 300)
    assert read(TEXT).tables["positions"].equals(whole.tables["positions"])
    parts = read(damaged)
    assert parts.unusable == expected.unusable
    assert parts.tables["positions"].equals(expected.tables["positions"])
