"""A manifest lists as many checksums of a part's blocks as its size asks for."""

import hashlib

import numpy as np
import pytest
from pydantic import ValidationError

from mapfilter.database.checked import BLOCK_BYTES, checksums
from mapfilter.database.manifest import _Part, describe_part

SHA = "0" * 64


def entry(size, blocks):
    return {"path": "points.parquet", "rows": 3, "bytes": size, "sha256": SHA, "blocks": blocks}


@pytest.mark.parametrize(
    ("size", "blocks"),
    [(0, 0), (1, 0), (BLOCK_BYTES, 0), (BLOCK_BYTES + 1, 2), (2 * BLOCK_BYTES, 2),
     (2 * BLOCK_BYTES + 1, 3)],
)  # fmt: skip
def test_a_part_has_a_checksum_for_each_block(size, blocks):
    """None beside that of the whole where there is but one block."""
    assert len(_Part.model_validate(entry(size, [SHA] * blocks)).blocks) == blocks
    for other in {0, 1, 2, 3, 4} - {blocks}:
        with pytest.raises(ValidationError, match="a checksum for each of"):
            _Part.model_validate(entry(size, [SHA] * other))


@pytest.mark.parametrize("size", [0, 100, BLOCK_BYTES, BLOCK_BYTES + 1, 3 * BLOCK_BYTES - 5])
def test_what_is_described_is_accepted(tmp_path, size):
    data = np.random.default_rng(1).bytes(size)
    (tmp_path / "levels").mkdir()
    file = tmp_path / "levels" / "part.bin"
    file.write_bytes(data)
    found = describe_part(tmp_path, file, 7, "S1.A")
    parts = [data[first : first + BLOCK_BYTES] for first in range(0, size, BLOCK_BYTES)]
    expected = [hashlib.sha256(one).hexdigest() for one in parts] if len(parts) > 1 else []
    assert found.get("blocks", []) == expected
    assert (found["path"], found["rows"], found["bytes"]) == ("levels/part.bin", 7, size)
    assert found["cell"] == "S1.A"
    assert found["sha256"] == hashlib.sha256(data).hexdigest()
    assert checksums(file) == (found["sha256"], tuple(expected))
    assert _Part.model_validate(found).blocks == expected
    assert "cell" not in describe_part(tmp_path, file, 7)
