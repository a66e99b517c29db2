# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later

# Use the first of these that runs and is 3.11 or 3.13: a version manager's command on PATH may only say
# that the version is missing.
VERSION := import sys; print("%d.%d" % sys.version_info[:2])
ifndef PYTHON
PYTHON := $(shell for p in python3.13 python3.11 python3; do \
	case "$$($$p -c '$(VERSION)' 2>/dev/null)" in (3.11 | 3.13) echo $$p; break ;; esac; done)
endif
PYTHON_VERSION := $(filter 3.11 3.13,$(shell '$(PYTHON)' -c '$(VERSION)' 2>/dev/null))

# One environment for each Python, ready when its stamp is there.
VENV := build/venv-$(PYTHON_VERSION)
VENV_PY := $(VENV)/bin/python
READY := $(VENV)/.ready
PEERS := $(VENV)/.peers
CLUSTER := $(VENV)/.cluster
# Core's tests need no Blender, so any Python from 3.11 on will do.
CORE := build/core-$(PYTHON_VERSION)
SITE := build/site
# The checkout as the package that Blender makes of it, whatever its folder is called: mypy imports from there.
TYPED := build/typed/tactile_patch
# Tests run beside each other, one process a processor, each with one thread.
BESIDE := -n auto --dist worksteal
# Tests of core share touched objects, so one process runs a whole file; the longest files come first.
test-core: BESIDE := -n auto --dist loadfile --no-loadscope-reorder
test test-core test-long test-cluster: export OMP_NUM_THREADS = 1
test test-core test-long test-cluster: export OPENBLAS_NUM_THREADS = 1

# The tests among which `make test-long` finds the long ones.
TESTS := tests
ZIP := build/tactile_patch.zip
# Folders too, so that a deleted file counts as a change.
SOURCES := blender_manifest.toml __init__.py LICENSE tools/build.py \
	$(shell find core tactile_addon docs -name __pycache__ -prune -o -print)

.PHONY: help demo dataset test test-core test-long test-cluster fuzz chart paper stability site figures film lesson sample zip zip-nowheels \
	release clean

help:
	@echo 'make demo [MESH=FILE]  rebuild a patch on a mesh and draw it'
	@echo 'make test              check style and types, then test the extension in Blender'
	@echo 'make test-core         run the tests of core alone, without Blender'
	@echo 'make test-long         run the tests that take long: many touches, whole objects, samples of the docs'
	@echo 'make fuzz              try more than 10,000 odd inputs, in a quarter of an hour'
	@echo 'make chart [QUICK=1]   draw speed against accuracy beside other methods, in build/charts'
	@echo 'make paper             repeat the experiments of the paper, beside its figures'
	@echo 'make stability         take every method to its limits, and count the warnings'
	@echo 'make dataset           touch some objects with two workers, tabulate and draw the results, in build'
	@echo 'make test-cluster      check the types and run the tests of data sets, with Dask'
	@echo 'make site              build the site of the documentation, in build/site/html'
	@echo 'make figures [ONLY=X]  run all benchmarks of the documentation, or those named X, and fill its tables and pictures'
	@echo 'make film              draw the moving picture of the README again'
	@echo 'make lesson            draw the pictures of docs/lesson.md again'
	@echo 'make sample            make examples/sample.blend again, in Blender 4.5'
	@echo 'make zip               build the zip files of a release, one for each platform, in build/dist'
	@echo 'make zip-nowheels      build the zip for a Blender whose own Python has scipy, in build/dist'
	@echo 'make release           make all files of a release, in build/release, if version, changelog and tag agree'
	@echo 'make clean             remove build; the downloaded wheels stay'
	@echo 'Each takes PYTHON=...: Python 3.11 (Blender 4.5) or 3.13 (Blender 5.2).'

demo: $(ZIP)
	$(VENV_PY) -m tools.demo --zip $(ZIP) --mesh "$(MESH)"

test: $(ZIP) | $(TYPED)
	$(VENV_PY) -m ruff check
	$(VENV_PY) -m ruff format --check
	$(VENV_PY) -m mypy core
	$(VENV_PY) -m mypy -p tactile_patch.tactile_addon
	TACTILE_ZIP="$(CURDIR)/$(ZIP)" $(VENV_PY) -m pytest $(BESIDE) -m "not long" --ignore tests/cluster

test-core: $(CORE)/.ready
	$(CORE)/bin/python -m pytest $(BESIDE) -m "not long" --hypothesis-profile=quick tests/core/scan tests/core tests/test_rooms.py

test-long: $(ZIP)
	TACTILE_ZIP="$(CURDIR)/$(ZIP)" $(VENV_PY) -m pytest $(BESIDE) -m long --ignore tests/cluster $(TESTS)

