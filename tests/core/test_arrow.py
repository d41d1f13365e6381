"""Arrow: what is read leaves no thread behind that holds an object of Python."""

import ast
import io
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import mapfilter
from mapfilter._arrow import arrow_bytes, arrow_file, open_parquet

ROOT = Path(mapfilter.__file__).parent
THREADED = {"read_csv", "read_parquet", "read_feather", "open_csv", "read_json", "dataset"}


def arrow_calls():
    """Yield file and call of what reads with Arrow, of the modules that import it."""
    for file in ROOT.rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        if "pyarrow" not in text:
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                yield str(file.relative_to(ROOT)), node


def test_parquet_is_read_by_one_door():
    found = {
        (file, node.func.attr)
        for file, node in arrow_calls()
        if node.func.attr in ("ParquetFile", "read_table", "ParquetDataset")
    }
    assert found == {("_arrow.py", "ParquetFile")}


def test_what_always_uses_threads_is_given_memory_of_arrow():
    found = []
    for file, node in arrow_calls():
        of_pandas = isinstance(node.func.value, ast.Name) and node.func.value.id == "pd"
        if node.func.attr in THREADED and not of_pandas:
            given = ast.unparse(node.args[0])
            assert re.match(r"pa\.BufferReader\(arrow_(bytes|file)\(", given), (file, given)
            found.append(file)
    assert len(found) == 3


@pytest.mark.skipif(sys.platform != "linux", reason="threads are counted in /proc")
@pytest.mark.parametrize("kind", ["bytes", "path", "file"])
def test_reading_parquet_starts_no_thread(tmp_path, kind):
    table = pa.table({name: np.arange(20_000) for name in "abcd"})
    path = tmp_path / "table.parquet"
    pq.write_table(table, path, row_group_size=5_000)
    code = """
import os, sys
from pathlib import Path
import pyarrow as pa
from mapfilter._arrow import open_parquet

path, kind = Path(sys.argv[1]), sys.argv[2]
data = path.read_bytes()
given = {"bytes": pa.BufferReader(data), "path": path, "file": path.open("rb")}[kind]
before = len(os.listdir("/proc/self/task"))
with open_parquet(given) as source:
    rows = source.read(["a", "c"]).num_rows + source.read_group(1, ["b"]).num_rows
print(rows, len(os.listdir("/proc/self/task")) - before)
"""
    run = [sys.executable, "-c", code, str(path), kind]
    assert subprocess.check_output(run, text=True).split() == ["25000", "0"]


def test_a_reader_gives_columns_groups_and_footer(tmp_path):
    path = tmp_path / "table.parquet"
    table = pa.table({"a": [1, 2, 3], "b": ["x", "y", "z"]})
    pq.write_table(table, path, row_group_size=2)
    with open_parquet(path) as source:
        footer = source.footer
        assert source.columns == ["a", "b"]
        assert source.read().equals(table)
        assert source.read(["b"]).equals(table.select(["b"]))
    assert footer.num_row_groups == 2
    with open_parquet(path, footer) as source:
        assert source.read_group(1, ["b"]).to_pydict() == {"b": ["z"]}


def test_a_page_that_changed_is_no_table(tmp_path):
    path = tmp_path / "table.parquet"
    values = np.random.default_rng(0).normal(size=1000)
    pq.write_table(pa.table({"a": values}), path, write_page_checksum=True, compression="none")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with open_parquet(path) as source, pytest.raises(OSError, match="CRC"):
        source.read()


def test_bytes_are_copied():
    data = bytearray(b"a,b\n1,2\n")
    held = arrow_bytes(memoryview(data)[4:])
    data[4] = ord("9")
    assert held.to_pybytes() == b"1,2\n"
    assert arrow_bytes(b"").to_pybytes() == b""


def test_a_file_is_read_whole_from_anywhere_in_it(tmp_path):
    path = tmp_path / "some"
    path.write_bytes(bytes(range(256)))
    with path.open("rb") as stream:
        stream.read(7)
        assert arrow_file(stream).to_pybytes() == bytes(range(256))


def test_a_file_that_is_cut_off_meanwhile_is_told():
    class Shrinking(io.BytesIO):
        def seek(self, to, whence=0):
            at = super().seek(to, whence)
            if not to and not whence:
                self.truncate(10)
            return at

    with pytest.raises(OSError, match="shorter"):
        arrow_file(Shrinking(b"0123456789ABC"))
