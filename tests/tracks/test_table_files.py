"""Tables of logs as files: headers, encodings, numbers, metadata; each fault is one message."""

import itertools
import json

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import InputError, MapfilterError
from mapfilter.tracks.column_values import _numbers
from mapfilter.tracks.log import make_log
from mapfilter.tracks.store import read_log
from mapfilter.tracks.table_files import read_table
from mapfilter.tracks.tables import _repeated

ROWS = "0,1.0\n1,1.0\n2,1.0\n"


def log_of(folder, text=f"time_s,step_m\n{ROWS}", head=None):
    data = text if isinstance(text, bytes) else text.encode()
    (folder / "motion.csv").write_bytes(data)
    (folder / "log.json").write_text(json.dumps(head or {"crs": "EPSG:32635"}))
    return folder


@pytest.mark.parametrize("header", ["time_s, time_s", "time_s,time_s", "time_s,step_m,step_m "])
def test_columns_given_twice_are_named(tmp_path, header):
    text = f"{header}\n" + "0,1,1\n"[: 2 * header.count(",") + 2].rstrip(",") + "\n"
    with pytest.raises(InputError, match=r"motion.csv, header: expected each column once"):
        read_log(log_of(tmp_path, text))


@pytest.mark.parametrize("number", ["1_0", "\u0661", "１", "1\u00a0", "0x1", "1e", "--1"])
def test_numbers_of_python_are_no_numbers_of_a_log(tmp_path, number):
    with pytest.raises(InputError, match=r"row 3, step_m"):
        read_log(log_of(tmp_path, f"time_s,step_m\n0,1\n1,{number}\n"))


@given(value=st.floats(allow_nan=False, allow_infinity=False, min_value=-1e5, max_value=1e5))
def test_texts_are_the_numbers_that_python_reads(value):
    forms = [repr(value), f"{value:.3f}", f"{value:e}", f"+{abs(value)!r}", f" {value!r} "]
    found, readable = _numbers(pd.Series(forms, dtype="str"))
    assert found.tolist() == [float(form) for form in forms]
    assert readable.all()


@pytest.mark.parametrize("form", ["utf-16-le", "utf-16-be", "utf-16"])
def test_utf_16_is_named_with_and_without_its_mark(tmp_path, form):
    text = f"time_s,step_m\n{ROWS}".encode(form)
    with pytest.raises(InputError, match="UTF-16") as refused:
        read_log(log_of(tmp_path, text))
    assert ("without a byte order mark" in str(refused.value)) == (form != "utf-16")


def test_zero_bytes_are_named(tmp_path):
    with pytest.raises(InputError, match=r"a zero byte \(byte 17\)"):
        read_log(log_of(tmp_path, f"time_s,step_m\n0,\0{ROWS}"))


PLACES = "".join(f"{n},{385400 + 1.25 * n:.2f},{6672000.5 + n:.2f}\n" for n in range(30))


def places_of(folder, end):
    log_of(folder)
    text = f"time_s,east_m,north_m\n{PLACES}".encode()
    (folder / "truth.csv").write_bytes(text + end)
    log = read_log(folder)
    return log.truth["time_s"].tolist(), log.notes


@pytest.mark.parametrize(
    ("end", "why"),
    [
        (b"30,385437.50,66", "within its last number (66, without a line end)"),
        (b"30,385437.50,", "within its last number (nothing, without a line end)"),
        (b"30,3854", "within the row (without a line end)"),
    ],
)
def test_a_row_in_which_a_file_was_cut_off_is_left_out(tmp_path, end, why):
    time_s, notes = places_of(tmp_path, end)
    assert time_s == list(range(30))
    assert notes == (f"{tmp_path / 'truth.csv'} row 32: cut off {why}, left out",)


@pytest.mark.parametrize("end", [b"30,385437.50,6672030.50", b"30,385437.50,6672030\n"])
def test_other_last_rows_are_kept(tmp_path, end):
    time_s, notes = places_of(tmp_path, end)
    assert time_s == list(range(31))
    assert not notes


@pytest.mark.parametrize(
    ("row", "lost"), [(b"", ""), (b"30,385437.50,667", ", with the unfinished row before them")]
)
def test_zero_bytes_that_a_dead_battery_leaves(tmp_path, row, lost):
    time_s, notes = places_of(tmp_path, row + bytes(4096))
    assert time_s == list(range(30))
    what = f"4096 zero bytes at the end (line 32) left out{lost}"
    assert notes == (f"{tmp_path / 'truth.csv'}: {what}",)


def test_a_file_of_zero_bytes_alone_is_refused(tmp_path):
    with pytest.raises(InputError, match="expected a header line, found zero bytes only"):
        read_log(log_of(tmp_path, bytes(100)))


def test_a_list_in_place_of_a_path_is_refused(tmp_path):
    head = {"crs": "EPSG:32635", "parts": [{"path": ["motion.csv"]}, {"path": {}}, 3]}
    with pytest.raises(MapfilterError, match="tables of a log"):
        read_log(log_of(tmp_path, head=head))


def test_half_a_surrogate_pair_is_refused(tmp_path):
    folder = log_of(tmp_path)
    (folder / "log.json").write_text('{"crs": "EPSG:32635", "notes": ["\\ud800"]}')
    with pytest.raises(MapfilterError, match="lone surrogate"):
        read_log(folder)
    rows = {"time_s": [0.0], "role": ["serving"], "cell": pd.Series(["A\udc80"], dtype=object)}
    with pytest.raises(InputError, match="surrogate pair"):
        make_log("EPSG:32635", radio=pd.DataFrame(rows))


