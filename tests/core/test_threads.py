"""Parts of particles: each is done once, errors are raised once, and no thread goes on."""

import contextlib
import gc
import os
import pickle
import signal
import subprocess
import sys
import threading
import weakref
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from time import sleep

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter._parallel import local_executor
from mapfilter._threads import LEAST_PARTICLES, ONE, Threads

SIZE = 5 * 1024 + 7


def names():
    return [one.name for one in threading.enumerate() if one.name.startswith("mapfilter-part")]


@given(st.integers(1, 200_000), st.integers(1, 64), st.integers(0, 100_000))
def test_parts_are_all_particles_once(size, count, least):
    parts = Threads(count, least).parts(size)
    assert parts[0][0] == 0
    assert parts[-1][1] == size
    assert all(end == first for (_, end), (first, _) in pairwise(parts))
    assert all(first % 1024 == 0 and end > first for first, end in parts)
    if size < least or count == 1:
        assert parts == [(0, size)]
    else:
        assert len(parts) == min(count, -(-size // 1024))
        lengths = [end - first for first, end in parts]
        assert max(lengths) - min(lengths) <= 2 * 1024


def test_no_particles():
    called = []
    Threads(3, least=0).over(0, (lambda first, stop: called.append((first, stop)),))
    assert called == [(0, 0)]


def test_calls_are_made_in_turn_for_each_part():
    made, lock = [], threading.Lock()

    def call(first, stop, name):
        with lock:
            made.append((first, stop, name, threading.get_ident()))

    three = Threads(3, least=0)
    three.over(SIZE, (call, "one"), (call, "other"))
    by_part = {part: [row for row in made if row[:2] == part] for part in three.parts(SIZE)}
    assert len(made) == 6
    for rows in by_part.values():
        assert [row[2] for row in rows] == ["one", "other"]
        assert rows[0][3] == rows[1][3]
    assert {row[3] for row in by_part[three.parts(SIZE)[0]]} == {threading.get_ident()}


def test_few_particles_are_not_divided():
    seen = []
    Threads(2).over(LEAST_PARTICLES - 1, (lambda *part: seen.append(part),))
    ONE.over(10**6, (lambda *part: seen.append(part),))
    assert seen == [(0, LEAST_PARTICLES - 1), (0, 10**6)]
    assert Threads(2).divide(LEAST_PARTICLES)


@pytest.mark.parametrize("failing", [{0}, {2048}, {0, 2048, 4096}])
def test_an_error_is_raised_once_and_after_all_parts(failing):
    done, begun = [], threading.Barrier(3)

    def call(first, _):
        begun.wait(60)
        if first in failing:
            raise ValueError(f"part {first}")
        sleep(0.02)
        done.append(first)

    three = Threads(3, least=0)
    assert [first for first, _ in three.parts(SIZE)] == [0, 2048, 4096]
    with pytest.raises(ValueError, match=f"part {min(failing)}"):
        three.over(SIZE, (call,))
    assert sorted(done) == sorted({0, 2048, 4096} - failing)
    # The threads are there for further parts.
    failing.clear()
    done.clear()
    three.over(SIZE, (call,))
    assert sorted(done) == [0, 2048, 4096]


def test_there_are_no_more_threads_than_asked():
    four, before, begun = Threads(4, least=0), len(names()), threading.Barrier(4)
    for _ in range(200):
        four.over(SIZE, (lambda *_: begun.wait(60),))
    assert len(names()) == max(before, 3)


def test_callers_side_by_side_do_not_share_a_part():
    def count(one):
        for _ in range(100):
            found = np.zeros(SIZE)
            three.over(SIZE, (add, found, one))
            assert found.min() == found.max() == one

    def add(first, stop, found, one):
        found[first:stop] += one

    three = Threads(3, least=0)
    with ThreadPoolExecutor(3) as callers:
        assert list(callers.map(count, (1.0, 2.0, 3.0))) == [None] * 3


def test_an_interrupt_is_raised_after_all_parts():
    done, begun = [], threading.Barrier(2)

    def call(first, _):
        begun.wait(60)
        if first == 0:
            # While the calling thread waits for the other part.
            signal.setitimer(signal.ITIMER_REAL, 0.05)
        else:
            sleep(0.3)
            done.append(first)

    two, before = Threads(2, least=0), signal.getsignal(signal.SIGALRM)
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            two.over(SIZE, (call,))
    finally:
        signal.signal(signal.SIGALRM, before)
    assert done == [two.parts(SIZE)[1][0]]
    two.over(SIZE, (lambda *_: None,))


def test_the_caller_makes_what_no_helper_has_begun():
    count = len(names()) + 2
    begun, let, two, made = threading.Barrier(count + 1), threading.Event(), Threads(2, 0), []

    def hold(*_):
        begun.wait(60)
        let.wait(60)

    def call(first, _):
        made.append((first, threading.get_ident()))
        if first in failing:
            raise ValueError("a part")

    with ThreadPoolExecutor(1) as others:
        held = others.submit(Threads(count, 0).over, count * 1024, (hold,))
        begun.wait(60)
        failing = set()
        two.over(SIZE, (call,))
        assert made == [(first, threading.get_ident()) for first, _ in two.parts(SIZE)]
        made.clear()
        failing = {0}
        with pytest.raises(ValueError, match="a part"):
            two.over(SIZE, (call,))
        let.set()
        held.result()
    # Nor after an error, which leaves it out.
    two.over(SIZE, (lambda *_: None,))
    assert [first for first, _ in made] == [0]


@pytest.mark.parametrize("failing", [0, 3072])
def test_no_array_is_kept_after_an_error(failing):
    begun = threading.Barrier(2)

    def call(first, _, array):  # noqa: ARG001
        begun.wait(60)
        if first == failing:
            raise MemoryError

    array = np.zeros(SIZE)
    kept = weakref.ref(array)
    gc.disable()
    try:
        with contextlib.suppress(MemoryError):
            Threads(2, least=0).over(SIZE, (call, array))
        del array
        assert kept() is None
    finally:
        gc.enable()


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers that send signals here")
def test_no_array_is_kept_after_an_interrupt_while_parts_are_awaited():
    main, begun = threading.get_ident(), threading.Barrier(2)

    interrupts = []

    def interrupt(*_):
        interrupts.append(1)
        raise KeyboardInterrupt

    def call(first, _, array):  # noqa: ARG001
        begun.wait(60)
        if threading.get_ident() == main:
            signal.setitimer(signal.ITIMER_REAL, 0.02)
        else:
            sleep(0.3)

    array = np.zeros(SIZE)
    kept, before = weakref.ref(array), signal.signal(signal.SIGALRM, interrupt)
    gc.disable()
    try:
        with contextlib.suppress(KeyboardInterrupt):
            Threads(2, least=0).over(SIZE, (call, array))
        del array
        assert interrupts
        assert kept() is None
    finally:
        gc.enable()
        signal.signal(signal.SIGALRM, before)


def test_threads_can_be_pickled():
    several = Threads(3, least=5)
    several.over(SIZE, (lambda *_: None,))
    assert pickle.loads(pickle.dumps(several)) == several


def test_worker_processes_divide_nothing():
    with local_executor(2) as workers:
        assert not workers.submit(Threads(2, least=0).divide, SIZE).result()
    assert Threads(2, least=0).divide(SIZE)


_FORKED = """
import os, sys, threading
from mapfilter._threads import Threads

found = []
def call(first, stop):
    begun.wait(60)
    found.append((first, threading.get_ident()))

begun = threading.Barrier(2)
two = Threads(2, least=0)
assert threading.active_count() == 1
two.over(5000, (call,))
assert len({thread for _, thread in found}) == 2
found.clear()
child = os.fork()
two.over(5000, (call,))
assert sorted(first for first, _ in found) == [0, 2048], found
if child:
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes cannot be forked here")
def test_a_forked_process_has_threads_of_its_own():
    done = subprocess.run(
        [sys.executable, "-c", _FORKED], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")
