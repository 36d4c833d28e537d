# make demo and make test set themselves up: all they need is Python 3.11+, make and pip.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# asked by the shell when it is needed: make itself would ask before the environment is there
PIP = `$(BIN)/python -m pip --version >/dev/null 2>&1 && echo $(BIN)/python -m pip || echo $(PYTHON) -m pip --python $(BIN)/python`

.DEFAULT_GOAL := help
.PHONY: help demo test test-rest test-all check fmus dist bench docs lint format clean

help:  ## Show the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

# what is installed for a target: the demo needs less than the tests, and these less than ruff and pyright, which `make test-rest` runs, too
EXTRAS_demo := native,report
EXTRAS_test := $(EXTRAS_demo),wasm,xarray,parquet,dask,interop,test
EXTRAS_dev := $(EXTRAS_test),dev
EXTRAS_docs := $(EXTRAS_demo),docs

$(VENV)/ready-%: pyproject.toml
	@$(PYTHON) -c 'import sys; v = sys.version_info[:2]; v >= (3, 11) or sys.exit("Python 3.11 or newer is needed, $(PYTHON) is %d.%d; give another one: make PYTHON=python3.12 ..." % v)'
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) >/dev/null 2>&1 || { rm -rf $(VENV); $(PYTHON) -m venv --without-pip $(VENV); }
	@echo "installing into $(VENV): $(EXTRAS_$*)"; $(PIP) install --quiet --editable '.[$(EXTRAS_$*)]'
	@touch $@

demo: $(VENV)/ready-demo  ## Build the FMUs, run and sweep the crane, write the reports
	$(BIN)/shaper-fmu build MotionProfile InputShaper OverheadCrane --platform this --force
	$(BIN)/shaper-fmu build ssp/overhead_crane --force
	$(BIN)/shaper-fmu run ssp/overhead_crane.ssp --report results/overhead_crane_run.html --force
	rm -f results/overhead_crane.sqlite*
	$(BIN)/shaper-fmu sweep ssp/overhead_crane/study.toml
	$(BIN)/shaper-fmu report results/overhead_crane.sqlite --output results/overhead_crane.html --force
	@echo "The report: results/overhead_crane.html"

test: $(VENV)/ready-test  ## Run the tests: every contract, on representatives
	$(BIN)/python -m pytest -n auto -m 'not thorough'

test-rest: $(VENV)/ready-dev  ## Run the tests that make test leaves out
	$(BIN)/python -m pytest -n auto -m thorough

test-all: test test-rest  ## Run all tests: every component, version and platform, sanitizers, other masters, papers

check:  ## What the continuous integration does: all tests, where nothing may be skipped, lint and docs
	CI=1 $(MAKE) test test-rest lint docs

fmus: $(VENV)/ready-demo  ## Build all FMUs, for all platforms: FMI 2.0 into fmus/, FMI 3.0 into fmus/fmi3/
	$(BIN)/shaper-fmu build --force
	$(BIN)/shaper-fmu build --fmi 3 --output fmus/fmi3 --force

dist: $(VENV)/ready-demo  ## Build a wheel that carries the native FMUs of all components, the master's loop and the kernels of pages, into dist/
	$(BIN)/python -m shaper_fmu.export.build
	$(BIN)/python -m shaper_fmu.master.loop_library
	$(BIN)/python -m shaper_fmu.container.library
	$(BIN)/python -m shaper_fmu.live.shipped
	rm -rf dist
	$(PIP) wheel --quiet --no-deps --wheel-dir dist .; status=$$?; rm -rf shaper_fmu/shipped; exit $$status
	@ls dist

bench: $(VENV)/ready-dev  ## Measure against peers; writes bench/results.json
	$(BIN)/python bench/run.py

lint: $(VENV)/ready-dev  ## ruff, the layers of imports, pyright
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/pyright

docs: $(VENV)/ready-docs  ## Build the documentation site into results/site/html; a link that leads nowhere is an error
	$(BIN)/python docs/site/assemble.py results/site/pages
	cp docs/site/mkdocs.yml results/site
	$(BIN)/zensical build --clean --strict --config-file results/site/mkdocs.yml

format: $(VENV)/ready-dev  ## Format the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:  ## Remove what was built
	rm -rf $(VENV) results dist fmus/*.fmu fmus/fmi3 ssp/*.ssp
