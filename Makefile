# Everything a fresh machine with Python 3.11 or newer and make needs. VENV may point elsewhere.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: rig test check lint types contracts tests explore lock study clean

rig: $(STAMP)  ## set up and drill wellbore 1
	$(BIN)/borechain rig scenarios/wellbore-1.toml --speed max --seed 1

test: check tests  ## set up and run every check and every test

$(STAMP): requirements.lock pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --no-build-isolation --no-deps --editable .
	touch $@

check: lint types contracts

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/mypy

contracts: $(STAMP)
	$(BIN)/lint-imports

tests: $(STAMP)
	$(BIN)/python -m pytest

explore: $(STAMP)  ## the properties with examples that no run before has seen
	HYPOTHESIS_PROFILE=explore $(BIN)/python -m pytest -m hypothesis

study: $(STAMP)  ## every study of the table, with many seeds; their tables are committed in docs/results
	$(BIN)/borechain experiment all --out docs/results
	$(BIN)/borechain bench realtime --nodes 50 --seconds 120 --out docs/results

lock:  ## pin the dependencies again, without addresses (needs pip-tools)
	pip-compile --quiet --upgrade --generate-hashes --all-extras --allow-unsafe --strip-extras --no-annotate \
	  --no-header --no-emit-index-url --no-emit-find-links --no-emit-trusted-host --no-emit-options \
	  --output-file requirements.lock pyproject.toml

clean:
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
