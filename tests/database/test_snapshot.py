"""A database is a snapshot: edited, damaged or replaced ones are named, never read as a mix."""

import json
import os
import pickle
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from small_world import FLOOR_DBM, IDS

from mapfilter._io import atomic_dir
from mapfilter._json_files import sealed
from mapfilter.database import checked
from mapfilter.database.build import build
from mapfilter.database.checked import Part, checksums, generation_of
from mapfilter.database.parquet import WindowReader, read_columns, write_columns
from mapfilter.database.store import open_database
from mapfilter.errors import StoreError


def digits(text):
    """Return where each digit of a text is that can be another one."""
    return [n for n, letter in enumerate(text) if letter.isdigit()]


def test_no_digit_of_a_manifest_can_be_changed(copy):
    file = copy / "manifest.json"
    text = file.read_text()
    places = np.random.default_rng(4).choice(digits(text), 60, replace=False)
    for place in places.tolist():
        other = str((int(text[place]) + 1) % 10)
        file.write_text(text[:place] + other + text[place + 1 :])
        with pytest.raises(StoreError, match=r"manifest\.json"):
            open_database(copy)
    file.write_text(text)
    open_database(copy)


@pytest.mark.parametrize(
    ("key", "by"), [("west_m", 10_000.0), ("north_m", -5.0), ("resolution_m", 0.5)]
)
def test_a_lattice_that_is_not_that_of_the_points_is_found_though_sealed(copy, key, by):
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["lattice"][key] += by
    (copy / "manifest.json").write_text(json.dumps(sealed(manifest)))
    with pytest.raises(StoreError, match=r"points\.parquet, extent: expected"):
        open_database(copy)


def test_a_crs_that_is_not_that_of_the_points_is_found_though_sealed(copy):
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["crs"] = manifest["lattice"]["crs"] = "EPSG:32630"
    (copy / "manifest.json").write_text(json.dumps(sealed(manifest)))
    with pytest.raises(StoreError, match=r"points\.parquet, CRS: expected EPSG:32630"):
        open_database(copy)


READS_DAMAGED = """
import sys
from pathlib import Path
from mapfilter.database.store import open_database
from mapfilter.errors import StoreError
import numpy as np
folder, step = Path(sys.argv[1]), int(sys.argv[2])
database = open_database(folder)
refused = flips = 0
for file in [folder / "points.parquet", *(one.file for one in database.level_parts["S1.A"])]:
    whole = file.read_bytes()
    size = len(whole)
    for at in range(0, size, step):
        flips += 1
        file.write_bytes(whole[:at] + bytes([whole[at] ^ (1 << at % 8)]) + whole[at + 1:])
        for read in (lambda: open_database(folder), database.field):
            try:
                read()
            except StoreError:
                refused += 1
    file.write_bytes(whole)
print(flips, refused)
"""


def test_no_flipped_bit_ends_the_process(copy):
    """Of footers, page headers and data alike: each is a StoreError, at opening and at reading."""
    run = subprocess.run(
        [sys.executable, "-c", READS_DAMAGED, str(copy), "29"], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    flips, refused = map(int, run.stdout.split())
    assert flips > 400
    assert refused == 2 * flips


def part_of_blocks(file, monkeypatch, block_bytes):
    monkeypatch.setattr(checked, "BLOCK_BYTES", block_bytes)
    digest, blocks = checksums(file)
    rows, size = pq.read_metadata(file).num_rows, file.stat().st_size
    return Part(file.parent, file.name, rows, size, digest, blocks, generation_of(file.parent))


@pytest.mark.parametrize("block_bytes", [64, 1000, 4096, 10**6])
def test_blocks_of_any_size_give_the_same_rows(copy, database, monkeypatch, block_bytes):
    part = part_of_blocks(copy / "points.parquet", monkeypatch, block_bytes)
    names = ["point", "row", "col", "geometry", "way_class"]
    assert read_columns(part, names).equals(pq.read_table(copy / "points.parquet", columns=names))
    window = (0, 0, database.lattice.rows, database.lattice.cols)
    found = WindowReader([part], ("row", "col", "way_id"), database.lattice).read(window)
    assert np.sort(found["row"]).tolist() == np.sort(database.points().row).tolist()


def test_a_column_of_a_large_part_needs_only_the_blocks_that_it_touches(tmp_path, monkeypatch):
    rng, file = np.random.default_rng(1), tmp_path / "large.parquet"
    table = pa.table({name: rng.random(40_000) for name in ("first", "second")})
    write_columns(table, file)
    part = part_of_blocks(file, monkeypatch, 4096)
    data = bytearray(file.read_bytes())
    data[len(data) // 2 + 8192] ^= 1
    file.write_bytes(bytes(data))
    assert read_columns(part, ["first"]).equals(table.select(["first"]))
    with pytest.raises(StoreError, match="SHA-256"):
        read_columns(part, ["second"])


def test_checksums_of_blocks_are_those_of_the_manifest_for_large_parts(tmp_path):
    file = tmp_path / "large"
    file.write_bytes(os.urandom(checked.BLOCK_BYTES * 2 + 5))
    assert len(checksums(file)[1]) == 3
    file.write_bytes(b"x" * checked.BLOCK_BYTES)
    assert checksums(file)[1] == ()


def rebuilt(world, out, margin_db):
    options = {"floor_dbm": FLOOR_DBM + margin_db, "tile_px": 16, "margin_db": margin_db}
    return build(world.rasters, world.plan, world.routes, out, **options)


def test_who_opened_a_database_before_it_was_replaced_is_told_so(world, copy):
    before = open_database(copy)
    field = before.field()
    rebuilt(world, copy, 5.0)
    sent = pickle.loads(pickle.dumps(before))
    reads = [before.field, before.points, lambda: before.cell_points(IDS[0]), sent.points]
    for read in reads:
        with pytest.raises(StoreError, match="replaced while in use; open it again"):
            read()
    with pytest.raises(StoreError, match="replaced while in use"):
        open_database(copy, generation=before.generation)
    after = open_database(copy)
    assert after.generation != before.generation
    assert not np.array_equal(after.field().level_dbm, field.level_dbm, equal_nan=True)


def test_who_opened_a_database_reads_on_when_an_equal_one_replaced_it(copy, database):
    before = open_database(copy)
    with atomic_dir(copy) as new:
        shutil.copytree(database.path, new, dirs_exist_ok=True)
    assert before.generation == open_database(copy).generation
    np.testing.assert_array_equal(before.field().level_dbm, database.field().level_dbm)


def test_a_database_that_is_gone_is_told_apart_from_a_damaged_one(copy):
    before = open_database(copy)
    shutil.rmtree(copy)
    with pytest.raises(StoreError, match="another one, or none"):
        before.points()


def test_an_opening_meets_a_replacement(world, copy, monkeypatch):
    """Replaced between its manifest and its parts: opened as it is afterwards."""
    from mapfilter.database import store

    read, calls = store.read_manifest, []

    def replaced_after(folder):
        found = read(folder)
        if not calls:
            calls.append(found)
            rebuilt(world, copy, 4.0)
        return found

    monkeypatch.setattr(store, "read_manifest", replaced_after)
    assert open_database(copy).margin_db == 4.0
    assert calls


def test_a_reader_of_one_cell_needs_no_other(copy):
    database = open_database(copy)
    assert replace(database, manifest={**database.manifest}).cell_points(IDS[0])[0].size > 0
