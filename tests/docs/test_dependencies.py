"""The table of dependencies names what pyproject.toml asks for, at the versions that are tested."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def names_of(requirements):
    return {re.split(r"[\[><=]", one)[0].lower() for one in requirements}


def constraints():
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    return {name.lower(): version for name, version in (line.split("==") for line in lines)}


def test_every_dependency_has_its_version_and_licence_in_the_docs():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    table = (ROOT / "docs" / "dependencies.rst").read_text()
    rows = re.findall(r"\* - ([a-z][^\n]*)\n     - ([^\n]+)\n     - ([^\n]+)\n", table)
    listed = {name: version for names, version, _ in rows for name in names.split(", ")}
    wanted = names_of(project["dependencies"])
    for extra in ("cluster", "serve"):
        wanted |= names_of(project["optional-dependencies"][extra])
    assert wanted <= listed.keys()
    assert {name: constraints()[name] for name in listed} == listed


def test_the_build_backend_and_all_extras_are_constrained():
    whole = tomllib.loads((ROOT / "pyproject.toml").read_text())
    every = names_of(whole["build-system"]["requires"])
    for extra in whole["project"]["optional-dependencies"].values():
        every |= names_of(extra)
    assert every <= constraints().keys()
    assert "PIP_BUILD_CONSTRAINT" in (ROOT / "Makefile").read_text()


IMPORTED_AS = {
    "scikit-learn": "sklearn",
    "python-calamine": "python_calamine",
    "annotated-types": "annotated_types",
    "dask": "distributed",
    "import-linter": "importlinter",
    "pytest-xdist": "xdist",
    "cupy-cuda12x": "cupy",
    "numba-cuda": "numba import cuda",
}
COMMANDS = {"sphinx", "furo", "import-linter", "mypy", "pytest", "pytest-xdist", "ruff", "uvicorn"}
"""Tools, which are called by their names and not imported."""
CALLED_FOR = {"jinja2": ".to_latex("}
"""What pandas calls a library for."""


def test_every_dependency_and_every_extra_is_used():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    package = "".join(path.read_text() for path in (ROOT / "mapfilter").rglob("*.py"))
    other = "".join(
        path.read_text() for name in ("tests", "benchmarks") for path in (ROOT / name).rglob("*.py")
    )

    def unused(requirements, text):
        return [
            name
            for name in sorted(names_of(requirements) - COMMANDS)
            if not re.search(rf"^\s*(import|from) {IMPORTED_AS.get(name, name)}\b", text, re.M)
            and CALLED_FOR.get(name, "no such call") not in text
        ]

    assert unused(project["dependencies"], package) == []
    for extra, requirements in project["optional-dependencies"].items():
        assert unused(requirements, package + other) == [], extra
