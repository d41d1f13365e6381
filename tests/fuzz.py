"""Hostile files, made from good ones: what every reader has to refuse, or to read, in peace.

A test feeds them to its reader and counts; ``--mutations 20000`` makes any such test a long one.
"""

import re
import resource
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from mapfilter.errors import MapfilterError

MUTATIONS = 100
"""How many of each sample the tests try when nobody asks for more."""
LONGEST_S = 10.0
MEMORY_BYTES = 512 << 20

_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_TEXTS = (
    b"", b"0", b"-0", b"-1", b"1", b"1e9", b"-1e9", b"1e308", b"-1e308", b"1e400", b"1e-320",
    b"nan", b"-inf", b"inf", b"2147483647", b"2147483648", b"4294967295", b"-2147483649",
    b"9223372036854775808", b"99999999999999999999999999", b"1,5", b"1.5", b"0x10", b"1_000",
    "\u0663".encode(), b"9" * 5000, b"-", b"+", b".", b"abc", b'"', b"\0", b"\xff\xfe", b"../../x",
    b"C:\\x", b"\n", b";", b",", b"\t", b"{}", b"\xe2\x82",
)  # fmt: skip
_WHOLE = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 2**31 - 1, 2**31, 2**32 - 1,
          2**40, 2**63 - 1, 2**63, 2**64 - 1)  # fmt: skip
_REAL = (0.0, -0.0, 1.0, -1.0, 1e-300, 1e10, 1e300, -1e300, np.inf, -np.inf, np.nan)
_HEAD_BYTES = 400
_HEAD_SHARE = 0.4
_MOST_CHANGES = 4


def mutations(sample: bytes, count: int, seed: int) -> Iterator[bytes]:
    """Yield damaged copies of a sample: bits flipped, cut off, spliced, numbers edited.

    The same arguments give the same copies; the first ones of a longer run are those of a shorter.
    """
    changes: tuple[Callable[[bytearray, np.random.Generator], None], ...] = (
        _flip_bits, _write_bytes, _cut_end, _cut_start, _cut_out, _double, _splice, _swap_bytes,
        _binary_number, _text_number, _text_number, _text_number, _insert_text, _swap_lines,
    )  # fmt: skip
    for i in range(count):
        rng = np.random.default_rng((seed, i))
        data = bytearray(sample)
        for _ in range(int(rng.integers(1, _MOST_CHANGES))):
            changes[int(rng.integers(len(changes)))](data, rng)
        yield bytes(data)


@dataclass(frozen=True)
class Tally:
    """How many copies a reader read and refused, its longest time and how its memory grew.

    Times are of the processor, as a busy machine says nothing about a reader.
    """

    read: int
    refused: int
    longest_s: float
    grown_bytes: int


def fuzz(sample: bytes, read: Callable[[bytes], object], count: int, seed: int = 0) -> Tally:
    """Feed mutations to a reader; any error but mapfilter's own goes through.

    Raises
    ------
    AssertionError
        One took longer than 10 s, or memory grew by more than twice the sample and 512 MB.
    """
    refused, longest_s, before_bytes = 0, 0.0, _peak_bytes()
    for i, data in enumerate(mutations(sample, count, seed)):
        # Of this process alone: a loaded machine makes no reader slow.
        began_s, said = time.process_time(), "nothing, as it was read"
        try:
            read(data)
        except MapfilterError as error:
            refused += 1
            said = str(error)
        except BaseException as error:
            error.add_note(f"mutation {i} of seed {seed}")
            raise
        assert said.strip(), f"mutation {i} of seed {seed} was refused without a word"
        longest_s = max(longest_s, time.process_time() - began_s)
        assert longest_s < LONGEST_S, f"mutation {i} of seed {seed} took {longest_s:.1f} s"
        grown_bytes = _peak_bytes() - before_bytes
        assert grown_bytes < 2 * len(sample) + MEMORY_BYTES, f"mutation {i} of seed {seed}: memory"
    return Tally(count - refused, refused, longest_s, _peak_bytes() - before_bytes)


