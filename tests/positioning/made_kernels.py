"""Kernels of a device that note what they are given, and add known numbers to their weights."""

from types import SimpleNamespace

import numpy as np

from mapfilter.positioning.bayes.beliefs import device_step

ADDED = {
    "weigh_by_ways": -0.25, "weigh_by_serving": -1.0, "weigh_by_levels": -2.0,
    "weigh_by_absence": -4.0, "weigh_by_bound": -8.0,
}  # fmt: skip
"""What each kernel adds to its weights, its last argument."""


class Placed:
    """A device with NumPy's arrays; what is placed there is noted."""

    arrays = np

    def __init__(self):
        self.noted = []

    def placed(self, array):
        self.noted.append(array)
        return array


def noted_kernels(monkeypatch):
    """Take the kernels' places; return their names and arguments as they are called, in order."""
    found = []

    def kernel(name):
        def called(*given):
            found.append((name, given))
            if name in ADDED:
                given[-1][:] += ADDED[name]

        return called

    def pixels(state, frame, pixel):
        found.append(("pixels", (state, frame, pixel)))
        pixel[:] = np.arange(pixel.size) % 63

    def copied(state, chosen, jitter, key, copies):
        found.append(("copy", (jitter, key)))
        copies[:] = state[:, chosen]

    kernels = SimpleNamespace(
        **{name: kernel(name) for name in (*ADDED, "age", "move")}, pixels=pixels
    )
    monkeypatch.setattr(device_step, "cuda_motion", kernels)
    monkeypatch.setattr(device_step, "cuda_reports", kernels)
    monkeypatch.setattr(device_step, "cuda_copies", SimpleNamespace(copy_with_jitter=copied))
    return found
