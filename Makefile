# Everything a fresh machine with Python 3.11 or newer and make needs. VENV may point elsewhere.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
RIG_STAMP := $(VENV)/.rig
# sizes of `make soak` (h of rig time) and `make seeds`
SOAK ?= 168
FROM ?= 50000
SEEDS ?= 20000
# six workers on two cores: two compute and four wait for processes (tests/conftest.py); each costs 5 s of CPU
WORKERS ?= $(shell echo $$((3 * $$(getconf _NPROCESSORS_ONLN))))
# a test run starts hundreds of processes; where the environment forbids bytecode each would compile what it imports
unexport PYTHONDONTWRITEBYTECODE
PYTEST := $(BIN)/python -m pytest --numprocesses $(WORKERS) --maxprocesses 8 --dist worksteal

.DEFAULT_GOAL := rig
.PHONY: help rig wheel-to-page test quick check lint types contracts bounds kernels kernels-of-floats kernels-of-integers bytecode browser fast tests planted mutation fuzz statistical truth explore lock study studies soak seeds clean wheel test-socketcan test-firmware test-compose

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-20s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

rig:  ## set up, with a bar, and drill wellbore 1
	@$(MAKE) --question $(RIG_STAMP) 2> /dev/null || $(PYTHON) deploy/set_up_shown.py $(VENV) $(MAKE) $(RIG_STAMP)
	$(BIN)/borechain rig scenarios/wellbore-1.toml --speed max --seed 1

test:  ## set up and run every check and every test, in parallel
	$(MAKE) --jobs=6 --output-sync browser kernels bytecode lint contracts
	$(MAKE) --jobs=2 types tests  # the two compilers above keep both cores busy until here; types depend on neither

quick: $(STAMP)  ## lint, types, contracts and the fast tests: under 90 s
	$(MAKE) --jobs=4 check fast

# the lock is complete, so nothing is left to resolve; uv installs it in a tenth of the time, and where uv finds no index
# (it does not read pip's settings) pip does. What is imported is compiled then, and the rest never. A rig needs a third
# of it, and what compiles kernels comes first: `make rig` has them compiled beside the rest. The pip outside installs
# into the environment, whose own takes 3 s to make and is left to what builds wheels
LOCKED := --no-deps --require-hashes --requirement
HAS_PIP := $(PYTHON) -c "import pip" 2> /dev/null
PIP = $(shell $(HAS_PIP) && echo $(PYTHON) -m pip --python $(BIN)/python || echo $(BIN)/python -m pip)
INSTALL = $(BIN)/uv pip install --python $(BIN)/python --quiet $(1) || $(PIP) install --quiet --no-compile $(1)
PICK = awk 'NR == FNR { wanted[$$1]; next } /^[a-z0-9]/ { split($$1, name, "=="); own = name[1] in wanted } own'
$(RIG_STAMP): requirements.lock pyproject.toml deploy/rig-packages.txt
	$(HAS_PIP) && $(PYTHON) -m venv --without-pip $(VENV) || $(PYTHON) -m venv $(VENV)
	echo uv | $(PICK) - requirements.lock > $(VENV)/uv.lock
	printf '%s\n' numba llvmlite numpy | $(PICK) - requirements.lock > $(VENV)/compiler.lock
	$(PICK) deploy/rig-packages.txt requirements.lock > $(VENV)/rig.lock
	$(PIP) install --quiet --no-compile $(LOCKED) $(VENV)/uv.lock
	$(call INSTALL,$(LOCKED) $(VENV)/compiler.lock)
	touch $(VENV)/.compiler
	$(call INSTALL,$(LOCKED) $(VENV)/rig.lock)
	$(call INSTALL,--no-build-isolation --no-deps --editable .)
	touch $@

$(STAMP): $(RIG_STAMP)
	$(BIN)/python -m ensurepip --default-pip > /dev/null
	$(call INSTALL,$(LOCKED) requirements.lock)
	touch $@

check: lint types contracts  ## lint, types and import contracts

lint: $(STAMP)  ## ruff: rules and format
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)  ## mypy, strict
	$(BIN)/mypy

contracts: $(STAMP)  ## which package may import which
	$(BIN)/lint-imports

# a kernel reads beyond the end of an array without a word; compiled like this it raises. Three minutes, most of it compiling
bounds: $(STAMP)  ## the tests of the kernels with every index checked
	NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$(VENV)/checked $(BIN)/python -m pytest -p no:xdist \
	  -m "not (slow or process or install or statistical)" tests/node tests/sim tests/groundstation/survey

kernels: kernels-of-floats kernels-of-integers  ## compile what the tests would compile, each worker for itself

# those in integers take longest and begin at once; what the others import is compiled once, before them
kernels-of-floats: bytecode  ## those of a node, of the published form, of strings and of surveys
	$(BIN)/python tests/tools/compile_kernels.py floats

kernels-of-integers: $(STAMP)  ## those of a node in integers
	$(BIN)/python tests/tools/compile_kernels.py integers

