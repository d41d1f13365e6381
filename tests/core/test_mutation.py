"""The command that plants small bugs: which bugs, which sample, and what it makes of the tests."""

import ast
from pathlib import Path

import pytest
from mutation import judge, record
from mutation.operators import applied, mutants
from mutation.rooms import ROOMS, Imports, Room
from mutation.workshop import Workshop, is_inlined

ROOT = Path(__file__).resolve().parents[2]


def changes(text):
    """Return (operator, line as mutated) of all mutants of a text."""
    found = []
    for mutant in mutants(text, "file.py"):
        lines = applied(text, mutant).splitlines()
        found.append((mutant.operator, lines[mutant.line - 1].strip()))
    return found


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x = a < b", [("boundary", "x = a <= b"), ("comparison", "x = a >= b")]),
        ("x = a == b", [("comparison", "x = a != b")]),
        ("x = a is not b", [("comparison", "x = a is b")]),
        ("x = a not in b", [("comparison", "x = a in b")]),
        ("x = (a) + (b)", [("arithmetic", "x = (a) - (b)")]),
        ("x = a // b", [("arithmetic", "x = a * b")]),
        ("x = a ** b", [("arithmetic", "x = a * b")]),
        ("x = -a", [("unary", "x = (a)")]),
        ("x = not a", [("unary", "x = (a)")]),
        ("x = a and b", [("boolean", "x = a or b")]),
        ("x = 0", [("constant", "x = 1")]),
        ("x = 1.5", [("constant", "x = 3.0")]),
        ("x = 0.0", [("constant", "x = 1.0")]),
        ("x = True", [("constant", "x = False")]),
        ("x += y", [("deletion", "pass"), ("arithmetic", "x -= y")]),
        ("x[i] = y", [("deletion", "pass")]),
        ("f(x)", [("deletion", "pass")]),
        ("x = np.min(y)", [("swap", "x = np.max(y)")]),
        ("x = max(y)", [("swap", "x = min(y)")]),
        ("x = np.sum(y, axis=0)", [("constant", "x = np.sum(y, axis=1)")]),
        ("x = np.searchsorted(a, b)", [("swap", 'x = np.searchsorted(a, b, side="right")')]),
        ('x = np.searchsorted(a, b, "left")', [("swap", 'x = np.searchsorted(a, b, "right")')]),
        ("x = f(east_m, north_m)", [("arguments", "x = f(north_m, east_m)")]),
        ("x = a if b else c", [("negation", "x = a if (not (b)) else c")]),
        ("def f() -> bool:\n    return a", [("negation", "return (not (a))")]),
        ("def f():\n    raise g", [("deletion", "pass")]),
        ("x = 'ä' + b; y = c * d", [("arithmetic", "x = 'ä' + b; y = c / d")]),
    ],
)
def test_small_bugs(text, expected):
    assert changes(text) == expected


def test_a_condition_of_one_comparison_is_negated_once():
    found = [line for _, line in changes("if a < b:\n    pass")]
    assert found == ["if (not (a < b)):", "if a <= b:"]


@pytest.mark.parametrize(
    "text",
    [
        '"""Words 1."""',
        "x: tuple[int, 3]",
        "def f(x: 'a < b' = None) -> 1: ...",
        "@njit(cache=True)\ndef f(): pass",
        "if TYPE_CHECKING:\n    x = 1",
        "__all__ = ['a' + 'b']",
        "x = f'{a + 1:.{2}f}'",
        "x = 'a' + b",
        "Both = A | B",
        "import a",
        "assert a < 1",
        "for a in zip(b, c, strict=True): pass",
    ],
)
def test_what_is_left_alone(text):
    assert changes(text) == []


def test_the_words_of_a_message_are_left_alone_but_not_the_message():
    text = "faults.add('x', 1 + 2)\nraise fail(InputError, 'x', n + 1)"
    assert changes(text) == [("deletion", "pass"), ("deletion", "pass")]


