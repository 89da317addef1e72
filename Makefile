# Two commands do everything on a fresh machine with python3 (3.10 or later), make and a network:
#   make walk   the main job: plan the paper's walk, print Table II, write out/walk.html
#   make test   the whole test suite, with linters and type checker
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin

.DEFAULT_GOAL := help
.PHONY: help walk test pytest test-slow lint bench fuzz faults interrupts lowest docs browser clean

help:
	@sed -n '2,3p' $(MAKEFILE_LIST) | sed 's/^#  //'
	@echo "  make bench      measure speed and memory, beside the obvious way"
	@echo "  make fuzz       wrong inputs for all readers and public functions (some 20 minutes)"
	@echo "  make faults     faults planted into plans, which the certificate must find"
	@echo "  make interrupts studies that are stopped, killed, or lose their cluster"
	@echo "  make lowest     the oldest versions that pyproject.toml allows, and quick tests with them"
	@echo "  make docs       build the documentation into docs/_build"
	@echo "  make test-slow  the tests that take long"
	@echo "  make clean      remove the virtual environment and everything built"

$(VENV)/.walk: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	  { echo "gaitopt needs Python 3.10 or later; try: make PYTHON=python3.12 walk"; exit 1; }
	@# What an interrupted run left behind is made anew.
	@$(BIN)/python -m pip --version 2>/dev/null | grep -q '^pip ' || { \
	  $(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || \
	    { echo "Python's venv is missing; on Debian and Ubuntu: sudo apt install python3-venv"; exit 1; }; \
	  $(PYTHON) -m venv --clear $(VENV); }
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable .
	@touch $@

$(VENV)/.test: $(VENV)/.walk
	$(BIN)/python -m pip install --quiet --editable '.[test,docs]'
	@touch $@

walk: $(VENV)/.walk
	$(BIN)/gaitopt walk --out out --overwrite

# The browser shows replays to the tests; without one (or without root) those tests say so.
browser:
	@.ci/install-browser

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# Linters beside tests: the type checker uses one core, and a minute of it where it has no cache.
test: $(VENV)/.test browser
	@$(MAKE) --no-print-directory -j2 lint pytest

# Many tests start new processes: without bytecode each of them would compile gaitopt again. There is
# a process of tests for each core: a second thread for small matrices only takes time of the other.
pytest: $(VENV)/.test
	PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n auto --dist loadscope --no-loadscope-reorder

test-slow: $(VENV)/.test browser
	$(BIN)/python -m pytest -m slow

bench: $(VENV)/.test
	$(BIN)/python -m benchmarks

fuzz: $(VENV)/.test
	$(BIN)/python -m benchmarks.fuzz --cases 2000

faults: $(VENV)/.test
	$(BIN)/python -m pytest tests/certificate tests/test_second_judge.py

interrupts: $(VENV)/.test
	$(BIN)/python -m pytest tests/studies/test_interrupted.py tests/studies/test_cluster.py \
	  tests/cli/test_interrupts.py

# The oldest versions that pyproject.toml allows, and a quick part of the suite with them: what is near
# to solvers and readers. The file that is written last is part of the repository: a test refuses
# bounds that are not in it.
lowest:
	$(PYTHON) -m venv --clear $(VENV)-lowest
	$(VENV)-lowest/bin/python -m pip install --quiet --target $(VENV)-lowest/uv uv
	$(VENV)-lowest/uv/bin/uv pip install --quiet --python $(VENV)-lowest/bin/python \
	  --resolution lowest-direct --editable '.[test]'
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(VENV)-lowest/bin/python -m pytest -p no:cacheprovider \
	  tests/retiming tests/motion tests/planners/phase_by_phase/test_standing_places.py \
	  tests/certificate/test_verify.py tests/stability tests/optimize tests/terrain tests/robots/test_*.py
	$(VENV)-lowest/bin/python .ci/bounds.py > .ci/lowest.txt

docs: $(VENV)/.test
	$(BIN)/python docs/make_replays.py
	GAITOPT_NOTEBOOKS=cache $(BIN)/sphinx-build -W --keep-going -b html docs docs/_build/html
	@echo "open docs/_build/html/index.html"

clean:
	rm -rf $(VENV) $(VENV)-lowest out docs/_build build dist .pytest_cache .mypy_cache .ruff_cache
