"""Names of rasters that hold ids of a plan: which prefix and suffix are theirs."""

from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from mapfilter.geodesy import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.names import named_by_plan
from mapfilter.rasters.raster_set import RxLevRasters

CRS = "EPSG:32629"
LATTICE = Lattice(CRS, 500_000.0, 4_000_000.0, 5.0, 4, 4)


@dataclass(frozen=True)
class File:
    cell_ids: tuple[str, ...]


def rasters(*names, notes=("before",)):
    """Rasters of some names, two to a file."""
    files = tuple(File(names[n : n + 2]) for n in range(0, len(names), 2))
    return RxLevRasters(Path("x"), names, LATTICE, "level", files, (), 1.0, "nearest", notes)


def plan(*ids):
    return CellPlan(CRS, tuple(Cell(one, "S", 1.0, 2.0, 30.0, 90.0, 50.0, 1800.0) for one in ids))


TEN = tuple(f"S{n:02}" for n in range(10))


@pytest.mark.parametrize(("prefix", "suffix"), [("HD", "_RSRP"), ("", ".best"), ("net-", "")])
def test_a_common_prefix_and_suffix_are_taken_away(prefix, suffix):
    given = rasters(*(f"{prefix}{one}{suffix}" for one in TEN))
    found = named_by_plan(given, plan(*TEN))
    assert found.cell_ids == TEN
    assert [file.cell_ids for file in found.files] == [TEN[n : n + 2] for n in range(0, 10, 2)]
    note = f"rasters named {prefix}*{suffix}, where * is a cell of the plan"
    assert found.notes == ("before", note)


def test_nothing_changes_where_a_raster_has_an_id_of_the_plan():
    for names in ((TEN[3], "HDS01", "HDS02"), ("HDS01", "HDS02", TEN[3]), ()):
        given = rasters(*names)
        assert named_by_plan(given, plan(*TEN)) is given


@pytest.mark.parametrize(("strange", "named"), [(1, True), (2, False)])
def test_nine_of_ten_names_have_to_fit(strange, named):
    names = [f"HD{one}" for one in TEN[:-strange]] + [f"HDX{n}" for n in range(strange)]
    given = rasters(*names)
    found = named_by_plan(given, plan(*TEN))
    if named:
        # The one that does not fit keeps its name.
        assert found.cell_ids == (*TEN[:9], "HDX0")
    else:
        assert found is given


def test_the_first_names_may_be_strange_and_the_fourth_is_too_late():
    fitting = [f"HD{one}" for one in TEN]
    for strange, named in ((2, True), (3, False)):
        names = [f"odd{n}" for n in range(strange)] + fitting * 4
        given = rasters(*dict.fromkeys(names), *(f"HDT{n:03}" for n in range(40)))
        ids = plan(*TEN, *(f"T{n:03}" for n in range(40)))
        assert (named_by_plan(given, ids) is not given) == named


def test_of_ids_within_ids_the_longest_are_taken():
    ids = ("A1", "A11", "1")
    found = named_by_plan(rasters("xA1y", "xA11y"), plan(*ids))
    assert found.cell_ids == ("A1", "A11")
    # An id that occurs twice in a name stands where the other names have theirs.
    found = named_by_plan(rasters("7_7", "7_8"), plan("7", "8"))
    assert found.cell_ids == ("7", "8")


def test_without_any_id_in_the_first_names_nothing_changes():
    given = rasters("a", "b", "c", "HDS01")
    assert named_by_plan(given, plan(*TEN)) is given
    assert replace(given) == given
