"""A worker that dies in the midst of the work."""

import os
import signal


class KillsOneWorker:
    """Passes tasks on, and a deadly one among them.

    ``mark`` is a file that is there once a worker has died.
    """

    def __init__(self, executor, mark):
        self.executor, self.mark, self.tasks, self.deaths = executor, mark, 0, []

    def submit(self, fn, /, *args, **kwargs):
        self.tasks += 1
        if self.tasks == 3:
            self.deaths.append(self.executor.submit(dies_once, self.mark))
        return self.executor.submit(fn, *args, **kwargs)


def dies_once(path):
    """Kill the worker that runs this, the first time."""
    if not path.exists():
        path.touch()
        os.kill(os.getpid(), signal.SIGKILL)