def test_names_do_not_depend_on_what_stands_above():
    text = "x = a + 1\ny = a + 1\nx = a + 1\n"
    below = f"import b\n{text}"
    assert [m.stable for m in mutants(text, "f")] == [m.stable for m in mutants(below, "f")]
    assert len({m.stable for m in mutants(text, "f")}) == len(mutants(text, "f")) == 6
    first = mutants(text, "mapfilter/f.py")[0]
    assert first.id == f"mapfilter/f.py:1:6:arithmetic:{first.stable}"
    assert first.change == "+ → -"


def test_every_room_has_files_and_tests_and_every_mutant_is_python():
    for room in ROOMS.values():
        assert room.sources(ROOT)
        assert room.test_files(ROOT)
    for file in ROOMS["evaluation"].sources(ROOT)[:4]:
        text = (ROOT / file).read_text()
        original = ast.dump(ast.parse(text))
        for mutant in mutants(text, file.as_posix()):
            assert ast.dump(ast.parse(applied(text, mutant))) != original


def test_imports_through_others():
    imports = Imports(ROOT)
    models = Path("mapfilter/models")
    assert models / "terms.py" in imports.direct(models / "gaussian.py")
    assert models / "gaussian.py" in imports.importers(models / "terms.py")
    assert Path("mapfilter/positioning/bayes/filter.py") in imports.importers(
        models / "street_motion.py"
    )
    assert models / "motion.py" not in imports.importers(models / "state.py")


SPIN = "def spin(n):\n    while n > 0:\n        n -= 1\n\n\n"
SPUN = "\n\ndef test_spin():\n    from toy.sums import spin\n\n    spin(3)\n"
# A file, and tests that notice a bug in its first function and none in its second.
TOY = {
    "toy/__init__.py": "",
    "toy/sums.py": (
        f"def add(a, b):\n    return a + b\n\n\n{SPIN}def unseen(a, b):\n    return a - b\n"
    ),
    "tests/test_sums.py": (
        f"from toy.sums import add\n\n\ndef test_add():\n    assert add(2, 3) == 5\n{SPUN}"
    ),
    "pyproject.toml": "[tool.pytest.ini_options]\n",
}
ROOM = {"toy": Room(("toy/*.py",), ("tests/test_*.py",))}


@pytest.fixture
def toy(tmp_path, monkeypatch):
    for name, text in TOY.items():
        (tmp_path / "toy" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "toy" / name).write_text(text)
    monkeypatch.setattr(judge, "_PATIENCE_S", 0.25)
    return tmp_path / "toy"


def judged(toy, near=None, **more):
    tasks = judge.plan(toy, "toy", None, 1, rooms=ROOM, near=near, package="toy")
    path = toy / "out" / "verdicts.jsonl"
    holding = judge.known(toy, tasks, record.read(path))
    made = list(judge.judged(toy, toy / "out", tasks, holding, package="toy", **more))
    for verdict in made:
        record.append(path, verdict)
    return {v.change + v.id.split(":")[1]: v.status for v in made}


def test_killed_survived_timed_out_and_not_judged_twice(toy):
    before = {name: (toy / name).read_text() for name in TOY}
    verdicts = judged(toy)
    assert verdicts["+ → -2"] == record.KILLED
    assert verdicts["- → +11"] == record.SURVIVED
    assert verdicts["n -= 1 → pass7"] == record.TIMEOUT
    assert {name: (toy / name).read_text() for name in TOY} == before
    assert judged(toy) == {}
    # A further test: only those that no test noticed are judged again.
    (toy / "tests" / "test_more.py").write_text(
        "from toy.sums import unseen\n\n\ndef test_unseen():\n    assert unseen(3, 2) == 1\n"
    )
    again = judged(toy, jobs=2)
    assert again["- → +11"] == record.KILLED
    assert "+ → -2" not in again


