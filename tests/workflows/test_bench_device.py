"""Asking for a device where there is none, or for what cannot be measured on one."""

import sys

import pytest
from command_line import mapfilter

from mapfilter.errors import ConfigError
from mapfilter.workflows.bench import run_bench


@pytest.fixture
def _no_cupy(monkeypatch):
    monkeypatch.setitem(sys.modules, "cupy", None)


@pytest.mark.usefixtures("_no_cupy")
def test_a_missing_device_is_named():
    with pytest.raises(ConfigError, match=r"^bench --device: expected a graphics processor.*cupy"):
        run_bench("filter", device="gpu")
    with pytest.raises(ConfigError, match=r"^bench --device: expected cpu or gpu, found 'tpu'$"):
        run_bench("filter", device="tpu")


@pytest.mark.parametrize(
    ("stage", "others", "message"),
    [
        ("build", {}, r"^bench --device: .*found build$"),
        ("filter", {"peers": True}, r"^bench: .* --device, found several$"),
        ("filter", {"threads": 2}, r"^bench: .* --device, found several$"),
    ],
)
def test_a_device_is_for_a_step_of_the_filter(stage, others, message):
    with pytest.raises(ConfigError, match=message):
        run_bench(stage, device="gpu", **others)


@pytest.mark.usefixtures("_no_cupy")
def test_the_command_says_so():
    told = mapfilter("bench", "filter", "--device", "gpu")
    assert told.code == 2
    assert "bench --device: expected a graphics processor" in told.err
