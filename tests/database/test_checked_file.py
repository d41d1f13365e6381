"""Bytes of a part of several blocks, in whatever order they are asked for."""

import io

import numpy as np
import pytest

from mapfilter.database.checked import BLOCK_BYTES, Part, _CheckedFile
from mapfilter.database.manifest import describe_part
from mapfilter.errors import StoreError

SIZE = 3 * BLOCK_BYTES + 1000


@pytest.fixture
def data(tmp_path):
    data = np.random.default_rng(1).bytes(SIZE)
    (tmp_path / "part.bin").write_bytes(data)
    return data


def part_in(folder):
    return Part.of(folder, describe_part(folder, folder / "part.bin", 1), "")


def reader(folder):
    return _CheckedFile(io.BytesIO((folder / "part.bin").read_bytes()), part_in(folder))


@pytest.mark.parametrize("number", [0, 1, 2, 3])
def test_any_block_may_be_the_first_that_is_read(tmp_path, data, number):
    checked = reader(tmp_path)
    first = number * BLOCK_BYTES
    checked.seek(first)
    assert checked.tell() == first
    assert checked.read(70) == data[first : first + 70]
    assert checked.read_block(number) == data[first : first + BLOCK_BYTES]
    assert checked.tell() == first + 70


@pytest.mark.parametrize(
    ("first", "size"),
    [(0, SIZE), (5, BLOCK_BYTES), (BLOCK_BYTES - 1, 2), (BLOCK_BYTES + 3, 2 * BLOCK_BYTES),
     (SIZE - 3, 3), (SIZE - 3, 50), (SIZE, 4), (SIZE + 10, 4), (100, 0), (2 * BLOCK_BYTES, -1),
     (7, None)],
)  # fmt: skip
def test_stretches_over_blocks_are_those_of_the_file(tmp_path, data, first, size):
    checked, plain = reader(tmp_path), io.BytesIO(data)
    for seek in (lambda one: one.seek(first), lambda one: one.seek(first - SIZE, io.SEEK_END)):
        assert seek(checked) == seek(plain) == first
        assert checked.read(size) == plain.read(size)
        assert checked.tell() == plain.tell()
    checked.seek(10)
    assert checked.seek(25, io.SEEK_CUR) == 35
    assert checked.read(3) == data[35:38]
    assert checked.readable()
    assert checked.seekable()


@pytest.mark.parametrize("number", [0, 1, 3])
def test_a_changed_byte_is_told_when_its_block_is_read(tmp_path, data, number):
    part = part_in(tmp_path)
    wrong = bytearray(data)
    wrong[number * BLOCK_BYTES + 17] ^= 1
    (tmp_path / "part.bin").write_bytes(wrong)
    with (tmp_path / "part.bin").open("rb") as stream:
        checked = _CheckedFile(stream, part)
        for other in range(4):
            if other == number:
                with pytest.raises(StoreError, match="SHA-256"):
                    checked.read_block(other)
            else:
                checked.read_block(other)


def test_a_file_is_read_from_its_beginning_to_its_end(tmp_path, data):
    checked = reader(tmp_path)
    assert checked.tell() == 0
    assert checked.read() == data
    assert checked.read() == b""


@pytest.mark.parametrize("size", [0, SIZE - 1, SIZE + 1])
def test_a_part_of_another_size_is_told_by_it_before_it_is_read(tmp_path, data, size):
    part = part_in(tmp_path)
    (tmp_path / "part.bin").write_bytes((data + b"?")[:size])
    with pytest.raises(StoreError) as caught, part.open():
        pass
    (fault,) = caught.value.faults
    assert (fault.expected, fault.got) == (f"{SIZE} bytes", f"{size} bytes")


def test_a_part_that_is_as_it_was_is_read(tmp_path, data):
    with part_in(tmp_path).open() as source:
        assert source.size() == SIZE
        assert source.read(9) == data[:9]
    small = data[:500]
    (tmp_path / "part.bin").write_bytes(small)
    with part_in(tmp_path).open() as source:
        assert source.read() == small
