"""A wheel holds all packages and all files that they read."""

import tomllib
from fnmatch import fnmatch
from importlib.metadata import version
from pathlib import Path

import mapfilter

ROOT = Path(__file__).parents[2]
SETUPTOOLS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]


def test_the_version_is_that_of_the_installed_package():
    assert mapfilter.__version__ == version("mapfilter")


def test_every_name_of_the_front_door_is_there():
    for name in dir(mapfilter):
        assert getattr(mapfilter, name) is not None, name


def test_every_package_is_listed():
    found = {
        ".".join(file.parent.relative_to(ROOT).parts)
        for file in (ROOT / "mapfilter").rglob("__init__.py")
    }
    assert found == set(SETUPTOOLS["packages"]) - {"mapfilter.data"}


def test_every_other_file_of_a_package_is_its_data():
    data = SETUPTOOLS["package-data"]
    for file in (ROOT / "mapfilter").rglob("*"):
        built = file.suffix in {".py", ".pyc", ".nbi", ".nbc"} or "__pycache__" in file.parts
        if file.is_dir() or built:
            continue
        package = file.parent
        while not (package / "__init__.py").is_file():
            package = package.parent
        name = ".".join(package.relative_to(ROOT).parts)
        inside = file.relative_to(package).as_posix()
        assert any(fnmatch(inside, pattern) for pattern in data.get(name, [])), file
