"""The engine that makes hostile files."""

from itertools import islice

import pytest
from fuzz import fuzz, mutations

from mapfilter.errors import InputError, fail

SAMPLE = b"ncols 3\nnrows 2\ncellsize 5.0\n" + bytes(range(256))


def test_equal_arguments_give_equal_copies_whatever_the_count() -> None:
    some = list(mutations(SAMPLE, 50, seed=1))
    assert some == list(islice(mutations(SAMPLE, 1000, seed=1), 50))
    assert some != list(mutations(SAMPLE, 50, seed=2))


def test_copies_differ_in_many_ways() -> None:
    copies = list(mutations(SAMPLE, 500, seed=0))
    assert sum(copy != SAMPLE for copy in copies) > 450
    assert len({len(copy) for copy in copies}) > 50
    assert any(b"1e308" in copy for copy in copies)


@pytest.mark.parametrize("sample", [b"", b"1", b"\n"])
def test_tiny_samples(sample: bytes) -> None:
    assert len(list(mutations(sample, 200, seed=0))) == 200


def test_refusals_are_counted_and_crashes_go_through() -> None:
    def read(data: bytes) -> None:
        if len(data) < len(SAMPLE):
            raise fail(InputError, "x", "more", "less")

    tally = fuzz(SAMPLE, read, 100)
    assert tally.read + tally.refused == 100
    assert tally.refused > 10
    with pytest.raises(KeyError) as caught:
        fuzz(SAMPLE, lambda _: {}["x"], 3)
    assert caught.value.__notes__ == ["mutation 0 of seed 0"]
