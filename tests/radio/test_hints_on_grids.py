"""Hints on files: rasters of another format beside texts, and drive tests without dates."""

from pathlib import Path

import pytest

from mapfilter.rasters.opening import _how_to_convert
from mapfilter.survey.read_measurements import read_measurements


@pytest.mark.parametrize("beside", ["A1.tab", "README.txt"])
def test_hint_names_the_grid_and_not_a_text_beside_it(beside: str) -> None:
    hint = _how_to_convert(sorted(["A1.grd", beside]))
    assert hint == "gdal_translate FROM TO.tif converts others, such as A1.grd"


def test_drive_tests_with_times_of_day_are_not_told_to_rename_the_file(tmp_path: Path) -> None:
    path = tmp_path / "2026-05-13.csv"
    path.write_text("time,lat,lon,cell,level_dbm\n10:00:00,60.1,24.9,A,-80\n")
    notes = " ".join(read_measurements([path]).notes)
    assert "a time of day without its date" in notes
    assert "name of the file" not in notes
