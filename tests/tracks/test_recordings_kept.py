"""Good recordings that resemble mistakes: what can be used of them is read, with a note."""

import numpy as np
import pytest
from made_recordings import COUNT, MADE

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
    told = f"radio, level_dbm: {COUNT} levels as ASU of an unknown technology, or beyond those of"
    assert [note.startswith(told) for note in found.ignored] == [True]


@pytest.mark.parametrize("stray", [127, 120])
@pytest.mark.parametrize("low", [20, 55])
def test_a_stray_value_among_units_costs_its_level_only(stray, low, upload):
    levels = asu(low, low + 39)
    levels[17] = stray
    found = upload(levels)
    level_dbm = found.tables["radio"]["level_dbm"]
    assert level_dbm.isna().sum() == 1
    assert (level_dbm.dropna() == np.delete(levels, 17) - 140).all()
    assert any("1 levels as ASU" in note for note in found.ignored)


def test_weak_units_with_many_odd_ones_are_no_levels_without_sign(upload):
    levels = np.where(np.arange(COUNT) % 10 == 0, 127, asu(20, 59))
    assert upload(levels).tables["radio"]["level_dbm"].notna().sum() == COUNT - 3
    with pytest.raises(InputError, match="a lost sign"):
        upload(asu(80, 110))
