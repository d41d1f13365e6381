"""Rows of positions in degrees that hold none are left out, with one note; metres stay."""

import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mapfilter as mf
from mapfilter.tracks.joining.no_fix import holds_no_fix, rows_without_fix
from mapfilter.tracks.log import make_log
from mapfilter.tracks.store import read_log

CRS = "EPSG:32633"
LAT, LON = 50.08, 14.42
MISSING = ["", "NaN", "nan", "null", "NULL", None, np.nan, pd.NA]
ZEROS = ["0", "0.0", "-0.000", 0, 0.0, np.float32(0), "0e0"]
GIVEN = ["50.08", 50.08, "north", 1e-9, "0x0", True, [0.0]]
NO_FIX = "(latitude and longitude both empty, or both 0: no fix; first row 1)"


def table(pairs):
    degrees = {"lat_deg": [lat for lat, _ in pairs], "lon_deg": [lon for _, lon in pairs]}
    rows = pd.DataFrame({"time_s": np.arange(float(len(pairs)))})
    return rows.assign(**{name: pd.Series(one, dtype=object) for name, one in degrees.items()})


PAIRS = [*[(one, one) for one in (*MISSING, *ZEROS)], ("", "NaN"), (0, "0.0"), (None, "null")]


@pytest.mark.parametrize("name", ["gnss", "truth"])
@pytest.mark.parametrize("pair", PAIRS, ids=repr)
def test_a_row_without_a_position_is_left_out(name, pair):
    rows = table([pair, (LAT, LON), pair, (LAT + 1e-4, LON)])
    log = make_log(CRS, **{name: rows})
    placed = rows.iloc[[1, 3]].astype({"lat_deg": float, "lon_deg": float})
    only = make_log(CRS, **{name: placed})
    pd.testing.assert_frame_equal(getattr(log, name), getattr(only, name))
    assert log.notes == (f"{name}: 2 rows without a position left out {NO_FIX}",)
    assert only.notes == ()


@pytest.mark.parametrize(
    "pair", [("", LON), (LAT, None), (np.nan, LON), ("", 0), (0.0, None), ("null", "0")], ids=repr
)
def test_one_value_beside_a_missing_one_stays_a_fault(pair):
    with pytest.raises(mf.MapfilterError, match=r"gnss row 2, l(at|on)_deg: expected degrees in"):
        make_log(CRS, gnss=table([(LAT, LON), pair]))


def test_a_clock_is_checked_in_such_rows_too():
    rows = table([("", ""), (LAT, LON)]).assign(time_s=[np.inf, 1.0])
    with pytest.raises(mf.MapfilterError, match="gnss row 1, time_s: expected seconds, found inf"):
        make_log(CRS, gnss=rows)


def test_faults_of_the_other_rows_keep_their_numbers():
    rows = table([(0, 0), (LAT, LON), (95.0, LON)])
    with pytest.raises(mf.MapfilterError) as refused:
        make_log(CRS, gnss=rows)
    assert "gnss row 3, lat_deg: expected degrees in -90..90, found 95.0" in str(refused.value)
    assert "row 1" not in str(refused.value)


def test_one_axis_of_zero_is_a_place():
    log = make_log("EPSG:32631", gnss=table([(0.0, 3.0), (0.0, 3.001)]))
    assert len(log.gnss) == 2
    assert log.notes == ()


def test_metres_at_the_origin_are_a_place():
    rows = pd.DataFrame({"time_s": [0.0, 1.0], "east_m": [0.0, 5.0], "north_m": [0.0, 5.0]})
    log = make_log(CRS, gnss=rows, truth=rows)
    assert log.gnss["east_m"].tolist() == log.truth["east_m"].tolist() == [0.0, 5.0]
    assert log.notes == ()


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_a_folder_names_its_file_and_first_line(tmp_path, form):
    (tmp_path / "log.json").write_text(json.dumps({"crs": CRS}))
    path, degrees = tmp_path / f"gnss.{form}", [np.nan, LAT, 0.0, LAT]
    of_lon = [LON if one == LAT else one for one in degrees]
    rows = pd.DataFrame({"time_s": np.arange(4.0), "lat_deg": degrees, "lon_deg": of_lon})
    rows = rows.assign(accuracy_m=[np.nan, 5.0, -1.0, 5.0])
    if form == "csv":
        rows.to_csv(path, index=False)
    else:
        rows.to_parquet(path)
    read = read_log(tmp_path)
    assert len(read.gnss) == 2
    line = 2 if form == "csv" else 1
    start = f"{path}: 2 rows without a position left out ("
    assert [note[: len(start)] for note in read.notes] == [start]
    assert read.notes[0].endswith(f"first row {line})")


def test_a_log_of_such_rows_alone_has_no_positions():
    motion = pd.DataFrame({"time_s": np.arange(3.0), "step_m": 1.0, "heading_rad": 0.0})
    log = make_log(CRS, motion=motion, gnss=table([(0, 0), ("", ""), ("nan", "nan")]))
    assert log.gnss.empty
    assert list(log.gnss.columns) == list(make_log(CRS, motion=motion).gnss.columns)
    found = mf.locate(log, filter="ekf").log.notes
    assert "nothing is located: no positions and no radio to start from" in found


@settings(deadline=None)
@given(st.lists(st.tuples(*[st.sampled_from([*MISSING, *ZEROS, *GIVEN])] * 2), max_size=8))
def test_columns_are_judged_as_single_values_are(pairs):
    expected = [holds_no_fix(*pair) for pair in pairs]
    lat, lon = (pd.Series([one[axis] for one in pairs], dtype=object) for axis in (0, 1))
    assert rows_without_fix(lat, lon).tolist() == expected
    if all(isinstance(one, str) for pair in pairs for one in pair):
        texts = pd.StringDtype(na_value=np.nan)
        assert rows_without_fix(lat.astype(texts), lon.astype(texts)).tolist() == expected


@pytest.mark.parametrize("kind", ["python", "pyarrow"])
@pytest.mark.parametrize("missing", [np.nan, pd.NA], ids=["nan", "NA"])
def test_a_missing_text_is_no_number_in_every_type_of_column(kind, missing):
    texts = pd.StringDtype(kind, na_value=missing)
    lat = pd.Series([None, None, "", None, "0"], dtype=texts)
    lon = pd.Series([None, "nan", None, "0", "8.6"], dtype=texts)
    assert rows_without_fix(lat, lon).tolist() == [True, True, True, False, False]


def test_only_numbers_and_texts_are_zeros():
    assert not holds_no_fix(False, False)
    assert not holds_no_fix([0.0], [0.0])
    assert holds_no_fix(np.int64(0), 0)


@settings(deadline=None)
@given(st.lists(st.text(alphabet="0.-+eEnaulNUL 1", max_size=6), min_size=1, max_size=8))
def test_texts_are_judged_alike_in_every_type_of_column(texts):
    plain, typed = (pd.Series(texts, dtype=one) for one in (object, pd.StringDtype()))
    found = rows_without_fix(plain, plain)
    assert rows_without_fix(typed, typed).tolist() == found.tolist()
    for text, without in zip(texts, found, strict=True):
        try:
            number = float(text)
        except ValueError:
            number = np.nan if not text.strip() or text.strip().lower() == "null" else 1.0
        assert without == (np.isnan(number) or number == 0), text
