"""An index of rasters whose names are shifted by one row is found as that, by check."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from check_world import LATTICE, base_levels, make_plan, make_world, write_tiff
from command_line import mapfilter
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.check.findings import Findings
from mapfilter.check.index_order import plan_by_index
from mapfilter.check.samples import RasterSample

PLAN = make_plan()
BANDS = [replace(cell, id=f"{cell.id}2", frequency_mhz=800.0) for cell in PLAN.cells]
INDEX = Path("index.txt")
levels_of = cache(base_levels)


def found_in(rasters_of, plan=PLAN, noise_db=0.0, seed=0):
    """Judge rasters (id of the index: id of the levels) in that order."""
    rng, levels = np.random.default_rng(seed), levels_of()
    noisy = {i: v + rng.normal(0, noise_db, v.shape).astype(np.float32) for i, v in levels.items()}
    samples = [
        RasterSample(name, LATTICE, noisy[of].astype(np.float32), name)
        for name, of in rasters_of.items()
    ]
    findings = Findings()
    meant = plan_by_index(samples, list(rasters_of), plan, INDEX, findings)
    return findings.found, meant


def rotated(ids, step):
    return dict(zip(ids, np.roll(ids, step).tolist(), strict=True))


@settings(max_examples=12, deadline=None)
@given(st.sampled_from([1, -1]), st.floats(0, 8), st.integers(0, 99))
def test_names_one_row_off(step, noise_db, seed):
    rasters_of = rotated(PLAN.ids, step)
    (found,), meant = found_in(rasters_of, noise_db=noise_db, seed=seed)
    assert (found.code, found.severity, found.where) == ("index-shifted", "error", "index.txt")
    side, way = ("above", "up") if step == 1 else ("below", "down")
    assert f"of the cell one row {side} (" in found.evidence
    assert found.remedy.endswith(f"{way} by one row.")
    for name, of in rasters_of.items():
        if name in meant:
            assert replace(meant[name], id=of) == PLAN[of]
    assert len(meant) >= len(PLAN) - 1


def test_also_with_two_bands_of_each_sector():
    pairs = [pair for both in zip(PLAN.cells, BANDS, strict=True) for pair in both]
    plan = replace(PLAN, cells=tuple(pairs))
    ids = [cell.id for cell in pairs]
    right = {i: i.removesuffix("2") if i in {b.id for b in BANDS} else i for i in ids}
    assert found_in(right, plan) == ([], plan)
    shifted = {i: right[of] for i, of in rotated(ids, 1).items()}
    assert [one.code for one in found_in(shifted, plan)[0]] == ["index-shifted"]


@settings(max_examples=12, deadline=None)
@given(st.permutations(PLAN.ids), st.floats(0, 8), st.integers(0, 99))
def test_right_names_in_any_order(order, noise_db, seed):
    assert found_in({i: i for i in order}, noise_db=noise_db, seed=seed) == ([], PLAN)


@pytest.mark.parametrize(
    "exchanged",
    [
        {"S1A": "S1C", "S1B": "S1A", "S1C": "S1B"},
        {f"S{n}{a}": f"S{n}{b}" for n in "123" for a, b in zip("ABC", "CAB", strict=True)},
        {"S1A": "S2A", "S2A": "S1A"},
    ],
    ids=["sectors of a site", "of each site", "sites"],
)
def test_other_exchanges_are_none(exchanged):
    assert found_in({i: exchanged.get(i, i) for i in PLAN.ids}) == ([], PLAN)


@pytest.fixture
def world(tmp_path):
    made = make_world(tmp_path, levels_of())
    made.write()
    text = made.toml.read_text(encoding="utf-8").replace("rxlev.tif", "rasters")
    made.toml.write_text(text, encoding="utf-8")
    (tmp_path / "rasters").mkdir()
    return made


def checked(world, levels, labels):
    folder = world.folder / "rasters"
    for name, values in levels.items():
        write_tiff(folder / f"{name}.tif", LATTICE, {name: values}, "level")
    rows = [f"{i};{of}.tif" for i, of in labels.items()]
    (folder / "index.txt").write_text("\n".join(["TX_NAME;FILE_NAME", *rows]), encoding="utf-8")
    outcome = mapfilter("check", "-c", world.toml, "--json")
    return [one["code"] for one in outcome.json["findings"]]


def test_the_shift_is_the_only_finding(world):
    assert checked(world, levels_of(), rotated(PLAN.ids, 1)) == ["index-shifted"]


def test_what_it_does_not_explain_is_reported_beside(world):
    strong = {name: values + 40 for name, values in levels_of().items()}
    codes = checked(world, strong, rotated(PLAN.ids, 1))
    assert codes == ["index-shifted", "levels-above-eirp"]


def test_without_a_shift_the_others_are_reported(world):
    exchanged = {"S1A": "S1C", "S1B": "S1A", "S1C": "S1B"}
    labels = {i: exchanged.get(i, i) for i in PLAN.ids}
    assert checked(world, levels_of(), labels) == ["sector-labels-swapped"]
