# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs of a face dropped into an empty Blender, Make My Head clicked, and nothing else: a relit head that looks
back. The photographs are of a synthetic person with open eyes; photographed.py made them."""

import shutil
from pathlib import Path

import addon
import bpy
import driver as d
import own_head

LIMIT_S = 1700

PHOTOGRAPHS = Path(__file__).resolve().parents[1] / "photographs"


def flow():
    yield from d.open_tab("WildCap")
    addon.use_solver()
    folder = Path.home() / "Documents" / "face"
    shutil.copytree(PHOTOGRAPHS, folder)
    yield from addon.drop(folder, *sorted(path.name for path in folder.iterdir()))
    own_head.quick(addon.settings())
    bpy.context.scene.wildcap.resolution, bpy.context.scene.wildcap.samples = 512, 16
    root = Path(addon.module("captures").root(addon.settings()))
    yield from own_head.make(root)
    yield from own_head.lit_face(root)
    looks_back()
    d.screenshot("photographs_3_rendered")


def looks_back() -> None:
    """The head's lids are open as they were photographed, and its eyeballs lie behind them."""
    head = own_head.head()
    keys = head.data.shape_keys.key_blocks
    assert min(keys[f"eyesOpen{side}"].value for side in ("Left", "Right")) > 0.9, "the lids are closed"
    materials = [material.name for material in head.data.materials if material]
    assert any("Eyes" in name for name in materials), "there are no eyes behind the lids"
