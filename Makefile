PYTHON ?= python3.11
BIN := .venv/bin
ONE_CORE := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
TIMED := benchmarks --benchmark-only --benchmark-columns=median,min --benchmark-sort=name
PLUGINS := $(wildcard plugins/tactile-*)

.PHONY: demo test lint bench clean

demo: .venv/installed
	$(BIN)/tactile demo --out demo

# Everything with the compiled kernels, then what has any once more without.
test: .venv/installed
	$(BIN)/python -m pytest
	TACTILE_FAST=0 $(BIN)/python -m pytest tests/algorithms tests/builtin tests/test_pipeline.py

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: .venv/installed
	$(ONE_CORE) $(BIN)/python -m pytest $(TIMED)
	TACTILE_FAST=0 $(ONE_CORE) $(BIN)/python -m pytest $(TIMED)

.venv/installed: pyproject.toml $(PLUGINS:%=%/pyproject.toml)
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev,fast]' $(PLUGINS:%=-e %)
	touch $@

clean:
	rm -rf .venv demo
