# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The white point and the tone's certainty in the panel: a click on a card in a frame, a ColorChecker by the solver,
and words that are true."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from tests.fixtures import standin
from tests.fixtures.recorded import make_entry
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


@pytest.fixture
def item(item, capture):
    """The standin capture with one frame, upper half grey card, lower half burnt out."""
    (capture / "frames").mkdir(exist_ok=True)
    frame = standin.png([[(118, 110, 100)] * 32] * 16 + [[(255, 255, 255)] * 32] * 16)
    (capture / "frames" / "00000.jpg").write_bytes(frame)
    return item


def linear(value: int) -> float:
    return ((value / 255 + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize(("card", "reflectance"), [('grey', 0.18), ('white', 0.88)])
def test_a_click_on_a_card_gives_the_white_point_and_the_cross_takes_it_away(addon, item, card, reflectance):
    images_before = len(bpy.data.images)
    bpy.ops.wildcap.pick_white_point(card=card, frame="00000.jpg", uv=(0.5, 0.75))
    found = [float(v) for v in item.solve.white_point.split(",")]
    assert np.allclose(found, [linear(v) / reflectance for v in (118, 110, 100)], rtol=0.01)
    assert len(bpy.data.images) == images_before
    assert addon("properties").job_settings(item)["solve"]["white_point"] == item.solve.white_point
    item.quality = "draft"
    assert item.solve.white_point != "auto", "a quality says nothing about the light"
    bpy.ops.wildcap.clear_white_point()
    assert item.solve.white_point == "auto"


@pytest.mark.parametrize(
    ("frame", "uv", "words"),
    [
        ("00000.jpg", (0.5, 0.2), "overexposed"),
        ("00000.jpg", (1.2, 0.2), "outside"),
        ("00009.jpg", (0.5, 0.7), "no such"),
    ],
)
def test_a_click_that_measures_nothing_says_why(item, frame, uv, words):
    refuses(words, bpy.ops.wildcap.pick_white_point, frame=frame, uv=uv)
    assert item.solve.white_point == "auto"


@pytest.fixture
def estimate(addon, monkeypatch):
    """Function that clicks a button, and lets the job of a worker end with these figures."""

    def estimate(click: str, figures: dict) -> str:
        started = []
        job = SimpleNamespace(figures=figures)
        monkeypatch.setattr(addon("jobs"), "start_tool", lambda item, tool, then: started.append((tool, then)) or job)
        getattr(bpy.ops.wildcap, click)()
        ((tool, then),) = started
        then()
        return tool

    return estimate


@pytest.mark.parametrize(
    ("click", "tool", "figures", "kept"),
    [
        (
            "estimate_skin_tone",
            "skin_tone",
            {"skin_tone_srgb": [0.5, 0.4, 0.3]},
            lambda item: item.estimated_tone[0] == 0.5,
        ),
        (
            "find_color_checker",
            "white_point",
            {"white_point": [0.9, 0.8, 0.6]},
            lambda item: item.solve.white_point == "0.9000,0.8000,0.6000",
        ),
    ],
)
def test_undo_of_what_came_after_an_estimate_leaves_the_estimate(item, estimate, click, tool, figures, kept):
    if not bpy.context.window_manager.windows:
        pytest.skip("no window in this Blender: the flows in a window hold it")
    cube = bpy.data.objects.new("Cube", None)
    bpy.context.scene.collection.objects.link(cube)
    bpy.ops.ed.undo_push(message="Cube")
    assert estimate(click, figures) == tool
    bpy.data.objects["Cube"].location.x = 1
    bpy.ops.ed.undo_push(message="Move")
    bpy.ops.ed.undo()
    assert bpy.data.objects["Cube"].location.x == 0 and kept(bpy.context.scene.wildcap.captures[0])


def test_estimate_counts_until_another_solve_has_made_its_own(addon, capture, item, estimate):
    def solve(hour: str) -> None:
        figures = {"skin_tone_srgb": [0.7, 0.6, 0.5], "skin_tone_source": "scene", "skin_tone_deviation_l": 6.0}
        entry = make_entry(figures=figures, finished=f"2026-11-22T{hour}:00:00")
        record = {"format": 2, "source": "", "stages": {"solve": entry}}
        (capture / "capture.json").write_text(json.dumps(record), encoding="utf-8")
        addon("status").refresh(bpy.context)

    tones = addon("tones")
    solve("10")
    assert tones.estimate(item) == ((0.7, 0.6, 0.5), 6.0)
    estimate("estimate_skin_tone", {"skin_tone_srgb": [0.5, 0.4, 0.3], "skin_tone_deviation_l": 2.0})
    assert tones.estimate(item)[0] == pytest.approx((0.5, 0.4, 0.3)), "by a white point since, perhaps"
    solve("11")
    assert tones.estimate(item) == ((0.7, 0.6, 0.5), 6.0)


def test_the_panel_says_where_the_tone_comes_from(addon, item, estimate):
    words = addon("solve.tone_panel").tone_words
    figures = {"skin_tone_srgb": [0.5, 0.4, 0.3], "skin_tone_group": "tan"}
    estimate("estimate_skin_tone", {**figures, "skin_tone_deviation_l": 6.4, "skin_tone_source": "scene"})
    assert "±6" in words(item, None) and not item.use_skin_tone, "it is marked; nobody has chosen it"
    estimate("estimate_skin_tone", {**figures, "skin_tone_deviation_l": 2.0, "skin_tone_source": "white point"})
    assert words(item, None) == "tan, ± 2 L*, by white point"
    item.estimated_tone, item.tone_source = (0, 0, 0), ""
    finding = {"stage": "solve", "problem": "Estimated, ±7.", "remedy": "Choose it.", "stopped": False}
    assert words(item, addon("status").Status(findings=(finding,))) == "Estimated, ±7. Choose it."
    assert "when the maps are solved" in words(item, None)
    item.use_skin_tone, item.skin_tone = True, (0.6, 0.4, 0.3)
    assert words(item, None) == "Chosen by you: this wins"
