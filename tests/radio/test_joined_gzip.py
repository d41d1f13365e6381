"""Lists of cells that are several gzip files one after another."""

import gzip
from pathlib import Path

from mapfilter.radio.tables import read_table


def test_all_files_of_a_joined_gzip_are_read(tmp_path: Path) -> None:
    path = tmp_path / "cells.csv.gz"
    path.write_bytes(gzip.compress(b"id,lat\nA,60\n") + gzip.compress(b"B,61\n") + bytes(512))
    assert len(read_table(path, "a cell plan").rows) == 2
