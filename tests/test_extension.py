# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension as Blender's own tool sees it: the manifest is valid, and the zip holds what an artist needs and
nothing else."""

import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from core.capture import code_key, shipped_files, stages

bpy = pytest.importorskip("bpy")

ROOT = Path(__file__).resolve().parents[1]
SCRIPTS = Path(bpy.utils.system_resource('SCRIPTS'))
TOOL = SCRIPTS / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
TAGS = SCRIPTS / "modules" / "_bpy_internal" / "extensions" / "tags.py"
SHIPPED = {"__init__.py", "__main__.py", "blender_manifest.toml", "LICENSE", "README.md"}
SHIPPED |= {"core", "farm", "requirements", "wildcap_addon"}
KINDS = {"", ".exr", ".js", ".json", ".md", ".npz", ".obj", ".png", ".py", ".safetensors", ".tflite", ".toml", ".txt"}


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    run("build", "--source-dir", str(ROOT), "--output-dir", str(folder))
    return next(folder.glob("*.zip"))


def run(*arguments: str) -> str:
    result = subprocess.run([sys.executable, str(TOOL), *arguments], capture_output=True, text=True, cwd=ROOT)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout + result.stderr


def test_the_manifest_passes_blenders_strict_validation():
    assert "Success" in run("validate", f"--valid-tags={TAGS}", ".")


def test_the_manifest_asks_for_files_and_network_with_a_reason_each():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert manifest["id"] == "wildcap"
    assert set(manifest["permissions"]) == {"files", "network"}
    assert all(len(reason) <= 64 and not reason.endswith(".") for reason in manifest["permissions"].values())
    version = re.search(r'__version__ = "(.+)"', (ROOT / "core" / "__init__.py").read_text(encoding="utf-8"))
    assert manifest["version"] == version[1]


def test_the_zip_holds_what_it_should_and_nothing_else(archive, tmp_path):
    with zipfile.ZipFile(archive) as file:
        names = {info.filename for info in file.infolist() if not info.is_dir()}
        file.extractall(tmp_path)
    assert {name.split("/")[0] for name in names} == SHIPPED and {Path(name).suffix for name in names} <= KINDS
    assert {f"core/{name}" for name in shipped_files.read_manifest()["core"]} < names
    assert archive.stat().st_size < 100e6
    for stage in stages.STAGES:
        assert code_key.code_key(stage.module, tmp_path / "core") == code_key.code_key(stage.module), stage.name


def test_the_built_zip_installs_and_registers_in_an_empty_profile(archive, tmp_path):
    """In a process of its own: this one runs the extension from the checkout."""
    code = f"""
import os
os.environ["BLENDER_USER_RESOURCES"] = {str(tmp_path / "profile")!r}
import bpy, addon_utils
assert bpy.ops.extensions.package_install_files(repo="user_default", filepath={str(archive)!r}, enable_on_install=True) == {{'FINISHED'}}
name = "bl_ext.user_default.wildcap"
assert name in bpy.context.preferences.addons, list(bpy.context.preferences.addons.keys())
assert hasattr(bpy.types, "WILDCAP_PT_main")
bpy.context.scene.wildcap.captures.add()
addon_utils.disable(name, default_set=True)
assert not hasattr(bpy.types, "WILDCAP_PT_main")
print("WELL")
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, cwd=tmp_path)
    assert "WELL" in result.stdout, result.stdout + result.stderr
