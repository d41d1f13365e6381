"""Layouts of a scene as files: what is no layout is refused in one message."""

import pytest

from mapfilter.errors import InputError
from mapfilter.experiments.papers.fritsche_klein_2009.scene import Layout, read_layout


def test_a_layout_reads_back_with_defaults_for_the_rest(tmp_path):
    file = tmp_path / "layout.toml"
    file.write_text("steps = 7\n")
    assert read_layout(file).steps == 7
    assert read_layout(file).serving == Layout().serving


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("steps = ", "TOML"),
        (f"steps = {'9' * 5000}", "TOML"),
        (f"steps = {'[' * 5000}", "TOML"),
        ("stps = 7", "keys among"),
        ("steps = 0", "steps"),
    ],
)
def test_what_is_no_layout_is_refused(tmp_path, text, told):
    file = tmp_path / "layout.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=told):
        read_layout(file)
