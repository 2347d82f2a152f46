# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One click on a swatch: the head shows it, Ctrl-Z brings it back, and the capture has what the panel says."""

import json
import shutil
from importlib import util
from pathlib import Path

import numpy as np
import pytest

from tests.fixtures import standin
from tests.fixtures.drawn import draw
from tests.fixtures.recorded import make_entry

bpy = pytest.importorskip("bpy")

needs_worker = pytest.mark.skipif(util.find_spec("cv2") is None, reason="the worker's part needs its packages")

SOLVED = tuple(round(v / 255, 4) for v in (200, 150, 130))  # of standin's albedo
FIGURES = {"skin_tone_srgb": SOLVED, "skin_tone_source": "scene", "skin_tone_deviation_l": 6.1}


def record(root: Path, **figures) -> None:
    """capture.json of a solve with these figures."""
    stages = {"solve": make_entry(figures={**FIGURES, **figures})}
    (root / "capture.json").write_text(json.dumps({"format": 2, "source": "", "stages": stages}), encoding="utf-8")


def linear(colours) -> np.ndarray:
    srgb = np.asarray(colours, float)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def choice(root: Path) -> str:
    path = root / "skin_tone.json"
    return json.loads(path.read_text())["skin_tone"] if path.is_file() else "auto"


def item():
    return bpy.context.scene.wildcap.captures[0]


def material():
    return item().head.data.materials[0]


