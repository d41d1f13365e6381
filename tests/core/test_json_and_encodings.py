"""JSON and text as editors of other systems save it: marks, wide characters, keys given twice."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import mapfilter
from mapfilter._inputs import first_foreign_byte, json_value
from mapfilter._json_files import read_json, write_sealed
from mapfilter.errors import MapfilterError, StoreError
from mapfilter.radio.tables import read_table as read_plan_table
from mapfilter.survey.measurement_files import DIALECTS, read_csv
from mapfilter.tracks.readers.texts.text import read_text
from mapfilter.tracks.store import read_log
from mapfilter.tracks.table_files import read_table

UTF_32 = ["utf-32-le", "utf-32-be"]


@pytest.mark.parametrize(
    "text", ['{"a": 1, "b": 2, "a": 1}', '{"b": [{"a": 1, "a": 2}]}', '{"a": 1, "\\u0061": 2}']
)
def test_a_key_given_twice_is_refused(tmp_path, text):
    file = tmp_path / "log.json"
    file.write_text(text)
    with pytest.raises(StoreError, match="the key 'a' twice in one object") as raised:
        read_json(file)
    assert "edited or damaged" in str(raised.value)
    assert "cut off" not in str(raised.value)


def test_many_keys_take_no_time_for_each_other(tmp_path):
    file = tmp_path / "log.json"
    keys = [f'"{number}": 0' for number in range(400_000)]
    file.write_text("{" + ", ".join([*keys, keys[-1]]) + "}")
    # Each compared with each, these would take an hour.
    with pytest.raises(StoreError, match="the key '399999' twice"):
        read_json(file)


def test_json_with_a_byte_order_mark_is_read(tmp_path):
    file = tmp_path / "log.json"
    file.write_text('{"a": 1}', encoding="utf-8-sig")
    assert read_json(file) == {"a": 1}


@pytest.mark.parametrize("codec", ["utf-16", "utf-32"])
def test_json_in_wide_characters_is_named(tmp_path, codec):
    file = tmp_path / "log.json"
    file.write_text('{"a": 1}', encoding=codec)
    with pytest.raises(StoreError, match=codec.upper()):
        read_json(file)


def test_json_that_is_cut_off_is_named_as_that(tmp_path):
    file = tmp_path / "sweep.json"
    write_sealed(file, {"a": [1, 2]})
    file.write_bytes(file.read_bytes()[:-5])
    with pytest.raises(StoreError, match="cut off"):
        read_json(file)


def test_constants_are_taken_unless_refused():
    assert json.dumps(json_value(b"[NaN]")) == "[NaN]"
    assert json_value(b"[NaN, -Infinity]", str.lower) == ["nan", "-infinity"]


def test_json_of_others_is_read_by_the_door_alone():
    """What a process notes for itself (the list of an older folder) needs no door."""
    package = Path(mapfilter.__file__).parent
    found = {
        file.relative_to(package).as_posix()
        for file in package.rglob("*.py")
        if re.search(r"json\.loads?\(|JSONDecoder\(", file.read_text(encoding="utf-8"))
    }
    assert found == {"_inputs.py", "_replace.py"}


@pytest.mark.parametrize("codec", UTF_32)
def test_utf_32_is_named_or_read(tmp_path, codec):
    table, text = tmp_path / "motion.csv", "\ufefftime_s,step_m\n1.0,0.5\n"
    table.write_bytes(text.encode(codec))
    with pytest.raises(MapfilterError, match="found UTF-32"):
        read_table("motion", table)
    with pytest.raises(MapfilterError, match="found UTF-32"):
        read_csv(table, DIALECTS["opencellid"])
    assert read_plan_table(table, "a cell plan").header == ("time_s", "step_m")
    recording = read_text(table)
    assert recording.data == b"time_s,step_m\n1.0,0.5\n"
    assert recording.notes == ("UTF-32 text",)


def test_utf_32_that_is_cut_off_is_read_to_its_last_letter(tmp_path):
    file = tmp_path / "recording.txt"
    file.write_bytes("a,b\n1,2".encode("utf-32")[:-2])
    assert read_text(file).data == b"a,b\n1,"


@pytest.mark.skipif(os.name != "posix", reason="locales by environment")
@pytest.mark.parametrize(
    ("name", "wanted"), [(b"caf\xc3\xa9.toml", "the encoding of the locale"), (b"caf\xe9", "UTF-8")]
)
def test_letters_of_a_path_that_the_locale_lacks_are_named_as_that(name, wanted):
    code = "import sys; from pathlib import Path; from mapfilter._inputs import path_fault\n"
    code += "print(path_fault(Path(sys.argv[1])))"
    ascii_only = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}
    run = [os.fsencode(sys.executable), b"-c", code.encode(), name]
    done = subprocess.run(run, env=os.environ | ascii_only, capture_output=True, check=True)
    text = done.stdout.decode()
    assert wanted in text
    assert ("PYTHONUTF8=1" in text) == (b"\xc3" in name)


@pytest.mark.parametrize(
    ("data", "place"),
    [
        ("Zeit,Länge\n1,2\n".encode() + b"\xe4,\xfc\n", -1),
        (b"RxLev;Qualit\xe9", 12),
        ("Zeit,Länge\n1,\u00e4".encode()[:-1], -1),
        ("PRÉ» ".encode("cp1252") + 50 * b"caf\xe9 de la gare ", 8),
    ],
    ids=["damaged", "cut at a letter", "cut off", "accidental"],
)
def test_one_whole_letter_tells_utf_8_from_windows_1252(data, place, tmp_path):
    assert first_foreign_byte(data) == place
    file = tmp_path / "recording.csv"
    file.write_bytes(data)
    text, notes = read_text(file).data.decode(), read_plan_table(file, "a cell plan").notes
    assert ("read as Windows-1252" in notes[0]) == (place >= 0)
    assert any("Windows-1252" in note for note in read_text(file).notes) == (place >= 0)
    for word in ("Länge", "Qualité", "PRÉ»"):
        if word.encode() in data or word.encode("cp1252") in data:
            assert word in text
            header = read_plan_table(file, "a cell plan").header
            assert any(word in name for name in header)


@pytest.mark.parametrize("separator", [",", ";"])
def test_tables_of_a_log_in_windows_1252_are_read_with_a_note(separator, tmp_path):
    (tmp_path / "log.json").write_text('{"crs": "EPSG:32635"}')
    rows = ["time_s,role,cell,level_dbm", *(f"{n},serving,Münster-Süd,-70" for n in range(3)), ""]
    text = "\n".join(rows).replace(",", separator)
    (tmp_path / "radio.csv").write_bytes(text.encode("cp1252"))
    log = read_log(tmp_path)
    assert log.radio["cell"].tolist() == ["Münster-Süd"] * 3
    assert log.notes == (f"{tmp_path / 'radio.csv'}: no UTF-8 (byte 38); read as Windows-1252",)
    (tmp_path / "radio.csv").write_bytes(text.encode())
    assert read_log(tmp_path).notes == ()
