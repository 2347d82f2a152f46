# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A tone that was chosen after the solve, rendered: the numbers that a delivery bakes; and heads of older files."""

import json

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
from core.capture.tone_choice import ToneChange  # noqa: E402
from core.capture.toned_albedo import apply_tone  # noqa: E402
from tests.fixtures.flat_patch import assembled, paint, seen, sockets, white_world  # noqa: E402
from tests.fixtures.recorded import make_entry  # noqa: E402

SOLVED, CHOSEN = (0.7, 0.55, 0.45), (0.45, 0.32, 0.25)
WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)


@pytest.fixture
def skin(patch):
    """A patch of the solved tone, its upper half skin and its lower half beard; without gloss, under even light."""
    figures = {"skin_tone_srgb": SOLVED, "skin_tone_source": "scene"}
    record = {"format": 2, "source": "", "stages": {"solve": make_entry(figures=figures)}}
    (patch / "capture.json").write_text(json.dumps(record), encoding="utf-8")
    paint(patch, "diffuse_albedo.png", SOLVED)
    paint(patch, "normal.png", (0.5, 0.5, 1))
    paint(patch, "skin_weight.png", [[WHITE] * 4] * 2 + [[BLACK] * 4] * 2)
    white_world()
    material = assembled()
    sockets(material)["Specular Amount"].default_value = sockets(material)["Subsurface"].default_value = 0.0
    return material


def choose(tone) -> None:
    item = bpy.context.scene.wildcap.captures[0]
    item.skin_tone = tone
    item.use_skin_tone = True


def halves(path) -> tuple[np.ndarray, np.ndarray]:
    """The rendered patch's upper and its lower half, away from the border between them."""
    picture = seen(path, samples=64, width=1.2)
    return picture[-2:].mean((0, 1)), picture[:2].mean((0, 1))


def test_what_is_rendered_is_what_a_delivery_bakes(skin, tmp_path):
    change = ToneChange(SOLVED, CHOSEN)
    gain, albedo = np.array(change.gain), np.array(ToneChange((1, 1, 1), SOLVED).gain)
    upper, lower = halves(tmp_path / "before.exr")
    assert upper == pytest.approx(albedo, rel=0.05) and lower == pytest.approx(albedo, rel=0.05)
    choose(CHOSEN)
    upper, lower = halves(tmp_path / "after.exr")
    assert upper == pytest.approx(apply_tone(albedo, 1.0, gain), rel=0.05)
    assert lower == pytest.approx(apply_tone(albedo, 0.0, gain), rel=0.05), "a beard stays as it is"


def test_maps_of_a_given_tone_go_back_to_the_estimate_when_it_is_given_up(patch, skin):
    figures = {"skin_tone_srgb": SOLVED, "skin_tone_source": "given", "skin_tone_estimate_srgb": CHOSEN}
    record = {"format": 2, "source": "", "stages": {"solve": make_entry(figures=figures)}}
    (patch / "capture.json").write_text(json.dumps(record), encoding="utf-8")
    choose(SOLVED)
    assert tuple(sockets(skin)["Tone"].default_value[:3]) == (1, 1, 1)
    bpy.context.scene.wildcap.captures[0].use_skin_tone = False
    assert sockets(skin)["Tone"].default_value[:3] == pytest.approx(ToneChange(SOLVED, CHOSEN).gain, rel=1e-3)


def test_a_terminal_that_renders_shows_the_capture_s_choice(patch, skin, addon):
    """It adds the capture and assembles the material, without a window that would look for news."""
    bpy.ops.wm.read_homefile(use_empty=True)
    (patch / "skin_tone.json").write_text(json.dumps({"skin_tone": ",".join(map(str, CHOSEN))}))
    item = addon("captures").add(bpy.context, patch)
    addon("head").bring_in(bpy.context, item)
    material, _ = addon("relight.material").assemble(bpy.context, item)
    assert sockets(material)["Tone"].default_value[:3] == pytest.approx(ToneChange(SOLVED, CHOSEN).gain, rel=1e-3)


def test_a_head_of_an_older_file_gets_the_sockets_when_a_tone_is_chosen(skin):
    """Its group has no tone, and its material knows neither the weight of skin nor the tone of its maps."""
    group = sockets(skin)[0].node.node_tree
    for name in ("Tone", "Skin"):
        group.interface.remove(next(item for item in group.interface.items_tree if item.name == name))
    group.nodes.remove(group.nodes["WildCap Tone"])
    group["wildcap_version"] = 4
    skin.node_tree.nodes.remove(skin.node_tree.nodes["WildCap Skin Weight"])
    del skin["wildcap_tone"]
    choose(CHOSEN)
    gain = ToneChange(SOLVED, CHOSEN).gain
    assert sockets(skin)["Tone"].default_value[:3] == pytest.approx(gain, rel=1e-3)
    assert sockets(skin)["Skin"].links[0].from_node.name == "WildCap Skin Weight"


def test_filmed_pictures_are_compared_as_they_were_filmed(patch, skin):
    choose(CHOSEN)
    (patch / "comparison").mkdir()
    (patch / "comparison" / "filmed.png").write_bytes((patch / "maps" / "diffuse_albedo.png").read_bytes())
    bpy.ops.wildcap.compare(show='FILMED')
    assert tuple(sockets(skin)["Tone"].default_value[:3]) == (1, 1, 1)
    bpy.ops.wildcap.compare(show='SOLVED')
    assert sockets(skin)["Tone"].default_value[0] == pytest.approx(ToneChange(SOLVED, CHOSEN).gain[0], rel=1e-3)