bytecode: $(STAMP)  ## compile what the tests import, asserts rewritten, each worker for itself
	$(BIN)/python -m pytest --collect-only --quiet --quiet > /dev/null || true  # the tests tell

browser:  ## install what the tests need of Debian (chromium, postgresql), where it is not there
	$(PYTHON) tests/tools/install_browser.py

fast: $(STAMP)  ## the fast tests; part of `make quick`
	$(PYTEST) --numprocesses $$(getconf _NPROCESSORS_ONLN) -m "not (slow or process or install or statistical)"

tests: $(STAMP)  ## every test but the statistical ones at full size
	$(PYTEST) -m "not statistical"

statistical: kernels  ## the statistical tests at full size, properties with more examples; part of `make study`
	BORECHAIN_CHIP_MINUTES=30 $(PYTEST) --timeout 1800 -m statistical  # a watchdog: six workers that compile the integers at once take minutes each
	HYPOTHESIS_PROFILE=study $(PYTEST) -m "hypothesis and not statistical"

truth: $(STAMP)  ## the table of the field by a second world, beside the study's
	PYTHONPATH=tests/truth $(BIN)/python tests/truth/both_tables.py 100

planted: kernels  ## plant every listed defect, one at a time, and see whether the tests notice
	nice -n 10 $(BIN)/python tests/planted/run_planted.py $(PLANT)

mutation: kernels  ## change an operator or a number of the pure modules, a sample by a seed, and see whether the tests notice
	nice -n 10 $(BIN)/python tests/planted/run_mutants.py $(MUTATE)

fuzz: $(STAMP)  ## changed files of every kind that is read, a minute each group
	nice -n 10 $(BIN)/python tests/fuzz/run_fuzz.py $(FUZZ)

explore: $(STAMP)  ## the properties with examples that no run before has seen
	HYPOTHESIS_PROFILE=explore $(BIN)/python -m pytest -m hypothesis

study: $(STAMP)  ## statistical tests, and every study with many seeds: its tables are committed in docs/results
	$(MAKE) --jobs=2 --output-sync=line statistical studies
	$(BIN)/borechain bench realtime --nodes 50 --seconds 120 --out docs/results
	$(BIN)/python -P benchmarks/codec.py
	nice -n 10 $(BIN)/python tests/planted/run_planted.py --sample 40
	nice -n 10 $(BIN)/python tests/fuzz/run_fuzz.py --seconds 60
	$(BIN)/python docs/make_faults.py
	$(BIN)/python docs/make_real_rests.py

# what the tests leave of the cores, the studies use; they are in no test's way
studies: kernels  ## the studies; part of `make study`
	nice -n 10 $(BIN)/borechain experiment all --out docs/results

soak: $(STAMP)  ## 100 000 seeds of the gauntlet, SOAK hours of a rig under faults, an hour of processes
	$(BIN)/borechain gauntlet --seeds 100000 --from 100000
	$(BIN)/borechain gauntlet --soak $(SOAK) --out docs/results
	$(BIN)/borechain bench hour --out docs/results

seeds: $(STAMP)  ## fresh seeds of the gauntlet, SEEDS of them FROM one on
	$(BIN)/borechain gauntlet --seeds $(SEEDS) --from $(FROM)

wheel: $(STAMP)  ## a wheel in dist with kernels compiled for every processor of this machine's family
	$(BIN)/python deploy/deliver_kernels.py
	$(BIN)/python -m pip wheel --quiet --no-build-isolation --no-deps --wheel-dir dist .

wheel-to-page: wheel  ## how long a newcomer waits: from the wheel to a live page with ten tubes; a quiet machine
	$(BIN)/python tests/tools/wheel_to_page.py

test-socketcan: $(STAMP)  ## joints on the kernel's own CAN, in a User-Mode Linux; says why where there is none
	$(BIN)/python tests/tools/socketcan.py

test-firmware: $(STAMP)  ## a node's C on this machine and on emulated chips; installs Debian's compilers and emulators, or says why not
	$(PYTHON) tests/tools/install_compilers.py
	$(PYTEST) --timeout 1800 tests/node/chip tests/firmware tests/test_firmware_command.py

test-compose: $(STAMP)  ## docker-compose.yml in containers until two tubes are surveyed; says why where that cannot be
	$(BIN)/python tests/tools/compose.py $(COLD)

lock:  ## pin the dependencies again, without addresses (needs pip-tools)
	pip-compile --quiet --upgrade --generate-hashes --all-extras --allow-unsafe --strip-extras --no-annotate \
	  --no-header --no-emit-index-url --no-emit-find-links --no-emit-trusted-host --no-emit-options \
	  --output-file requirements.lock pyproject.toml
	$(BIN)/uv pip compile --quiet --extra ground --extra build --constraint requirements.lock --no-annotate --no-header \
	  --no-emit-index-url pyproject.toml | sed 's/[^a-z0-9-].*//' | sort > deploy/rig-packages.txt

clean:  ## remove the environment and every cache
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
