# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Make My Head in the bpy wheel, its job played by hand: what comes into the scene when, and what an artist's edits
keep out; and words of the terminal."""

import sys
from types import SimpleNamespace

import pytest

from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


@pytest.fixture
def job(addon, item, monkeypatch):
    """The job that the click starts. `end` lets it end; `reach` tells of stages as the timer does in a window."""
    jobs, results, root = addon("jobs"), addon("make.results"), addon("captures").root(item)
    played = SimpleNamespace(running=None, rendered=[])

    def start(item, goal, *, first=None, then, on_stage, **_):
        played.goal, played.first, played.then, played.on_stage, played.running = goal, first, then, on_stage, object()

    def reach(*stages):
        for stage in stages:
            played.on_stage(stage)
        if results.has_news(root):
            results.take(bpy.context, item)

    def end(well=True):
        played.running = None
        if well:
            played.then()
        reach()

    played.reach, played.end, played.has_news = reach, end, lambda: results.has_news(root)
    played.head = lambda: addon("captures").head(bpy.context, item)
    played.words = lambda: addon("problems").of(root).problem
    monkeypatch.setattr(jobs, "start", start)
    monkeypatch.setattr(jobs, "of", lambda root: played.running if root else None)
    monkeypatch.setattr(
        addon("relight.output"), "render_still", lambda _, path, wait: played.rendered.append(path.name)
    )
    return played


def test_one_click_brings_in_the_head_the_material_and_a_picture(job):
    assert bpy.ops.wildcap.make_my_head() == {'FINISHED'} and (job.goal, job.first) == ("make", None)
    job.reach("frames", "cameras", "registration")
    assert job.head() is None, "it comes with its texture"
    job.reach("texture")
    assert "wildcap_skin" not in job.head().data.materials[0]
    job.reach("solve")
    material = job.head().data.materials[0]
    assert "wildcap_skin" in material and not job.rendered
    job.reach("upscale")
    job.end()
    assert job.rendered == ["three_point.png"] and job.head().data.materials[0] == material
    assert job.words() == "Your head is ready." and not job.has_news()


def test_a_material_that_somebody_edited_is_left_alone(job):
    bpy.ops.wildcap.make_my_head()
    job.reach("texture", "solve")
    head, skin = job.head(), job.head().data.materials[0].node_tree.nodes["WildCap Skin"]
    before = head["wildcap_maps_time"]
    skin.inputs["Roughness"].default_value, head["wildcap_maps_time"] = 0.31, 1.0
    job.reach("upscale")
    assert head["wildcap_maps_time"] == 1.0 and skin.inputs["Roughness"].default_value == pytest.approx(0.31)
    bpy.ops.wildcap.assemble_material()  # the button still does it, and keeps the value
    assert head["wildcap_maps_time"] == before and skin.inputs["Roughness"].default_value == pytest.approx(0.31)


def test_a_material_of_somebodys_own_is_left_alone(job):
    bpy.ops.wildcap.make_my_head()
    job.reach("texture")
    job.head().data.materials[0] = own = bpy.data.materials.new("Mine")
    job.reach("solve")
    assert job.head().data.materials[0] == own


def test_a_head_that_cannot_take_the_new_shape_says_so_and_gets_no_maps_of_it(addon, job, monkeypatch):
    def refuse(obj, mesh):
        raise addon("head").Problem("It cannot follow.", "Keep it.")

    bpy.ops.wildcap.make_my_head()
    job.reach("texture")
    kept = job.head().data.materials[0]
    monkeypatch.setattr(addon("head"), "FOLLOWERS", [refuse])
    job.reach("texture", "solve")
    job.reach()
    assert job.head().data.materials[0] == kept and "wildcap_skin" not in kept and not job.has_news()
    assert job.words() == "It cannot follow."


def test_what_was_cancelled_leads_nowhere(job):
    bpy.ops.wildcap.make_my_head()
    job.reach("texture")
    job.end(well=False)
    assert not job.rendered and not job.has_news()


def test_a_proposal_is_accepted_by_one_click(capture, job):
    assert bpy.ops.wildcap.accept_proposal() == {'FINISHED'} and (job.goal, job.first) == ("make", "solve")
    job.end(well=False)
    (capture / "texture.exr").unlink()
    refuses("no proposed mask", bpy.ops.wildcap.accept_proposal)


def test_the_terminal_runs_the_chain_with_the_solver_that_is_set_up(addon, capture, capfd, monkeypatch):
    execute, preferences, folder = addon("terminal").execute, addon("preferences"), capture.parent
    monkeypatch.setattr(preferences, "python", lambda: None)
    assert execute(["solve", str(capture)]) == 1 and "not set up" in capfd.readouterr().err
    monkeypatch.setattr(preferences, "python", lambda: sys.executable)
    monkeypatch.setenv("PYTHONHOME", str(capture))  # of another Python: the solver's does not listen
    monkeypatch.chdir(folder)  # paths are told from the folder that Blender was called in
    # the chain's own exit code, and its words
    assert execute(["run", "a film.mp4", "new.wildcap", "--quality", "draft"]) == 2
    assert str(folder / "a film.mp4") in capfd.readouterr().err and (folder / "new.wildcap").is_dir()
    assert not (addon("jobs").ROOT / "new.wildcap").exists()
    with pytest.raises(SystemExit):
        execute(["run"])
