"""Films of a page: as GIF, as MP4 where ffmpeg is there, and what is said where it is not."""

import shutil

import pytest
from PIL import Image
from viewing import made_bundle as made

from mapfilter.errors import OutputError
from mapfilter.viewing.page import write_page
from mapfilter.workflows import film as film_module
from mapfilter.workflows.film import run_film


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "replay.html"
    write_page(made.replay_bundle(), path)
    return path


def test_a_gif_has_its_pictures(page, tmp_path):
    found = run_film(page, tmp_path / "walk.gif", pictures=4)
    assert found["pictures"] == 4
    with Image.open(tmp_path / "walk.gif") as film:
        assert film.n_frames == 4


def test_without_ffmpeg_an_mp4_is_refused_in_one_sentence(page, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(
        OutputError, match="the program ffmpeg, which makes MP4, found none"
    ) as told:
        run_film(page, tmp_path / "walk.mp4", pictures=2)
    assert "write a .gif" in str(told.value)
    assert not list(tmp_path.glob("walk*"))


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="the program ffmpeg is not installed")
def test_an_mp4_where_ffmpeg_is_there(page, tmp_path):
    run_film(page, tmp_path / "walk.mp4", pictures=4)
    assert (tmp_path / "walk.mp4").read_bytes()[4:8] == b"ftyp"


def test_other_endings_are_named(page, tmp_path):
    with pytest.raises(OutputError, match=r"\.gif or \.mp4"):
        run_film(page, tmp_path / "walk.avi", pictures=2)


def test_a_run_without_a_belief_is_filmed_by_its_estimate(tmp_path):
    """Of Kalman-type filters no belief is recorded, and they were refused."""
    bundle = made.replay_bundle()
    for run in bundle["runs"]:
        run["belief"] = None
    write_page(bundle, tmp_path / "replay.html")
    assert run_film(tmp_path / "replay.html", tmp_path / "walk.gif", pictures=3)["pictures"] == 3
    with Image.open(tmp_path / "walk.gif") as film:
        assert film.n_frames == 3


def test_the_source_of_the_map_is_named(page, tmp_path, monkeypatch):
    """Licences of maps ask for it."""
    named = []
    monkeypatch.setattr(
        film_module, "write_film", lambda _, base, out, **__: (named.append(base), out.touch())
    )
    run_film(page, tmp_path / "walk.gif", pictures=2)
    assert [base.attribution for base in named] == ["made by hand"]
