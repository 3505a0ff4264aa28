PYTHON ?= python3.11
BIN := .venv/bin
PLUGINS := $(wildcard plugins/tactile-*)

.PHONY: demo test lint bench clean

demo: .venv/installed
	$(BIN)/tactile demo --out demo

test: .venv/installed
	$(BIN)/python -m pytest

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: .venv/installed
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest benchmarks --benchmark-only --benchmark-columns=median,min --benchmark-sort=name

.venv/installed: pyproject.toml $(PLUGINS:%=%/pyproject.toml)
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]' $(PLUGINS:%=-e %)
	touch $@

clean:
	rm -rf .venv demo
