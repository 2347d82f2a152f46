# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Turntable and contact sheet: one render of several frames, judged by where the light and the head are in each."""

import errno
import shutil

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def pixels(path):
    """A picture file [H, W, 3] as its numbers are, rows from the bottom."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.is_data = True
    return np.array(image.pixels[:]).reshape(image.size[1], image.size[0], 4)[..., :3]


def test_the_contact_sheet_shows_each_preset_as_it_is_alone(addon, capture):
    headless = addon("relight.headless")
    path = headless.render_contact_sheet(capture, resolution=32, samples=2)
    found = pixels(path)
    assert path == capture / "renders" / "contact_sheet.png" and found.shape == (2 * 32 + 3 * 8, 3 * 32, 3)
    names = [name for name, *_ in addon("properties").LIGHTS if name != "hdri"]
    for i, name in enumerate(names):
        top = (i // 3) * (32 + 8)
        cell = found[::-1][top : top + 32, 32 * (i % 3) : 32 * (i % 3) + 32]
        assert np.abs(cell - pixels(capture / "renders" / f"{name}.png")[::-1]).max() < 1.5 / 255
        assert found[::-1][top + 32 : top + 40, 32 * (i % 3) : 32 * (i % 3) + 32].max() > 0.3, "its caption"
        assert (capture / "renders" / f"{name}.exr").is_file()
    shown = {name: pixels(capture / "renders" / f"{name}.exr") for name in ("window", "rim")}
    headless.render_relit(capture, shown, resolution=32, samples=2)
    for name, before in shown.items():
        off = np.abs(pixels(capture / "renders" / f"{name}.exr") - before).mean()
        assert off < 0.1 * before.mean(), "the same light as in a render of its own"
    assert not [p for p in (capture / "renders").iterdir() if p.name.startswith(".")]
    assert not [d for d in (*bpy.data.curves, *bpy.data.actions) if d.users == 0]


@pytest.mark.parametrize("moment", [20, 20.5, 30000])
def test_a_head_that_is_animated_is_in_each_light_as_it_is_now(addon, capture, moment):
    """It jumps into the picture a quarter of a frame before `moment`, where it also drifts by a radius a frame: it is
    beside the camera's view in frames 1 to 6."""
    bpy.ops.wildcap.bring_in_head()
    head, scene = bpy.context.view_layer.objects.active, bpy.context.scene
    for place, frame in ((5.0, 1), (0.0, moment - 0.25), (0.125, moment + 1)):
        head.location.x = place
        head.keyframe_insert("location", index=0, frame=frame)
    keys = _keys(head)
    keys[0].interpolation, keys[1].interpolation = 'CONSTANT', 'LINEAR'
    before = [tuple(key.co) for key in keys]
    scene.frame_set(int(moment), subframe=moment % 1)
    here = head.matrix_world.translation.x
    assert here == pytest.approx(0.025)
    names, reel = tuple(addon("relight.lights").PRESETS), addon("relight.reel")
    settings = addon("relight.picture").RenderSettings(16, 1)
    shown, first = reel.each_light(head, names, settings)
    for i, name in enumerate(names):
        shown.frame_set(first + i)
        depsgraph = shown.view_layers[0].depsgraph
        lamps = {
            o.name.split(".")[0]
            for o in shown.objects
            if o.type == 'LIGHT' and not o.evaluated_get(depsgraph).hide_render
        }
        assert lamps == {f"WildCap {lamp.name}" for lamp in addon("relight.lights").preset(name).lamps}
        off = head.evaluated_get(depsgraph).matrix_world.translation.x - here
        assert 0 <= off <= 0.1 * 0.2, "a fifth of a frame's drift at most, and never what was before now"
    assert scene.frame_current_final == moment and [tuple(key.co) for key in _keys(head)] == before
    scene.frame_set(int(moment), subframe=moment % 1)
    assert settings.scene(head, "sun").frame_current_final == moment, "time goes by as ever in the next render"


