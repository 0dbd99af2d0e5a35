# All targets use .venv, made from requirements/*.txt (pinned, with hashes), and install nothing else on
# the machine. They need a Rust toolchain, Python 3.11 or newer, and make.

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules

BIN := .venv/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
PY := $(BIN)/python
# The interpreter that makes .venv: the first in this list with version 3.11 or newer.
PYTHONS := $(or $(PYTHON),python3 python3.14 python3.13 python3.12 python3.11 python)
# pyo3 compiles for this interpreter, not for the first one on the PATH.
export PYO3_PYTHON := $(CURDIR)/$(PY)
# Python's own settings must not leak into .venv.
unexport PYTHONPATH PYTHONHOME

# The peers of `bench-peers` live in an environment of their own.
PEERS := .venv-peers/$(notdir $(BIN))

# Print what a step does, then its seconds.
STEP := @bash .ci/step
PIP := $(PY) -m pip install --disable-pip-version-check --progress-bar off --no-input
EDITABLE := $(PIP) --quiet --no-deps --no-build-isolation --editable .
# Keep only pip's lines on downloads, with sizes; errors go to the terminal directly.
BRIEFLY := grep --line-buffered -E '^==>|(Downloading|Using cached) .*\.whl \('

# Make one goal after another even with -j: two goals would install into .venv at the same time. If everything
# is installed already, BESIDE=1 lets -j run several goals.
ifndef BESIDE
.NOTPARALLEL:
endif

# Sources of the compiled module; cargo decides which of them to compile again.
SOURCES := $(shell find rust -name '*.rs') Cargo.toml Cargo.lock pyproject.toml

.PHONY: help install edit demo docs test test-rust test-python test-slow fuzz lint lint-rust lint-python format dist lock clean bench bench-count bench-startup bench-output bench-fit bench-peers bench-states bench-crossings bench-discovery bench-odebench bench-odebench-pysindy bench-tracker bench-page test-browser

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-13s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

install: .venv/.ready-user ## make .venv with all extras of udd (no docs, test or lint) and the release build

# Targets that need the release build compile it again.
edit: .venv/.has-build .venv/.has-user .venv/.has-test ## compile the changed Rust core in seconds; the module runs half as fast as the release build
	@rm -f .venv/.module
	$(STEP) "compiling what changed" env VIRTUAL_ENV=$(CURDIR)/.venv $(BIN)/maturin develop --profile dev --locked --skip-install
	@[ -e .venv/.udd ] || { MATURIN_PEP517_ARGS="--locked --profile dev" $(EDITABLE) && touch .venv/.udd; }

demo: .venv/.ready-demo ## from the sample film to the report: run the main job and print where its report is
	$(STEP) "udd demo" $(BIN)/udd demo

