# make serve      find north on the simulated instruments
# make test       lint, types, import contracts and every test; what CI runs
# make test-quick the tests alone, without the slow and the timed ones
# make check      lint, types, import contracts only
# make proof      the long forms: 60 s loads, large statistics, fresh environments

PYTHON ?= python3
BIN := .venv/bin
PYTEST := $(BIN)/python -m pytest

.PHONY: serve test test-quick check proof clean

serve: .venv/installed
	$(BIN)/northfinder seek

test: check
	$(BIN)/coverage run -m pytest tests/codecs tests/estimators -m "not proof and not speed"
	$(BIN)/coverage report --include='drivers/codecs/*,northfinder/estimators/*' --fail-under=100
	$(PYTEST) --ignore=tests/codecs --ignore=tests/estimators -m "not proof and not speed"
	$(PYTEST) -m "speed and not proof"

test-quick: .venv/installed-dev
	@echo "test-quick: without lint, types, coverage, timed and long tests"
	$(PYTEST) -m "not proof and not speed and not slow"

check: .venv/installed-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/mypy --platform win32
	$(BIN)/lint-imports

proof: .venv/installed-dev
	$(BIN)/northfinder bench --require
	$(PYTEST) -m proof

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "northfinder needs Python 3.11 or newer: make PYTHON=python3.11 ..."; exit 1; }
	$(PYTHON) -m venv .venv

.venv/installed: pyproject.toml | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	touch $@

.venv/installed-dev: pyproject.toml | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	touch $@ .venv/installed

clean:
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build dist
