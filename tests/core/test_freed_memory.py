"""Freed memory that is kept, by the pages that a process asks for."""

import os
import subprocess
import sys

import pytest

from mapfilter._memory import keep_freed_memory

AGAIN = """
import ctypes, resource, sys
# Huge pages (PR_SET_THP_DISABLE) would hide how often memory is asked for.
ctypes.CDLL(None).prctl(41, 1, 0, 0, 0)
from mapfilter._memory import keep_freed_memory
if sys.argv[1] == "kept" and not keep_freed_memory():
    raise SystemExit(3)
for _ in range(20):
    some = [bytearray(3_000_000) for _ in range(12)]
    del some
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt)
"""


def faults(how):
    # A cluster on this machine leaves such settings to what its process starts later.
    plain = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    given = [sys.executable, "-c", AGAIN, how]
    done = subprocess.run(given, env=plain, capture_output=True, text=True, timeout=120)
    if done.returncode == 3:
        pytest.skip("not glibc")
    assert done.returncode == 0, done.stderr
    return int(done.stdout)


def test_memory_that_is_freed_is_used_again():
    given_back, kept = faults("given back"), faults("kept")
    # Twenty times 36 MB are 176 000 pages.
    assert given_back > 100_000
    assert kept < given_back / 4


def test_other_systems_are_left_as_they_are(monkeypatch):
    monkeypatch.setattr("sys.platform", "win32")
    monkeypatch.setattr("ctypes.CDLL", None)
    assert not keep_freed_memory()
