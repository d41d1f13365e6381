"""Recordings of other programs as measurements of a survey."""

import numpy as np
import pytest
from command_line import assert_done, assert_refused, mapfilter
from made_recordings import COUNT, LEVEL_DBM, MADE

from mapfilter.errors import InputError
from mapfilter.survey.measurements import read_measurements
from mapfilter.workflows.measured import recorded_rows


@pytest.fixture
def made(tmp_path):
    def write(name, text=None):
        path = tmp_path / MADE[name][0]
        path.write_text(MADE[name][1] if text is None else text)
        return path

    return write


def read(*paths):
    return read_measurements(paths, "EPSG:32635", recorded=recorded_rows)


def test_a_drive_test_of_gnettrack(made):
    found = read(made("gnettrack"))
    assert found.cell_ids == ("244-91-2124-102764173",)
    assert found.identities == {"244-91-2124-102764173": (244, 91, 2124, 102764173)}
    assert found.level_dbm.tolist() == np.asarray(LEVEL_DBM, dtype=float).tolist()
    assert len(np.unique(found.session)) == 1
    assert any(f"{COUNT} levels of cells without identity" in note for note in found.notes)


def test_both_readers_give_the_same_measurements(made):
    path = made("towercollector")
    own = read_measurements([path], "EPSG:32635")
    rows = recorded_rows(path)
    ids = list(rows.cells)
    assert set(ids) == set(own.cell_ids)
    order = np.argsort(rows.columns[0], kind="stable")
    for mine, theirs in zip(
        rows.columns[[0, 3, 4]], (own.time_s, own.level_dbm, own.accuracy_m), strict=True
    ):
        assert np.allclose(mine[order], theirs[np.argsort(own.time_s, kind="stable")])
    assert [ids[i] for i in rows.cell] == [own.cell_ids[i] for i in own.cell]


def test_levels_lie_between_the_positions_before_and_after(made):
    text = (
        "time,lat,lon,mcc,mnc,lac,ci,rsrp,technology\n"
        "1777629600,60.17,24.94,,,,,,\n"
        "1777629601,,,244,91,1,7,-80,LTE\n"
        "1777629604,60.18,24.94,,,,,,\n"
        "1777629610,,,244,91,1,7,-90,LTE\n"
        "1777629620,60.18,24.95,,,,,,\n"
        "1777629630,,,244,91,1,7,-95,LTE\n"
    )
    rows = recorded_rows(made("csv", text))
    assert rows.columns[1] == pytest.approx([60.1725])
    assert rows.columns[3].tolist() == [-80.0]
    assert rows.aside["levels without a position within 10 s"] == 2


def test_files_without_cells_or_positions_are_told(made, tmp_path):
    with pytest.raises(InputError, match="levels of cells, and positions, found a GPX"):
        read(made("gpx"))
    other = tmp_path / "other.txt"
    other.write_text("nothing that anybody knows\n")
    assert recorded_rows(other) is None
    with pytest.raises(InputError, match=r"other\.txt"):
        read(other)


def test_a_map_of_a_recorded_drive(made, tmp_path):
    made("gnettrack")
    config = tmp_path / "survey.toml"
    config.write_text(
        '[area]\nmap = "none"\n[prediction]\nmodel = "survey"\n[prediction.survey]\n'
        'files = ["walk.txt"]\ncross_validate = false\n[output]\ndir = "out"\npictures = "none"\n'
    )
    done = assert_done(mapfilter("predict", "-c", config, "--json")).json
    assert done["cells"] == 1
    assert done["measurements"] == COUNT
    (tmp_path / "walk.txt").write_text(MADE["gpx"][1])
    assert_refused(mapfilter("predict", "-c", config), "walk.txt: expected levels of cells")
