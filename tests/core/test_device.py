"""The device of arrays: the processor unless asked for, and errors that say what is missing."""

import pickle
import sys
import warnings
from importlib.abc import MetaPathFinder
from importlib.util import spec_from_loader
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
import strict_arrays

from mapfilter import _cuda, _device
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


class Broken(MetaPathFinder):
    """Finds a CuPy whose library cannot be loaded, and that says so as CuPy does."""

    def __init__(self, *, explained):
        self.explained = explained

    def find_spec(self, name, *_):
        return spec_from_loader(name, self) if name == "cupy" else None

    def create_module(self, _):
        return None

    def exec_module(self, _):
        try:
            raise ImportError("libnvrtc.so.12: cannot open shared object file")
        except ImportError as error:
            if not self.explained:
                raise
            text = "\n==========\nFailed to import CuPy.\n\nIf you installed CuPy via wheels ...\n"
            raise ImportError(text) from error


@pytest.mark.parametrize("explained", [True, False])
def test_a_module_that_is_installed_but_broken_is_not_called_missing(monkeypatch, explained):
    monkeypatch.delitem(sys.modules, "cupy", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Broken(explained=explained), *sys.meta_path])
    with pytest.raises(ConfigError) as caught:
        open_device("gpu", "here")
    text = str(caught.value)
    assert "found libnvrtc.so.12: cannot open shared object file" in text
    assert "installed, but" in text
    assert "pip install" not in text
    assert len(text.splitlines()) == 1


class WarningKernel:
    """A kernel that warns of few blocks as it is configured, and of something as it runs."""

    def __getitem__(self, blocks_threads):
        warnings.warn("\33[1mGrid size 1 will likely result in GPU under-utilization", stacklevel=2)
        return lambda *_: warnings.warn(f"{blocks_threads}", stacklevel=2)


def test_starting_a_kernel_leaves_the_filters_of_warnings_as_they_are():
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        before = list(warnings.filters)
        _cuda.start(WarningKernel(), 129)
        _cuda.start(WarningKernel(), 0)
        assert list(warnings.filters) == before
        assert [str(one.message) for one in found] == ["(2, 128)"]


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
    before = list(warnings.filters)
    found = open_device("gpu")
    assert list(warnings.filters) == before
    assert (found.name, found.arrays, found.is_host) == ("gpu", cupy, False)
    assert pickle.loads(pickle.dumps(found)) == found