def test_the_contact_sheet_of_an_animated_head_is_that_of_its_pose(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    head, sheet = bpy.context.view_layer.objects.active, addon("relight.contact_sheet")
    settings, folder = addon("relight.picture").RenderSettings(16, 1), capture / "renders"
    still = pixels(sheet.render(head, folder, True, settings))
    for place, frame in ((5.0, 1), (0.0, 20)):
        head.location.x = place
        head.keyframe_insert("location", index=0, frame=frame)
    _keys(head)[0].interpolation = 'CONSTANT'
    bpy.context.scene.frame_set(20)
    assert np.abs(pixels(sheet.render(head, folder, True, settings)) - still).mean() < 0.005, "but for noise, the same"
    assert not [p for p in folder.iterdir() if p.name.startswith(".")] and bpy.context.scene.frame_current == 20


def test_a_contact_sheet_before_frame_0_is_refused(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    bpy.context.scene.frame_set(-3)
    with pytest.raises(RuntimeError, match="Frame -3 lies before frame 0"):
        bpy.ops.wildcap.contact_sheet()


def _keys(obj):
    """The keys of an object's one curve."""
    action = obj.animation_data.action
    curves = action.fcurves if hasattr(action, "fcurves") else action.layers[0].strips[0].channelbags[0].fcurves
    return curves[0].keyframe_points


@pytest.mark.parametrize("turns", ['LIGHT', 'HEAD'])
def test_a_turntable_goes_once_around(addon, capture, turns):
    """The window stands at the head's right: a quarter turn counter-clockwise it is before the face, half a turn at the
    left. Where the head turns, the light stays with the viewer, and the open back of the egg comes around."""
    folder = addon("relight.headless").render_turntable(capture, "window", turns, 4, resolution=32, samples=4)
    assert sorted(p.name for p in folder.iterdir()) == ["0001.png", "0002.png", "0003.png", "0004.png"]
    views = [pixels(folder / f"{i:04d}.png")[8:24].mean((0, 2)) for i in range(1, 5)]
    balance = [view[18:].sum() / view[:14].sum() for view in views]
    if turns == 'LIGHT':
        lit = [v.sum() for v in views]
        assert balance[0] < 0.8 and balance[2] > 1.2 and lit[1] > 1.2 * lit[3], (balance, lit)
    else:
        head, scene = bpy.data.objects[capture.stem], bpy.data.scenes["WildCap Relight"]
        assert head.animation_data is None and head.matrix_world.is_identity
        places = []
        for i in range(1, 5):
            scene.frame_set(i)
            places.append(scene.camera.evaluated_get(scene.view_layers[0].depsgraph).matrix_world.translation.copy())
        assert all(a.z == pytest.approx(places[0].z) for a in places)
        assert (places[0] + places[2]).xy.length < 0.05 * places[0].xy.length, "the other side after half a turn"
        assert places[0].xy.angle_signed(places[1].xy) == pytest.approx(np.pi / 2, abs=0.02), (
            "clockwise, so that the head turns counter-clockwise"
        )


def test_a_film_replaces_the_frames_and_one_that_is_stopped_leaves_the_last(addon, capture, monkeypatch):
    headless, output = addon("relight.headless"), addon("relight.output")
    folder = headless.render_turntable(capture, "sun", frames=2, film=True, resolution=32, samples=1)
    assert [p.name for p in folder.iterdir()] == ["turntable.mp4"]
    assert b"ftyp" in (folder / "turntable.mp4").read_bytes()[:12]
    output._running = output.Running(folder=folder)
    (folder.parent / ".turntable").mkdir()
    output.drop()
    assert not (folder.parent / ".turntable").exists() and (folder / "turntable.mp4").is_file()
    shutil.rmtree(folder)
    # one that Esc stops before its first frame
    monkeypatch.setattr(output, "_render", lambda scene, wait, **what: None)
    output.render_frames(bpy.data.scenes[output.SCENE], folder, "####.png", 2, False)
    output.drop()
    assert not folder.exists()
    monkeypatch.setattr(addon("relight.reel"), "can_film", lambda: False)
    with pytest.raises(headless.Problem, match="without FFmpeg"):
        headless.render_turntable(capture, frames=2, film=True)


def test_the_command_line_renders_and_says_what_is_wrong(addon, capture, capsys):
    execute = addon("terminal").execute
    assert (
        execute(
            ["turntable", str(capture), "--frames", "2", "--turns", "light", "--resolution", "16", "--samples", "1"]
        )
        == 0
    )
    assert str(capture / "renders" / "turntable") in capsys.readouterr().out
    assert execute(["relight", str(capture), "moon"]) == 1
    assert "no light named moon" in capsys.readouterr().err


def test_the_buttons_render_what_the_panel_says_and_wait_for_each_other(addon, capture, monkeypatch):
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    props = bpy.context.scene.wildcap
    props.resolution, props.samples, props.view, props.light, props.turn_frames, props.turn_file = (
        16,
        1,
        'AgX',
        'overcast',
        2,
        'PNG',
    )
    bpy.ops.wildcap.render()
    assert b"View transform: AgX" in (capture / "renders" / "overcast.png").read_bytes()
    bpy.ops.wildcap.turntable()
    bpy.ops.wildcap.contact_sheet()
    renders = capture / "renders"
    assert len(list((renders / "turntable").iterdir())) == 2 and (renders / "contact_sheet.png").is_file()
    monkeypatch.setattr(addon("relight.output"), "busy", lambda: True)
    for name in ("render", "turntable", "contact_sheet"):
        with pytest.raises(RuntimeError, match="Blender is rendering"):
            getattr(bpy.ops.wildcap, name)()


@pytest.mark.parametrize(
    "film, turns, light, resolution, said",
    [(True, 'HEAD', "sun", 17, "resolution that is even"), (False, 'LIGHT', "overcast", 16, "same from every side")],
)
def test_a_turntable_that_cannot_be_is_refused_before_it_is_rendered(
    addon, capture, film, turns, light, resolution, said
):
    headless = addon("relight.headless")
    with pytest.raises(headless.Problem, match=said):
        headless.render_turntable(capture, light, turns, 2, film, resolution=resolution, samples=1)
    assert not (capture / "renders").exists()


@pytest.mark.parametrize(
    "error, said",
    [
        (PermissionError(errno.EACCES, "in use", "/renders/sun.png"), "sun.png cannot be written"),
        (ValueError("no picture"), "An error inside WildCap stopped Render"),
    ],
)
def test_a_render_that_cannot_be_put_in_place_is_told_and_frees_its_memory(addon, capture, monkeypatch, error, said):
    output, problems = addon("relight.output"), addon("problems")
    bpy.ops.wildcap.bring_in_head()
    head = bpy.context.view_layer.objects.active
    scene = addon("relight.picture").RenderSettings(16, 1).scene(head, "sun")

    def fail(*_):
        raise error

    for stands_in in ("place_file", "place_folder"):
        monkeypatch.setattr(output, stands_in, fail)
    monkeypatch.setattr(output, "_render", lambda scene, wait, **what: None)
    with monkeypatch.context() as patched:
        patched.setattr(output, "busy", lambda: True)
        assert output._finish_or_show() == 0.1
    output.render_stills(scene, [capture / "renders" / "sun.png"], False, lambda: None)
    assert scene.render.use_persistent_data
    assert output._finish_or_show() is None and said in problems.of("").problem
    assert not scene.render.use_persistent_data and head.name not in scene.objects
    monkeypatch.setattr(output, "place_file", lambda source, path: None)
    monkeypatch.setattr(output, "_picture", lambda path: None)

    def refuse():
        raise addon("head").Problem("The sheet cannot be joined.", "Try again.")

    output.render_stills(scene, [capture / "renders" / "sun.png"], False, refuse)
    output._finish_or_show()
    assert problems.of("").problem == "The sheet cannot be joined."


def test_pictures_are_rendered_by_the_artists_device_and_from_a_terminal_by_the_cpu(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    now, settings = bpy.context.scene, addon("relight.picture").RenderSettings(16, 1)
    now.cycles.device, now.render.threads_mode, now.render.threads = 'GPU', 'FIXED', 3
    scene = settings.scene(bpy.context.view_layer.objects.active, "sun")
    assert (scene.cycles.device, scene.render.threads_mode, scene.render.threads) == ('GPU', 'FIXED', 3)
    head, _ = addon("relight.headless").open_head(capture)
    assert settings.scene(head, "sun").cycles.device == 'CPU'
