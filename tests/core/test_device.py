"""The device of arrays: the processor unless asked for, and errors that say what is missing."""

import pickle
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
import strict_arrays

from mapfilter import _device
from mapfilter._device import PROCESSOR, Device, arrays_of, on_host, open_device
from mapfilter.errors import ConfigError


@pytest.fixture(autouse=True)
def _opened_anew():
    _device._opened.cache_clear()
    yield
    _device._opened.cache_clear()


def made_cupy(devices):
    def count():
        if isinstance(devices, Exception):
            raise devices
        return devices

    module = ModuleType("cupy")
    module.cuda = SimpleNamespace(runtime=SimpleNamespace(getDeviceCount=count))
    return module


def test_the_processor_has_arrays_as_they_are():
    array = np.arange(3.0)
    assert open_device("cpu") is PROCESSOR
    assert PROCESSOR.is_host
    assert PROCESSOR.placed(array) is on_host(array) is array
    assert arrays_of(array) is np
    assert pickle.loads(pickle.dumps(PROCESSOR)) is PROCESSOR


def test_arrays_of_a_device_are_brought_there_and_back():
    device = Device("gpu", strict_arrays)
    there = device.placed(np.arange(3.0))
    assert not device.is_host
    assert device.placed(there) is there
    assert arrays_of(there) is strict_arrays
    np.testing.assert_array_equal(on_host(there), [0.0, 1.0, 2.0])
    with pytest.raises(TypeError, match="Implicit"):
        np.asarray(there)
    with pytest.raises(TypeError, match=r"numpy\.exp"):
        np.exp(there)
    with pytest.raises(TypeError, match="Unsupported"):
        there + np.arange(3.0)


def test_another_name_is_an_error():
    with pytest.raises(ConfigError, match=r"^here: expected cpu or gpu, found 'tpu'$"):
        open_device("tpu", "here")


def test_a_missing_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "cupy", None)
    with pytest.raises(ConfigError, match=r"^filter\.grid\.device: .*cupy.*mapfilter\[gpu\]"):
        open_device("gpu", "filter.grid.device")


@pytest.mark.parametrize("found", [RuntimeError("cudaErrorNoDevice: none"), 1])
def test_a_missing_processor_is_named(monkeypatch, found):
    """Neither for CuPy nor, as on any machine without a driver, for numba."""
    monkeypatch.setitem(sys.modules, "cupy", made_cupy(found))
    monkeypatch.setattr("numba.cuda.is_available", lambda: False)
    why = "cudaErrorNoDevice" if isinstance(found, Exception) else r"numba\.cuda"
    with pytest.raises(ConfigError, match=rf"{why}.*no driver of NVIDIA"):
        open_device("gpu")


def test_a_processor_that_is_there_is_taken(monkeypatch):
    cupy = made_cupy(1)
    monkeypatch.setitem(sys.modules, "cupy", cupy)
    monkeypatch.setattr("numba.cuda.is_available", lambda: True)
    found = open_device("gpu")
    assert (found.name, found.arrays, found.is_host) == ("gpu", cupy, False)
    assert pickle.loads(pickle.dumps(found)) == found