test-cluster: $(CLUSTER)
	$(VENV_PY) -m mypy cluster
	$(VENV_PY) -m pytest tests/cluster

dataset: $(CLUSTER) $(PEERS)
	$(VENV_PY) -m tools.dataset

fuzz: $(ZIP)
	TACTILE_ZIP="$(CURDIR)/$(ZIP)" $(VENV_PY) -m pytest --hypothesis-profile=long \
		--hypothesis-show-statistics tests/core/reconstruction/test_fuzz_core.py tests/addon/test_fuzz_operator.py

chart: $(PEERS)
	$(VENV_PY) -m benchmarks.chart $(if $(QUICK),--quick)

paper: $(ZIP) $(PEERS)
	$(VENV_PY) -m benchmarks.paper $(ZIP)

stability: $(PEERS)
	$(VENV_PY) -m benchmarks.stability

site: $(SITE)/.ready
	@NO_MKDOCS_2_WARNING=1 $(SITE)/bin/mkdocs build --quiet --strict
	@$(SITE)/bin/python tools/check_site.py $(SITE)/html

figures: $(ZIP) $(PEERS)
	$(VENV_PY) -m tools.figures --only "$(ONLY)"

film: $(ZIP) $(PEERS)
	$(VENV_PY) -m tools.film --zip $(ZIP)

lesson: $(READY) $(PEERS)
	$(VENV_PY) -m tools.lesson

sample: $(ZIP)
	$(VENV_PY) -m tools.sample --zip $(ZIP)

zip: $(READY)
	$(VENV_PY) tools/build.py --wheels all

release: $(READY)
	@$(VENV_PY) -m tools.release
	@$(VENV_PY) -m tools.try_release

zip-nowheels: $(READY)
	$(VENV_PY) tools/build.py --wheels none

clean:
	rm -rf build .mypy_cache .pytest_cache .ruff_cache

# The environment has to be there to build, but a new one is no reason to build again.
$(ZIP): $(SOURCES) | $(READY)
	@zip=$$($(VENV_PY) tools/build.py --output build) && mv "$$zip" $@

$(TYPED):
	@mkdir -p $(@D) && ln -sfn ../.. $@

$(SITE)/.ready: tools/site_requirements.txt
	@echo 'Installing what the site is made with, in $(SITE): once.'
	@'$(or $(PYTHON),python3)' -m venv $(SITE)
	@$(SITE)/bin/python -m pip install --quiet --disable-pip-version-check --requirement $<
	@touch $@

$(CORE)/.ready: pyproject.toml tools/requirements.txt
	@echo 'Installing numpy, scipy and pytest, in $(CORE): once.'
	@'$(or $(PYTHON),python3)' -m venv $(CORE)
	@$(CORE)/bin/python -m pip install --quiet --disable-pip-version-check \
		--constraint tools/requirements.txt . pytest pytest-xdist hypothesis
	@touch $@

# One by one: a chart goes without a peer that is not made for this Python or system, or for Blender's numpy.
$(PEERS): benchmarks/requirements.txt $(READY)
	@echo 'Installing what the charts are drawn with and compare to: once.'
	@sed '/^#/d; /^$$/d' $< | while read -r peer; do $(VENV_PY) -m pip install --quiet --disable-pip-version-check \
		--constraint tools/requirements.txt "$$peer" </dev/null || true; done
	@touch $@

$(CLUSTER): cluster/requirements.txt | $(READY)
	@echo 'Installing what data sets are made with: once.'
	@$(VENV_PY) -m pip install --quiet --disable-pip-version-check --requirement $<
	@touch $@

$(READY): tools/requirements.txt tools/check_bpy.py
ifeq ($(PYTHON_VERSION),)
	@echo 'Blender is a Python module for Python 3.11 (Blender 4.5) and 3.13 (Blender 5.2) only, which' \
		'$(if $(PYTHON),$(PYTHON) is not,no python3 here is): install one (3.11 is in Debian 12, 3.13 in' \
		'Debian 13; elsewhere pyenv install 3.13) and name it, as in make PYTHON=python3.13.' >&2; exit 2
else
	@'$(PYTHON)' -c 'import ensurepip, venv' 2>/dev/null || { \
		echo 'This Python cannot make an environment: sudo apt install python3-venv' \
			'(python$(PYTHON_VERSION)-venv if it is not the system'"'"'s own Python).' >&2; exit 2; }
	@echo 'Installing Blender as a Python module, and the tools, in $(VENV): once, some minutes.'
	@'$(PYTHON)' -m venv $(VENV)
	@$(VENV_PY) -m pip install --quiet --disable-pip-version-check --requirement tools/requirements.txt
	@$(VENV_PY) tools/check_bpy.py
	@touch $@
endif
