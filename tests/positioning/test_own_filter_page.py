"""The template of a filter of one's own, as the documentation shows it, keeps the contract."""

import re
import textwrap
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "own-filter.rst"


def test_the_template_runs():
    blocks = re.findall(r"code-block:: python\n\n((?:   .*\n|\n)+)", PAGE.read_text("utf-8"))
    names: dict[str, object] = {}
    for block in blocks:
        exec(textwrap.dedent(block), names)
    assert "check_filter" in names
