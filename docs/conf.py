"""Sphinx configuration; build with ``sphinx-build -W -b html docs docs/_build``."""

import gc
from importlib.metadata import version as installed_version
from importlib.util import find_spec
from pathlib import Path
from runpy import run_path
from shutil import rmtree
from typing import Any

from sphinx.application import Sphinx
from sphinx.pycode.parser import Parser

# Pages are kept until the end: the search among them for unused cycles takes a tenth of a build.
gc.set_threshold(200_000, 50, 100)

project = "mapfilter"
author = "The mapfilter developers"
copyright = "The mapfilter developers, Apache-2.0"  # noqa: A001
release = version = installed_version("mapfilter")

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.doctest",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
]
templates_path = ["_templates"]
exclude_patterns = ["_build", "_templates"]

# Pictures of pages that are drawn from made cases.
run_path(str(Path(__file__).with_name("diagrams.py")))["draw"](
    Path(__file__).parent / "_static" / "drawn"
)

# The notebooks, as files to download and run.
run_path(str(Path(__file__).with_name("notebook_files.py")))["write_all"](
    Path(__file__).parent / "notebooks", Path(__file__).parent / "_static" / "notebooks"
)

# Which object a short name in a docstring means.
_NAMES = run_path(str(Path(__file__).with_name("kept_names.py")))["Names"]

# Pages of modules that are gone would stay and fail the next build.
rmtree(Path(__file__).parent / "api", ignore_errors=True)
autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
# There are none, and looking for them parses every source again.
autodoc_use_type_comments = False
autodoc_default_options = {"members": True}
_ALIASES = "ArrayLike Bools Bounds Floats Floats32 Geometries Ints Ints32 Levels Progress Rows"
autodoc_type_aliases = {name: name for name in _ALIASES.split()}
napoleon_google_docstring = False
napoleon_use_rtype = False
# Examples in docstrings are run by pytest, with the names of their modules.
doctest_test_doctest_blocks = ""

html_static_path = ["_static"]
html_css_files = ["house.css"]
html_theme = "furo" if find_spec("furo") is not None else "alabaster"
html_title = f"mapfilter {release}"
html_show_sphinx = False


def _sidebar_of_modules(
    _app: Sphinx, page: str, _template: str, context: dict[str, Any], _tree: object
) -> None:
    """List in the sidebar of a module's page its own package alone, elsewhere no modules.

    The tree of all modules in each page takes longer than all else of a page together.
    """
    whole = context.get("toctree")
    if whole is not None:
        of_modules = page == "api" or page.startswith("api/")
        less = {"collapse": True} if of_modules else {"maxdepth": 2}
        context["toctree"] = lambda **given: whole(**{**given, **less})


def _find_no_definitions(_parser: Parser) -> None:
    """Leave out the lines of definitions, which pages with sources alone would need.

    Looking for them takes most of the reading of sources.
    """


def setup(app: Sphinx) -> None:
    """Connect what is done to pages before the theme (at 500) is."""
    app.add_domain(_NAMES, override=True)
    Parser.parse_definition = _find_no_definitions
    app.connect("html-page-context", _sidebar_of_modules, priority=400)
