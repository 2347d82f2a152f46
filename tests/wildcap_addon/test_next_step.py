# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The next-step button over the life of a capture: one chain of states, and the turns off it."""

from importlib import import_module

import pytest

pytest.importorskip("bpy")

BEFORE = ("frames", "cameras", "scan", "registration", "delight", "texture", "shadow_mask")


@pytest.fixture
def step(wildcap):
    """Facts by keyword -> the operator of the next step. `done`, `stale` and `absent` name stages; the rest are to
    do."""
    next_step = import_module(f"{wildcap}.wildcap_addon.next_step")
    status = import_module(f"{wildcap}.wildcap_addon.status")

    def of(
        done=(),
        stale=(),
        absent=(),
        source="face.mp4",
        capture=True,
        python=True,
        running="",
        painting=False,
        head=-1.0,
        maps=-1.0,
        **known,
    ):
        states = {
            name: "done" if name in done else "stale" if name in stale else "absent" if name in absent else "to do"
            for name in (*BEFORE, "solve", "upscale")
        }
        found = status.Status(source=source, stages=states, **known) if capture else None
        return next_step.next_step(
            next_step.Facts(
                has_capture=capture,
                has_python=python,
                running=running,
                painting=painting,
                head_time=head,
                maps_time=maps,
                status=found,
            )
        )

    return of


def test_the_chain_from_nothing_to_a_picture(step):
    head = {"has_head": True, "head_time": 5.0}
    maps = {"has_maps": True, "maps_time": 9.0}
    chain = [
        step(capture=False, python=False),
        step(capture=False),
        step(),
        step(done=BEFORE, **head),
        step(done=BEFORE, head=5.0, **head),
        step(done=BEFORE, head=5.0, has_mask=True, **head),
        step(done=(*BEFORE, "solve"), head=5.0, has_mask=True, **head, **maps),
        step(done=(*BEFORE, "solve"), head=5.0, has_mask=True, maps=9.0, **head, **maps),
    ]
    assert [s.operator.split(".")[1] for s in chain] == [
        "install_solver",
        "choose_video",
        "make_my_head",
        "bring_in_head",
        "paint_mask",
        "solve",
        "assemble_material",
        "render",
    ]
    assert all(s.state and s.label for s in chain)
    others = {s.operator.split(".")[1]: s.alternative[1].split(".")[1] for s in chain if s.alternative}
    assert others == {"make_my_head": "reconstruct", "paint_mask": "accept_proposal"}


def test_a_cancelled_reconstruction_continues(step):
    assert step(done=("frames", "cameras")).label == "Continue Reconstruction"
    assert step(done=("frames", "cameras")).alternative[0] == "Make My Head"
    assert "Scan" in step(done=("frames", "cameras")).state


def test_a_running_job_offers_cancel_and_painting_offers_the_way_out(step):
    assert step(running="solve").operator == "wildcap.cancel"
    assert step(painting=True).operator == "wildcap.finish_mask"


def test_a_changed_mask_leads_back_to_solve_but_stale_frames_do_not_lead_back_to_the_start(step):
    finished = {
        "has_head": True,
        "head_time": 5.0,
        "has_mask": True,
        "has_maps": True,
        "maps_time": 9.0,
        "head": 5.0,
        "maps": 9.0,
    }
    assert step(done=BEFORE, stale=("solve",), **finished).operator == "wildcap.solve"
    assert step(done=(*BEFORE[1:], "solve"), stale=("frames",), **finished).operator == "wildcap.render"


def test_new_maps_are_assembled_again(step):
    finished = {
        "has_head": True,
        "head_time": 5.0,
        "has_mask": True,
        "has_maps": True,
        "maps_time": 12.0,
        "head": 5.0,
        "maps": 9.0,
    }
    assert step(done=(*BEFORE, "solve"), **finished).operator == "wildcap.assemble_material"


def test_the_sample_head_needs_no_solver(step):
    sample = {
        "source": "",
        "absent": ("texture", "shadow_mask", "solve"),
        "has_head": True,
        "head_time": 5.0,
        "has_maps": True,
        "maps_time": 9.0,
    }
    assert step(python=False, **sample).operator == "wildcap.bring_in_head"
    assert step(python=False, head=5.0, maps=9.0, **sample).operator == "wildcap.render"


def test_without_a_solver_whatever_needs_one_leads_to_its_set_up(step):
    assert step(python=False).operator == "wildcap.install_solver"
    offered = step(python=False, done=BEFORE, has_head=True, head_time=5.0, head=5.0, has_mask=True)
    assert offered.operator == "wildcap.install_solver"
