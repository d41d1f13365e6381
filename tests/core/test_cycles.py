"""How often a command searches for cycles of objects; each in a process of its own."""

import subprocess
import sys

_SEARCHES = """
import gc
from mapfilter._memory import search_cycles_rarely
searches = []
gc.callbacks.append(lambda phase, info: searches.append(phase))
search_cycles_rarely()
kept = [[] for _ in range({count})]
print(len(searches) // 2, gc.get_threshold()[0])
"""


def _searches(count):
    code = _SEARCHES.format(count=count)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return tuple(map(int, done.stdout.split()))


def test_a_short_command_does_not_search_for_cycles():
    assert _searches(400_000) == (0, 500_000)


def test_a_long_one_searches_often_from_the_first_time_on():
    searches, threshold = _searches(600_000)
    assert threshold == 5_000
    assert searches > 10
