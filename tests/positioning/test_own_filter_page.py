"""The template of a filter of one's own, as the documentation shows it, keeps the contract."""

import re
import textwrap
from pathlib import Path

from cross_world import make_database

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "own-filter.rst"


def test_the_template_keeps_the_contract(tmp_path, monkeypatch):
    (tmp_path / "out").mkdir()
    make_database(tmp_path / "out")
    monkeypatch.chdir(tmp_path)
    template, check = re.findall(
        r"code-block:: python\n\n((?:   .*\n|\n)+)", PAGE.read_text("utf-8")
    )
    names: dict[str, object] = {}
    for block in (template, check):
        exec(textwrap.dedent(block), names)
    assert "check_filter" in names
    assert sum(bool(line.strip()) for line in template.split("class MyFilter")[1].splitlines()) < 45
