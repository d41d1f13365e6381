# Two commands, each from a fresh clone: make demo, make test. Both set up .venv themselves.
# make mutants plants small bugs and sees whether tests notice: MUTANTS="--room models --seed 2".
PYTHON ?= python3
MUTANTS ?= --sample 40 --seed 1
# Processes that run tests: one for each processor, but at least two and at most four.
TESTERS ?= $(shell n=$$(nproc 2>/dev/null || echo 2); echo $$((n < 2 ? 2 : n > 4 ? 4 : n)))
VENV := .venv
BIN := $(VENV)/bin
# Also for the build backend, which pip installs apart.
export PIP_CONSTRAINT := $(CURDIR)/constraints.txt
export PIP_BUILD_CONSTRAINT := $(CURDIR)/constraints.txt
# Every process of a test would compile every module again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test check docs kernels mutants clean

demo: $(VENV)/.demo
	$(BIN)/mapfilter demo --out out/demo

# Style and documentation beside each other, and kernels when style is done, which otherwise both
# processes of the tests would compile at once; the tests alone, as some of them watch a clock.
test: $(VENV)/.test
	$(MAKE) -j2 check docs kernels
	$(BIN)/python -m pytest -n $(TESTERS) --dist worksteal

check: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(VENV)/.test
	$(BIN)/sphinx-build -j auto -q -W --keep-going -b html docs docs/_build/html

kernels: $(VENV)/.test
	$(BIN)/python -m mapfilter.workflows.kernels

$(VENV)/.demo: EXTRAS :=
$(VENV)/.test: EXTRAS := [test,docs]

# pip compiles modules one after the other, other packages' tests among them: half of its time. A few
# modules are templates that no Python compiles, and of some packages next to none is imported.
# Kernels are compiled here, or the first replay would wait for them.
$(VENV)/.demo $(VENV)/.test: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --no-compile --constraint constraints.txt --editable '.$(EXTRAS)'
	$(BIN)/python -m compileall -qq -j 0 -x '/(tests|pip|setuptools|fontTools|pygments)/' $(VENV)/lib || true
	$(BIN)/python -m mapfilter.workflows.kernels --replay
	touch $@

mutants: $(VENV)/.test
	$(BIN)/python -m tests.mutation $(MUTANTS)

clean:
	rm -rf $(VENV) out build docs/_build *.egg-info
