# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The next-step button over the life of a capture: one chain of states, and the turns off it."""

import pytest

pytest.importorskip("bpy")

BEFORE = ("frames", "cameras", "scan", "registration", "delight", "texture", "shadow_mask")
HEAD = {"has_head": True, "head_time": 5.0}
MAPS = {"has_maps": True, "maps_time": 9.0}
FINISHED = {**HEAD, **MAPS, "has_mask": True, "head": 5.0, "maps": 9.0}


@pytest.fixture
def step(addon):
    """Facts by keyword -> the next step. `done`, `stale`, `older` and `absent` name stages; the rest are to do."""
    next_step, status = addon("next_step"), addon("status")

    def of(capture=True, python=True, head=-1.0, maps=-1.0, running="", painting="", source="face.mp4", **known):
        stages = dict.fromkeys((*BEFORE, "solve", "upscale"), "to do")
        for state in ("done", "stale", "older", "absent"):
            stages |= dict.fromkeys(known.pop(state, ()), state)
        seen = status.Status(source=source, stages=stages, **known) if capture else None
        return next_step.next_step(next_step.Facts(capture, python, running, painting, head, maps, seen))

    return of


def test_the_chain_from_nothing_to_a_picture(step):
    facts = {
        "install_solver": {"capture": False, "python": False},
        "choose_video": {"capture": False},
        "make_my_head": {},
        "bring_in_head": {"done": BEFORE, **HEAD},
        "paint_mask": {"done": BEFORE, "head": 5.0, **HEAD},
        "solve": {"done": BEFORE, "head": 5.0, "has_mask": True, **HEAD},
        "assemble_material": {"done": (*BEFORE, "solve"), "head": 5.0, "has_mask": True, **HEAD, **MAPS},
        "render": {"done": (*BEFORE, "solve"), **FINISHED},
    }
    chain = {operator: step(**given) for operator, given in facts.items()}
    assert {operator: each.operator for operator, each in chain.items()} == {name: f"wildcap.{name}" for name in facts}
    assert all(each.state and each.label for each in chain.values())
    others = {operator: each.alternative[1] for operator, each in chain.items() if each.alternative}
    assert others == {"make_my_head": "wildcap.reconstruct", "paint_mask": "wildcap.accept_proposal"}


def test_a_cancelled_reconstruction_continues(step):
    begun = step(done=("frames", "cameras"))
    assert begun.label == "Continue Reconstruction" and begun.alternative[0] == "Make My Head" and "Scan" in begun.state


SAMPLE = {"source": "", "absent": ("texture", "shadow_mask", "solve"), **HEAD, **MAPS}


@pytest.mark.parametrize(
    ("operator", "facts"),
    [
        ("cancel", {"running": "solve"}),
        ("finish_mask", {"painting": "SHADOW"}),
        ("solve", {**FINISHED, "done": BEFORE, "stale": ("solve",)}),
        ("render", {**FINISHED, "done": (*BEFORE[1:], "solve"), "stale": ("frames",)}),  # not back to the start
        ("render", {**FINISHED, "older": (*BEFORE, "solve")}),
        ("assemble_material", {**FINISHED, "done": (*BEFORE, "solve"), "maps_time": 12.0}),
        ("bring_in_head", {**SAMPLE, "python": False}),  # the sample head needs no solver
        ("render", {**SAMPLE, "python": False, "head": 5.0, "maps": 9.0}),
        ("install_solver", {"python": False}),
        ("install_solver", {"python": False, "done": BEFORE, "head": 5.0, "has_mask": True, **HEAD}),
    ],
)
def test_the_turns_off_the_chain(step, operator, facts):
    assert step(**facts).operator == f"wildcap.{operator}"


def test_the_consent_is_asked_for_where_the_chain_stopped_for_it(addon, step):
    plan = addon("status").consent.Sending("sdk.beeble.ai", {"00000.jpg": "a"}, 0, False)
    before = BEFORE[: BEFORE.index("delight")]
    asked = step(done=before, sending=plan)
    assert asked.operator == "wildcap.allow_sending" and "Nothing was sent" in asked.state
    for facts in (
        {"done": before},
        {"done": before, "sending": plan, "agreed": True},
        {"done": before[:-1], "sending": plan},  # the head comes first
    ):
        assert step(**facts).operator == "wildcap.reconstruct"
