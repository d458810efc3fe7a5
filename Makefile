# Everything goes into .venv, made once from the lock files in requirements/. Arguments for the program: ARGS="...".
PYTHON ?= python3
BIN := .venv/bin

# uv, matplotlib and numba each need a home that they can write to.
ifneq ($(shell test -w "$$HOME" && echo yes),yes)
export HOME := $(CURDIR)/.cache
endif

# Each module is compiled once and not in every process that imports it.
unexport PYTHONDONTWRITEBYTECODE

# Tests hardly wait, for processes and for disks, and each further worker collects them all once more.
WORKERS := $(shell getconf _NPROCESSORS_ONLN)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help run test machine-code slow bench docs reference wheel lint style types size format lock clean

help: ## show these targets
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' Makefile | expand -t 16

run: .venv/.bytecode .venv/.gl machine-code ## run the main scenario
	@$(BIN)/escort-mj run scenarios/main.yaml $(ARGS)

test: .venv/.run ## lint, types, import contracts, then the fast tests
	@$(MAKE) --no-print-directory -j4 machine-code lint .venv/.gl .venv/.bytecode
	$(BIN)/pytest -n $(WORKERS) --maxprocesses 8 --dist worksteal $(ARGS)

machine-code: .venv/.run ## compile all kernels for this machine's level of processors
	@$(BIN)/python -m escort_mj.native.compiler.ship

wheel: .venv/.run ## the wheel, with machine code for every level of x86-64 processors
	$(BIN)/python -m escort_mj.native.compiler.ship --every-level
	$(BIN)/python -m hatchling build -t wheel

slow: .venv/.test .venv/.gl ## the tests too slow for every change
	$(BIN)/pytest -m slow $(ARGS) || [ $$? -eq 5 ]  # 5: there are none

bench: .venv/.test ## measure speed
	$(BIN)/python -m benchmarks $(ARGS)

docs: .venv/.test ## the site, in docs/site; broken links are errors
	rm -rf docs/jupyter_execute # output of an earlier build, which Sphinx would read as pages
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet -d .cache/doctrees docs docs/site $(ARGS)

reference: .venv/.test ## write the schema of scenarios for editors, and the fields of kernels
	$(BIN)/python -m escort_mj.memory.stub
	$(BIN)/escort-mj schema > scenarios/schema.json

lint: style types size ## style, types, import contracts and sizes

style: .venv/.test
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports --no-logo

types: .venv/.test
	$(BIN)/mypy

size: .venv/.run ## lines of code by room, and whether each keeps its budget
	@$(BIN)/python .ci/size.py

format: .venv/.test ## put the code into its style
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

COMPILE := $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --custom-compile-command "make lock"
lock: $(BIN)/uv ## pin the dependencies anew (all of them to their newest: make lock ARGS=--upgrade)
	$(COMPILE) $(ARGS) pyproject.toml --group setup --extra compile --extra video -o requirements/run.txt
	$(COMPILE) $(ARGS) pyproject.toml --group setup --extra test -c requirements/run.txt -o requirements/test.txt

clean: ## remove .venv and every cache
	rm -rf .venv escort_mj/native/machine_code .cache .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis dist
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

INSTALL := $(BIN)/uv pip install --quiet --python $(BIN)/python
# Leaves bytecode of what programs import, also for those that may write none; of all of it would take thrice as long.
IMPORT := $(BIN)/python -W ignore -c

.venv/.run: requirements/run.txt pyproject.toml | $(BIN)/uv
	@echo "Installing the packages pinned in requirements/run.txt into .venv ..."
	@$(INSTALL) -r requirements/run.txt
	@$(INSTALL) --no-deps --no-build-isolation --editable .
	@touch $@

.venv/.bytecode: .venv/.run
	@$(IMPORT) 'import dm_control.mjcf' 2>/dev/null || true # not for Python 3.13 and later
	@$(IMPORT) 'import h5py, matplotlib.pyplot, mediapy, mujoco, numba, pandas, pydantic, rich, \
	    ruamel.yaml, scipy.optimize, scipy.spatial, scipy.stats, typer, xarray, escort_mj.api'
	@touch $@

.venv/.test: requirements/test.txt .venv/.run
	@echo "Adding the test tools pinned in requirements/test.txt ..."
	@$(INSTALL) -r requirements/test.txt
	@$(IMPORT) 'import cmaes, distributed, gymnasium, hypothesis, jsonschema, mcap, minari, optuna, pettingzoo, \
	    pyarrow.parquet, pytest, rosbags.highlevel, viser, xdist'
	@touch $@

# Tried once: a machine that may not install EGL is not asked again, and every run says what it lacks.
.venv/.gl: | .venv/.run
	@$(BIN)/python -m escort_mj.gl --install
	@touch $@

# A Debian with python3-pip alone has no ensurepip, one with python3-venv alone has no pip: either is enough.
$(BIN)/uv:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	    || { echo "escort_mj needs Python 3.11 or newer as $(PYTHON) (or: make PYTHON=python3.12 ...)."; exit 1; }
	@$(PYTHON) -m venv --clear --without-pip .venv
	@if $(PYTHON) -m pip --version >/dev/null 2>&1; then pip="$(PYTHON) -m pip --python $(BIN)/python"; \
	    elif $(BIN)/python -m ensurepip >/dev/null 2>&1; then pip="$(BIN)/python -m pip"; \
	    else echo "$(PYTHON) has no pip. This command adds it:  sudo apt-get install -y python3-pip"; exit 1; fi; \
	    $$pip --disable-pip-version-check install --quiet --no-user -c requirements/run.txt uv
