# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Turntable and contact sheet: one render of several frames, judged by where the light and the head are in each."""

import errno
import shutil

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
from tests.fixtures.flat_patch import pixels  # noqa: E402
from tests.fixtures.refused import refuses  # noqa: E402


def set_keys(head, *keys: tuple[float, float]) -> None:
    """Key the head's x: each value with its frame; the first is held until the second."""
    for place, frame in keys:
        head.location.x = place
        head.keyframe_insert("location", index=0, frame=frame)
    keys_of(head)[0].interpolation, keys_of(head)[1].interpolation = 'CONSTANT', 'LINEAR'


def keys_of(head):
    action = head.animation_data.action
    curves = action.fcurves if hasattr(action, "fcurves") else action.layers[0].strips[0].channelbags[0].fcurves
    return curves[0].keyframe_points


def hidden(folder) -> list:
    return [path for path in folder.iterdir() if path.name.startswith(".")]


def test_the_contact_sheet_shows_each_preset_as_it_is_alone(addon, capture):
    headless, renders = addon("relight.headless"), capture / "renders"
    path = headless.render_contact_sheet(capture, resolution=32, samples=2)
    sheet = pixels(path)[::-1]
    assert path == renders / "contact_sheet.png" and sheet.shape == (2 * 32 + 3 * 8, 3 * 32, 3)
    names = [name for name, *_ in addon("properties").LIGHTS if name != "hdri"]
    for i, name in enumerate(names):
        top, left = (i // 3) * (32 + 8), 32 * (i % 3)
        cell = sheet[top : top + 32, left : left + 32]
        assert np.abs(cell - pixels(renders / f"{name}.png")[::-1]).max() < 1.5 / 255
        assert sheet[top + 32 : top + 40, left : left + 32].max() > 0.3, "its caption"
    before = pixels(renders / "rim.exr")
    headless.render_relit(capture, ["rim"], resolution=32, samples=2)
    off = np.abs(pixels(renders / "rim.exr") - before).mean()
    assert off < 0.1 * before.mean(), "the same light as in a render of its own"
    assert not hidden(renders) and not [d for d in (*bpy.data.curves, *bpy.data.actions) if d.users == 0]


@pytest.mark.parametrize("moment", [20, 20.5, 30000])
def test_a_head_that_is_animated_is_in_each_light_as_it_is_now(addon, head, moment):
    """It jumps into the picture a quarter of a frame before `moment`, where it also drifts by a radius a frame: it is
    beside the camera's view in frames 1 to 6."""
    scene, lights = bpy.context.scene, addon("relight.lights")
    set_keys(head, (5.0, 1), (0.0, moment - 0.25), (0.125, moment + 1))
    before = [tuple(key.co) for key in keys_of(head)]
    scene.frame_set(int(moment), subframe=moment % 1)
    here = head.matrix_world.translation.x
    assert here == pytest.approx(0.025)
    settings = addon("relight.picture").RenderSettings(16, 1)
    shown, first = addon("relight.reel").each_light(head, tuple(lights.PRESETS), settings)
    for i, preset in enumerate(lights.PRESETS.values()):
        shown.frame_set(first + i)
        depsgraph = shown.view_layers[0].depsgraph
        lamps = [o for o in shown.objects if o.type == 'LIGHT' and not o.evaluated_get(depsgraph).hide_render]
        assert {o.name.split(".")[0] for o in lamps} == {f"WildCap {lamp.name}" for lamp in preset.lamps}
        off = head.evaluated_get(depsgraph).matrix_world.translation.x - here
        assert 0 <= off <= 0.1 * 0.2, "a fifth of a frame's drift at most, and never what was before now"
    assert scene.frame_current_final == moment and [tuple(key.co) for key in keys_of(head)] == before
    assert settings.scene(head, "sun").frame_current_final == moment, "time goes by as ever in the next render"


def test_the_contact_sheet_of_an_animated_head_is_that_of_its_pose(addon, capture, head):
    sheet, settings = addon("relight.contact_sheet"), addon("relight.picture").RenderSettings(16, 1)
    still = pixels(sheet.render(head, capture / "renders", True, settings))
    set_keys(head, (5.0, 1), (0.0, 20))
    bpy.context.scene.frame_set(20)
    again = pixels(sheet.render(head, capture / "renders", True, settings))
    assert np.abs(again - still).mean() < 0.005, "but for noise, the same"
    assert not hidden(capture / "renders") and bpy.context.scene.frame_current == 20
    bpy.context.scene.frame_set(-3)
    refuses("Frame -3", bpy.ops.wildcap.contact_sheet)


@pytest.mark.parametrize("turns", ['HEAD', 'LIGHT'])
def test_a_head_that_turns_goes_counter_clockwise_as_a_light_does_and_light_stays_with_the_viewer(addon, head, turns):
    scene = addon("relight.reel").animate_turn(head, "window", turns, 4, addon("relight.picture").RenderSettings(16, 1))
    assert head.animation_data is None and head.matrix_world.is_identity
    rig, places, turn = addon("relight.lights").rig(scene), [], 1 if turns == 'HEAD' else -1
    for i in range(1, 5):
        scene.frame_set(i)
        depsgraph = scene.view_layers[0].depsgraph
        camera, light = (thing.evaluated_get(depsgraph).matrix_world.copy() for thing in (scene.camera, rig))
        places.append(camera.translation)
        assert np.cos(light.to_euler().z + turn * (i - 1) * np.pi / 2) == pytest.approx(1, abs=1e-4)
    if turns == 'LIGHT':
        assert (places[0] - places[1]).length < 1e-6
        return
    assert all(place.z == pytest.approx(places[0].z) for place in places)
    assert (places[0] + places[2]).xy.length < 0.05 * places[0].xy.length, "the other side after half a turn"
    assert places[0].xy.angle_signed(places[1].xy) == pytest.approx(np.pi / 2, abs=0.02), "clockwise around the head"


def test_a_film_replaces_the_frames_and_one_that_is_stopped_leaves_the_last(addon, capture, monkeypatch):
    output = addon("relight.output")
    folder = addon("relight.headless").render_turntable(capture, "sun", frames=2, film=True, resolution=32, samples=1)
    assert [p.name for p in folder.iterdir()] == ["turntable.mp4"]
    assert b"ftyp" in (folder / "turntable.mp4").read_bytes()[:12]
    output._running = output.Running(folder=folder)
    (folder.parent / ".turntable").mkdir()
    output.drop()
    assert not hidden(folder.parent) and (folder / "turntable.mp4").is_file()
    shutil.rmtree(folder)
    # one that Esc stops before its first frame
    monkeypatch.setattr(output, "_render", lambda scene, wait, **what: None)
    output.render_frames(bpy.data.scenes[output.SCENE], folder, "####.png", 2, False)
    output.drop()
    assert not folder.exists()


def test_the_command_line_renders_and_says_what_is_wrong(addon, capture, capsys):
    execute, small = addon("terminal").execute, ("--resolution", "16", "--samples", "1")
    assert execute(["turntable", str(capture), "--frames", "2", "--turns", "light", *small]) == 0
    assert str(capture / "renders" / "turntable") in capsys.readouterr().out
    assert execute(["relight", str(capture), "moon"]) == 1
    assert "moon" in capsys.readouterr().err


def test_the_buttons_render_what_the_panel_says_and_wait_for_each_other(addon, capture, head, monkeypatch):
    props, renders = bpy.context.scene.wildcap, capture / "renders"
    props.resolution, props.samples, props.view, props.light = 16, 1, 'AgX', 'overcast'
    props.turn_frames, props.turn_file = 2, 'PNG'
    bpy.ops.wildcap.render()
    assert b"View transform: AgX" in (renders / "overcast.png").read_bytes()
    bpy.ops.wildcap.turntable()
    bpy.ops.wildcap.contact_sheet()
    assert len(list((renders / "turntable").iterdir())) == 2 and (renders / "contact_sheet.png").is_file()
    monkeypatch.setattr(addon("relight.output"), "busy", lambda: True)
    for name in ("render", "turntable", "contact_sheet"):
        refuses("Blender is rendering", getattr(bpy.ops.wildcap, name))


@pytest.mark.parametrize(
    "film, turns, light, resolution, ffmpeg, word",
    [
        (True, 'HEAD', "sun", 17, True, "even"),
        (True, 'HEAD', "sun", 16, False, "FFmpeg"),
        (False, 'LIGHT', "overcast", 16, True, "every side"),
    ],
)
def test_a_turntable_that_cannot_be_is_refused_before_it_is_rendered(
    addon, capture, monkeypatch, film, turns, light, resolution, ffmpeg, word
):
    headless = addon("relight.headless")
    monkeypatch.setattr(addon("relight.reel"), "can_film", lambda: ffmpeg)
    refuses(word, headless.render_turntable, capture, light, turns, 2, film, resolution=resolution, samples=1)
    assert not (capture / "renders").exists()


@pytest.mark.parametrize(
    "error, words",
    [(PermissionError(errno.EACCES, "in use", "/renders/sun.png"), "sun.png"), (ValueError("no picture"), "Render")],
)
def test_a_render_that_cannot_be_put_in_place_is_shown_and_frees_its_memory(
    addon, capture, head, monkeypatch, error, words
):
    output, problems = addon("relight.output"), addon("problems")
    scene, path = addon("relight.picture").RenderSettings(16, 1).scene(head, "sun"), capture / "renders" / "sun.png"

    def failing(raised):
        def fail(*_):
            raise raised

        return fail

    for stands_in in ("place_file", "place_folder"):
        monkeypatch.setattr(output, stands_in, failing(error))
    monkeypatch.setattr(output, "_render", lambda scene, wait, **what: None)
    with monkeypatch.context() as patched:
        patched.setattr(output, "busy", lambda: True)
        assert output._finish_or_show() == 0.1
    output.render_stills(scene, [path], False, lambda: None)
    assert scene.render.use_persistent_data
    assert output._finish_or_show() is None and words in problems.of("").problem
    assert not scene.render.use_persistent_data and head.name not in scene.objects
    monkeypatch.setattr(output, "place_file", lambda source, path: None)
    monkeypatch.setattr(output, "_picture", lambda path: None)
    output.render_stills(scene, [path], False, failing(output.Problem("The sheet cannot be joined.", "Try again.")))
    output._finish_or_show()
    assert problems.of("").problem == "The sheet cannot be joined."


def test_pictures_are_rendered_by_the_artists_device_and_from_a_terminal_by_the_cpu(addon, capture, head):
    now, settings = bpy.context.scene, addon("relight.picture").RenderSettings(16, 1)
    now.cycles.device, now.render.threads_mode, now.render.threads = 'GPU', 'FIXED', 3
    scene = settings.scene(head, "sun")
    assert (scene.cycles.device, scene.render.threads_mode, scene.render.threads) == ('GPU', 'FIXED', 3)
    head, _ = addon("relight.headless").open_head(capture)
    assert settings.scene(head, "sun").cycles.device == 'CPU'
