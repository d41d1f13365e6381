"""Films of a page: as GIF, as MP4 where ffmpeg is there, and what is said where it is not."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import animation
from PIL import Image
from viewing import made_bundle as made

from mapfilter.errors import OutputError
from mapfilter.report import film
from mapfilter.viewing.arrays import packed, places, starts
from mapfilter.viewing.page import write_page
from mapfilter.workflows.film import run_film


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "replay.html"
    write_page(made.replay_bundle(), path)
    return path


def test_a_gif_has_its_pictures(page, tmp_path):
    told = []
    found = run_film(
        page, tmp_path / "walk.gif", pictures=4, progress=lambda *counts: told.append(counts)
    )
    assert found["pictures"] == 4
    assert told == [(1, 4), (2, 4), (3, 4), (4, 4)]
    with Image.open(tmp_path / "walk.gif") as moving:
        assert moving.n_frames == 4


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


@pytest.mark.parametrize("name", ["walk.gif", "walk.mp4"])
def test_what_is_no_older_film_is_not_replaced(page, tmp_path, monkeypatch, name):
    """It was, without a word."""
    monkeypatch.setattr(animation.writers, "is_available", lambda _: True)
    film_path, holiday = tmp_path / name, b"GIF89a of a holiday;"
    film_path.write_bytes(holiday)
    with pytest.raises(OutputError, match="expected nothing yet, or an older film"):
        run_film(page, film_path, pictures=2)
    assert film_path.read_bytes() == holiday


def test_an_older_film_is_replaced_and_one_that_was_edited_is_not(page, tmp_path):
    film_path = tmp_path / "walk.gif"
    for pictures in (2, 3):
        run_film(page, film_path, pictures=pictures)
    with Image.open(film_path) as moving:
        assert moving.n_frames == 3
        frames = [moving.seek(at) or moving.copy() for at in range(3)]
    frames[0].save(film_path, save_all=True, append_images=frames[1:2])
    with pytest.raises(OutputError, match="one changed since"):
        run_film(page, film_path, pictures=2)


def test_the_mark_of_an_mp4_is_a_box_of_its_own(tmp_path):
    box = b"\0\0\0\x0cftypmp42"
    path = tmp_path / "walk.mp4"
    path.write_bytes(box)
    film._mark_as_film(path, ".mp4")
    data, kinds = path.read_bytes(), []
    while data:
        size = int.from_bytes(data[:4], "big")
        kinds.append(data[4:8])
        assert 8 <= size <= len(data)
        data = data[size:]
    assert kinds == [b"ftyp", b"free"]


def test_a_run_without_a_belief_is_filmed_by_its_estimate(tmp_path):
    """Of Kalman-type filters no belief is recorded, and they were refused."""
    bundle = made.replay_bundle()
    for run in bundle["runs"]:
        run["belief"] = None
    write_page(bundle, tmp_path / "replay.html")
    assert run_film(tmp_path / "replay.html", tmp_path / "walk.gif", pictures=3)["pictures"] == 3
    with Image.open(tmp_path / "walk.gif") as moving:
        assert moving.n_frames == 3


@pytest.fixture
def seen(monkeypatch):
    """What the pictures of a film show: texts, words of the legend, and the trail's lines."""
    found = []

    class Caught(animation.AbstractMovieWriter):
        @classmethod
        def isAvailable(cls):  # noqa: N802
            return True

        def setup(self, fig, outfile, dpi=None):
            super().setup(fig, outfile, dpi)

        def grab_frame(self, **_):
            (axes,) = self.fig.axes
            trails = [one for one in axes.collections if one.get_zorder() == 4]
            truth = [one for one in axes.lines if one.get_zorder() == 2.5]
            found.append(
                SimpleNamespace(
                    title=axes.get_title(),
                    texts=[text.get_text() for text in axes.texts],
                    legend=[text.get_text() for one in self.fig.legends for text in one.texts],
                    trail=[segment for one in trails for segment in one.get_segments()],
                    colors=[tuple(c) for one in trails for c in one.get_colors()],
                    truth=[line.get_xydata() for line in truth],
                    limits=(axes.get_xlim(), axes.get_ylim()),
                )
            )

        def finish(self):
            Path(self.outfile).write_bytes(b";")

    animation.writers.register("caught")(Caught)
    monkeypatch.setitem(film.FILM_FORMATS, ".gif", "caught")
    return found


