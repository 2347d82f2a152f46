# The two commands of the README (demo, test), the figures of the documentation, the add-on in other Blenders and in a real window, and the extension's zip.
PYTHON ?= python3.11
# Python 3.13, as Blender 5.1 and newer have it, gets an environment of its own beside that of 3.11.
VERSION := $(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])')
VENV := .venv$(if $(filter-out 3.11,$(VERSION)),-$(VERSION))
BIN := $(VENV)/bin
# A folder of wheels (`python -m core wheels`) to install the worker's packages from, in place of the package index.
WHEELS ?=
DEMO ?= .demo
EXTENSION_TOOL = $(wildcard $(VENV)/lib/python3*/site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py)

RELEASE := $(shell sed -n 's/^version = "\(.*\)"/\1/p' blender_manifest.toml)

# The oldest Blender that the add-on supports, the long-term releases since, and the newest with Python 3.11; each beside the NumPy that it ships.
BLENDERS ?= 4.2.0 4.5.15 5.0.1 5.2.3
.blenders/4.2.%: SHIPS = numpy==1.24.3
.blenders/4.5.% .blenders/5.0.%: SHIPS = numpy==1.26.4
.blenders/5.1.% .blenders/5.2.%: SHIPS = numpy==2.3.4

# Blender 5.1 and newer have Python 3.13, which a version manager may keep where no command leads to it.
PYTHON3.13 ?= $(firstword $(shell python3.13 -c 'import sys; print(sys.executable)' 2>/dev/null) $(wildcard ~/.pyenv/versions/3.13.*/bin/python) python3.13)
.blenders/5.1.% .blenders/5.2.%: OWN_PYTHON = $(PYTHON3.13)

PROCESSES = --numprocesses auto --maxprocesses 4 --dist loadfile

.PHONY: demo test test-research test-failed results test-blenders test-gui test-gui-newest zip site clean

demo: $(VENV)/installed
	$(BIN)/python -m research.benchmarks.captures.demo $(DEMO)

test: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check --quiet .
	$(BIN)/python -m pytest tests --ignore=tests/gui $(PROCESSES)

# The subjects, trainings and benchmarks of research.
test-research: $(VENV)/installed
	$(BIN)/python -m pytest research/tests $(PROCESSES)

# The pages of docs/results, out of the records that the benchmarks left in research/records.
results: $(VENV)/installed
	$(BIN)/python -m research.benchmarks.results

# What failed in `make test`, once more by itself: a shared machine may stand still for as long as a test waits.
test-failed: $(VENV)/installed
	$(BIN)/python -m pytest tests research/tests --ignore=tests/gui --last-failed --last-failed-no-failures none

# Two at a time; what one prints comes when it has ended.
test-blenders: $(BLENDERS:%=.blenders/%/installed)
	printf '%s\n' $(BLENDERS) | xargs --max-procs=2 --replace=VERSION sh -c \
	    '.blenders/VERSION/bin/python -m pytest tests/wildcap_addon > .blenders/VERSION.log 2>&1; ended=$$?; cat .blenders/VERSION.log; exit $$ended'

.blenders/%/installed: Makefile
	$(or $(OWN_PYTHON),$(PYTHON)) -m venv .blenders/$*
	.blenders/$*/bin/python -m pip install --quiet --disable-pip-version-check bpy==$* $(SHIPS) pytest==9.0.3
	touch $@

test-gui: $(VENV)/installed zip
	$(BIN)/python -m pytest tests/gui/test_window.py -s

# Six of the same in the newest Blender that Debian has, or the reason why not.
test-gui-newest: $(VENV)/installed zip
	$(BIN)/python -m pytest tests/gui/test_newest_window.py -s -rs

# Blender's own extension tool, from the bpy wheel.
zip: $(VENV)/installed
	mkdir -p dist
	$(BIN)/python $(EXTENSION_TOOL) build --source-dir . --output-dir dist

# A repository of extensions to put on any web server of static files: the zip, its listing, and a page to drag it into Blender from.
site: zip
	rm -rf dist/site
	mkdir -p dist/site
	cp dist/wildcap-$(RELEASE).zip dist/site/
	$(BIN)/python $(EXTENSION_TOOL) server-generate --repo-dir dist/site --html --html-template docs/site.html

# The worker's packages by the lock of this platform and Python, as Install Solver brings them. The tests need Blender's module besides, which asks for another
# NumPy than ours and works with it.
$(VENV)/installed: requirements/worker.txt requirements/test.txt requirements/farm.txt requirements/blender.txt $(wildcard requirements/locks/*.txt)
	test ! -f $(VENV)/installed || touch $(VENV)/wildcap_compute.txt  # one that an older Makefile made is ours, too
	$(PYTHON) -m core install $(VENV) --compute cpu --packages pip $(if $(WHEELS),--wheels $(WHEELS))
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/test.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -r requirements/blender.txt
	touch $@

clean:
	rm -rf .demo .blenders dist
