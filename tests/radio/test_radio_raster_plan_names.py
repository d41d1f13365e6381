"""Names of rasters that hold ids of a plan: which prefix and suffix are theirs."""

from dataclasses import dataclass, replace
from pathlib import Path
from unicodedata import normalize

import pytest

from mapfilter.check.findings import Findings
from mapfilter.check.raster_checks import check_ids
from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.names import named_by_plan
from mapfilter.rasters.raster_set import RxLevRasters, check_against_plan

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
    # The longer id is the one that the name holds, whichever side it is longer on.
    for names, longest in ((("xA1", "xA2"), ("A1", "A2")), (("1Ax", "2Ax"), ("1A", "2A"))):
        found = named_by_plan(rasters(*names), plan("1", "2", *longest))
        assert found.cell_ids == longest
    # An id that occurs twice in a name stands where the other names have theirs.
    found = named_by_plan(rasters("7_7", "7_8"), plan("7", "8"))
    assert found.cell_ids == ("7", "8")


def test_without_any_id_in_the_first_names_nothing_changes():
    given = rasters("a", "b", "c", "HDS01")
    assert named_by_plan(given, plan(*TEN)) is given
    assert replace(given) == given


ACCENTED = ("Café-1", "Orléans", "plain")


@pytest.mark.parametrize(("of_files", "of_plan"), [("NFD", "NFC"), ("NFC", "NFD")])
def test_names_in_another_unicode_form_are_those_of_the_plan(of_files, of_plan):
    ids = tuple(normalize(of_plan, one) for one in ACCENTED)
    found = named_by_plan(rasters(*(normalize(of_files, one) for one in ACCENTED)), plan(*ids))
    assert found.cell_ids == ids
    assert [file.cell_ids for file in found.files] == [ids[:2], ids[2:]]
    note = "2 rasters named as in the plan, in another Unicode form"
    assert found.notes == ("before", note)
    check_against_plan(found, plan(*ids))


def test_names_in_another_unicode_form_between_common_texts():
    ids = ACCENTED[:2]
    found = named_by_plan(rasters(*(normalize("NFD", f"HD{one}_é") for one in ids)), plan(*ids))
    assert found.cell_ids == ids


@pytest.mark.parametrize("twice", ["files", "plan"])
def test_two_names_of_one_form_are_left_alone(twice):
    both, one = ("Caf\u00e9", "Cafe\u0301"), ("Cafe\u0301",)
    given = rasters(*(both if twice == "files" else one))
    assert named_by_plan(given, plan(*(("Caf\u00e9",) if twice == "files" else both))) is given


def test_names_in_another_case_are_named_as_that():
    with pytest.raises(InputError) as caught:
        check_against_plan(rasters("s1a", "s1b", "X"), plan("S1A", "S1B", "X"))
    hint = "names differ in upper and lower case only: raster 's1a', cell 'S1A' and 1 more"
    assert [fault.hint for fault in caught.value.faults] == [hint, hint]
    with pytest.raises(InputError, match="different dates or places"):
        check_against_plan(rasters("s1a"), plan("T1A"))


def test_a_check_tells_of_another_case_too():
    findings = Findings()
    check_ids(rasters("s1a", "X"), plan("S1A", "X"), "cells.csv", findings)
    told = {finding.code: finding.evidence for finding in findings.result().findings}
    assert told == {
        "cell-without-raster": "1 of 2 cells have no raster: S1A. Names differ in upper and lower "
        "case only: raster 's1a', cell 'S1A'.",
        "raster-without-cell": "1 of 2 rasters have no cell: s1a.",
    }
    findings = Findings()
    check_ids(rasters("t1a"), plan("S1A"), "cells.csv", findings)
    assert all("case" not in finding.evidence for finding in findings.result().findings)


def test_tiles_of_one_cell_are_named_as_such():
    with pytest.raises(InputError) as caught:
        check_against_plan(rasters("A_1", "A_2", "B_1", "B_2"), plan("A", "B"))
    hint = "several rasters of cell 'A', such as 'A_1' and 'A_2'; join tiles of an area"
    assert [fault.hint.startswith(hint) for fault in caught.value.faults] == [True, True]
    for others in (("A_1", "B_2"), ("X_1", "X_2", "X_3", "X_4")):
        with pytest.raises(InputError, match="different dates or places"):
            check_against_plan(rasters(*others), plan("A", "B"))


def test_cells_that_the_plan_switches_off_are_told_as_that():
    off = replace(plan("S1A"), inactive=("S1B", "S1C"))
    findings = Findings()
    check_ids(rasters("S1A", "S1B", "odd"), off, "cells.csv", findings)
    (told,) = findings.result().findings
    assert told.evidence == (
        "2 of 3 rasters have no cell: S1B, odd. The plan has S1B, but switched off: switch it on, "
        "or take its raster out."
    )
    with pytest.raises(InputError, match=r"likely: the plan has S1B, but switched off: switch it"):
        check_against_plan(rasters("S1A", "S1B", "odd"), off)
    # Also where files have more in their names than the cell.
    found = named_by_plan(rasters("HDS1A_1", "HDS1B_1"), off)
    assert found.cell_ids == ("S1A", "S1B")


def test_a_cell_of_which_one_row_is_switched_off_still_names_its_raster():
    """As a plan has with a carrier each, of which one is not yet on air, or two that are not."""
    off = replace(plan("S1A"), inactive=("S1A", "S1B", "S1B"))
    assert named_by_plan(rasters("HDS1A_1"), off).cell_ids == ("S1A",)
    found = named_by_plan(rasters("HDS1A_1", "HDS1B_1"), off)
    assert found.cell_ids == ("S1A", "S1B")


def test_a_row_without_a_name_that_is_switched_off_names_no_raster():
    off = replace(plan("S1A"), inactive=("",))
    assert named_by_plan(rasters("odd"), off).cell_ids == ("odd",)


def test_an_id_may_begin_within_another_place_of_it():
    """Of equally good texts before and after it those before are the longest."""
    for name, cell_id, prefix in (("x11", "1", "x1"), ("x111y", "11", "x1")):
        found = named_by_plan(rasters(name), plan(cell_id))
        assert found.cell_ids == (cell_id,)
        suffix = name.removeprefix(prefix + cell_id)
        assert found.notes[-1] == f"rasters named {prefix}*{suffix}, where * is a cell of the plan"
