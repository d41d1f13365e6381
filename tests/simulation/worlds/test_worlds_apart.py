"""The foreign worlds share no model with prediction, filters and the other worlds."""

import ast
from pathlib import Path

import mapfilter.simulation.worlds as worlds

APART = ("filters", "models", "positioning", "propagation", "database", "survey")
ALLOWED = {("mapfilter.propagation.shadowing", "named_rng")}
FOLDER = Path(worlds.__file__).parent


def imported():
    for file in sorted(FOLDER.glob("*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("mapfilter."):
                for name in node.names:
                    yield file.name, node.module, name.name


def test_only_named_generators_are_shared():
    shared = {(module, name) for _, module, name in imported() if module.split(".")[1] in APART}
    assert shared == ALLOWED


def test_nothing_of_the_other_worlds_is_used():
    modules = {module for _, module, _ in imported() if module.startswith("mapfilter.simulation.")}
    assert all(module.startswith("mapfilter.simulation.worlds.") for module in modules)
