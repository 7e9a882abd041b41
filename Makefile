# Needs Python 3.11 or later, make and git; everything else goes into a virtual environment of its own.
PYTHON ?= python3
VENV ?= .venv
WORKERS ?= 2

PY := $(VENV)/bin/python
SIM := $(VENV)/.sim-installed
TEST := $(VENV)/.test-installed
DOCS := $(VENV)/.docs-installed
RELEASE := $(VENV)/.release-installed
PIP := $(PY) -m pip --disable-pip-version-check install --quiet
TYPED := $(wildcard geometry estimation rti_mpcc examples benchmarks tests)

# One thread a process: the matrices are small, and test workers share the cores.
export OMP_NUM_THREADS = 1
export OPENBLAS_NUM_THREADS = 1
export MKL_NUM_THREADS = 1
# Pictures are written, never shown.
export MPLBACKEND = Agg

.DEFAULT_GOAL := help
.PHONY: help test lint types unit demo docs acceptance same reproduce figures fresh soak bench dist pythons clean

help:
	@echo "make demo        set up $(VENV) and dock docking_behind: prints the result, writes pictures"
	@echo "make test        set up $(VENV) and run lint, types and tests (lint, types, unit: one of them)"
	@echo "make docs        build the site of docs/, with search and a reference, in runs/site; a warning is an error"
	@echo "make acceptance  run every acceptance list in full; figures go to runs/acceptance.json"
	@echo "make same        drive 330 runs here and at the commit before (or BASE=COMMIT), and report whether"
	@echo "                 each command and plan is the same to the bit"
	@echo "make reproduce   repeat the paper's experiments next to the published figures: runs/reproduce"
	@echo "make figures     measure the tables and pictures of docs that are older than the code, and write them there"
	@echo "                 (at most an hour; again after an interruption: the rest; FIGURES=--all: each of them)"
	@echo "make fresh       check that no table or picture of docs is older than the code"
	@echo "make soak        drive one controller for 100000 cycles: memory, failures, times; figures: runs/soak.json"
	@echo "make bench       time the cycles of all scenarios against a yardstick (figures: runs/bench.json),"
	@echo "                 and of some against the commit before (or BASE=COMMIT), in turn"
	@echo "make dist        build wheel and sdist of HEAD for an index, in dist/ (PROJECT_URL=... of the repository)"
	@echo "make pythons     try Python 3.11, 3.12 and 3.13, each where found: install, dock, tests"
	@echo "make clean       remove $(VENV), builds and caches (runs/ stays)"

# Types are checked beside the tests.
test: $(TEST)
	$(MAKE) --no-print-directory -j3 lint types unit

lint: $(TEST)
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .

types: $(TEST)
	$(PY) -m mypy $(TYPED)

# A file's tests share what they drive. The workers load what is compiled once, before them.
unit: $(TEST)
	$(VENV)/bin/rti-mpcc warm
	$(PY) -m pytest -q -n $(WORKERS) --dist loadfile --ignore tests/acceptance

demo: $(SIM)
	$(VENV)/bin/rti-mpcc run docking_behind

docs: $(DOCS)
	NO_MKDOCS_2_WARNING=1 $(VENV)/bin/mkdocs build --strict --quiet
	@echo "site: runs/site/index.html"

# tests/acceptance is named so that its conftest is loaded in the process that collects the workers' figures;
# the other folders have longer forms of their own tests, marked one by one.
acceptance: $(TEST)
	$(PY) -m pytest -m acceptance -n $(WORKERS) --dist worksteal tests/acceptance tests
	@echo "figures: runs/acceptance.json"

same: $(TEST)
	$(PY) -m benchmarks.same $(or $(BASE),HEAD~1) --jobs $(WORKERS)

reproduce: $(TEST)
	$(PY) -m benchmarks.reproduction

figures: $(TEST)
	$(PY) -m benchmarks.fresh --measure $(FIGURES)

fresh: $(TEST)
	$(PY) -m benchmarks.fresh

soak: $(TEST)
	$(PY) -m benchmarks.soak

# One after the other and alone: other work on the machine shows in the figures.
bench: $(TEST)
	$(PY) -m benchmarks.compare_speed $(BASE)
	$(PY) -m benchmarks.measure_speed $(BENCH)
	$(PY) -m benchmarks.measure_narrow $(BENCH)

# The wheel comes from a copy of HEAD. A tag is set, and files are uploaded, by whoever publishes.
dist: $(RELEASE)
	$(PY) -m benchmarks.release $(if $(PROJECT_URL),--url $(PROJECT_URL))

pythons: $(SIM)
	$(PY) -m benchmarks.pythons --jobs $(WORKERS)

clean:
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Some systems ship venv without ensurepip: then the machine's own pip puts pip into the environment.
$(PY):
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "$(PYTHON) is older than 3.11 or missing: name a later one, as in make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) >/dev/null 2>&1 \
		|| { rm -rf $(VENV) && $(PYTHON) -m venv --without-pip $(VENV) \
			&& $(PYTHON) -m pip --python $(PY) install --quiet pip; } \
		|| { rm -rf $(VENV); echo "$(PYTHON) cannot create a virtual environment: install its venv module" >&2; exit 1; }

$(SIM): pyproject.toml | $(PY)
	$(PIP) -e '.[sim]'
	@touch $@

# The test environment holds what the demo needs, which need not be installed again.
$(TEST): pyproject.toml | $(PY)
	$(PIP) -e '.[test]'
	@touch $(SIM) $@

$(DOCS): pyproject.toml | $(PY)
	$(PIP) -e '.[docs]'
	@touch $@

$(RELEASE): pyproject.toml | $(PY)
	$(PIP) -e '.[release]'
	@touch $@
