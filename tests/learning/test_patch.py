"""Patches: written, read back, refused where they are wrong, and applied."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from learning_world import CRS, EAST, NORTH, database_of, levels_of, plan_of

from mapfilter.database.rewrite import levels_of as stored_levels
from mapfilter.database.rewrite import rewrite, routes_of
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, InputError, OutputError
from mapfilter.learning.apply import apply_patch
from mapfilter.learning.patch import Change, Patch, read_patch, write_patch
from mapfilter.workflows.learn import run_accept

SHA = "0" * 64
NAMES = st.text(min_size=1, max_size=8).filter(lambda t: t == t.strip() and t.isprintable())
NUMBER = st.floats(-1e6, 1e6).map(lambda value: round(value, 2))


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    return database_of(plan_of(), tmp_path_factory.mktemp("given") / "a")


def patched(database, tmp_path, *changes):
    return apply_patch(database, Patch(CRS, SHA, 3, changes), tmp_path / "patched")


def difference_db(database, other, cell):
    a = stored_levels(database)[database.plan.index(cell)]
    b = stored_levels(other)[other.plan.index(cell)]
    both = np.isfinite(a) & np.isfinite(b)
    assert both.sum() > 100
    return (b - a)[both]


@st.composite
def changes(draw):
    kind = draw(st.sampled_from(["offset", "dead", "moved", "turned", "swapped", "way"]))
    count = {"swapped": 2, "way": 0}.get(kind, 1)
    made = Change(
        kind,
        tuple(draw(st.lists(NAMES, min_size=count, max_size=count, unique=True))),
        log_bayes_factor=draw(NUMBER),
        probability=round(draw(st.floats(0, 1)), 6),
        journeys=draw(st.integers(0, 99)),
        accept=draw(st.booleans()),
    )
    if kind == "offset":
        return replace(made, offset_db=round(draw(st.floats(-60, 60)), 2))
    if kind == "turned":
        return replace(made, turn_deg=round(draw(st.floats(0, 359)), 2))
    if kind == "moved":
        return replace(made, east_m=draw(NUMBER), north_m=draw(NUMBER))
    if kind == "way":
        line = draw(st.lists(st.tuples(NUMBER, NUMBER), min_size=2, max_size=5))
        return replace(made, line_m=tuple(line), half_width_m=5.0)
    return made


def equal(one, other):
    same = [
        a == b or (isinstance(a, float) and math.isnan(a) and math.isnan(b))
        for a, b in zip(vars(one).values(), vars(other).values(), strict=True)
    ]
    return all(same)


@given(st.lists(changes(), max_size=4))
def test_a_patch_reads_back_as_it_was_written(tmp_path_factory, some):
    file = tmp_path_factory.mktemp("patch") / "patch.toml"
    patch = Patch(CRS, SHA, 40, tuple(some))
    write_patch(patch, file)
    found = read_patch(file)
    assert (found.crs, found.database_sha256, found.journeys) == (CRS, SHA, 40)
    assert len(found.changes) == len(some)
    assert all(equal(a, b) for a, b in zip(found.changes, some, strict=True))


HEAD = f'format = "mapfilter patch"\nversion = 1\ncrs = "{CRS}"\ndatabase_sha256 = "{SHA}"\n'
HEAD += "journeys = 3\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "format"),
        ("\x00", "TOML"),
        ('format = "x"', "mapfilter patch"),
        (HEAD.replace("version = 1", "version = 2"), "version"),
        (HEAD.replace(SHA, "abc"), "database_sha256"),
        (HEAD + '[[change]]\nkind = "offset"\ncells = ["A"]\n', "change 1, offset_db"),
        (HEAD + '[[change]]\nkind = "offset"\ncells = ["A"]\noffset_db = nan\n', "finite"),
        (HEAD + '[[change]]\nkind = "offset"\ncells = ["A"]\noffset_db = 500\n', "60"),
        (HEAD + '[[change]]\nkind = "swapped"\ncells = ["A"]\n', "2 for 'swapped'"),
        (HEAD + '[[change]]\nkind = "swapped"\ncells = ["A", "A"]\n', "each cell once"),
        (HEAD + '[[change]]\nkind = "explode"\ncells = ["A"]\n', "kind"),
        (HEAD + '[[change]]\nkind = "dead"\ncells = ["A"]\nacept = false\n', "acept"),
        (HEAD + '[[change]]\nkind = "dead"\ncells = ["A"]\naccept = "no"\n', "accept"),
        (HEAD + '[[change]]\nkind = "way"\nline_m = [[1.0, 2.0]]\nhalf_width_m = 5\n', "two"),
        (HEAD + '[[change]]\nkind = "way"\nline_m = [[1.0, 2.0], [3.0]]\n', "line_m"),
    ],
)
def test_wrong_patches_are_refused_with_their_place(tmp_path, text, told):
    file = tmp_path / "patch.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=told) as raised:
        read_patch(file)
    assert str(file) in str(raised.value)


def test_a_patch_that_is_no_text_is_refused(tmp_path):
    file = tmp_path / "patch.toml"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="TOML"):
        read_patch(file)
    with pytest.raises(InputError, match="readable"):
        read_patch(tmp_path / "none.toml")


@pytest.mark.parametrize("number", ["9" * 5000, "[" * 5000])
def test_numbers_and_lists_that_no_one_writes_are_refused(tmp_path, number):
    file = tmp_path / "patch.toml"
    file.write_text(HEAD.replace("version = 1", f"version = {number}"))
    assert number in file.read_text()
    with pytest.raises(InputError, match="a patch in TOML"):
        read_patch(file)


def test_unknown_cells_and_another_crs_are_refused_together(database, tmp_path):
    patch = Patch("EPSG:32633", SHA, 1, (Change("dead", ("nobody",)),))
    with pytest.raises(InputError, match=r"(?s)crs.*nobody"):
        apply_patch(database, patch, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_rewriting_without_a_change_gives_the_same_files(database, tmp_path):
    same = rewrite(
        database, tmp_path / "same", database.plan, routes_of(database), stored_levels(database)
    )
    for file in database.path.rglob("*.parquet"):
        assert (same.path / file.relative_to(database.path)).read_bytes() == file.read_bytes()


def test_an_offset_is_added_to_levels_and_power(database, tmp_path):
    other = patched(database, tmp_path, Change("offset", ("S1B",), offset_db=-7.5))
    assert difference_db(database, other, "S1B") == pytest.approx(-7.5, abs=0.011)
    assert difference_db(database, other, "S1A") == pytest.approx(0.0)
    assert other.plan["S1B"].eirp_dbm == database.plan["S1B"].eirp_dbm - 7.5


def test_a_dead_cell_is_gone_and_others_serve_its_points(database, tmp_path):
    other = patched(database, tmp_path, Change("dead", ("S2A",)))
    assert "S2A" not in other.plan
    assert len(other.points()) == len(database.points())


@pytest.mark.parametrize("kind", ["rotated", "swapped"])
def test_turned_cells_have_the_levels_of_a_database_that_was_built_right(database, tmp_path, kind):
    plan = database.plan
    if kind == "rotated":
        change = Change("rotated", ("S3A", "S3B", "S3C"), turn_deg=120.0)
        azimuth = {f"S3{n}": (plan[f"S3{n}"].azimuth_deg + 120.0) % 360.0 for n in "ABC"}
    else:
        change = Change("swapped", ("S3A", "S3B"))
        azimuth = {"S3A": 120.0, "S3B": 0.0}
    right = replace(
        plan,
        cells=tuple(replace(c, azimuth_deg=azimuth.get(c.id, c.azimuth_deg)) for c in plan.cells),
    )
    other = patched(database, tmp_path, change)
    assert [c.azimuth_deg for c in other.plan.cells] == [c.azimuth_deg for c in right.cells]
    anew = database_of(right, tmp_path / "b")
    for cell in azimuth:
        # Grid and true north differ by hundredths of a degree off the central meridian.
        assert np.abs(difference_db(anew, other, cell)).max() < 0.1


def test_cells_of_two_technologies_that_are_each_other_s_keep_their_carriers(tmp_path):
    own = {
        "S1B": {"technology": "LTE", "arfcn": 6300, "bsic": 400, "frequency_mhz": 806.0},
        "S2C": {"technology": "GSM", "arfcn": 20, "bsic": 12, "frequency_mhz": 939.0},
    }
    plan = plan_of()
    plan = replace(plan, cells=tuple(replace(c, **own.get(c.id, {})) for c in plan.cells))
    database = database_of(plan, tmp_path / "a")
    other = patched(database, tmp_path, Change("swapped", ("S1B", "S2C")))
    for name, planned in (("S1B", "S2C"), ("S2C", "S1B")):
        cell, before = other.plan[name], database.plan[planned]
        assert {key: getattr(cell, key) for key in own[name]} == own[name]
        assert (cell.east_m, cell.azimuth_deg) == (before.east_m, before.azimuth_deg)


def test_a_moved_cell_is_predicted_by_distance(database, tmp_path):
    cell = database.plan["I1"]
    east, north = cell.east_m - 400.0, cell.north_m + 200.0
    other = patched(database, tmp_path, Change("moved", ("I1",), east_m=east, north_m=north))
    right = plan_of(indoor=((500, 500),))
    anew = database_of(right, tmp_path / "b")
    assert (other.plan["I1"].east_m, other.plan["I1"].north_m) == (east, north)
    assert np.abs(difference_db(anew, other, "I1")).max() < 1.0


def test_a_way_adds_points_with_the_levels_about_them(database, tmp_path):
    line = ((EAST + 710.0, NORTH + 590.0), (EAST + 890.0, NORTH + 590.0))
    other = patched(database, tmp_path, Change("way", line_m=line, half_width_m=15.0))
    added = len(other.points()) - len(database.points())
    assert 5 <= added <= 30
    field = other.field()
    row, col = field.lattice.row_col(EAST + 850.0, NORTH + 595.0)
    assert field.on_way[row, col]
    assert not database.field().on_way[row, col]
    expected = levels_of(database.plan, np.array([EAST + 850.0]), np.array([NORTH + 595.0]))[0]
    known = np.isfinite(expected) & np.isfinite(field.level_dbm[row, col])
    assert known.sum() > 5
    assert np.abs(field.level_dbm[row, col] - expected)[known].max() < 6.0


def test_accepting_leaves_out_what_is_refused_and_records_the_patch(database, tmp_path):
    file = tmp_path / "patch.toml"
    made = (
        Change("offset", ("S1A",), offset_db=5.0),
        Change("dead", ("S2A",), accept=False),
    )
    write_patch(Patch(CRS, SHA, 3, made), file)
    told = run_accept(database.path, file, tmp_path / "after")
    other = open_database(tmp_path / "after", verify="full")
    assert (told["changes"], told["refused"]) == (1, 1)
    assert "another database" in told["notes"][0]
    assert "S2A" in other.plan
    assert [entry["role"] for entry in other.manifest["inputs"]] == ["database", "patch"]


def test_a_database_is_never_changed_in_place(database, tmp_path):
    file = tmp_path / "patch.toml"
    write_patch(Patch(CRS, SHA, 3, ()), file)
    with pytest.raises(ConfigError, match="in place"):
        run_accept(database.path, file, database.path)


def test_a_folder_of_others_is_not_overwritten(database, tmp_path):
    file, out = tmp_path / "patch.toml", tmp_path / "out"
    write_patch(Patch(CRS, SHA, 3, ()), file)
    out.mkdir()
    (out / "letter.txt").write_text("dear")
    with pytest.raises(OutputError, match=r"letter\.txt"):
        run_accept(database.path, file, out)
    assert Path(out / "letter.txt").read_text() == "dear"


def test_all_cells_dead_is_refused(database, tmp_path):
    every = tuple(Change("dead", (name,)) for name in database.plan.ids)
    with pytest.raises(InputError, match="a cell that is left"):
        patched(database, tmp_path, *every)


@pytest.mark.parametrize("after", [95, -35])
def test_an_eirp_that_no_cell_has_is_named_by_its_offset(database, tmp_path, after):
    """It spoke of watts given for dBm, and of no offset."""
    given = after - database.plan["S1A"].eirp_dbm
    with pytest.raises(InputError) as refused:
        patched(database, tmp_path, Change("offset", ("S1A",), offset_db=given))
    message = str(refused.value)
    expected = "expected an EIRP in -30..80 dBm after it"
    assert message.startswith(f"patch, offset_db of S1A: {expected}")
    assert f"{given:+g} dB = {after} dBm" in message
    assert "watts" not in message