def in_solid(v: float = 0.4) -> np.ndarray:
    """sRGB that Solid shading shows in the middle of the face, or at another height of the map."""
    image = material().node_tree.nodes.active.image
    width, height = image.size
    pixels = np.array(image.pixels[:]).reshape(height, width, -1)
    return pixels[int(v * height), width // 2, :3]


def tone() -> np.ndarray:
    return np.array(material().node_tree.nodes["WildCap Skin"].inputs["Tone"].default_value[:3])


def click(number: int) -> None:
    assert bpy.ops.wildcap.choose_swatch('EXEC_DEFAULT', True, number=number) == {'FINISHED'}


@pytest.fixture
def root(wildcap, tmp_path) -> Path:
    """A solved capture whose head is in the scene with its maps."""
    made = standin.make(tmp_path / "Zoë et moi" / "head.wildcap")
    record(made)
    bpy.ops.wildcap.open_capture(directory=str(made))
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    bpy.ops.ed.undo_push(message="Assembled")
    return made


def test_a_click_shows_the_swatch_at_once_and_undo_brings_the_head_back(root):
    assert choice(root) == "auto" and np.allclose(tone(), 1) and np.allclose(in_solid(), SOLVED, atol=0.01)
    click(8)
    chosen = tuple(item().skin_tone)
    assert item().use_skin_tone and choice(root) == ",".join(f"{v:.4f}" for v in chosen)
    assert np.allclose(tone() * linear(SOLVED), linear(chosen), rtol=1e-3)
    assert np.allclose(in_solid(), chosen, atol=0.01) and chosen[0] < SOLVED[0] - 0.2
    click(3)
    assert item().skin_tone[0] > chosen[0] + 0.2 and np.allclose(in_solid(), item().skin_tone, atol=0.01)
    bpy.ops.ed.undo()
    assert tuple(item().skin_tone) == chosen and choice(root).startswith(f"{chosen[0]:.4f}")
    assert np.allclose(in_solid(), chosen, atol=0.01)
    bpy.ops.ed.undo()
    assert not item().use_skin_tone and choice(root) == "auto" and np.allclose(tone(), 1)
    assert material().node_tree.nodes.active.name == "WildCap Albedo" and np.allclose(in_solid(), SOLVED, atol=0.01)
    bpy.ops.ed.redo()
    assert np.allclose(in_solid(), chosen, atol=0.01) and choice(root) != "auto"


@needs_worker
def test_dense_brows_stay_as_they_are_in_solid_shading_and_in_the_shader(root):
    """The capture was solved before there was a weight: the template's masks tell, as for a delivery."""
    from core.capture.capture import Capture
    from core.face import skin_weight, template

    brows, black = template.mask("brows", 64) > 0.9, (63, 63, 63)  # of a luminance of 0.05
    rows = [[black if brow else (200, 150, 130) for brow in row] for row in brows]
    (root / "maps" / "diffuse_albedo.png").write_bytes(standin.png(rows))
    bpy.ops.wildcap.assemble_material()
    click(9)
    image = material().node_tree.nodes.active.image
    pixels = np.array(image.pixels[:]).reshape(64, 64, -1)[::-1]
    assert np.allclose(pixels[brows][:, :3], 63 / 255, atol=0.02) and not np.allclose(in_solid(), SOLVED, atol=0.1)
    delivered = skin_weight.read_skin_weight(Capture(root), 64)
    shown = np.array(material().node_tree.nodes["WildCap Skin Weight"].image.pixels[:]).reshape(64, 64, 4)[::-1, :, 0]
    assert np.abs(shown - delivered).mean() < 0.01 and delivered[brows].max() < 0.1
    weight = material().node_tree.nodes["WildCap Skin Weight"]
    assert weight.outputs[0].links[0].to_socket.name == "Skin" and weight.image.packed_file is not None
    assert weight.image.colorspace_settings.is_data


@needs_worker
def test_maps_without_a_tone_on_record_are_measured_as_a_delivery_does(wildcap, tmp_path):
    from core.capture.capture import Capture
    from core.face.skin_weight import measure_tone

    made = standin.make(tmp_path / "sample.wildcap")
    bpy.ops.wildcap.open_capture(directory=str(made))
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    click(8)
    assert tuple(material()["wildcap_tone"]) == pytest.approx(measure_tone(Capture(made)), abs=2e-4)
    assert np.allclose(in_solid(), item().skin_tone, atol=0.01)


def test_the_artists_material_and_view_are_left_alone(root, addon):
    skin = addon("relight.material")
    click(8)
    assert not skin.is_edited(item().head), "a tone is no edit: Make My Head may go on"
    mine = material().node_tree.nodes.new('ShaderNodeTexImage')
    mine.name, material().node_tree.nodes.active = "Mine", mine
    click(2)
    assert material().node_tree.nodes.active.name == "Mine" and skin.is_edited(item().head)
    bpy.ops.wildcap.assemble_material()
    gain = linear(item().skin_tone) / linear(SOLVED)
    assert np.allclose(tone(), gain, rtol=2e-3), "assembled again, it wears the chosen tone"


def test_before_the_solve_the_texture_is_shown_in_the_tone(wildcap, tmp_path):
    made = standin.make(tmp_path / "new.wildcap", solved=False)
    bpy.ops.wildcap.open_capture(directory=str(made))
    bpy.ops.wildcap.bring_in_head()
    filmed = in_solid()
    bpy.ops.ed.undo_push(message="Brought in")
    click(7)
    assert np.allclose(in_solid(), item().skin_tone, atol=0.01) and not np.allclose(filmed, in_solid(), atol=0.1)
    shader = next(n for n in material().node_tree.nodes if n.type == 'BSDF_PRINCIPLED')
    assert shader.inputs["Base Color"].links[0].from_node.name == "WildCap Toned"
    bpy.ops.ed.undo()
    assert material().node_tree.nodes.active.name == "Texture" and np.allclose(in_solid(), filmed)
    shader = next(n for n in material().node_tree.nodes if n.type == 'BSDF_PRINCIPLED')
    assert shader.inputs["Base Color"].links[0].from_node.name == "Texture"


def test_what_another_program_chose_is_taken_in_and_a_copy_and_a_reopened_file_agree(root, addon, tmp_path):
    click(8)
    saved, chosen = tmp_path / "mine.blend", tuple(item().skin_tone)
    bpy.ops.wm.save_as_mainfile(filepath=str(saved))
    copy = Path(shutil.copytree(root, tmp_path / "copy.wildcap"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wildcap.open_capture(directory=str(copy))
    assert tuple(item().skin_tone) == pytest.approx(chosen, abs=1e-4) and item().use_skin_tone
    (root / "skin_tone.json").write_text('{"skin_tone": "4"}')  # as a terminal or a batch does
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    fourth = addon("solve.tone_panel")._swatches(item())[3]
    assert tuple(item().skin_tone) == pytest.approx(fourth, abs=1e-4) and choice(root) == "4"
    assert np.allclose(tone() * linear(SOLVED), linear(fourth), rtol=2e-3), "and it is on the head"
    assert addon("properties").job_settings(item())["solve"]["skin_tone"] == "4"


def test_undo_of_the_artists_own_step_leaves_what_another_program_chose_meanwhile(root, addon):
    status = addon("status")
    (root / "skin_tone.json").write_text('{"skin_tone": "4"}')
    status.of(item())
    status._tick()
    assert item().use_skin_tone and choice(root) == "4"
    bpy.data.objects.new("Cube", None)
    bpy.ops.ed.undo_push(message="Cube")
    bpy.ops.ed.undo()
    assert "Cube" not in bpy.data.objects and item().use_skin_tone and choice(root) == "4"


def test_the_slider_warms_the_tone_and_keeps_its_lightness(root, addon):
    assert item().skin_warmth == pytest.approx(0, abs=1e-3)
    item().skin_warmth = 1.5
    assert item().use_skin_tone and item().skin_warmth == pytest.approx(1.5, abs=0.01)
    red, _, blue = item().skin_tone
    assert red > SOLVED[0] and blue < SOLVED[2] and np.allclose(in_solid(), item().skin_tone, atol=0.01)
    click(6)
    assert item().skin_warmth == pytest.approx(1.5, abs=0.02), "all ten are warmer"


def test_ten_buttons_with_the_estimate_marked_and_its_interval_shaded(root, addon):
    icons, drawn = addon("solve.swatch_icons"), []
    original = icons.icon

    def spy(colour, framed, dotted):
        drawn.append((framed, dotted))
        return original(colour, framed, dotted)

    icons.icon = spy
    try:
        layout = draw(bpy.types.WILDCAP_PT_skin_tone)
    finally:
        icons.icon = original
    buttons = [options for name, args, options in layout.calls if name == "operator" and "depress" in options]
    assert [button["text"] for button in buttons] == [str(number) for number in range(1, 11)]
    assert not any(button["depress"] for button in buttons)
    framed, dotted = zip(*drawn, strict=True)
    assert 1 <= sum(framed) <= 3 and sum(dotted) == 1 and framed[dotted.index(True)]
    pixels = icons.draw((0.6, 0.45, 0.35), True, True)
    assert np.allclose(pixels[8, 8], [0.6, 0.45, 0.35, 1]), "as the screen shows sRGB"
    assert pixels[0, 0, 0] == pixels[16, 16, 0] == 0 and icons.draw((0.2, 0.1, 0.1), True, False)[0, 0, 0] == 1
    click(2)
    buttons = [o for n, _, o in draw(bpy.types.WILDCAP_PT_skin_tone).calls if n == "operator" and "depress" in o]
    assert [button["depress"] for button in buttons].index(True) == 1


def test_an_unsure_estimate_asks_by_the_large_buttons_line_until_a_swatch_is_chosen(root, addon):
    def step():
        panel = addon("panel")
        return addon("next_step").next_step(panel.gather(bpy.context, item()))

    addon("status").refresh(bpy.context)
    assert "Skin Tone" not in step().state
    record(root, skin_tone_deviation_l=12.0)
    addon("status").refresh(bpy.context)
    asked = step()
    assert "choose a swatch under Skin Tone" in asked.state and asked.operator, "the button goes on all the same"
    click(5)
    assert "Skin Tone" not in step().state
