"""Recordings of two phones on one walk are noted; those of two programs on one phone are not."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf

SECONDS = np.arange(100)
LEVEL_DBM = -80 + 5 * np.sin(SECONDS / 5)


@pytest.fixture
def write(tmp_path):
    def written(name, late_s=0, ci=11702, level_dbm=LEVEL_DBM):
        table = {"time": 1_778_000_000 + 5 * SECONDS + late_s, "mcc": 244, "mnc": 91, "lac": 3021}
        table |= {"ci": ci, "level_dbm": np.round(level_dbm), "lat": 60.17, "lon": 24.94}
        pd.DataFrame(table).to_csv(tmp_path / name, index=False)
        return tmp_path / name

    return written


def noted(*paths):
    return [note for note in mf.read_log(paths).notes if "two phones" in note]


@pytest.mark.parametrize(
    "other",
    [
        {"ci": 11703},
        {"level_dbm": LEVEL_DBM - 8},
        {"ci": np.where(SECONDS < 50, 11702, 11703)},
    ],
)
def test_other_cells_or_levels_are_those_of_another_phone(write, other):
    """They became one phone's, without a note."""
    (note,) = noted(write("a.csv"), write("b.csv", 1, **other))
    assert note.startswith("b.csv and a.csv: serving cells or levels differ in ")
    assert note.endswith("name the files of one phone alone")


def test_two_programs_on_one_phone_and_files_one_after_the_other_are_of_one(write):
    assert not noted(write("a.csv"), write("b.csv", 1, level_dbm=LEVEL_DBM + 1))
    assert not noted(write("a.csv"), write("b.csv", 600, ci=11703))


def test_files_of_one_name_are_told_with_their_folders(tmp_path):
    """``Acc.csv: accelerometer not used, Acc.csv has it`` told nothing."""
    rows = [f"{1_778_000_000 + i / 10},0,0,9.8" for i in range(100)]
    paths = [tmp_path / phone / "Acc.csv" for phone in ("mine", "yours")]
    for path in paths:
        path.parent.mkdir()
        path.write_text("\n".join(["time,acc_x,acc_y,acc_z", *rows]) + "\n")
    notes = mf.read_log(paths).notes
    assert "yours/Acc.csv: accelerometer not used, mine/Acc.csv has it" in notes
    shifted = mf.read_log(paths, offsets_s={"yours/Acc.csv": 60.0}).notes
    assert "yours/Acc.csv: +60 s, as given" in shifted
    assert not any("not used, mine" in note for note in shifted)
