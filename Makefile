# The two commands: `make run` and `make test`. Both set up .venv first, from nothing.
PYTHON ?= python3
TARGET ?= sphere
VENV := .venv
BIN := $(VENV)/bin

.PHONY: run test test-slow test-lowest lint bench clean

run: $(VENV)/.installed
	$(BIN)/rig run --target $(TARGET)

test: $(VENV)/.installed-dev
	$(BIN)/python -m pytest

test-slow: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -m slow

test-lowest:
	$(PYTHON) -m venv .venv-lowest
	.venv-lowest/bin/python -m pip install --quiet -e '.[test]' -c tests/lowest.txt
	.venv-lowest/bin/python -m pytest

bench: $(VENV)/.installed-dev
	$(BIN)/python -m benchmarks.bench_limb
	$(BIN)/python -m benchmarks.bench_sim
	$(BIN)/python -m benchmarks.bench_run
	$(BIN)/python -m benchmarks.bench_camera
	$(BIN)/python -m benchmarks.bench_ur
	$(BIN)/python -m benchmarks.bench_grbl
	$(BIN)/python -m benchmarks.bench_lateness

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

clean:
	rm -rf $(VENV) .venv-lowest dist build

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet -e .
	touch $@

$(VENV)/.installed-dev: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet -e '.[dev]'
	touch $@ $(VENV)/.installed
