"""The page: self-contained, and nothing in it that a user's text could start."""

import re
from base64 import b64decode, b64encode
from html.parser import HTMLParser

import numpy as np
import pytest

from mapfilter.errors import InputError, StoreError
from mapfilter.viewing.arrays import packed, unpacked
from mapfilter.viewing.bundle import FORMAT, VERSION
from mapfilter.viewing.merge import side_by_side
from mapfilter.viewing.notebook import View
from mapfilter.viewing.page import OPENING, page_html, read_page, write_page

HOSTILE = (
    "</script><script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    "{{BUNDLE}} /*{{SCRIPT}}*/ {{TITLE}}",
    "\"'`&amp;\u2028\0]]>",
)


class _Tags(HTMLParser):
    def __init__(self):
        super().__init__()
        self.tags, self.title, self._within = [], "", ""

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self._within = tag

    def handle_data(self, data):
        if self._within == "title":
            self.title += data

    def handle_endtag(self, tag):  # noqa: ARG002
        self._within = ""


def view_of(**changes):
    head = {"format": FORMAT, "version": VERSION, "kind": "replay", "title": "Replay"}
    rest = {"database": "", "frame": {}, "notes": [], "runs": [{"name": "walk"}], "levels": None}
    return {**head, **rest, "why": None, **changes}


def tags_of(html):
    found = _Tags()
    found.feed(html)
    return found


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_texts_change_nothing_of_the_page(text, tmp_path):
    run = {"name": text, "notes": [text], "figures": {text: text}}
    bundle = view_of(title=text, runs=[run], cells=[{"id": text}], notes=[text])
    hostile, harmless = tags_of(page_html(bundle)), tags_of(page_html(view_of()))
    assert hostile.tags == harmless.tags
    assert hostile.title.replace("\0", "") == text.replace("\0", "")
    write_page(bundle, tmp_path / "replay.html")
    assert read_page(tmp_path / "replay.html") == bundle


@pytest.mark.parametrize("text", HOSTILE)
def test_a_notebook_shows_one_frame_and_nothing_else(text):
    found = tags_of(View(view_of(title=text))._repr_html_())
    assert [tag for tag, _ in found.tags] == ["iframe"]
    ((_, attributes),) = found.tags
    assert "allow-same-origin" not in attributes["sandbox"]
    assert attributes["srcdoc"] == page_html(view_of(title=text))


def test_nothing_is_loaded_from_elsewhere():
    html = page_html(view_of())
    policy = next(
        attributes["content"]
        for tag, attributes in tags_of(html).tags
        if tag == "meta" and attributes.get("http-equiv") == "Content-Security-Policy"
    )
    assert "default-src 'none'" in policy
    assert not re.search(r"https?:|\*", policy)
    for tag, attributes in tags_of(html).tags:
        for name in {"src", "href"} & set(attributes):
            assert tag == "a" or attributes[name].startswith("data:"), (tag, attributes)
    assert "{{" not in html.partition(OPENING)[0].partition("<style>")[0]


def test_equal_bundles_give_equal_pages():
    assert page_html(view_of()) == page_html(view_of())


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda text: text[:0], "no bundle in it"),
        (lambda text: text.replace(OPENING, ""), "no bundle in it"),
        (lambda text: text[: text.index(OPENING) + len(OPENING) + 40], "cut off"),
        (lambda text: text.replace(OPENING, OPENING + "!"), "cut off"),
    ],
)
def test_damaged_pages_are_named(tmp_path, damage, told):
    file = tmp_path / "replay.html"
    file.write_text(damage(page_html(view_of())), encoding="utf-8")
    with pytest.raises(StoreError, match=told):
        read_page(file)


@pytest.mark.parametrize("place", [0, 3, 12, 40, -9, -1])
def test_changed_bytes_of_a_bundle_are_named(tmp_path, place):
    html, file = page_html(view_of()), tmp_path / "replay.html"
    start = html.index(OPENING) + len(OPENING)
    end = html.index("<", start)
    packed = bytearray(b64decode(html[start:end]))
    packed[place] ^= 0x15
    file.write_text(html[:start] + b64encode(packed).decode() + html[end:], encoding="utf-8")
    with pytest.raises(StoreError, match="a page that mapfilter wrote"):
        read_page(file)


def test_pages_of_other_versions_and_formats(tmp_path):
    for changes, told in (({"version": 99}, "version 1, found 99"), ({"format": "x"}, "another")):
        write_page(view_of(**changes), tmp_path / "replay.html")
        with pytest.raises(StoreError, match=told):
            read_page(tmp_path / "replay.html")


def test_side_by_side_names_and_databases():
    levels = {"grid": {"rows": 2, "cols": 2, "step": 5.0}}
    first = view_of(title="A", notes=["n"])
    second = view_of(title="B", levels=levels, why={"weight": 1}, notes=["n", "m"])
    both = side_by_side([("a", first), ("b", second)])
    assert [run["name"] for run in both["runs"]] == ["walk", "walk (2)"]
    assert (both["title"], both["notes"]) == ("A | B", ["n", "m"])
    more = side_by_side([("a b", both), ("a", first)])
    assert [run["name"] for run in more["runs"]] == ["walk", "walk (2)", "walk (3)"]
    assert (both["levels"], both["why"]) == (levels, {"weight": 1})
    faults = [("c", view_of(database="other")), ("d", view_of(kind="database"))]
    with pytest.raises(InputError) as raised:
        side_by_side([("a", first), *faults])
    assert [fault.where for fault in raised.value.faults] == ["c", "d"]


def test_side_by_side_with_a_page_whose_reasons_are_numbered_in_another_way():
    """A later version of the program may know more of them."""
    old = view_of(statuses=["A", "B"], reasons=["used", "stale"], words={"stale": "old words"})
    new = view_of(statuses=["A", "C", "B"], reasons=["used", "twice", "stale"], words={"used": "u"})
    for view in (old, new):
        count = len(view["reasons"])
        numbers = packed(np.arange(count), "u1")
        view["runs"] = [
            {
                "name": "walk",
                "epochs": {"status": numbers, "reason": numbers, "count": count},
                "readings": {"use": numbers},
                "unused": {"reason": numbers},
            }
        ]
    for views in ((old, new), (new, old)):
        both = side_by_side([("x", one) for one in views])
        assert both["words"] == {"stale": "old words", "used": "u"}
        for run, view in zip(both["runs"], views, strict=True):
            for listed, table, column in (
                ("statuses", "epochs", "status"),
                ("reasons", "epochs", "reason"),
                ("reasons", "readings", "use"),
                ("reasons", "unused", "reason"),
            ):
                numbers = unpacked(run[table][column])
                assert [both[listed][one] for one in numbers] == view[listed]
