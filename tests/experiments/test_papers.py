"""All papers are described alike."""

import pytest

from mapfilter.errors import ConfigError
from mapfilter.experiments.papers import PAPERS, find_paper
from mapfilter.experiments.papers.paper import PaperSettings
from mapfilter.workflows.reproduce import run_reproduce


@pytest.mark.parametrize("name", PAPERS)
def test_a_paper_is_found_by_its_name(name):
    paper = find_paper(name)
    least, most = paper.trial_limits
    assert paper.name == name
    assert least <= paper.trials <= (most or paper.trials)
    assert set(paper.options) <= {"--map", "--bbox", "--layout"}


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        ("nobody-1900", {}, "one of khalaf-allah-2007, "),
        ("zhang-2006", {"map_name": "helsinki"}, "--map: expected nothing, as zhang-2006"),
        ("khalaf-allah-2007", {"layout_file": "a.toml"}, "--layout: expected nothing"),
        ("tesa", {"trials": 1}, "--trials: expected at least 2, found 1"),
        ("zhang-2006", {"trials": 0}, r"--trials: expected a number in 1\.\.20000, found 0"),
    ],
)
def test_what_a_paper_does_not_take_is_refused(name, given, message, tmp_path):
    with pytest.raises(ConfigError, match=message):
        run_reproduce(name, tmp_path / "out", **given)
    assert not (tmp_path / "out").exists()


def test_a_paper_on_a_map_says_what_makes_one():
    with pytest.raises(
        ConfigError, match=r"sweep: expected .* \(likely: .*run_reproduce makes the map"
    ):
        find_paper("khalaf-allah-2007").run(PaperSettings(1))