def of_epochs(bundle, **columns):
    """Give the runs other columns, and no belief."""
    for run in bundle["runs"]:
        run["belief"] = None
        for name, values in columns.items():
            run["epochs"][name] = packed(np.asarray(values), "u1" if name == "status" else "f4")
    return bundle


def filmed(bundle, folder, **options):
    bundle["background"]["streets"] |= {
        "first": starts([]),
        "east": places([]),
        "north": places([]),
    }
    bundle["attribution"] = ""
    write_page(bundle, folder / "replay.html")
    run_film(folder / "replay.html", folder / "walk.gif", **options)


def test_the_source_of_the_map_is_on_every_picture(page, tmp_path, seen):
    """Licences of maps ask for it."""
    run_film(page, tmp_path / "walk.gif", pictures=3)
    assert len(seen) == 3
    assert all("made by hand" in one.texts for one in seen)


def test_a_film_without_a_map_has_trails_and_a_legend(tmp_path, seen):
    """The way so far; not where the filter searches or is lost, nor across a leap."""
    statuses = made.replay_bundle()["statuses"]
    searching, tracking, lost = map(statuses.index, ("SEARCHING", "TRACKING", "LOST"))
    status = np.full(made.EPOCHS, tracking)
    status[:10], status[100:] = searching, lost
    east = 2.0 * np.arange(made.EPOCHS)
    east[60:] += 500.0
    straight = {"east": east, "north": np.full(made.EPOCHS, 100.0), "status": status}
    truth = {"truth_east": east - 3, "truth_north": np.full(made.EPOCHS, 101.0)}
    filmed(of_epochs(made.replay_bundle(), **straight, **truth), tmp_path, pictures=made.EPOCHS)
    assert seen[0].legend == [
        "truth",
        "estimate",
        "while searching",
        "lost or outside",
        "95 % radius",
    ]
    assert [len(one.trail) for one in seen[:12]] == [0] * 11 + [1]
    assert len(seen[50].trail) == 40
    # 50 steps before the leap, which is none, and 39 after it; none where it is lost.
    assert len(seen[-1].trail) == 49 + 39
    assert [len(line) for one in (seen[0], seen[70]) for line in one.truth] == [1, 71]
    assert seen[-1].title.endswith("119 s  lost")
    (left, right), (low, high) = seen[0].limits
    assert high - low > 0.4 * (right - left)


def test_a_film_names_only_what_is_in_it(tmp_path, seen):
    statuses = made.replay_bundle()["statuses"]
    unknown = np.full(made.EPOCHS, np.nan)
    status = np.full(made.EPOCHS, statuses.index("TRACKING"))
    bundle = of_epochs(
        made.replay_bundle(), status=status, truth_east=unknown, truth_north=unknown, r95=unknown
    )
    filmed(bundle, tmp_path, pictures=2)
    assert seen[-1].legend == ["estimate"]
    assert seen[-1].truth == []
    assert len(seen[-1].trail) > 100


def test_a_stray_position_does_not_shrink_the_film(tmp_path, seen):
    bundle = made.replay_bundle()
    east = 2.0 * np.arange(made.EPOCHS)
    east[0] = 200_000.0
    filmed(
        of_epochs(bundle, east=east, truth_east=2.0 * np.arange(made.EPOCHS)), tmp_path, pictures=1
    )
    (left, right), _ = seen[0].limits
    assert right - left < 1000.0
