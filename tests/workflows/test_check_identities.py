"""Cells that reports cannot tell apart are found by ``check``."""

import pytest
from check_world import CRS, make_world
from command_line import mapfilter

from mapfilter.check.findings import Findings
from mapfilter.check.identity_checks import check_identities
from mapfilter.radio.cells import Cell, CellPlan


@pytest.fixture
def world(tmp_path, levels):
    made = make_world(tmp_path, levels)
    for number, row in enumerate(made.rows):
        row |= {"mcc": 244, "mnc": 91, "lac": 3021, "ci": 100 + number}
        row |= {"arfcn": 600 + number, "bsic": number, "technology": "GSM"}
    return made


def check(world):
    world.write()
    outcome = mapfilter("check", "-c", world.toml, "--json", *world.settings)
    assert outcome.err == ""
    return outcome.code, outcome.json["findings"]


def test_identities_of_their_own_are_no_finding(world):
    assert check(world) == (0, [])


def test_two_cells_of_one_identity(world):
    world.row("S2B")["ci"] = world.row("S1A")["ci"]
    code, (found,) = check(world)
    assert (code, found["code"], found["severity"]) == (2, "identity-repeated", "error")
    assert found["where"].endswith("cells S1A, S2B")
    assert "S1A, S2B have 244-91-3021-100." in found["evidence"]


def test_the_location_area_counts_in_gsm_and_not_in_lte(world):
    world.row("S2B").update(ci=100, lac=3022)
    assert check(world) == (0, [])
    for row in world.rows:
        row["technology"] = "LTE"
    assert [found["code"] for found in check(world)[1]] == ["identity-repeated"]


def test_cells_of_other_technologies_have_numbers_of_their_own(world):
    names = ("mcc", "mnc", "lac", "ci", "arfcn", "bsic")
    same = {name: world.row("S1A")[name] for name in names}
    world.row("S2B").update(same, technology="LTE")
    assert check(world) == (0, [])


def test_parts_of_an_identity_are_a_warning(world):
    for row in world.rows:
        row |= {"mcc": "", "mnc": "", "lac": ""}
    world.row("S2B")["ci"] = world.row("S1A")["ci"]
    code, (found,) = check(world)
    assert (code, found["code"], found["severity"]) == (0, "identity-repeated", "warning")


def test_ids_that_are_identities_count_as_these(world):
    world.rename({"S2B": "244-91-3021-100"})
    world.row("S2B").update(cell="244-91-3021-100", mcc="", mnc="", lac="", ci="")
    code, (found,) = check(world)
    assert (code, found["code"]) == (2, "identity-repeated")


@pytest.mark.parametrize(("one", "other"), [("S1A", "S1B"), ("S1A", "S3B")])
def test_one_carrier_and_code_at_a_site_or_near_it(world, one, other):
    world.row(other).update({name: world.row(one)[name] for name in ("arfcn", "bsic")})
    code, (found,) = check(world)
    assert (code, found["code"], found["severity"]) == (0, "code-reused-nearby", "warning")
    assert f"{one} and {other} (600, 0) are " in found["evidence"]
    world.row(other)["bsic"] = 63
    assert check(world) == (0, [])


def rows_of_sites(count, spacing_m, again_at):
    """A plan of sites in a row, of which the first and another have one carrier and code."""
    cells = [
        Cell(
            f"C{n}", f"S{n}", 385_000.0 + n * spacing_m, 6_673_000.0, 30.0, None, 43.0, 1800.0,
            antenna="omni", arfcn=600, bsic=0 if n in (0, again_at) else n,
        )
        for n in range(count)
    ]  # fmt: skip
    return CellPlan(CRS, tuple(cells))


@pytest.mark.parametrize(
    ("spacing_m", "again_at", "is_near"),
    [(500.0, 6, True), (500.0, 7, False), (4000.0, 2, True), (4000.0, 3, False)],
)
def test_codes_are_used_again_far_away(spacing_m, again_at, is_near):
    findings = Findings()
    plan = rows_of_sites(20, spacing_m, again_at)
    check_identities(plan, "cells.csv", findings)
    assert [found.code for found in findings.found] == ["code-reused-nearby"] * is_near


def test_sectors_whose_sites_have_their_own_names_are_of_one_site():
    cells = [
        Cell(
            f"C{n}", f"C{n}", 385_000.0 + 500.0 * (n // 3), 6_673_000.0, 30.0, 120.0 * (n % 3),
            43.0, 1800.0, arfcn=600, bsic=0 if n in (0, 12) else n,
        )
        for n in range(60)
    ]  # fmt: skip
    findings = Findings()
    check_identities(CellPlan(CRS, tuple(cells)), "cells.csv", findings)
    (found,) = findings.found
    assert "C0 and C12 (600, 0) are 2000 m apart" in found.evidence


def test_names_of_site_sector_and_carrier_are_no_identities():
    """A site's number of five digits was taken for that of a network: its sectors were one cell."""
    cells = [
        Cell(
            f"12345-{n}-2", "12345", 385_000.0, 6_673_000.0, 30.0, 120.0 * n, 43.0, 1800.0,
            technology="LTE",
        )
        for n in range(3)
    ]  # fmt: skip
    findings = Findings()
    check_identities(CellPlan(CRS, tuple(cells)), "cells.csv", findings)
    assert findings.found == []


def test_many_cells_of_one_placeholder_take_no_long_time():
    cells = [
        Cell(
            f"C{n}", f"S{n}", 385_000.0 + 90.0 * (n % 100), 6_673_000.0 + 90.0 * (n // 100), 30.0,
            None, 43.0, 1800.0, antenna="omni", arfcn=0, bsic=0, ci=0,
        )
        for n in range(10_000)
    ]  # fmt: skip
    findings = Findings()
    check_identities(CellPlan(CRS, tuple(cells)), "cells.csv", findings)
    assert [found.code for found in findings.found] == ["identity-repeated", "code-reused-nearby"]
    assert all(len(found.evidence) < 600 for found in findings.found)


def test_cells_of_gsm_and_umts_may_have_one_identity(world):
    world.row("S2B").update(ci=100, technology="UMTS")
    assert check(world) == (0, [])
