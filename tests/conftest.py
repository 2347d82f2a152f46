# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender for the add-on's tests: the checkout seen as an installed extension, under the very name users get.

The bpy wheel hangs at exit when a class stays registered, so the fixture disables the extension at the end.
"""

import atexit
import os
import shutil
import sys
import tempfile
from importlib import import_module
from pathlib import Path

import pytest

from core.worker.client import SPINS, THREAD_VARIABLES

ROOT = Path(__file__).resolve().parent.parent
MODULE = "bl_ext.user_default.wildcap"
STATUS = pytest.StashKey()

# Blender reads this when it starts, and any test may be the one that imports bpy first.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="wildcap-test-")
atexit.register(shutil.rmtree, os.environ["BLENDER_USER_RESOURCES"], ignore_errors=True)


# As the worker has it: what else the machine does would otherwise slow a test down tenfold. OpenMP reads it when torch
# is first imported.
for name, value in SPINS.items():
    os.environ.setdefault(name, value)

# A process of xdist has one core: with more threads than that the libraries wait for each other.
if "PYTEST_XDIST_WORKER" in os.environ:
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")

# Every file of a capture is flushed to the disk before it gets its name, which is most of a test's time; where memory
# serves as a disk it takes none.
MEMORY_DISK, ROOM = Path("/dev/shm"), 6e9
if os.access(MEMORY_DISK, os.W_OK) and shutil.disk_usage(MEMORY_DISK).free > ROOM:
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(MEMORY_DISK))


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    """The bpy 4.2 module crashes at its exit where any property ever had an update callback (seen with five lines of
    plain bpy), long after the last test: it leaves without its exit.
    And where a test had the glTF exporter write in a process that has the worker's packages as well, the module's exit
    waits for its threads for ever."""
    bpy = sys.modules.get("bpy")
    exported = "io_scene_gltf2.blender.exp.export" in sys.modules
    if bpy is not None and (bpy.app.version < (4, 3, 0) or exported):
        shutil.rmtree(os.environ["BLENDER_USER_RESOURCES"], ignore_errors=True)
        sys.stdout.flush()
        os._exit(int(config.stash.get(STATUS, 1)))


def pytest_sessionfinish(session):
    session.config.stash[STATUS] = session.exitstatus


@pytest.fixture(scope="session")
def enabled_extension():
    """The extension's package inside Blender; enabled once per test process."""
    pytest.importorskip("bpy")
    import addon_utils

    repository = Path(os.environ["BLENDER_USER_RESOURCES"]) / "extensions" / "user_default"
    repository.mkdir(parents=True, exist_ok=True)
    (repository / "wildcap").symlink_to(ROOT, target_is_directory=True)
    assert addon_utils.enable(MODULE, default_set=True) is not None, "Blender could not enable the extension"
    yield MODULE
    addon_utils.disable(MODULE, default_set=True)


@pytest.fixture
def wildcap(enabled_extension):
    """As `enabled_extension`, with Blender's start-up scene emptied first: import_module(f"{wildcap}.wildcap_addon...")
    is the add-on."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    return enabled_extension


@pytest.fixture
def addon(wildcap):
    """import_module inside the add-on, in which no job of another test is left."""
    import_module(f"{wildcap}.wildcap_addon.jobs")._jobs.clear()
    return lambda name: import_module(f"{wildcap}.wildcap_addon.{name}")


@pytest.fixture
def capture(tmp_path, wildcap):
    """An open, solved capture in a folder with a space and an accent."""
    import bpy

    from tests.fixtures import standin

    root = standin.make(tmp_path / "Zoë et moi" / "head.wildcap")
    bpy.ops.wildcap.open_capture(directory=str(root))
    return root


@pytest.fixture
def item(addon, capture):
    """The list's item of `capture`."""
    import bpy

    return addon("captures").active(bpy.context)


@pytest.fixture(scope="session")
def tiny_code(tmp_path_factory):
    """The code tree of tiny_chain, for tests that change nothing of it."""
    from tests.fixtures import tiny_chain

    return tiny_chain.build(tmp_path_factory.mktemp("tiny") / "Erweiterung für mich")


@pytest.fixture
def jobs(addon, monkeypatch, tiny_code):
    """The add-on's jobs, over a chain of tiny rooms that this very Python runs."""
    from tests.fixtures.polled_jobs import follow

    module = addon("jobs")
    monkeypatch.setattr(module, "ROOT", tiny_code)
    addon("preferences").get().python = sys.executable
    yield module
    for root in list(module._jobs):
        module.cancel(root)
    follow(addon)
    addon("preferences").get().python = ""


@pytest.fixture
def batches(addon, monkeypatch, tmp_path, tiny_code):
    """The add-on's view of batches, over a chain of tiny rooms; no batch of a test is left running, or known to the
    next one."""
    from tests.fixtures import batch_faces

    module, running = addon("batches"), addon("batch.running")
    monkeypatch.setattr(addon("jobs"), "ROOT", tiny_code)
    addon("problems").clear("")
    preferences = addon("preferences").get()
    preferences.python, preferences.captures = sys.executable, str(tmp_path / "captures")
    yield module
    while module.current() is not None:
        batch_faces.wait(addon, lambda: not running.running() or running.cancel())
        module.close()
    addon("paint.session").forget()
    # looked up again: where the add-on was disabled meanwhile, those of before are gone
    addon("preferences").get().python = ""