def test_decimal_columns_and_damaged_metadata_of_parquet_are_read(tmp_path):
    folder = log_of(tmp_path)
    (folder / "motion.csv").unlink()
    steps = pa.array([1, 2, 3]).cast(pa.decimal128(21, 2))
    table = pa.table({"time_s": [0.0, 1.0, 2.0], "step_m": steps})
    for damaged in (b"{", b'{"index_columns": [7], "columns": 3}', b"\xff\xfe"):
        pq.write_table(
            table.replace_schema_metadata({b"pandas": damaged}), folder / "motion.parquet"
        )
        assert read_log(folder).motion["step_m"].tolist() == [1.0, 2.0, 3.0]


TEXTS = [
    "time_s,step_m\n0,1\n1,\n",
    "time_s;step_m\n0;1,5\n1;2\n",
    "\n\ntime_s\tstep_m\n0\t1\n",
    'time_s,step_m\n"0","1"\n',
    "time_s,step_m\r\n0,1\r\n1,2\r\n",
    "time_s,step_m\n0,1\n\n1,2\n",
    "time_s,step_m\r0,1\r1,2\r",
    "time_s,step_m\n0,1\n1,2",
    " time_s , step_m \n0, 1\n",
]


@pytest.mark.parametrize("text", TEXTS)
def test_the_fast_way_reads_what_pandas_reads(tmp_path, monkeypatch, text):
    (tmp_path / "motion.csv").write_bytes(text.encode())
    fast = read_table("motion", tmp_path / "motion.csv")
    monkeypatch.setattr("mapfilter.tracks.table_files._plain_rows", lambda *_: None)
    slow = read_table("motion", tmp_path / "motion.csv")
    assert fast.rows.columns.tolist() == slow.rows.columns.tolist() == ["time_s", "step_m"]
    assert fast.rows.to_numpy().tolist() == slow.rows.to_numpy().tolist()
    assert fast.row_numbers.tolist() == slow.row_numbers.tolist()
    assert fast.notes == slow.notes


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 2)), max_size=40), st.booleans())
def test_repeated_rows_are_found_part_by_part(rows, in_order):
    rows = sorted(rows) if in_order else rows
    table = pd.DataFrame({"time_s": [float(a) for a, _ in rows], "b": [b for _, b in rows]})
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("mapfilter.tracks.tables._ROWS_AT_ONCE", 3)
        found = _repeated(table)
    seen: set = set()
    expected = [row in seen or bool(seen.add(row)) for row in rows]
    assert found.tolist() == expected


def walked(count=200, turn=0.05):
    course = turn * np.arange(count)
    east, north = (np.append(0.0, np.cumsum(1.5 * f(course))) for f in (np.cos, np.sin))
    time_s = np.arange(count + 1.0)
    truth = pd.DataFrame({"time_s": time_s, "east_m": 385000 + east, "north_m": 6672000 + north})
    return course, truth


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda course: np.pi / 2 - course, "clockwise from north"),
        (lambda course: -course, "clockwise from another axis"),
        (lambda course: course - np.pi / 2, "counted from north"),
        (lambda course: course, ""),
        (lambda course: course + np.random.default_rng(1).normal(0, 0.4, course.size), ""),
    ],
)
def test_headings_are_compared_with_the_course(wrong, said):
    course, truth = walked()
    heading = (wrong(course) + np.pi) % (2 * np.pi) - np.pi
    time_s = truth["time_s"].to_numpy()
    motion = pd.DataFrame({"time_s": time_s, "step_m": 1.5, "heading_rad": np.append(0, heading)})
    notes = [note for note in make_log("EPSG:32635", motion=motion, truth=truth).notes
             if "heading_rad" in note]  # fmt: skip
    assert len(notes) == bool(said)
    assert not said or said in notes[0]


def test_a_straight_way_tells_no_sense_of_rotation():
    course, truth = walked(turn=0.0)
    motion = pd.DataFrame({"time_s": truth["time_s"], "step_m": 1.5, "heading_rad": np.pi / 2})
    assert not make_log("EPSG:32635", motion=motion, truth=truth).notes
    assert not course.any()


def test_of_many_rows_texts_are_kept_once():
    cells = pd.Series(list(itertools.islice(itertools.cycle(["A", "B"]), 1000)), dtype="str")
    radio = pd.DataFrame({"time_s": np.arange(1000.0), "role": "serving", "cell": cells})
    found = make_log("EPSG:32635", radio=radio).radio["cell"]
    assert len({id(cell) for cell in found}) == 2


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("table", ["gnss", "truth"])
@pytest.mark.parametrize("degrees", [True, False])
def test_decimal_commas_are_read_in_places_in_metres_and_in_degrees(
    tmp_path, separator, table, degrees
):
    time_s = np.arange(20.0)
    if degrees:
        places = {"lat_deg": 60.125 + 1e-5 * time_s, "lon_deg": -0.0625 + 1e-5 * time_s}
        places["accuracy_m"] = 4.5
    else:
        places = {"east_m": 385400.25 + time_s, "north_m": 6672000.75 + time_s}
    rows = pd.DataFrame({"time_s": time_s + 0.5, **places})
    found = []
    for decimal in ".,":
        folder = tmp_path / f"log{ord(decimal)}"
        folder.mkdir()
        (folder / "log.json").write_text(json.dumps({"crs": "EPSG:32630"}))
        path = folder / f"{table}.csv"
        rows.to_csv(path, index=False, sep=separator, decimal=decimal)
        assert ("," in path.read_text()) == (decimal == ",")
        found.append(getattr(read_log(folder), table))
    pd.testing.assert_frame_equal(*found)
    assert len(found[0]) == 20
