# make serve      the service with the simulated rig, http://127.0.0.1:8000
# make test       lint, types, import contracts and every test; what CI runs
# make test-quick the tests that need neither browser nor PostgreSQL, without slow and timed ones
# make check      lint, types, import contracts only
# make soak       half an hour of a technician's work: nothing lost, memory flat
# make proof      the long forms: 60 s loads, kills, large statistics, fresh environments, the soak;
#                 writes docs/proof.md

PYTHON ?= python3
BIN := .venv/bin
PYTEST := $(BIN)/python -m pytest
# Several tests at once: half of their time they wait, for a page, a service, a deadline.
PARALLEL := --numprocesses logical --maxprocesses 4 --dist worksteal

# Held to the last line and branch by their own tests.
PURE := tests/codecs tests/estimators tests/attitude tests/alignment
PURE_ROOMS := drivers/codecs/*,northfinder/estimators/*,northfinder/attitude/*,northfinder/alignment/*

# What the long forms measured, each step's into a file of its own; docs/proof.md is made of them.
PROOF := build/proof
NAMED = $(shell $(BIN)/python -m northfinder.proof.document --named-tests)
TIMED = bash -c 'TIMEFORMAT="$@ took %0lR"; time "$$@"' timed

.PHONY: serve test test-quick check proof soak clean system-packages
.PHONY: proof-bench proof-long proof-named proof-alone proof-can proof-document

serve: .venv/installed
	$(BIN)/northfinder serve

test: check system-packages
	$(PYTEST) $(PARALLEL) --cov --cov-report= $(PURE) -m "not proof and not alone"
	$(BIN)/coverage report --include='$(PURE_ROOMS)' --fail-under=100
	$(PYTEST) $(PARALLEL) $(PURE:%=--ignore=%) -m "not proof and not alone"
	tests/vcan/run $(PYTEST) -m "not proof" tests/can
	$(PYTEST) -m "alone and not proof"

test-quick: .venv/installed-dev
	@echo "test-quick: without lint, types, coverage, browser, PostgreSQL, timed and long tests"
	$(PYTEST) $(PARALLEL) --ignore=tests/page -m "not proof and not alone and not slow and not postgresql"

check: .venv/installed-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/mypy --platform win32
	$(BIN)/lint-imports

# Every step runs although an earlier one failed.
proof: .venv/installed-dev system-packages
	rm -rf $(PROOF)
	mkdir -p $(PROOF)
	$(MAKE) --keep-going --jobs=1 proof-bench proof-long proof-named proof-alone proof-can soak proof-document

proof-bench:
	$(TIMED) $(BIN)/northfinder bench --require --json $(PROOF)/bench.json

proof-long:
	$(TIMED) $(PYTEST) $(PARALLEL) -m "proof and not alone" --junitxml $(PROOF)/long.xml

proof-named:
	$(TIMED) $(PYTEST) $(PARALLEL) -m "not proof and not alone" --junitxml $(PROOF)/named.xml $(filter-out tests/can/%,$(NAMED))

proof-alone:
	$(TIMED) $(PYTEST) -m alone --junitxml $(PROOF)/alone.xml

proof-can:
	$(TIMED) tests/vcan/run $(PYTEST) --junitxml $(PROOF)/can.xml $(filter tests/can/%,$(NAMED))

proof-document:
	$(BIN)/python -m northfinder.proof.document --machine --require \
		--bench $(addprefix $(PROOF)/,bench.json soak.json) \
		--tests $(addprefix $(PROOF)/,long.xml named.xml alone.xml can.xml)

soak: .venv/installed-dev
	$(TIMED) $(BIN)/python -m northfinder.proof.soak --minutes 30 --json $(PROOF)/soak.json

system-packages:
	tests/install-system-packages

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
