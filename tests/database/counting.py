"""Work that is stopped on the way."""

from mapfilter._parallel import SerialExecutor


class Counting(SerialExecutor):
    """Counts tasks, and is interrupted at one of them."""

    def __init__(self, last=10**9):
        self.tasks, self.last = 0, last

    def submit(self, fn, /, *args, **kwargs):
        self.tasks += 1
        if self.tasks > self.last:
            raise KeyboardInterrupt
        return super().submit(fn, *args, **kwargs)