def test_a_mutant_is_judged_by_the_nearest_tests_alone(toy):
    # None of these spins.
    for name in ("toy/sums.py", "tests/test_sums.py"):
        (toy / name).write_text(TOY[name].replace(SPIN, "").replace(SPUN, ""))
    (toy / "tests" / "test_any.py").write_text(
        "import toy.other\nfrom toy.sums import unseen\n\n\n"
        "def test_unseen():\n    assert unseen(3, 2) == 1\n"
    )
    (toy / "toy" / "other.py").write_text("")
    # Of two that import the file, the one that imports less.
    assert judged(toy, near=1)["- → +6"] == record.SURVIVED
    assert judged(toy, near=1) == {}
    # One that no test noticed is judged again by more tests; one that a test noticed is not.
    again = judged(toy, near=2)
    assert again["- → +6"] == record.KILLED
    assert "+ → -2" not in again
    assert judged(toy) == {}


def test_the_nearest_tests_import_a_file_through_the_fewest_others(tmp_path):
    texts = {
        "toy/far.py": "",
        "toy/kernel.py": "from toy import far",
        "toy/door.py": "import toy.kernel",
        "tests/test_a.py": "import toy.door",
        "tests/test_b.py": "import toy.door\nimport toy.kernel",
        "tests/test_c.py": "from toy.kernel import x",
        "tests/test_d.py": "import os",
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    tests = [Path(name) for name in texts if name.startswith("tests")]
    imports = Imports(tmp_path, "toy")

    def nearest(file, count):
        found = imports.nearest(Path("toy", file), tests[::-1], count)
        return "".join(test.stem[-1] for test in found)

    assert nearest("kernel.py", 9) == nearest("far.py", 9) == "cba"
    assert nearest("door.py", 9) == "ab"
    assert nearest("far.py", 1) == "c"


def test_tests_that_name_a_file_are_nearer_than_others_that_do_not_import_it(tmp_path):
    texts = {
        "toy/__init__.py": "if TYPE_CHECKING:\n    from toy.door import read as read",
        "toy/wave_files.py": "",
        "toy/formats.py": "from toy import wave_files",
        "toy/door.py": "import toy.formats",
        "tests/test_a.py": "import toy.formats",
        "tests/test_b.py": "import toy.formats\nimport toy.door\n# Wave files, and WAVE_FILES.",
        "tests/test_wave_files_c.py": "import mapfilter as mf\nmf.read('waves')",
        "tests/test_d.py": "from toy.wave_files import x",
        "tests/test_e.py": "import mapfilter as mf\nmf.write('wave_files')",
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    tests = [Path(name) for name in texts if name.startswith("tests")]
    imports = Imports(tmp_path, "toy")
    found = imports.nearest(Path("toy", "wave_files.py"), tests, 9)
    # A name of the front door counts as an import of its file, and a name that has none does not.
    assert "".join(test.stem[-1] for test in found) == "dbca"
    assert imports.direct(Path("tests/test_wave_files_c.py")) == {Path("toy/door.py")}


def test_kernels_hold_constants_and_compiled_functions():
    def inlined(text):
        return [is_inlined(text, mutant) for mutant in mutants(text, "file.py")]

    assert inlined("A = 1\n\n\ndef f():\n    return 2\n") == [True, False]
    assert inlined("class A:\n    b = 1\n\n    def f(self):\n        return 2\n") == [True, False]
    assert inlined("from numba import njit\n\n\ndef f():\n    return 2\n") == [True]
    # A decorator of another module may compile.
    assert inlined("from a import kernel\n\n\n@kernel\ndef f():\n    return 2\n") == [True]


def test_a_mutant_that_no_test_is_near_to_survives_and_nothing_is_run(toy):
    (toy / "toy" / "alone.py").write_text("A = 1\n")
    # The only test that there is could not even be imported.
    (toy / "toy" / "sums.py").unlink()
    assert judged(toy, near=3) == {"1 → 21": record.SURVIVED}


def test_tests_that_fail_anyway_are_an_error(toy):
    (toy / "tests" / "test_more.py").write_text("def test_no():\n    assert False\n")
    with pytest.raises(RuntimeError, match="without any mutant"):
        judged(toy)


def test_examples_that_fail_are_not_shrunk(toy):
    (toy / "tests" / "conftest.py").write_text(
        "from hypothesis import settings\n\n"
        "settings.register_profile('own', deadline=None)\nsettings.load_profile('own')\n"
    )
    (toy / "tests" / "test_more.py").write_text(
        "from hypothesis import Phase, settings\n\n\ndef test_phases():\n"
        "    assert Phase.generate in settings.default.phases\n"
        "    assert Phase.shrink not in settings.default.phases\n"
    )
    assert judged(toy)


def test_two_runs_never_share_a_copy(toy):
    with (
        Workshop(toy, toy / "out", "toy"),
        pytest.raises(RuntimeError, match="another run"),
        Workshop(toy, toy / "out", "toy"),
    ):
        pass


def test_samples_are_the_same_for_a_seed_and_grow(toy):
    def sample(count, seed):
        return [task.mutant.id for task in judge.plan(toy, "toy", count, seed, rooms=ROOM)]

    assert sample(3, 1) == sample(3, 1) == sample(6, 1)[:3]
    assert sorted(sample(None, 1)) == sorted(sample(None, 2))
    assert sample(None, 1) != sample(None, 2)
    before = sample(None, 1)
    (toy / "toy" / "sums.py").write_text("import os\n" + TOY["toy/sums.py"])
    assert [name.split(":")[-1] for name in sample(None, 1)] == [
        name.split(":")[-1] for name in before
    ]


def test_a_sample_of_some_files_has_mutants_of_these_alone(toy):
    (toy / "toy" / "more.py").write_text("def more(a):\n    return a + 1\n")

    def files(*patterns):
        tasks = judge.plan(toy, "toy", None, 1, rooms=ROOM, files=patterns)
        return {task.mutant.file for task in tasks}

    assert files() == {"toy/sums.py", "toy/more.py"}
    assert files("more.py") == files("toy/m*.py") == {"toy/more.py"}
    assert files("more.py", "sums.py") == files()
    assert files("ore.py") == set()


def test_equivalents_are_matched_by_line_and_change(toy):
    entry = record.Reviewed("toy/sums.py", "return a - b", "- → +", "an example")
    tasks = judge.plan(toy, "toy", None, 1, [entry], rooms=ROOM)
    assert [task.mutant.line for task in tasks if task.equivalent] == [11]
    gone = record.Reviewed("toy/sums.py", "return a * b", "* → /", "an example")
    assert record.unmatched([task.mutant for task in tasks], [entry, gone]) == [gone]


def test_the_list_of_equivalents_is_up_to_date():
    entries = record.reviewed(ROOT / "tests" / "mutation" / "equivalent.toml")
    files = {entry.file for entry in entries}
    there = [m for file in files for m in mutants((ROOT / file).read_text(), file)]
    assert record.unmatched(there, entries) == []


def test_an_equivalent_without_a_reason_is_an_error(tmp_path):
    file = tmp_path / "equivalent.toml"
    file.write_text('[[mutant]]\nfile = "f"\nline = "x"\nchange = "y"\nreason = " "\n')
    with pytest.raises(ValueError, match="a reason"):
        record.reviewed(file)


def test_verdicts_cut_short_are_left_out_and_the_last_one_counts(tmp_path):
    path = tmp_path / "verdicts.jsonl"
    first = record.Verdict("f:1", "s", "r", "c", record.SURVIVED, "", 1.0, "a", "b", "c")
    last = record.Verdict("f:1", "s", "r", "c", record.KILLED, "t", 1.0, "a", "b", "c")
    record.append(path, first)
    record.append(path, last)
    path.write_text(path.read_text() + '{"id": "f:2", "sta')
    assert record.read(path) == [last]


def test_the_score_counts_what_can_be_noticed():
    statuses = [record.KILLED] * 7 + [record.TIMEOUT] + [record.SURVIVED] * 2
    score = record.Score.of("room", [*statuses, record.EQUIVALENT])
    assert (score.sampled, score.judged) == (11, 10)
    low, high = record.wilson(8, 10)
    assert (round(low, 3), round(high, 3)) == (0.49, 0.943)
    assert "80 %" in score.row()
    assert record.wilson(0, 0) == (0.0, 1.0)
    assert "–" in record.Score.of("room", []).row()
