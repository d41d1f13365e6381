"""What the first pages tell of the demo is what it prints; the README's ten lines run on it."""

import re
from pathlib import Path

import pytest
from PIL import Image

from mapfilter.workflows.demo import run_demo

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
SAMPLED = 0.1
"""Share by which figures of a sampled filter may differ on another processor."""
TOLD = {
    "switch_distance_m": (r"after\s+about\s+(\d+)\s+m(?:\s+one\s+place\s+is\s+left)?,\s+\d", -1),
    "error_at_switch_m": (r"after\s+about[^,]+,\s+(\d+)\s+m\s+off", 0),
    "error_mean_m": (r"error\s+is\s+(\d+)\s+m\s+on\s+average", 0),
    "error_95_m": (r"95\s+%\s+of\s+it\s+within\s+about\s+(\d+)\s+m", 0),
}
"""Words by the name of the figure, and the digits to which it is rounded there."""
PAGES = {
    "README.md": tuple(TOLD),
    "docs/quickstart.rst": tuple(TOLD),
    "docs/index.rst": ("switch_distance_m", "error_at_switch_m"),
}


@pytest.fixture(scope="module")
def demo(tmp_path_factory, few_single_reports):  # noqa: ARG001
    """Return the folder in which the demo was run, and its figures."""
    folder = tmp_path_factory.mktemp("demo")
    return folder, run_demo(folder / "out" / "demo", ["output.pictures=none"])


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES)
def test_figures_of_the_first_pages_are_those_of_the_demo(demo, page):
    _, figures = demo
    text = (ROOT / page).read_text(encoding="utf-8")
    told = {name: re.findall(TOLD[name][0], text) for name in PAGES[page]}
    for name, numbers in told.items():
        assert len(numbers) == 1, name
        assert is_told(float(numbers[0]), figures[name], TOLD[name][1]), name


def is_told(number, figure, digits):
    """Return whether a rounded number may be that of a figure of the same walk elsewhere."""
    return abs(number - figure) <= 0.5 * 10**-digits + SAMPLED * figure


@pytest.mark.parametrize(
    ("number", "figure", "digits"), [(27.0, 19.0, 0), (40.0, 35.0, 0), (200.0, 262.0, -1)]
)
def test_another_number_is_not_that_of_a_figure(number, figure, digits):
    assert not is_told(number, figure, digits)
    assert is_told(round(figure, digits), figure, digits)


def test_the_ten_lines_of_the_readme_save_a_picture(demo, monkeypatch, capsys):
    folder, _ = demo
    monkeypatch.chdir(folder)
    (code,) = re.findall(r"```python\n(.+?)```", README, flags=re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) == 10
    exec(code, {})
    (name,) = re.findall(r'save_picture\(axes, "(.+?)"\)', code)
    with Image.open(folder / name) as picture:
        assert min(picture.size) > 500
    assert capsys.readouterr().out.startswith("Score: converged after ")
