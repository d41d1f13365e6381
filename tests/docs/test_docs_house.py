"""The shelves hold every page, notebooks are whole files, the pictures of the gallery exist."""

import json
import re
from pathlib import Path
from runpy import run_path

import pytest
from PIL import Image

from tests.docs.html_pages import broken_links

DOCS = Path(__file__).resolve().parents[2] / "docs"
SHELVES = ("tutorials", "howto", "explanation", "reference")
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.rst"))
GALLERY = DOCS / "_static" / "gallery"


def page(name: str) -> str:
    return (DOCS / f"{name}.rst").read_text(encoding="utf-8")


def listed(text: str) -> set[str]:
    """Return the pages of all tables of contents."""
    blocks = re.findall(r"^\.\. toctree::\n(?:   :.*\n)*\n((?:   \S.*\n?)+)", text, re.MULTILINE)
    return {line.strip() for block in blocks for line in block.splitlines()}


def test_every_page_stands_on_one_shelf():
    found = [name for shelf in SHELVES for name in listed(page(shelf))]
    assert len(found) == len(set(found))
    there = {
        path.relative_to(DOCS).with_suffix("").as_posix()
        for path in DOCS.rglob("*.rst")
        if path.relative_to(DOCS).parts[0] not in ("api", "_build", "_templates")
    }
    assert set(found) == there - {"index", "gallery", *SHELVES}
    assert listed(page("index")) == {"gallery", *SHELVES}


def test_there_are_four_notebooks():
    assert {path.stem for path in NOTEBOOKS} == {
        "first-fix",
        "own-city",
        "own-filter-and-sweep",
        "drive-test-to-survey",
    }


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_has_the_code_and_outputs_of_its_page(path):
    text = path.read_text(encoding="utf-8")
    made = run_path(str(DOCS / "notebook_files.py"))["notebook"](text)
    assert made["nbformat"] == 4
    assert len({cell["id"] for cell in made["cells"]}) == len(made["cells"])
    code = [cell for cell in made["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    sources = "\n".join(cell["source"] for cell in code)
    compile(sources, path.name, "exec")
    lines = re.findall(r"^(?:>>>|\.\.\.) ?(.*)$", text, re.MULTILINE)
    assert [line for line in lines if line] == [line for line in sources.split("\n") if line]
    prose = "\n".join(cell["source"] for cell in made["cells"] if cell["cell_type"] == "markdown")
    assert ">>>" not in prose
    assert ":doc:" not in prose
    assert prose.startswith("# ")
    assert f"_static/notebooks/{path.stem}.ipynb" in text


def test_notebook_files_are_json_in_utf_8(tmp_path):
    written = run_path(str(DOCS / "notebook_files.py"))["write_all"](DOCS / "notebooks", tmp_path)
    assert len(written) == 4
    for path in written:
        assert json.loads(path.read_text(encoding="utf-8"))["cells"]


def test_the_gallery_shows_what_its_script_draws():
    shown = set(re.findall(r"_static/gallery/([\w-]+)\.webp", page("gallery")))
    drawn = set(run_path(str(DOCS / "gallery.py"), run_name="gallery")["PICTURES"])
    assert shown == {*drawn, "narrowing"}
    assert {path.stem for path in GALLERY.iterdir()} == shown
    assert sum(path.stat().st_size for path in GALLERY.iterdir()) < 4e6


def test_the_animation_is_one_and_small():
    path = GALLERY / "narrowing.webp"
    assert path.stat().st_size <= 1_500_000
    with Image.open(path) as image:
        assert image.n_frames >= 12


def test_broken_links_are_found(tmp_path):
    (tmp_path / "a.html").write_text('<a id="here" href="b.html#there">b</a><img src="c.png">')
    (tmp_path / "b.html").write_text('<p id="there"><a href="a.html#gone">a</a>')
    assert broken_links(tmp_path) == ["a.html: c.png", "b.html: a.html#gone (no such place)"]
    (tmp_path / "c.png").touch()
    (tmp_path / "b.html").write_text('<p id="there"><a href="a.html#here">a</a>')
    assert broken_links(tmp_path) == []
