"""Pictures as PNG, SVG and PDF, on given axes; tables as CSV and LaTeX."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from mapfilter.errors import InputError, OutputError
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix
from mapfilter.report.basemap import BaseMap
from mapfilter.report.canvas import BLACK, BLUE, distinct_colours
from mapfilter.report.cumulative import Distribution, plot_cumulative
from mapfilter.report.errors import (
    plot_error_over_distance,
    plot_errors_apart,
    plot_errors_over_time,
)
from mapfilter.report.saving import save
from mapfilter.report.table import latex_table, write_table
from mapfilter.report.track import plot_track

TRUTH = Truth(np.arange(9.0), 10 * np.arange(9.0), np.full(9, 50.0))
TABLE = pd.DataFrame(
    {"filter": ["ekf", "p_f"], "above_db": [None, -17.0], "error_m": [12.34567, np.nan]},
    dtype=object,
)


def estimate():
    status = [Status.SEARCHING] * 2 + [Status.CONVERGED] + [Status.TRACKING] * 6
    nan = np.full((2, 2), np.nan)
    fixes = [
        Fix(t, 10 * t, 53.0, nan, np.full(3, 9.0), one, 1, 0.5, 0, np.nan, Reason.USED)
        for t, one in enumerate(status)
    ]
    return TrackEstimate.of_fixes("EPSG:32635", "bayes", fixes)


@pytest.mark.parametrize(
    ("suffix", "head"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("PDF", b"%PDF")]
)
def test_each_format_is_written_whole_and_the_same_each_time(suffix, head, tmp_path):
    base = BaseMap((-10.0, 0.0, 100.0, 90.0), attribution="© somebody")
    paths = [save(plot_track(estimate(), TRUTH, base), tmp_path / f"{n}.{suffix}") for n in "ab"]
    one, other = (path.read_bytes() for path in paths)
    assert one == other
    assert one.startswith(head)
    assert sorted(tmp_path.iterdir()) == paths


@pytest.mark.parametrize("name", ["track.jpg", "track", "table.csv"])
def test_other_formats_are_refused(name, tmp_path):
    drawn = plot_errors_over_time({"bayes": estimate()}, TRUTH)
    with pytest.raises(OutputError, match=r"\.png, \.svg or \.pdf"):
        save(drawn, tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "draw",
    [
        lambda ax: plot_track(estimate(), TRUTH, BaseMap((0.0, 0.0, 90.0, 90.0)), ax),
        lambda ax: plot_error_over_distance(estimate(), TRUTH, ax),
        lambda ax: plot_errors_over_time({"bayes": estimate()}, TRUTH, ax),
        lambda ax: plot_cumulative([Distribution("a", np.ones(3), BLUE)], ax, title="", most_m=2.0),
    ],
    ids=["track", "error", "errors", "cumulative"],
)
def test_given_axes_are_drawn_on(draw):
    figure = Figure()
    left, right = figure.subplots(1, 2)
    assert draw(right) is right
    assert right.get_legend() is not None
    assert not left.lines
    assert not figure.legends


def test_saving_lays_out_once_and_leaves_the_figure_as_it_was(tmp_path, monkeypatch):
    axes = plot_error_over_distance(estimate(), TRUTH)
    figure = axes.figure
    engine, dpi = figure.get_layout_engine(), figure.dpi
    runs = []
    execute = type(engine).execute
    monkeypatch.setattr(
        type(engine), "execute", lambda self, fig: (runs.append(fig), execute(self, fig))
    )
    save(axes, tmp_path / "a.png")
    assert runs == [figure]
    assert figure.get_layout_engine() is engine
    assert figure.dpi == dpi
    # Labels have room: the layout was made.
    assert axes.get_position().x0 > 0.05


def test_each_of_five_estimates_has_a_panel_with_the_others_in_grey():
    names = ["everything", "no satellites", "no cells", "no map", "satellites alone"]
    figure = plot_errors_apart(dict.fromkeys(names, estimate()), TRUTH, spans=[("jammed", 2, 4)])
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title() for axes in shown] == names
    for axes in shown:
        assert [line.get_color() for line in axes.lines].count(BLUE) == 1
        assert len(axes.lines) == 5
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["error", "the others", "jammed"]
    with pytest.raises(InputError, match="one or more"):
        plot_errors_apart({}, TRUTH)


def test_truth_is_wider_than_the_estimate_over_it():
    axes = plot_track(estimate(), TRUTH, BaseMap((0.0, 0.0, 90.0, 90.0)))
    truth = next(line for line in axes.lines if line.get_label() == "truth")
    marks = next(m for m in axes.collections if to_hex(m.get_facecolors()[0]) == BLUE)
    assert truth.get_linewidth() > 1.5 * np.sqrt(marks.get_sizes()[0])
    assert truth.get_zorder() < marks.get_zorder()
    assert truth.get_color() != BLACK


def test_no_colour_repeats_on_a_map_of_sixty_cells():
    assert len(set(distinct_colours(60))) == 60
    assert len(set(distinct_colours(2000))) == 2000
    assert distinct_colours(9) == distinct_colours(60)[:9]


def test_tables_are_csv_and_latex(tmp_path):
    path = write_table(TABLE, tmp_path / "new" / "errors.csv")
    assert path.read_text(encoding="utf-8") == "filter,above_db,error_m\nekf,,12.35\np_f,-17,nan\n"
    assert write_table(TABLE, tmp_path / "errors.tex").read_text() == latex_table(TABLE)
    lines = latex_table(TABLE, digits=None).splitlines()
    assert lines[0] == r"\begin{tabular}{lrr}"
    assert r"filter & above\_db & error\_m \\" in lines
    assert r"ekf &  & 12.34567 \\" in lines
    with pytest.raises(OutputError, match=r"\.csv or \.tex"):
        write_table(TABLE, tmp_path / "errors.xlsx")


def test_ticks_of_a_figure_of_the_users_own_are_mathematical_text(tmp_path):
    """Those of logarithmic axes are made while the figure is written."""

    def words(save_to):
        figure = Figure()
        axes = figure.subplots()
        axes.plot([1.0, 1000.0], [0.0, 1.0])
        axes.set_xscale("log")
        save_to(figure)
        return {
            tick.label1.get_text(): tick.label1.get_parse_math() for tick in axes.xaxis.majorTicks
        }

    found = words(lambda figure: save(figure, tmp_path / "own.png"))
    assert any("$" in text for text in found)
    assert all(found.values())
