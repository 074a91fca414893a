# defshade: `make demo` and `make test` do all their own setting up, also on a bare Debian or Ubuntu.
#
#   make demo    render scenes/showcase.usda to out/
#   make test    run the tests
#   make lint    ruff and mypy
#   make check   lint, and the tests that draw nothing: before each commit
#   make coverage  run the tests and say which lines they miss, also in build/coverage
#   make docs    write docs/commands.md anew from the commands, and build the site into build/site
#   make tables  measure the layouts anew, for the table in docs/lighting.md
#   make bench-reading  measure what reading a stage costs
#   make bench   measure whole processes, ours and peers' in PEERS_PYTHON, into docs/performance.md
#   make accuracy  measure accumulated light against Mitsuba 3, into docs/accuracy.md
#   make error-check  compare the errors that renders claim with those that they have, into docs/accuracy.md
#   make fuzz    render mutated stages and images in contained processes: 10,000, or COUNT=N, from SEED=N,
#                FIRST=N on, for SECONDS_AT_MOST=N
#   make kill-check  kill renders at 200 random moments
#   make stress  render the corners of the arithmetic, into docs/stability.md
#   make conformance  lay stages by others beside their references, into build/conformance and docs/conformance.md
#   make bench-farm  measure what a batch costs by its workers and chunks, into docs/scale.md
#   make farm-check  a batch of a thousand frames while workers die and the disk fills
#   make gallery  render the documents' figures into docs/images
#   make wheel   build dist/*.whl and dist/*.tar.gz
#   make image   build the container image defshade, which renders without a GPU, also with DOCKER=podman
#   make clean   remove what was built, the virtual environment too

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := demo
.PHONY: demo test lint check coverage image docs tables bench bench-reading bench-farm accuracy error-check stress conformance gallery
.PHONY: fuzz kill-check farm-check wheel clean

PYTHON ?= python3
PEERS_PYTHON ?= .venv/bin/python
DOCKER ?= docker
BIN := .venv/bin
PYTEST = $(BIN)/pytest -q --numprocesses logical --maxprocesses 8 --dist worksteal
LIBRARIES := libEGL.so.1 libGL.so.1
LIBRARY_PACKAGES := libegl1 libgl1 libgl1-mesa-dri

# $(call apt_install,PACKAGES): with apt, as root or through sudo without a password; else say what to type.
define apt_install
	if ! command -v apt-get >/dev/null; then \
		echo "defshade: error: please install what Debian calls: $(1)" >&2; exit 1; fi; \
	if [ "$$(id -u)" = 0 ]; then as_root=; \
	elif sudo -n true 2>/dev/null; then as_root="sudo -n"; \
	else echo "defshade: error: please run 'sudo apt-get install $(1)', then make again" >&2; exit 1; fi; \
	echo "defshade: installing $(1)"; \
	$$as_root apt-get update -qq; \
	$$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $(1) >/dev/null
endef

demo: .venv/.ready
	mkdir -p out
	$(BIN)/defshade render scenes/showcase.usda --samples 4 -o out/showcase.exr -o out/showcase.png
	echo "defshade: the demo is out/showcase.png, and scene-linear in out/showcase.exr"

test: .venv/.ready-dev
	$(PYTEST)

check: lint
	$(PYTEST) -m "not slow and not renders"

coverage: .venv/.ready-dev
	$(PYTEST) --cov --cov-report=term:skip-covered --cov-report=html:build/coverage

lint: .venv/.ready-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: .venv/.ready-docs
	$(BIN)/python -m defshade_cli.cli.reference > docs/commands.md
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet --strict
	echo "defshade: the documents are build/site/index.html; with a search at python3 -m http.server --directory build/site"

bench-reading: .venv/.ready
	$(BIN)/python benchmarks/reading.py

bench: .venv/.ready-reference
	$(BIN)/python benchmarks/compare.py out/bench --python $(PEERS_PYTHON) --page docs/performance.md

accuracy: .venv/.ready-reference
	$(BIN)/python -m defshade_cli.measure.accuracy docs/accuracy.md
	$(BIN)/python -m defshade_cli.measure.accuracy_plot docs/accuracy.md

error-check: .venv/.ready-reference
	$(BIN)/python -m defshade_cli.measure.convergence docs/accuracy.md

COUNT ?= 10000
SEED ?= 1
FIRST ?= 0
SECONDS_AT_MOST ?=
fuzz: .venv/.ready
	$(BIN)/python -m defshade_cli.measure.fuzz $(COUNT) $(SEED) $(FIRST) $(SECONDS_AT_MOST)

kill-check: .venv/.ready-dev
	DEFSHADE_KILLS=200 $(BIN)/pytest -q tests/test_faults.py -k killed

bench-farm: .venv/.ready-dev
	$(BIN)/python benchmarks/farm.py --page docs/scale.md

farm-check: .venv/.ready-dev
	$(BIN)/pytest -q -s -m slow tests/test_farm_scale.py

stress: .venv/.ready
	$(BIN)/python -m defshade_cli.measure.stress docs/stability.md

conformance: .venv/.ready
	$(BIN)/python -m defshade_cli.measure.conformance build/conformance docs/conformance.md

tables: .venv/.ready
	$(BIN)/python -m defshade_cli.measure.layouts docs/lighting.md

gallery: .venv/.ready
	$(BIN)/python -m defshade_cli.measure.gallery docs/images

wheel: | .venv/bin/pip
	$(BIN)/pip install --quiet build
	$(BIN)/python -m build --outdir dist . >/dev/null
	ls dist/*.whl dist/*.tar.gz

image:
	$(DOCKER) build --tag defshade .

clean:
	rm -rf .venv out dist build .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The stamps: quick when nothing changed, made anew when the dependencies did.
.venv/.ready: pyproject.toml | .venv/bin/pip libraries
	echo "defshade: installing into .venv"
	$(BIN)/pip install --quiet --editable .
	touch $@

.venv/.ready-dev: .venv/.ready
	$(BIN)/pip install --quiet --editable '.[dev]'
	touch $@

.venv/.ready-docs: .venv/.ready
	$(BIN)/pip install --quiet --editable '.[docs]'
	touch $@

.venv/.ready-reference: .venv/.ready
	$(BIN)/python -c 'from defshade_cli.measure.llvm import find_llvm; find_llvm()' 2>/dev/null || { $(call apt_install,libllvm19); }
	$(BIN)/pip install --quiet --editable '.[reference]'
	touch $@

.venv/bin/pip:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "defshade: error: Python 3.11 or newer is needed")'
	$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { $(call apt_install,python3-venv); }
	$(PYTHON) -m venv .venv

.PHONY: libraries
libraries:
	$(PYTHON) -c 'import ctypes, sys; [ctypes.CDLL(name) for name in sys.argv[1:]]' $(LIBRARIES) 2>/dev/null || \
	{ $(call apt_install,$(LIBRARY_PACKAGES)); }

$(VERBOSE).SILENT:
