# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Circumstances that are not the developer's: an extension folder that cannot be written to, a user's name in other
letters, decimal commas, a studio's own colours. Each in a Blender process of its own (habits.py)."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

ROOT = Path(__file__).resolve().parents[3]
READ_ONLY = 'mount --bind "$0" "$0" && mount -o remount,ro,bind "$0" && exec "$@"'

CONFIGURATION = """ocio_profile_version: 2
roles:
  {default: Studio Picture, default_byte: Studio Picture, default_float: Studio Linear, default_sequencer: Studio Picture,
   scene_linear: Studio Linear, rendering: Studio Linear,
   color_picking: Studio Picture, texture_paint: Studio Linear, matte_paint: Studio Linear, data: Studio Numbers, aces_interchange: Studio ACES,
   cie_xyz_d65_interchange: Studio XYZ}
displays:
  Studio Monitor:
    - !<View> {name: Studio Look, colorspace: Studio Picture}
active_displays: [Studio Monitor]
active_views: [Studio Look]
colorspaces:
  - !<ColorSpace> {name: Studio Linear, encoding: scene-linear, isdata: false}
  - !<ColorSpace>
    name: Studio Picture
    encoding: sdr-video
    isdata: false
    to_reference: !<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055}
  - !<ColorSpace> {name: Studio Numbers, encoding: data, isdata: true}
  - !<ColorSpace>
    name: Studio XYZ
    isdata: false
    to_reference: !<MatrixTransform>
      matrix: [3.2404542, -1.5371385, -0.4985314, 0, -0.969266, 1.8760108, 0.041556, 0, 0.0556434, -0.2040259, 1.0572252, 0, 0, 0, 0, 1]
  - !<ColorSpace>
    name: Studio ACES
    isdata: false
    to_reference: !<MatrixTransform>
      matrix: [2.521686, -1.134131, -0.387555, 0, -0.276480, 1.372719, -0.096239, 0, -0.015378, -0.152975, 1.168353, 0, 0, 0, 0, 1]
"""


def install(profile: Path) -> Path:
    """A copy of what ships as an extension of a profile; its folder."""
    folder = profile / "extensions" / "user_default" / "wildcap"
    for name in ("core", "wildcap_addon", "requirements"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("__init__.py", "blender_manifest.toml"):
        shutil.copyfile(ROOT / name, folder / name)
    return folder


def spend(profile: Path, *words: str, before: tuple[str, ...] = (), **environment: str) -> tuple[dict, str]:
    """What habits.py saw under these circumstances, and all that was printed."""
    own = {"BLENDER_USER_RESOURCES": str(profile), "HOME": str(profile), "PYTHONDONTWRITEBYTECODE": "1"}
    result = subprocess.run(
        [*before, sys.executable, str(ROOT / "tests" / "fixtures" / "habits.py"), *words],
        env={**os.environ, **own, **environment},
        cwd=profile,
        capture_output=True,
        text=True,
        timeout=300,
    )
    printed = "".join(text.split("Started.\n")[-1] for text in (result.stdout, result.stderr))
    found = [line.removeprefix("SEEN ") for line in result.stdout.splitlines() if line.startswith("SEEN ")]
    assert result.returncode == 0 and found and "Traceback" not in printed, printed[-4000:]
    return json.loads(found[0]), printed


def german(folder: Path) -> dict[str, str]:
    """The environment of a German user, whose locale is made where the system has none; {} without its sources."""
    command = ["localedef", "-i", "de_DE", "-f", "UTF-8", str(folder / "de_DE.UTF-8")]
    made = shutil.which("localedef") and subprocess.run(command, capture_output=True).returncode == 0
    return {"LC_ALL": "de_DE.UTF-8", "LOCPATH": str(folder)} if made else {}


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="a folder has no such mode here")
def test_a_folder_that_cannot_be_written_to_a_name_in_other_letters_and_decimal_commas(tmp_path):
    """Root ignores a folder's mode, so for root it is mounted."""
    profile = tmp_path / "Юзер 山田"
    profile.mkdir()
    folder = install(profile)
    before: tuple[str, ...] = ()
    if os.geteuid():
        subprocess.run(["chmod", "-R", "a-w", str(folder)], check=True)
    else:
        before = ("unshare", "--mount", "--propagation", "private", "sh", "-c", READ_ONLY, str(folder))
        probe = subprocess.run([*before, "touch", str(folder / "x")], capture_output=True, text=True)
        if "Read-only" not in probe.stderr:
            pytest.skip("this machine lets nobody mount a folder read-only")
    environment = german(profile)
    try:
        seen, _ = spend(profile, "worker", before=before, **environment)
    finally:
        subprocess.run(["chmod", "-R", "u+w", str(folder)], check=True)
    assert seen["decimal_point"] == ("," if environment else ".")
    assert seen["capture"] == str(profile / "WildCap" / "sample_head.wildcap")
    assert 0.2 < seen["height_m"] < 0.5 and seen["mask"] == 0.5 and seen["render"]
    assert seen["problem"] == "" and all(0.1 < c < 1 for c in seen["tone"]) and seen["tone"] != [0.69, 0.54, 0.45]
    assert seen["spaces"] == {"WildCap Albedo": "sRGB", "WildCap Specular": "Non-Color", "WildCap Normal": "Non-Color"}


def test_a_studios_own_colour_configuration(tmp_path):
    install(tmp_path)
    (tmp_path / "studio.ocio").write_text(CONFIGURATION, encoding="utf-8")
    seen, printed = spend(tmp_path, OCIO=str(tmp_path / "studio.ocio"))
    assert seen["spaces"] == {
        "WildCap Albedo": "Studio Picture",
        "WildCap Specular": "Studio Numbers",
        "WildCap Normal": "Studio Numbers",
    }
    assert seen["mask_space"] == "Studio Numbers" and seen["mask"] == 0.5 and seen["render"]
    assert "no sRGB by a known name" in printed and "no view without a look" in printed, "the artist is told"
