# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A skin tone by one click: a swatch is clicked and the head changes, Ctrl-Z brings it back, and Deliver ships what was
shown."""

import json

import addon
import bpy
import driver as d
import numpy as np

LIMIT_S = 900


def flow():
    root = yield from addon.open_to_deliver()
    addon.settings().deliver.format = "obj"
    bpy.ops.wildcap.assemble_material('EXEC_DEFAULT', True)
    yield 1.0
    before = shown("skin_tone_1_solved")
    yield from d.press("wildcap.choose_swatch", "number=8")
    yield 1.5
    dark = shown("skin_tone_2_swatch_8")
    assert dark.mean() < 0.8 * before.mean(), (before, dark)
    chosen = tuple(addon.settings().skin_tone)
    assert (root / "skin_tone.json").is_file()
    yield from d.key('Z', ctrl=True)
    yield 1.5
    back = shown("skin_tone_3_undone")
    assert np.abs(back - before).max() < 0.02, (before, back)
    assert not addon.settings().use_skin_tone
    assert json.loads((root / "skin_tone.json").read_text(encoding="utf-8"))["skin_tone"] == "auto"
    yield from d.press("wildcap.choose_swatch", "number=8")
    yield 1.5
    assert np.abs(shown("skin_tone_4_again") - dark).max() < 0.02 and tuple(addon.settings().skin_tone) == chosen
    yield from ships(root, chosen)


def ships(root, chosen):
    """The delivered skin has the tone that was shown, and its provenance says so."""
    target = root / "exports" / f"{root.stem}_head_blender_obj"
    yield from d.press("wildcap.deliver")
    yield 1.0
    yield from d.key('RET')
    yield from addon.delivered(root, target)
    told = json.loads((target / "provenance.json").read_text(encoding="utf-8"))["skin_tone"]
    assert np.allclose(told["chosen_srgb"], chosen, atol=1e-3), told
    solved, delivered = (
        cheek(path) for path in (root / "maps/diffuse_albedo.png", target / f"textures/{root.stem}_albedo.png")
    )
    gain = linear(np.array(told["chosen_srgb"])) / linear(np.array(told["solved_srgb"]))
    assert np.allclose(linear(delivered) / linear(solved), gain, rtol=0.03), (solved, delivered, gain)
    d.say("delivered", *told["chosen_srgb"])


def shown(name: str) -> np.ndarray:
    """Mean of what the window shows in the middle of the 3D view, sRGB."""
    picture = bpy.data.images.load(str(d.screenshot(name)))
    width, height = picture.size
    pixels = np.array(picture.pixels[:], np.float32).reshape(height, width, -1)[..., :3]
    bpy.data.images.remove(picture)
    x, y = map(int, d.middle())
    return pixels[y - 20 : y + 20, x - 20 : x + 20].mean((0, 1))


def cheek(path) -> np.ndarray:
    """Mean of a map, as it is stored, on the left cheek."""
    picture = bpy.data.images.load(str(path))
    picture.colorspace_settings.is_data = True
    side = picture.size[0]
    pixels = np.array(picture.pixels[:], np.float32).reshape(side, side, -1)[..., :3]
    bpy.data.images.remove(picture)
    row, column = int(0.4 * side), int(0.65 * side)
    return pixels[row - 5 : row + 5, column - 5 : column + 5].mean((0, 1))


def linear(srgb: np.ndarray) -> np.ndarray:
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
