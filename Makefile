# Demsmith: `make demo` shows it at work, `make test` checks it; each sets up what it needs.
# Debian 12+ or Ubuntu 24.04+; see `make help`.

SHELL := /bin/bash
VENV := .venv
NUMPY2 := .venv-numpy2
PY := $(VENV)/bin/python
DIST := dist
REVISION := HEAD
VERSION = $(shell sed -n 's/^__version__ = "\(.*\)"/\1/p' __init__.py)
SETUP_FILES := pyproject.toml constraints-qgis.txt tools/setup_env.sh

# Packages of the user's own account must not mix with those of the environment.
export PYTHONNOUSERSITE := 1
unexport PYTHONHOME PYTHONPATH

.NOTPARALLEL:
.PHONY: help env env-numpy2 demo test lint bench zip clean

help: ## list the targets
	@sed -n 's/^\([a-z0-9-]*\):.*## \(.*\)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 20

env: $(VENV)/test.stamp env-numpy2 ## set up all that the other targets need

# demo.stamp: enough to run Demsmith; test.stamp: that and the tools for its tests.
# Where QGIS is missing no stamp is left, so that the next run looks for it again.
$(VENV)/demo.stamp: $(SETUP_FILES)
	@tools/setup_env.sh $(VENV) demo

$(VENV)/test.stamp: $(SETUP_FILES)
	@tools/setup_env.sh $(VENV) test

env-numpy2: $(NUMPY2)/numpy2.stamp ## the same library beside the newest NumPy, without QGIS and GDAL

$(NUMPY2)/numpy2.stamp: $(SETUP_FILES) | $(VENV)/test.stamp
	@tools/setup_env.sh $(NUMPY2) numpy2

demo: $(VENV)/demo.stamp ## fill the voids of a real tile, score it, draw it; TILE=path: of your own
	@$(PY) demo/demo.py $(if $(TILE),--tile "$(TILE)")

# Two at once, whole files each: their fixtures are shared, and kernels are compiled once.
test: lint env-numpy2 ## every check: style, imports, the suite with QGIS's part, the zip
	@$(PY) -m pytest -n 2 --dist loadfile

lint: $(VENV)/test.stamp ## style and the direction of imports
	@$(PY) -m ruff check .
	@$(PY) -m ruff format --check .
	@$(PY) -m flake8
	@$(VENV)/bin/lint-imports --no-logo --no-cache

bench: $(VENV)/test.stamp ## measure against the peers in the same run: filling, samples, tuning, reconstruction, sunlight, drainage, compression
	@$(PY) benchmarks/fill.py
	@$(PY) benchmarks/mcmd.py
	@$(PY) benchmarks/tuning.py
	@$(PY) benchmarks/voids.py
	@$(PY) benchmarks/voids_auxiliary.py
	@$(PY) benchmarks/solar.py
	@$(PY) benchmarks/drainage.py
	@$(PY) benchmarks/compression.py
	@$(PY) benchmarks/dictionaries.py
	@$(PY) benchmarks/procedural.py

zip: ## the plugin as QGIS installs it, from the last commit (REVISION=… for another)
	@mkdir -p "$(DIST)"
	@git archive --format=zip --prefix=demsmith/ -o "$(DIST)/demsmith-$(VERSION).zip" "$(REVISION)"
	@echo "==> $(DIST)/demsmith-$(VERSION).zip"

clean: ## remove what these targets made
	rm -rf $(VENV) $(NUMPY2) build dist out *.egg-info
	rm -rf .pytest_cache .hypothesis .ruff_cache .import_linter_cache .qgis-settings
	find . -name __pycache__ -prune -exec rm -rf {} +
