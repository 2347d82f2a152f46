# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The white point and the tone's certainty in the panel: a click on a card in a frame, a ColorChecker by the solver,
and words that are true."""

import numpy as np
import pytest

from tests.fixtures import standin

bpy = pytest.importorskip("bpy")


@pytest.fixture
def item(addon, capture):
    """The standin capture with one frame, upper half grey card, lower half burnt out."""
    (capture / "frames").mkdir(exist_ok=True)
    frame = standin.png([[(118, 110, 100)] * 32] * 16 + [[(255, 255, 255)] * 32] * 16)
    (capture / "frames" / "00000.jpg").write_bytes(frame)
    return addon("captures").active(bpy.context)


def linear(value: int) -> float:
    return ((value / 255 + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize(("card", "reflectance"), [('grey', 0.18), ('white', 0.88)])
def test_a_click_on_a_card_gives_the_white_point_and_the_cross_takes_it_away(addon, item, card, reflectance):
    images_before = len(bpy.data.images)
    bpy.ops.wildcap.pick_white_point(card=card, frame="00000.jpg", uv=(0.5, 0.75))
    found = [float(v) for v in item.solve.white_point.split(",")]
    assert np.allclose(found, [linear(v) / reflectance for v in (118, 110, 100)], rtol=0.01)
    assert (
        addon("properties").job_settings(item)["solve"]["white_point"] == item.solve.white_point
        and len(bpy.data.images) == images_before
    )
    item.quality = "draft"
    assert item.solve.white_point != "auto", "a quality says nothing about the light"
    bpy.ops.wildcap.clear_white_point()
    assert item.solve.white_point == "auto"


@pytest.mark.parametrize(
    ("frame", "uv", "said"),
    [
        ("00000.jpg", (0.5, 0.2), "burnt out or black"),
        ("00000.jpg", (1.2, 0.2), "outside the frame"),
        ("00009.jpg", (0.5, 0.7), "no such frame"),
    ],
)
def test_a_click_that_measures_nothing_says_why(item, frame, uv, said):
    with pytest.raises(RuntimeError, match=said):
        bpy.ops.wildcap.pick_white_point(frame=frame, uv=uv)
    assert item.solve.white_point == "auto"


def test_the_chart_that_the_solver_finds_reaches_the_settings(addon, item, monkeypatch):
    class Job:
        figures = {"white_point": [0.9, 0.8, 0.6]}

    started = []

    def start_tool(item, tool, **options):
        started.append((tool, options))
        return Job()

    monkeypatch.setattr(addon("jobs"), "start_tool", start_tool)
    bpy.ops.wildcap.find_color_checker()
    assert started[0][0] == "white_point"
    started[0][1]["then"]()
    assert item.solve.white_point == "0.9000,0.8000,0.6000"


@pytest.mark.parametrize(
    "ask, figures, kept",
    [
        ("estimate_skin_tone", {"skin_tone_srgb": [0.5, 0.4, 0.3]}, lambda item: item.use_skin_tone),
        ("find_color_checker", {"white_point": [0.9, 0.8, 0.6]}, lambda item: item.solve.white_point != "auto"),
    ],
)
def test_undo_of_what_came_after_an_estimate_leaves_the_estimate(addon, item, monkeypatch, ask, figures, kept):
    if not bpy.context.window_manager.windows:
        pytest.skip("no window in this Blender: the flows in a window hold it")
    ended = []
    monkeypatch.setattr(
        addon("jobs"),
        "start_tool",
        lambda item, tool, then: ended.append(then) or type("Job", (), {"figures": figures}),
    )
    cube = bpy.data.objects.new("Cube", None)
    bpy.context.scene.collection.objects.link(cube)
    bpy.ops.ed.undo_push(message="Cube")
    getattr(bpy.ops.wildcap, ask)()
    ended[0]()
    bpy.data.objects["Cube"].location.x = 1
    bpy.ops.ed.undo_push(message="Move")
    bpy.ops.ed.undo()
    assert bpy.data.objects["Cube"].location.x == 0 and kept(bpy.context.scene.wildcap.captures[0])


def test_operators_that_change_the_scene_are_steps_of_undo(addon):
    for name in ("solve", "solve_edited", "fit_landmarks"):
        assert 'UNDO' in getattr(bpy.types, f"WILDCAP_OT_{name}").bl_options


def test_the_panel_says_where_the_tone_comes_from(addon, capture, item):
    words, set_tone = (lambda item: addon("solve.panel").tone_words(item, None)), addon("solve.operators").set_tone
    root = addon("captures").root(item)
    set_tone(
        root,
        {
            "skin_tone_srgb": [0.5, 0.4, 0.3],
            "skin_tone_group": "tan",
            "skin_tone_deviation_l": 6.4,
            "skin_tone_source": "scene",
        },
    )
    assert words(item) == "Skin tone: estimated, ±6. Choose it if it looks wrong." and item.use_skin_tone
    set_tone(
        root,
        {
            "skin_tone_srgb": [0.5, 0.4, 0.3],
            "skin_tone_group": "tan",
            "skin_tone_deviation_l": 2.0,
            "skin_tone_source": "white point",
        },
    )
    assert words(item) == "tan, ± 2 L*, by white point"
    item.use_skin_tone = False
    finding = {
        "stage": "solve",
        "problem": "Skin tone: estimated, ±7.",
        "remedy": "Choose it if it looks wrong.",
        "stopped": False,
    }
    solved = addon("status").Status(findings=(finding,))
    assert addon("solve.panel").tone_words(item, solved) == "Skin tone: estimated, ±7. Choose it if it looks wrong."
    assert "when the maps are solved" in words(item)
    item.use_skin_tone = True
    item.skin_tone = (0.6, 0.4, 0.3)
    assert words(item) == "Chosen by you: this wins"
