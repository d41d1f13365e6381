"""What the how-to pages and the explanation of models tell is what the program has."""

import itertools
import re
import shlex
import textwrap
from pathlib import Path
from typing import get_args

import pytest
import typer

from mapfilter.cli import app
from mapfilter.config.load import load_config
from mapfilter.propagation.models import ModelName
from mapfilter.propagation.published_ranges import PUBLISHED

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGES = sorted((DOCS / "howto").glob("*.rst"))
WITHOUT_CONFIGURATION = {"see-a-replay"}


def blocks(path, kind):
    text = path.read_text(encoding="utf-8")
    found = re.findall(rf"code-block:: {kind}\n\n((?:   .*\n|\n)+)", text)
    return [textwrap.dedent(block) for block in found]


def configuration(path, folder):
    text = blocks(path, "toml")[0]
    file = folder / "page.toml"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_configurations_of_the_how_to_pages_are_read(path, tmp_path):
    texts = blocks(path, "toml")
    assert texts or path.stem in WITHOUT_CONFIGURATION
    for text in texts:
        file = tmp_path / "page.toml"
        file.write_text(text, encoding="utf-8")
        assert load_config(file) != load_config(None)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_commands_and_settings_of_the_how_to_pages_exist(path, tmp_path):
    file = None if path.stem in WITHOUT_CONFIGURATION else configuration(path, tmp_path)
    commands = typer.main.get_command(app).commands
    shown = "\n".join(blocks(path, "console")).replace("\\\n", " ")
    lines = [shlex.split(line)[2:] for line in shown.splitlines() if line.startswith("$ mapfilter")]
    assert lines
    for name, *words in lines:
        known = {option for parameter in commands[name].params for option in parameter.opts}
        assert {word for word in words if re.match("--?[a-z]", word)} <= known, (name, words)
        load_config(file, [b for a, b in itertools.pairwise(words) if a == "--set"])


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_scripts_of_the_how_to_pages_compile(path):
    for code in blocks(path, "python"):
        compile(code, path.name, "exec")


def test_every_model_is_told_with_its_published_range():
    text = (DOCS / "explanation" / "radio-prediction.rst").read_text(encoding="utf-8")
    cell = r"     - (.*)\n"
    rows = {row[0]: row[1:] for row in re.findall(rf"   \* - ``(\w+)``\n{cell * 4}", text)}
    assert set(rows) == set(get_args(ModelName))
    scales = {"frequency_mhz": 1, "base_height_m": 1, "mobile_height_m": 1, "distance_m": 1000}
    for model, published in PUBLISHED.items():
        for (name, scale), told in zip(scales.items(), rows[model], strict=True):
            if name in published:
                numbers = re.findall(r"\d+(?: \d{3})*(?:\.\d+)?", told)
                values = [float(number.replace(" ", "")) * scale for number in numbers]
                assert (values[0], values[-1]) == published[name], (model, name)