docs: .venv/.ready-docs ## build the documentation into docs/_build/html; every page is run, and a warning is an error
	$(STEP) "docs" $(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build/html

# Side by side: the compiler uses one core for part of its time.
test: .venv/.ready-test ## build everything and run all tests (cargo and pytest)
	@$(MAKE) --no-print-directory BESIDE=1 -j2 -k --output-sync=line test-rust test-python

test-rust: ## only the tests of the Rust core; needs no Python
	$(STEP) "cargo test" cargo test --locked --no-fail-fast

test-python: .venv/.ready-test ## only the tests of the Python package (ARGS="-k section" for some of them)
	$(STEP) "pytest" $(PY) -m pytest -n auto --dist worksteal --durations=25 $(ARGS)

test-slow: .venv/.ready-test ## tests that `make test` skips: stricter versions of faster tests
	$(STEP) "pytest, the slow tests" $(PY) -m pytest -m nightly -n auto --durations=0 $(ARGS)

fuzz: .venv/.ready-test ## hostile inputs for an hour: formulas, tables, files, films, arguments (ARGS="--minutes 5 --kinds csv,files")
	$(PY) tests/fuzz/campaign.py $(ARGS)

test-browser: .venv/.browser ## the page in Debian's chromium (ARGS="-k link" for some of it)
	$(STEP) "pytest in a browser" env UDD_BROWSER=1 $(PY) -m pytest tests/browser --durations=15 $(ARGS)

bench-page: .venv/.browser ## the page's frames per second and its delay from slider to frame
	$(PY) benches/python/page.py

lint: lint-rust lint-python ## rustfmt, clippy, ruff, zizmor, mypy --strict, the stub of udd._core, and the prose of the change

lint-rust: .venv/.made
	cargo fmt --all --check
	$(STEP) "clippy" cargo clippy --workspace --locked --all-targets --features udd/python -- -D warnings

lint-python: .venv/.ready-user .venv/.ready-lint
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports
	$(BIN)/zizmor --offline --quiet .github
	$(PY) tools/prose.py --diff
	$(STEP) "mypy" $(BIN)/mypy --strict python/udd
	$(STEP) "stubtest" $(PY) -m mypy.stubtest udd._core --mypy-config-file pyproject.toml

format: .venv/.has-lint ## format the Rust and the Python code
	cargo fmt --all
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

dist: .venv/.has-build ## build the wheel and the source distribution into dist/
	$(BIN)/maturin build --release --locked --strip --sdist --out dist

bench: ## time the core's hot paths (ARGS="section --quick" for some of them, in short; ARGS=--limit: how far from the machine's limit they are)
	cargo bench --locked --package udd-benches -- $(ARGS)

bench-count: .venv/.made ## count their instructions; fails where one takes over 3 % more than committed (ARGS=--update to refresh)
	$(STEP) "bench-count" $(PY) benches/count.py $(ARGS)

bench-startup: .venv/.ready-user ## what importing udd takes in seconds, and a long sweep in memory
	$(PY) benches/python/startup.py
	$(PY) benches/python/memory.py

bench-output: .venv/.ready-user ## seconds to the first output of each command of the docs (ARGS='"udd fit"' for some of them)
	$(PY) benches/python/first_output.py $(ARGS)

bench-fit: .venv/.ready-user ## what fits of simulated films take on one core (ARGS="--frames 3000 --turns 9")
	$(PY) benches/python/fit.py $(ARGS)

bench-states: .venv/.ready-user ## what steps and fits take by the number of states, 2 to 12, on one core (ARGS="--turns 9")
	$(PY) benches/python/states.py $(ARGS)

bench-crossings: .venv/.ready-user ## sections and switches with known answers: none missed, none seen twice (ARGS="--cases 10000 --jobs 2")
	$(STEP) "bench-crossings" $(PY) benches/python/crossings.py $(ARGS)

bench-discovery: .venv/.ready-user ## what the loop finds in drawn records (ARGS="--batches three,nulls --records 3 --jobs 2")
	$(STEP) "bench-discovery" $(PY) benches/python/discovery $(ARGS)

bench-odebench: .venv/.ready-user ## the systems of ODEBench (or dysts): a missing term, a whole system (ARGS="--from dysts --noise 0 0.01 --only missing")
	$(STEP) "bench-odebench" $(PY) benches/python/odebench $(ARGS)

bench-odebench-pysindy: .venv-peers/.deps ## whole systems of these by PySINDy with its defaults
	$(PEERS)/python benches/python/odebench --only pysindy $(ARGS)

bench-tracker: .venv/.ready-user ## the tracker on films with every defect in turn (ARGS="--only clean,standard --trackers udd,fast,HSV")
	$(PY) benches/python/tracker $(ARGS)

bench-peers: .venv-peers/.udd ## udd beside SciPy, numba, heyoka, ...: print the table (ARGS=--quick for a smoke run)
	cd benches/python && PYTHONPATH=. $(CURDIR)/$(PEERS)/python -m peers $(ARGS)

# Resolve all groups together, with the current versions; each list is a part of that result.
LOCK = .venv/lock/$(notdir $(BIN))/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
  --no-emit-index-url --no-emit-find-links --no-annotate --custom-compile-command "make lock"
PART = $(LOCK) --constraint .venv/lock/all.txt --output-file

lock: .venv/.made ## write requirements/*.txt anew, with today's versions
	rm -rf .venv/lock
	$(PY) -m venv .venv/lock
	.venv/lock/$(notdir $(BIN))/python -m pip install --quiet uv
	$(LOCK) pyproject.toml --all-extras --group build --group test --group lint --output-file .venv/lock/all.txt
	rm -f requirements/*.txt
	$(PART) requirements/build.txt --group build
	$(PART) requirements/demo.txt pyproject.toml --extra track
	$(PART) requirements/user.txt pyproject.toml --extra all
	$(PART) requirements/test.txt --group test
	$(PART) requirements/lint.txt --group lint
	$(PART) requirements/docs.txt pyproject.toml --extra docs

clean: ## remove .venv and everything that was built
	rm -rf .venv .venv-peers build dist demo docs/_build docs/api/generated target .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find python tests benches -name __pycache__ -type d -prune -exec rm -rf {} +
	rm -f python/udd/_core*.so python/udd/_core*.pyd

# --- steps of `install`, `demo` and the like; a stamp file marks each, so make repeats only steps that changed

.venv/.made:
	@python=; for p in $(PYTHONS); do \
	  if "$$p" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then python=$$p; break; fi; \
	done; \
	if [ -z "$$python" ]; then echo "make: no Python 3.11 or newer found among: $(PYTHONS)" >&2; exit 1; fi; \
	if ! command -v cargo >/dev/null; then echo "make: no cargo found; a Rust toolchain is needed" >&2; exit 1; fi; \
	rm -rf .venv; \
	if ! bash .ci/step "a virtual environment in .venv" "$$python" -m venv .venv; then \
	  rm -rf .venv; \
	  echo "make: $$python cannot make a virtual environment (on Debian and Ubuntu: install python3-venv)" >&2; \
	  exit 1; \
	fi
	@touch $@

# Packages of one list in requirements/.
.venv/.has-%: requirements/%.txt .venv/.made
	$(STEP) "packages of requirements/$*.txt" $(PIP) --require-hashes --no-deps --only-binary :all: -r $< | $(BRIEFLY)
	@touch $@

# Tests and documentation use all extras of udd.
.venv/.has-test .venv/.has-docs: .venv/.has-user

# Compile the module into python/udd; this needs only maturin.
.venv/.module: .venv/.has-build $(SOURCES)
	$(STEP) "compiling the module" env VIRTUAL_ENV=$(CURDIR)/.venv $(BIN)/maturin develop --release --locked --skip-install
	@touch $@

# Point the package in .venv to python/udd; repeat this only if the package's metadata change.
.venv/.udd: pyproject.toml Cargo.toml | .venv/.module
	$(STEP) "udd into .venv" env MATURIN_PEP517_ARGS=--locked $(EDITABLE)
	@touch $@

# All lists for the checks, one after the other.
.venv/.packages: $(addprefix requirements/,build.txt user.txt test.txt lint.txt docs.txt) .venv/.made
	+@$(MAKE) --no-print-directory BESIDE= $(addprefix .venv/.has-,user test lint docs)
	@touch $@

# Download packages while the module compiles.
.venv/.ready-%: $(wildcard requirements/*.txt) $(SOURCES)
	+@$(MAKE) --no-print-directory -j2 BESIDE=1 .venv/.has-$* .venv/.module
	+@$(MAKE) --no-print-directory .venv/.udd
	@touch $@

.venv/.browser: tests/browser/requirements.txt .venv/.ready-test
	@command -v chromium chromium-browser google-chrome >/dev/null || \
	  { as=$$([ "$$(id -u)" = 0 ] || echo sudo); $$as apt-get update -qq && $$as apt-get install -qq --yes --no-install-recommends chromium; }
	$(PY) -m pip install --disable-pip-version-check --progress-bar off --quiet --only-binary :all: -r $<
	@touch $@

# --- steps of `bench-peers`; the table notes each peer that cannot be installed here

.venv-peers/.deps: benches/python/requirements-peers.txt
	rm -rf .venv-peers
	@for p in $(PYTHONS); do \
	  if "$$p" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then "$$p" -m venv .venv-peers; exit; fi; \
	done; \
	echo "make: no Python 3.11 or newer found among: $(PYTHONS)" >&2; exit 1
	sed -e 's/ *#.*//' -e '/^$$/d' $< | while read -r package; do \
	  $(PEERS)/python -m pip install --disable-pip-version-check --progress-bar off --quiet "$$package" -c $< || \
	    echo "make: $$package cannot be installed here; the table goes without it" >&2; \
	done
	@touch $@

.venv-peers/.udd: .venv-peers/.deps $(SOURCES)
	PYO3_PYTHON=$(CURDIR)/$(PEERS)/python MATURIN_PEP517_ARGS=--locked \
	  $(PEERS)/python -m pip install --disable-pip-version-check --force-reinstall --no-deps .
	@touch $@