def _peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def _place(data: bytearray, rng: np.random.Generator) -> int:
    """Return an offset, more often in the head, where sizes and types stand."""
    end = min(len(data), _HEAD_BYTES) if rng.random() < _HEAD_SHARE else len(data)
    return int(rng.integers(0, end + 1))


def _length(data: bytearray, rng: np.random.Generator) -> int:
    """Return a length, mostly short."""
    return int(min(len(data), np.exp(rng.uniform(0, np.log(max(len(data), 2))))))


def _flip_bits(data: bytearray, rng: np.random.Generator) -> None:
    for _ in range(int(rng.integers(1, 5))):
        if data:
            at = min(_place(data, rng), len(data) - 1)
            data[at] ^= 1 << int(rng.integers(8))


def _write_bytes(data: bytearray, rng: np.random.Generator) -> None:
    at, length = _place(data, rng), int(rng.integers(1, 9))
    data[at : at + length] = rng.bytes(length)


def _cut_end(data: bytearray, rng: np.random.Generator) -> None:
    del data[_place(data, rng) :]


def _cut_start(data: bytearray, rng: np.random.Generator) -> None:
    del data[: _length(data, rng)]


def _cut_out(data: bytearray, rng: np.random.Generator) -> None:
    at = _place(data, rng)
    del data[at : at + _length(data, rng)]


def _double(data: bytearray, rng: np.random.Generator) -> None:
    at = _place(data, rng)
    data[at:at] = data[at : at + _length(data, rng)]


def _splice(data: bytearray, rng: np.random.Generator) -> None:
    at, other, length = _place(data, rng), _place(data, rng), _length(data, rng)
    data[at : at + length] = data[other : other + length]


def _swap_bytes(data: bytearray, rng: np.random.Generator) -> None:
    """Turn numbers of 2, 4 or 8 bytes into the other byte order: one, or all that follow."""
    size = int(rng.choice((2, 4, 8)))
    at = _place(data, rng) // size * size
    end = at + size if rng.random() < 0.7 else len(data)
    for start in range(at, min(end, len(data) - size + 1), size):
        data[start : start + size] = data[start : start + size][::-1]


def _binary_number(data: bytearray, rng: np.random.Generator) -> None:
    size, order = int(rng.choice((1, 2, 4, 8))), "<" if rng.random() < 0.8 else ">"
    at = _place(data, rng)
    if rng.random() < 0.5:
        at = at // size * size
    if size >= 4 and rng.random() < 0.3:
        with np.errstate(over="ignore"):
            value = np.array(_REAL[int(rng.integers(len(_REAL)))]).astype(f"{order}f{size}")
        number = value.tobytes()
    else:
        whole = _WHOLE[int(rng.integers(len(_WHOLE)))] % 256**size
        number = whole.to_bytes(size, "little" if order == "<" else "big")
    data[at : at + size] = number


def _text_number(data: bytearray, rng: np.random.Generator) -> None:
    """Replace a number written as text by one that nobody expects."""
    start = _place(data, rng)
    found = _NUMBER.search(bytes(data), start) or _NUMBER.search(bytes(data))
    if found is not None:
        data[found.start() : found.end()] = _TEXTS[int(rng.integers(len(_TEXTS)))]


def _insert_text(data: bytearray, rng: np.random.Generator) -> None:
    at = _place(data, rng)
    data[at:at] = _TEXTS[int(rng.integers(len(_TEXTS)))]


def _swap_lines(data: bytearray, rng: np.random.Generator) -> None:
    lines = bytes(data).split(b"\n")
    a, b = rng.integers(len(lines), size=2)
    lines[a], lines[b] = lines[b], lines[a]
    data[:] = b"\n".join(lines)


if __name__ == "__main__":
    import sys
    import warnings
    from itertools import chain
    from pathlib import Path

    _OWN = Path(__file__).parent
    _ROOMS = ("roads", "positioning", "experiments")
    sys.path[:0] = [str(_OWN), *(str(_OWN / room) for room in _ROOMS)]
    from fuzz_command import main
    from fuzz_readers import targets
    from fuzz_stored import stored

    # A warning says of no file what is wrong with it: it is a fault, too.
    warnings.simplefilter("error")
    sys.exit(main(lambda folder: chain(targets(folder), stored(folder))))
