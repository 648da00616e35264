# The two commands: `make run` and `make test`. Both set up .venv first, from nothing.
PYTHON ?= python3
TARGET ?= sphere
VENV := .venv
BIN := $(VENV)/bin

.PHONY: run test test-slow test-faults test-lowest lint bench clean

run: $(VENV)/.installed
	$(BIN)/rig run --target $(TARGET)

# Two at a time; then, one by one, the tests that run on the wall clock.
test: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -n 2 --dist loadfile -m 'not slow and not hardware and not realtime'
	$(BIN)/python -m pytest -m 'realtime and not slow and not hardware'

test-slow: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -m slow --seeds 3

# Every fault and every ending at 20 random moments, in real time: an hour or two.
test-faults: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -m slow --seeds 20 -s tests/rig/test_faults.py tests/rig/test_endings.py \
	  tests/rig/test_endings_killed.py

test-lowest:
	$(PYTHON) -m venv .venv-lowest
	.venv-lowest/bin/python -m pip install --quiet -e '.[test]' -c tests/lowest.txt
	.venv-lowest/bin/python -m pytest

bench: $(VENV)/.installed-dev
	$(BIN)/python -m benchmarks.bench_limb
	$(BIN)/python -m benchmarks.bench_sim
	$(BIN)/python -m benchmarks.bench_run
	$(BIN)/python -m benchmarks.bench_log
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
