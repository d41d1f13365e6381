"""The pictures that a build of the documentation draws are those that its pages show."""

import re
from pathlib import Path
from runpy import run_path

from matplotlib.image import imread

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_every_drawn_picture_is_shown_and_every_shown_one_is_drawn(tmp_path):
    made = run_path(str(DOCS / "diagrams.py"))["draw"](tmp_path, made=500)
    shown = {
        name
        for page in DOCS.rglob("*.rst")
        for name in re.findall(r"_static/drawn/([\w.-]+)", page.read_text(encoding="utf-8"))
    }
    assert {path.name for path in made} == shown == {path.name for path in tmp_path.iterdir()}
    for path in made:
        assert imread(path)[..., :3].std() > 0.05, path.name
