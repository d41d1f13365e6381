"""Technologies of cells in columns whose names may mean something else."""

import pytest

import mapfilter as mf
from mapfilter.tracks.readers.texts import text

NOTE = "taken for the technology of cells, by its words"


def read(folder, column, words, before="", **more):
    """Read 120 reports with a column of some words, repeated."""
    path = folder / "phone.csv"
    rows = (
        f"{1_700_000_000 + n},60.{n:04d},24.9,-80,244,91,100,{12_345_600 + n % 3},{before},"
        f"{words[n % len(words)]}\n"
        for n in range(120)
    )
    head = f"time,lat,lon,rsrp,mcc,mnc,tac,ci,{'rat' if before else 'spare'},{column}\n"
    path.write_text(head + "".join(rows), encoding="utf-8")
    return mf.read_log(path, **more)


def technologies(log):
    return set(log.radio["technology"].dropna()) if "technology" in log.radio else set()


@pytest.mark.parametrize("column", ["type", "Type", "cell_type", "networkType", "radio_type"])
def test_words_of_technologies_are_those_of_the_cells(column, tmp_path):
    log = read(tmp_path, column, ["LTE", "5G", "", "unknown"])
    assert technologies(log) == {"LTE", "NR"}
    assert f"phone.csv: {column.lower()}: {NOTE}" in log.notes


@pytest.mark.parametrize("words", [["serving", "neighbour"], ["macro", "LTE", "small"], [""]])
def test_other_types_are_none(words, tmp_path):
    log = read(tmp_path, "type", words)
    assert technologies(log) == set()
    assert not any(NOTE in note for note in log.notes)


def test_a_column_of_technologies_goes_before(tmp_path):
    log = read(tmp_path, "type", ["LTE"], before="GSM")
    assert technologies(log) == {"GSM"}


def test_a_column_that_is_named_for_another_field_stays_it(tmp_path):
    log = read(tmp_path, "type", ["LTE"], columns={"cell": "type"})
    assert technologies(log) == set()


def test_later_parts_of_a_large_file_are_read_as_the_first(tmp_path, monkeypatch):
    monkeypatch.setattr(text, "_PART_BYTES", 2000)
    log = read(tmp_path, "type", ["LTE"] * 60 + ["macro"] * 60)
    assert log.radio["technology"].notna().sum() == 60
