"""The device that arrays lie on: the processor, or a graphics processor where one is asked for.

Code over arrays takes its module from the arrays themselves (:func:`arrays_of`): NumPy for those of
the processor, CuPy for those on a graphics processor. The two are never converted to each other
unless :meth:`Device.placed` or :func:`on_host` is called.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from mapfilter.errors import ConfigError, fail

DeviceName = Literal["cpu", "gpu"]
_EXPECTED = "a graphics processor with CUDA, CuPy and numba-cuda"


@dataclass(frozen=True, slots=True)
class Device:
    """Where the arrays of a filter lie.

    Parameters
    ----------
    name : {"cpu", "gpu"}
        As it is asked for.
    arrays : module
        NumPy, or a module with the same functions over arrays of the device.
    """

    name: DeviceName
    arrays: Any

    @property
    def is_host(self) -> bool:
        """Whether arrays are NumPy's."""
        return self.arrays is np

    def placed(self, array: Any) -> Any:
        """Return an array on the device: itself if it lies there already."""
        return self.arrays.asarray(array)

    @property
    def title(self) -> str:
        """The device's own name."""
        if self.is_host:
            return "processor"
        runtime = self.arrays.cuda.runtime
        return str(runtime.getDeviceProperties(runtime.getDevice())["name"].decode())

    def wait(self) -> None:
        """Wait until the device has done all that was started."""
        if not self.is_host:
            self.arrays.cuda.runtime.deviceSynchronize()

    def __reduce__(self) -> tuple[Any, ...]:
        # A module cannot be sent to another process, which opens its own device.
        return open_device, (self.name,)


PROCESSOR = Device("cpu", np)
"""The processor, whose arrays are NumPy's."""


def arrays_of(array: Any) -> Any:
    """Return the module of an array: NumPy, or that of the device which the array lies on.

    Examples
    --------
    >>> arrays_of(np.zeros(3)).__name__
    'numpy'
    """
    return sys.modules[type(array).__module__.partition(".")[0]]


def on_host(array: Any) -> NDArray[Any]:
    """Return an array as NumPy's: itself if it is one already, else a copy."""
    if isinstance(array, np.ndarray):
        return array
    found: NDArray[Any] = arrays_of(array).asnumpy(array)
    return found


def open_device(name: str, where: str = "device") -> Device:
    """Return a device by its name; nothing of a graphics processor is touched for ``cpu``.

    Parameters
    ----------
    name : {"cpu", "gpu"}
    where : str
        What named it, for messages.

    Raises
    ------
    ConfigError
        There is no such name, no graphics processor, or what it needs is not installed or cannot
        be imported.
    """
    if name == "cpu":
        return PROCESSOR
    if name != "gpu":
        raise fail(ConfigError, where, "cpu or gpu", repr(name))
    try:
        return Device("gpu", _opened())
    except ModuleNotFoundError as error:
        hint = "the extra gpu is not installed: pip install 'mapfilter[gpu]'"
        raise fail(ConfigError, where, _EXPECTED, f"no module {error.name}", hint) from None
    except ImportError as error:
        hint = "installed, but not with the libraries of CUDA that it needs, or of another version"
        raise fail(ConfigError, where, _EXPECTED, _reason(error), hint) from None
    except RuntimeError as error:
        hint = "no driver of NVIDIA, or no such device in this machine or container; cpu needs none"
        raise fail(ConfigError, where, _EXPECTED, str(error), hint) from None


def _reason(error: ImportError) -> str:
    """Return in one line why an import failed; CuPy wraps the cause in a page of advice."""
    cause: BaseException = error
    while cause.__cause__ is not None:
        cause = cause.__cause__
    lines = [line.strip(" =") for line in str(cause).splitlines()]
    return next(filter(None, lines), type(cause).__name__)


@cache
def _opened() -> Any:
    """Return CuPy, with a device that it and numba can use."""
    import cupy
    from numba import cuda

    # CuPy's error, a RuntimeError, says what is missing.
    cupy.cuda.runtime.getDeviceCount()
    if not cuda.is_available():
        raise RuntimeError("none that numba.cuda can use")
    return cupy
