PYTHON ?= python3.11
BIN := .venv/bin
ONE_CORE := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
PARALLEL := --numprocesses auto --dist worksteal
FURTHER := $(wildcard $(addsuffix /python3.1[2-9],$(subst :, ,$(PATH)) $(shell pyenv root 2>/dev/null)/versions/*/bin))
TIMED := benchmarks --benchmark-only --benchmark-columns=median,min --benchmark-sort=name
PLUGINS := $(wildcard plugins/tactile-*)

.PHONY: demo test test-hardware test-oldest test-pythons headline lint soak fuzz mutants bench docs reference wheels try-wheels clean

demo: .venv/installed
	$(BIN)/tactile demo --out demo

# On all cores; what has compiled kernels runs with them and without (tests/support/kernel_paths.py).
test: .venv/installed
	$(BIN)/python -m pytest $(PARALLEL)

# Real drivers in a virtual machine, with emulated devices; skips with a reason what cannot run here.
test-hardware: .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[hardware-tests]'
	$(ONE_CORE) $(BIN)/python -m pytest -m hardware -rs tests/hardware

# The same with the oldest versions that pyproject.toml admits.
test-oldest: .venv-oldest/installed
	.venv-oldest/bin/python -m pytest $(PARALLEL)

# The same with every newer interpreter that is on this machine.
test-pythons:
	for python in $(FURTHER); do \
	    $$python --version >/dev/null 2>&1 || continue; \
	    venv=.venv-$${python##*/}; \
	    $$python -m venv $$venv || exit; \
	    $$venv/bin/python -m pip install --quiet --disable-pip-version-check --no-compile -e '.[dev,fast]' $(PLUGINS:%=-e %) || exit; \
	    $$venv/bin/python -m pytest $(PARALLEL) || exit; \
	done

# Published figures, on all the recordings that they speak of.
headline: .venv/installed
	$(BIN)/python -m pytest $(PARALLEL) -m headline tests

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# What runs for minutes: thousands of frames, in flat memory and without a mark mistaken.
soak: .venv/installed
	$(ONE_CORE) $(BIN)/python -m pytest -m soak -s tests plugins

# Thousands of bad inputs and faults; FUZZ='--seed 7' tries others, '--case ID' one of them again.
fuzz: .venv/installed
	$(ONE_CORE) PYTHONPATH=tests $(BIN)/python -m fuzz $(FUZZ)

# Makes small mistakes, one by one, in a copy of the tree; fails if the tests miss one.
mutants: .venv/installed
	PYTHONPATH=tests $(BIN)/python -m mutants $(if $(ONLY),--only $(ONLY))

bench: .venv/installed
	$(ONE_CORE) $(BIN)/python -m pytest $(TIMED)
	TACTILE_FAST=0 $(ONE_CORE) $(BIN)/python -m pytest $(TIMED)
	$(ONE_CORE) $(BIN)/python benchmarks/bench_sim.py
	$(ONE_CORE) $(BIN)/python benchmarks/bench_sim.py --plain

# The site, in site/; open site/index.html.
docs: .venv/docs-installed
	$(BIN)/python docs/building/stage_site.py
	$(BIN)/zensical build --strict --clean --config-file build/docs/mkdocs.yml
	rm -rf site && mv build/docs/site site

# The Python reference below docs/reference/python/, from the docstrings.
reference: .venv/installed
	$(BIN)/python docs/building/reference_pages.py

wheels: .venv/installed
	rm -rf dist
	for d in . $(PLUGINS); do $(BIN)/python -m build --wheel --no-isolation --outdir dist $$d || exit; done

# Installs the wheels into an empty environment elsewhere and runs the demo there.
try-wheels: wheels
	elsewhere=$$(mktemp -d) && $(PYTHON) -m venv $$elsewhere/env \
	&& $$elsewhere/env/bin/pip install --quiet --disable-pip-version-check dist/*.whl \
	&& cd $$elsewhere && env/bin/tactile demo --out demo && rm -rf $$elsewhere

.venv/installed: pyproject.toml $(PLUGINS:%=%/pyproject.toml)
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -e '.[dev,fast]' $(PLUGINS:%=-e %)
	touch $@

.venv-oldest/installed: pyproject.toml $(PLUGINS:%=%/pyproject.toml)
	$(PYTHON) -m venv .venv-oldest
	.venv-oldest/bin/python -m pip install --quiet --disable-pip-version-check uv
	.venv-oldest/bin/uv pip install --quiet --python .venv-oldest --resolution lowest-direct -e '.[dev,fast]' $(PLUGINS:%=-e %)
	touch $@

.venv/docs-installed: .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	touch $@

clean:
	rm -rf .venv .venv-* demo dist site
