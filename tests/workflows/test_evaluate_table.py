"""The table that ``evaluate`` prints: the main figures of each case, in their columns."""

from dataclasses import fields
from pathlib import Path

from mapfilter.experiments.benchmarks.results import CaseResult
from mapfilter.workflows.evaluate import EvaluateResult, main_table
from mapfilter.workflows.outputs.result_text import text_lines


def case(name, **figures):
    every = {field.name: 0.0 for field in fields(CaseResult) if "fault" not in field.name}
    return CaseResult(**{**every, "name": name, "filter": "bayes", "runs": 3, **figures})


def test_figures_stand_in_the_row_of_their_case():
    cases = case("levels-6", error_mean_m=7.5, wrong=0.25), case("cell-6", error_mean_m=12.5)
    shown = main_table(EvaluateResult("city", 1, 100, cases, 2.0, Path("out")))
    head, *rows = [line.split() for line in text_lines(shown) if line.startswith("  ")]
    table = {row[0]: dict(zip(head, row, strict=True)) for row in rows}
    assert table["levels-6"]["error_mean_m"] == "7.5"
    assert table["levels-6"]["wrong"] == "0.25"
    assert table["cell-6"]["error_mean_m"] == "12.5"
    assert "success_low" not in head


def test_faults_of_sensors_have_figures_of_their_own():
    cases = case("motion-ends", fault_noticed_s=12.5), case("pooled", fault_wrong=0.25)
    cases += (case("radio-ends", fault_wrong=0.5, fault_noticed_max_s=99.0),)
    shown = main_table(EvaluateResult("city", 1, 100, cases, 2.0, Path("out")))
    lines = [line for line in text_lines(shown) if line.startswith("  ")]
    assert {"fault_wrong", "fault_noticed_s", "claimed"} <= set(lines[0].split())
    assert lines[-1].split()[-1] == "99"
