"""The documentation's examples run, and what it lists is what the program has."""

import doctest
import inspect
import re
import shlex
import shutil
import textwrap
import tomllib
from dataclasses import fields
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import typer
from pydantic import BaseModel
from typer.testing import CliRunner

import mapfilter as mf
from mapfilter.check.findings import REMEDIES
from mapfilter.cli import app
from mapfilter.config.load import load_config
from mapfilter.config.reference import reference_toml
from mapfilter.config.sections import Config
from mapfilter.evaluation.accuracy import Accuracy
from mapfilter.evaluation.outcome import Outcome
from mapfilter.evaluation.success import SuccessSummary
from mapfilter.experiments.benchmarks.results import CaseResult
from mapfilter.experiments.sweep.table import SCHEMA as SWEEP_SCHEMA
from mapfilter.filters.candidate import CandidateOptions
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate_store import _COLUMNS as ESTIMATE_COLUMNS
from mapfilter.radio.cell_layouts import COLUMNS as PLAN_COLUMNS
from mapfilter.tracks.readers.formats import FORMATS
from mapfilter.tracks.schema import SCHEMA
from mapfilter.tracks.sensors import SENSOR_COLUMNS

DOCS = Path(__file__).resolve().parents[2] / "docs"
CITATION = DOCS.parent / "CITATION.cff"
PAGES = sorted(path.relative_to(DOCS) for path in DOCS.rglob("*.rst") if "api" not in path.parts)


def page(name: str) -> str:
    return (DOCS / name).read_text(encoding="utf-8")


def named(text: str) -> set[str]:
    """Everything in double backticks, without the braces of examples around it."""
    return set(re.findall(r"``([^`]+)``", text))


@pytest.mark.usefixtures("few_single_reports")
@pytest.mark.parametrize("name", PAGES, ids=str)
def test_examples_of_each_page(name):
    failed, _ = doctest.testfile(
        str(DOCS / name), module_relative=False, encoding="utf-8", verbose=False
    )
    assert failed == 0


def test_all_that_pages_import_is_there():
    """Also in scripts, which the tests compile and do not run."""
    shown = [
        (module, name)
        for path in [*PAGES, Path("..") / "README.md"]
        for module, one, several in re.findall(
            r"from (mapfilter[\w.]*) import (?:([\w, ]+)|\(([^)]+)\))", page(str(path))
        )
        for name in re.findall(r"\w+", re.sub(r" as \w+", "", one or several))
    ]
    assert len(shown) > 100
    missing = [(module, name) for module, name in shown if not _has_name(module, name)]
    assert missing == []


def _has_name(module: str, name: str) -> bool:
    return hasattr(import_module(module), name) or find_spec(f"{module}.{name}") is not None


def test_the_quickstart_has_examples():
    parser = doctest.DocTestParser()
    assert len(parser.get_examples(page("quickstart.rst"))) > 10
    assert len(parser.get_examples(page("conventions.rst"))) > 10


