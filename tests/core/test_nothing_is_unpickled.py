"""No file is read in a way that runs code of the file."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "mapfilter"
MODULES = {"pickle", "cPickle", "dill", "cloudpickle", "shelve", "marshal", "joblib", "yaml"}
CALLS = {"eval", "exec", "read_pickle"}


def dangers(text: str) -> list[str]:
    """Return what a module imports or calls that may run code of what it reads."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found += [one.name for one in node.names if one.name.split(".")[0] in MODULES]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in MODULES:
            found.append(str(node.module))
        elif isinstance(node, ast.Call):
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            on = getattr(getattr(node.func, "value", None), "id", "")
            if name in CALLS and on in ("", "pd", "pandas", "builtins"):
                found.append(name)
            found += [
                "allow_pickle"
                for one in node.keywords
                if one.arg == "allow_pickle" and getattr(one.value, "value", True) is not False
            ]
    return found


def test_no_module_unpickles_or_evaluates_what_it_reads():
    found = {
        path.relative_to(PACKAGE).as_posix(): dangers(path.read_text())
        for path in PACKAGE.rglob("*.py")
    }
    assert len(found) > 200
    assert {name: which for name, which in found.items() if which} == {}


@pytest.mark.parametrize(
    "text",
    [
        "import pickle",
        "from pickle import load",
        "import numpy as np\nnp.load(path, allow_pickle=True)",
        "import numpy as np\nnp.load(path, allow_pickle=given)",
        "eval(text)",
        "import pandas as pd\npd.read_pickle(path)",
    ],
)
def test_each_of_them_is_found(text):
    assert dangers(text)
