"""Interrupts between any two steps of a division: raised once, after its parts, and it goes on."""

import os
import signal
import subprocess
import sys

import pytest

_DIVIDED = """
import random, signal, sys, threading, time
from mapfilter import _threads
from mapfilter._threads import Threads

two, under_way, begun = Threads(2, least=0), [], []
main = threading.get_ident()

def call(first, stop):
    # Short calls of C, after which an interrupt may come.
    if threading.get_ident() == main:
        time.sleep(pause_s)
        return
    under_way.append(first)
    begun.append(first)
    time.sleep(2 * pause_s)
    under_way.clear()

def divide():
    try:
        two.over(5000, (call,))
    finally:
        assert not under_way, "a part goes on"
"""

_BY_SIGNALS = """
pause_s = 2e-5
raised = 0

def handler(*_):
    global raised
    raised += 1
    raise KeyboardInterrupt

signal.signal(signal.SIGALRM, handler)
random.seed(1)
caught = 0
for _ in range(4000):
    try:
        signal.setitimer(signal.ITIMER_REAL, random.uniform(5e-6, 3e-4))
        for _ in range(5):
            divide()
        signal.setitimer(signal.ITIMER_REAL, 0)
    except KeyboardInterrupt:
        caught += 1
assert caught == raised > 1000, (caught, raised)
assert len(begun) > 100, len(begun)
"""

_AFTER_EACH_CALL = """
def interrupted(after):
    left = after
    def profile(frame, event, argument):
        nonlocal left
        if event in ("call", "c_return"):
            left -= 1
            if left == 0:
                raise KeyboardInterrupt
    return profile

def calls_of_a_division(*, fresh):
    for after in range(1, 1000):
        if fresh:
            _threads._pool.cache_clear()
        profile = interrupted(after)
        try:
            sys.setprofile(profile)
            divide()
            sys.setprofile(None)
        except KeyboardInterrupt:
            # The next one is as any other.
            divide()
        else:
            sys.setprofile(None)
            return after

pause_s = 1e-3
kept, fresh = calls_of_a_division(fresh=False), calls_of_a_division(fresh=True)
assert 15 < kept < fresh < 999, (kept, fresh)
assert len(begun) > 15, len(begun)
"""

_AGAIN_AND_AGAIN = """
done = []
raised = 0

def handler(*_):
    global raised
    if not done:
        raised += 1
        raise KeyboardInterrupt

def call(first, stop):
    if threading.get_ident() == main:
        began.acquire()
        signal.setitimer(signal.ITIMER_REAL, 1e-4, 1e-4)
        return
    began.release()
    time.sleep(0.3)
    done.append(first)

began = threading.Lock()
began.acquire()
signal.signal(signal.SIGALRM, handler)
try:
    two.over(5000, (call,))
except KeyboardInterrupt:
    signal.setitimer(signal.ITIMER_REAL, 0)
    assert done == [2048], done
else:
    raise AssertionError("no interrupt")
assert raised > 10, raised
"""


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers that send signals here")
@pytest.mark.parametrize(
    "script",
    [
        pytest.param(_BY_SIGNALS, id="signals"),
        pytest.param(_AFTER_EACH_CALL, id="after-each-call"),
        pytest.param(_AGAIN_AND_AGAIN, id="again-and-again"),
    ],
)
def test_divisions_end_and_raise_their_interrupts(script):
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", _DIVIDED + script],
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ,
    )
    assert (done.returncode, done.stderr) == (0, "")