@pytest.mark.long
@pytest.mark.usefixtures("few_single_reports")
def test_quickstart_commands_run(tmp_path, monkeypatch, drawn_small):
    """All but the demo, which is these same steps, one after another in an empty folder."""
    text = page("quickstart.rst")
    toml = re.search(r"code-block:: toml\n\n((?:   .*\n|\n)+)", text)
    assert toml is not None
    (tmp_path / "helsinki.toml").write_text(textwrap.dedent(toml[1]), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    commands = re.findall(r"^   \$ mapfilter (.+)$", text, flags=re.MULTILINE)
    assert len(commands) == 13
    for command in commands:
        if command.startswith("demo"):
            continue
        if "my-walk" in command:
            shutil.copytree("out/journeys/journey-0001-draw-000", "my-walk")
        with drawn_small():
            result = CliRunner().invoke(app, shlex.split(command), catch_exceptions=False)
        assert result.exit_code == 0, (command, result.output)
    found = {path.name for path in (tmp_path / "located").rglob("*")}
    named_there = {f"estimate.{kind}" for kind in ("parquet", "gpx", "geojson")}
    assert named_there | {"figures.json", "belief.png", "track.png", "evidence.png"} <= found
    drawn = {path.name for path in (tmp_path / "located-candidate").rglob("*.png")}
    assert drawn == {"candidates.png", "track.png", "error.png"}
    (code,) = re.findall(r"code-block:: python\n\n((?:   .*\n|\n)+)", text)
    exec(textwrap.dedent(code), {})
    assert (tmp_path / "out" / "track.png").stat().st_size > 10_000


def test_citation_is_of_this_version_and_licence():
    project = tomllib.loads((DOCS.parent / "pyproject.toml").read_text("utf-8"))["project"]
    text = CITATION.read_text("utf-8")
    assert f"\nversion: {project['version']}\n" in text
    assert f"\nlicense: {project['license']}\n" in text
    experiments = set(re.findall(r"mapfilter reproduce ([\w-]+)", text))
    assert experiments == {"khalaf-allah-2007", "fritsche-klein-2009", "zhang-2006", "tesa", "dlr"}


def test_conventions_name_every_status_and_reason():
    listed = named(page("conventions.rst"))
    assert {str(status) for status in Status} <= listed
    assert {str(reason) for reason in Reason} <= listed


def test_files_name_every_column():
    listed = named(page("file-formats.rst"))
    assert set(PLAN_COLUMNS) <= listed
    assert set(ESTIMATE_COLUMNS) <= listed
    assert {column.name for table in SCHEMA.values() for column in table} <= listed


def test_files_name_every_column_of_a_database():
    from mapfilter.database.points import Points

    listed = named(page("file-formats.rst"))
    assert {field.name for field in fields(Points)} <= listed
    assert {"level_dbm", "below_best_db", "cell", "geometry"} <= listed


def test_files_name_every_column_of_a_sweep():
    assert set(SWEEP_SCHEMA.names) <= named(page("file-formats.rst"))


def test_files_name_every_figure_of_a_replay():
    listed = named(page("file-formats.rst"))
    for kind in (Outcome, Accuracy, SuccessSummary):
        assert {field.name for field in fields(kind)} <= listed


def test_pages_name_every_figure_of_a_benchmark():
    names = "simulated-worlds", "foreign-worlds", "satellites-on-the-map", "protection-levels"
    listed = set[str]().union(*(named(page(f"explanation/{name}.rst")) for name in names))
    told = {field.name for field in fields(CaseResult)} - {"name", "filter", "runs"}
    assert {name for name in told if not name.endswith(("_low", "_high"))} <= listed


def test_filter_page_tells_every_option_with_its_default():
    text = page("explanation/candidate-filter.rst")
    told = dict(re.findall(r"\* - ``(\w+)``\n     - ``([^`]+)``", text))
    assert told == {field.name: str(field.default) for field in fields(CandidateOptions)}


def test_configuration_file_is_made_from_the_sections():
    """Written anew by ``python -m mapfilter.config.reference > docs/configuration.toml``."""
    assert page("configuration.toml") == reference_toml()


def test_configuration_file_holds_every_key_with_its_default(tmp_path):
    file = DOCS / "configuration.toml"
    assert load_config(file, out=tmp_path) == load_config(None, out=tmp_path)
    text = file.read_text(encoding="utf-8")
    _compare(Config, tomllib.loads(text), text)


def _compare(model: type[BaseModel], given: dict[str, object], text: str) -> None:
    """Every key is in the file, in a comment if it has no default."""
    for key, field in model.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            values = given.get(key, {})
            assert isinstance(values, dict)
            _compare(field.annotation, values, text)
        elif field.default is None:
            assert re.search(rf"^# {key} = ", text, flags=re.MULTILINE), key
        else:
            assert key in given, key


def test_command_line_page_names_every_command_and_option():
    text = page("cli.rst")
    command = typer.main.get_command(app)
    for name, sub in command.commands.items():
        assert f"mapfilter {name}" in text
        for parameter in sub.params:
            for option in parameter.opts:
                if option.startswith("-") and option != "--help":
                    assert option in text, (name, option)


def test_command_line_page_says_which_commands_take_an_option():
    commands = typer.main.get_command(app).commands
    rows = re.findall(
        r"   \* - (``-.+)\n     - (.+)\n", page("cli.rst").partition("\nExit codes\n")[0]
    )
    told: dict[str, set[str]] = {}
    for options, takers in rows:
        for option in re.findall(r"--?[a-z][\w-]*", options):
            told.setdefault(option, set()).update(set(re.findall(r"\w+", takers)) & set(commands))
    # These say it in words; options of the command's own row are not in the table.
    for option in told.keys() - {"--json", "--set", "--memory", "--version"}:
        having = {n for n, c in commands.items() if any(_has(p, option) for p in c.params)}
        assert told[option] == having, option


def _has(parameter: Any, option: str) -> bool:
    return option in (*parameter.opts, *parameter.secondary_opts)


@pytest.mark.parametrize(
    "path", [DOCS.parent / "README.md", *map(DOCS.joinpath, PAGES)], ids=lambda path: path.stem
)
def test_commands_and_options_of_every_page_exist(path):
    commands = typer.main.get_command(app).commands
    text = path.read_text(encoding="utf-8").replace("\\\n", " ")
    line = (
        r"^mapfilter (.+)"
        if path.suffix == ".md"
        else r"^ *\$ mapfilter (.+)|``mapfilter ([^`]+)``"
    )
    for found in re.findall(line, text, re.MULTILINE):
        name, *words = re.sub(r"[#|;].*", "", "".join(found)).split()
        if name in ("COMMAND", "--help"):
            continue
        for word in (one.rstrip(".,:") for one in words if re.match(r"--?[a-z]", one)):
            taken = any(_has(p, word.partition("=")[0]) for p in commands[name].params)
            assert taken or word == "--db", (name, word)


def test_the_architecture_page_has_every_package_and_the_import_contract():
    text = page("explanation/architecture.rst")
    project = tomllib.loads((DOCS.parent / "pyproject.toml").read_text("utf-8"))
    (layers,) = [c["layers"] for c in project["tool"]["importlinter"]["contracts"] if "layers" in c]
    (shown,) = re.findall(r"\n::\n\n((?:   [\w| ]+\n)+)", text)
    assert [line.strip() for line in shown.splitlines()] == layers
    table = text.partition("The import contract")[0]
    root = DOCS.parent / "mapfilter"
    rooms = {path.stem for path in (*root.glob("*.py"), *root.glob("*/")) if path.suffix == ".py"}
    rooms |= {path.parent.name for path in root.glob("*/__init__.py")}
    assert rooms - {"__init__", "__main__"} <= named(table)


def test_the_readme_names_the_commands_that_read_a_configuration():
    text = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    (told,) = re.findall(r"([^.]+) read a configuration\s+\(`-c FILE`", text)
    commands = typer.main.get_command(app).commands
    having = {
        option: {
            name for name, sub in commands.items() if any(option in p.opts for p in sub.params)
        }
        for option in ("-c", "--set", "--json")
    }
    assert set(re.findall(r"`(\w+)`", told)) == having["-c"]
    assert having["--set"] - having["-c"] == {"demo"}
    assert set(commands) - having["--json"] == {"serve"}


def test_help_has_whole_summaries_examples_and_pages(monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    text = CliRunner().invoke(app, ["--help"]).output
    command = typer.main.get_command(app)
    for name, sub in command.commands.items():
        summary = sub.help.partition("\n")[0]
        assert f"{name} {summary}" in " ".join(text.split()), name
        shown = CliRunner().invoke(app, [name, "--help"]).output
        example = re.search(r"Example:\n +mapfilter (.+)\n", shown)
        pointer = re.search(r"Documentation: docs/(\S+)", shown)
        assert example is not None, name
        assert pointer is not None, name
        first, *arguments = shlex.split(example[1])
        assert first == name
        sub.make_context(name, arguments)
        assert (DOCS / pointer[1]).is_file()
    assert "..." not in text.replace("[ARGS]...", "")


def test_command_line_page_names_every_finding_of_check():
    assert set(REMEDIES) <= named(page("cli.rst"))


def test_quickstart_shows_only_commands_that_exist():
    commands = set(typer.main.get_command(app).commands)
    shown = set(re.findall(r"^   \$ mapfilter (\w+)", page("quickstart.rst"), flags=re.MULTILINE))
    assert shown <= commands
    assert commands - shown <= {
        "merge",
        "convert",
        "learn",
        "locate",
        "bench",
        "bound",
        "evaluate",
        "film",
        "serve",
        "sweep",
        "reproduce",
        "view",
    }


def test_recordings_page_lists_every_format_with_an_example():
    text = page("howto/recordings.rst")
    rows = re.findall(r"^   \* - ``([\w-]+)``\n     - (.+)", text, flags=re.MULTILINE)
    assert {name for name, _ in rows} - {"--format"} == {known.name for known in FORMATS}
    assert len(re.findall(r"^     - ``convert .+--out \w+``$", text, re.MULTILINE)) == len(FORMATS)
    listed = named(page("file-formats.rst"))
    assert {column for columns in SENSOR_COLUMNS.values() for column in columns} <= listed
    assert set(SENSOR_COLUMNS) <= listed


def test_the_reference_lists_every_name_of_the_front_door_with_its_page():
    links = dict(re.findall(r":(?:class|func):`(\w+) <([\w.]+)>`", page("api.rst")))
    assert sorted(links) == sorted(mf.__all__)
    for name, target in links.items():
        module, _, short = target.rpartition(".")
        here = getattr(import_module(module), short)
        assert short == name
        assert inspect.unwrap(getattr(mf, name)) is inspect.unwrap(here)


def test_reference_lists_every_package_or_says_that_it_is_internal():
    text, root = page("api.rst"), DOCS.parent / "mapfilter"
    packages = {path.parent.name for path in root.glob("*/__init__.py")}
    modules = {path.stem for path in root.glob("[a-z]*.py")}
    listed = set(re.findall(r"^   mapfilter\.(\w+)$", text, re.MULTILINE))
    internal = set(re.findall(r"``mapfilter\.(\w+)``", text))
    assert listed | internal == packages | modules
    assert not listed & internal
