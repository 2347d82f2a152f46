# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Make My Head in the bpy wheel, its job played by hand: what comes into the scene when, and what an artist's edits
keep out; and words of the terminal."""

import sys
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def job(addon, monkeypatch):
    """The job that the click starts, and what it was asked for; `job.end()` lets it end."""
    jobs, played = addon("jobs"), SimpleNamespace(running=None)

    def start(item, goal, *, first=None, then, on_stage, **_):
        played.goal, played.first, played.then, played.stage, played.running = goal, first, then, on_stage, object()

    def end(well=True):
        played.running = None
        if well:
            played.then()

    played.end = end
    monkeypatch.setattr(jobs, "start", start)
    monkeypatch.setattr(jobs, "of", lambda root: played.running if root else None)
    rendered = []
    monkeypatch.setattr(addon("relight.output"), "render_still", lambda scene, path, wait: rendered.append(path.name))
    played.rendered = rendered
    return played


def take(addon) -> None:
    """What the timer does in a window."""
    results, item = addon("make.results"), bpy.context.scene.wildcap.captures[0]
    if results.has_news(addon("captures").root(item)):
        results.take(bpy.context, item)


def wanted(addon) -> bool:
    return addon("make.results").has_news(addon("captures").root(bpy.context.scene.wildcap.captures[0]))


def head(addon):
    return addon("captures").head(bpy.context, bpy.context.scene.wildcap.captures[0])


def test_one_click_brings_in_the_head_the_material_and_a_picture(addon, capture, job):
    assert bpy.ops.wildcap.make_my_head() == {'FINISHED'}
    assert (job.goal, job.first) == ("make", None)
    for stage in ("frames", "cameras", "registration"):
        job.stage(stage)
        take(addon)
    assert head(addon) is None, "it comes with its texture"
    job.stage("texture")
    take(addon)
    assert head(addon) is not None and "wildcap_skin" not in head(addon).data.materials[0]
    job.stage("solve")
    take(addon)
    material = head(addon).data.materials[0]
    assert "wildcap_skin" in material and not job.rendered
    job.stage("upscale")
    take(addon)
    job.end()
    take(addon)
    assert job.rendered == ["three_point.png"] and head(addon).data.materials[0] == material
    told = addon("problems").of(addon("captures").root(bpy.context.scene.wildcap.captures[0]))
    assert told.problem == "Your head is ready."
    assert not wanted(addon)


def test_a_material_that_somebody_edited_is_left_alone(addon, capture, job):
    bpy.ops.wildcap.make_my_head()
    job.stage("texture")
    job.stage("solve")
    take(addon)
    skin = head(addon).data.materials[0].node_tree.nodes["WildCap Skin"]
    seen = head(addon)["wildcap_maps_time"]
    skin.inputs["Roughness"].default_value = 0.31
    head(addon)["wildcap_maps_time"] = 1.0
    job.stage("upscale")
    take(addon)
    assert head(addon)["wildcap_maps_time"] == 1.0 and skin.inputs["Roughness"].default_value == pytest.approx(0.31)
    bpy.ops.wildcap.assemble_material()  # the button still does it, and keeps the value
    assert head(addon)["wildcap_maps_time"] == seen and skin.inputs["Roughness"].default_value == pytest.approx(0.31)


def test_a_material_of_somebodys_own_is_left_alone(addon, capture, job):
    bpy.ops.wildcap.make_my_head()
    job.stage("texture")
    take(addon)
    own = bpy.data.materials.new("Mine")
    head(addon).data.materials[0] = own
    job.stage("solve")
    take(addon)
    assert head(addon).data.materials[0] == own


def test_a_head_that_cannot_take_the_new_shape_says_so_and_gets_no_maps_of_it(addon, capture, job, monkeypatch):
    bpy.ops.wildcap.make_my_head()
    job.stage("texture")
    take(addon)
    kept = head(addon).data.materials[0]

    def refuse(obj, mesh):
        raise addon("head").Problem("It cannot follow.", "Keep it.")

    monkeypatch.setattr(addon("head"), "FOLLOWERS", [refuse])
    job.stage("texture")
    job.stage("solve")
    take(addon)
    take(addon)
    assert head(addon).data.materials[0] == kept and "wildcap_skin" not in kept and not wanted(addon)
    told = addon("problems").of(addon("captures").root(bpy.context.scene.wildcap.captures[0]))
    assert told.problem == "It cannot follow."


def test_what_was_cancelled_leads_nowhere(addon, capture, job):
    bpy.ops.wildcap.make_my_head()
    job.stage("texture")
    take(addon)
    job.end(well=False)
    take(addon)
    assert not job.rendered and not wanted(addon)


def test_a_proposal_is_accepted_by_one_click(addon, capture, job):
    for name in ("texture.exr", "shadow_mask_auto.png"):
        (capture / name).write_bytes(b"")
    assert bpy.ops.wildcap.accept_proposal() == {'FINISHED'}
    assert (job.goal, job.first) == ("make", "solve")
    job.end(well=False)
    (capture / "texture.exr").unlink()
    with pytest.raises(RuntimeError, match="no proposed mask yet"):
        bpy.ops.wildcap.accept_proposal()


def test_what_is_left_of_the_whole_is_told_from_the_last_times(addon):
    jobs, timings = addon("jobs"), addon("timings")
    timings.unregister()
    job = jobs.Job("make", None, planned=("delight", "texture", "solve"), stage="delight")
    job.progress = SimpleNamespace(eta_s=30.0)
    assert jobs.eta(job) == "30 s left"
    timings.record_stage("texture", 60.0)
    timings.record_stage("solve", 210.0)
    assert jobs.eta(job) == "30 s left, about 5 min in all"
    timings.register()  # as the next Blender does
    assert timings.of_stages(("texture", "solve")) == 270.0 and timings.of_stages(("texture", "upscale")) is None


def test_the_terminal_runs_the_chain_with_the_solver_that_is_set_up(addon, capture, capfd, monkeypatch):
    execute, preferences = addon("terminal").execute, addon("preferences")
    monkeypatch.setattr(preferences, "python", lambda: None)
    assert execute(["solve", str(capture)]) == 1
    assert "solver is not set up" in capfd.readouterr().err
    monkeypatch.setattr(preferences, "python", lambda: sys.executable)
    monkeypatch.setenv("PYTHONHOME", str(capture))  # of another Python: the solver's does not listen
    # the chain's own exit code, and its words
    assert execute(["run", str(capture / "no_film.mp4"), str(capture), "--quality", "draft"]) == 2
    assert "no_film.mp4" in capfd.readouterr().err
    monkeypatch.chdir(capture.parent)  # paths are told from the folder that Blender was called in
    assert execute(["run", "a film.mp4", "new.wildcap", "--settings", "mine.json"]) == 2
    assert str(capture.parent / "mine.json") in capfd.readouterr().err
    assert execute(["run", "a film.mp4", "new.wildcap"]) == 2
    assert str(capture.parent / "a film.mp4") in capfd.readouterr().err
    assert (capture.parent / "new.wildcap").is_dir() and not (addon("jobs").ROOT / "new.wildcap").exists()
    with pytest.raises(SystemExit):
        execute(["run"])
