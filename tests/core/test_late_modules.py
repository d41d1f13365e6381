"""Parts of NumPy that a command does not read until something is asked of them."""

import subprocess
import sys

import pytest

LATE = "from mapfilter._late_modules import read_parts_late\nread_parts_late()\n"


def printed(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


READ = "print(*{'numpy.f2py.crackfortran', 'unittest'} & set(sys.modules))"


def test_scipy_does_not_read_them():
    code = LATE + "import sys, numpy, scipy.ndimage, scipy.special\n" + READ
    assert printed(code) == []


@pytest.mark.parametrize(
    "asked",
    [
        "from numpy.testing import assert_array_equal as _",
        "import numpy; numpy.testing.assert_array_equal([1], [1])",
        "import scipy.special, numpy.testing; numpy.testing.assert_array_equal([1], [1])",
    ],
)
def test_whoever_uses_them_finds_them(asked):
    assert printed(LATE + asked + "\nimport sys\n" + READ) == ["unittest"]


def test_they_are_found_once():
    assert printed(
        LATE + LATE + "import sys; print(sum('Late' in repr(f) for f in sys.meta_path))"
    ) == ["1"]


def test_a_command_does_not_read_them():
    code = (
        "import sys\nfrom mapfilter.cli import main\nsys.argv = ['mapfilter', 'info', 'nothing']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\nimport scipy.special\n"
    )
    assert printed(code + READ) == []
