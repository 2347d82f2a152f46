# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The choice of the delighter in Blender: its card and what it lacks, the consent before a frame leaves the machine,
and the key's way to the worker."""

import json
import os

import pytest

from core.capture import switchlight_api as service
from core.settings import delighter_cards
from tests.fixtures import standin
from tests.fixtures.drawn import Layout, drawn
from tests.fixtures.switchlight_server import KEY

bpy = pytest.importorskip("bpy")


class Asked:
    """A layout that notes the names of the properties it is given."""

    def __init__(self):
        self.names = []

    def __getattr__(self, name):
        def call(*arguments, **options):
            self.names += arguments[1:2]
            return (self, self) if name == "panel" else self

        return call


@pytest.fixture
def item(addon, capture, monkeypatch):
    """A capture with two selected frames of three, SwitchLight chosen, and Blender online where this one can be."""
    standin.add_evidence(capture)
    monkeypatch.delenv(service.KEY_VARIABLE, raising=False)
    bpy.context.preferences.system.use_online_access = True
    found = addon("captures").active(bpy.context)
    found.delight.delighter = "switchlight"
    addon("status").refresh(bpy.context)
    yield found
    addon("preferences").get().switchlight_key = ""
    bpy.context.preferences.system.use_online_access = False


def words(addon) -> str:
    addon("status").refresh(bpy.context)
    return " ".join(text for text, _ in drawn(addon("reconstruct.panel").WILDCAP_PT_delighter))


@pytest.fixture
def online(item):
    if not bpy.app.online_access:
        pytest.skip("this Blender cannot go online")


def test_every_delighter_shows_its_card_and_its_own_settings_alone(addon, item):
    fields = {name for card in delighter_cards.CARDS.values() for name in card.settings}
    for name in delighter_cards.choices():
        item.delight.delighter = name
        card = delighter_cards.CARDS[name]
        text = words(addon)
        for line in (card.what, card.runs, card.leaves, card.costs, card.shadows, card.weights, card.licence):
            assert "".join(line.split()) in "".join(text.split()), (name, line)
        addon("reconstruct.card").draw(layout := Asked(), item, 300)
        assert fields & set(layout.names) == set(card.settings), name


def test_what_a_delighter_lacks_is_said_beside_it(addon, item):
    card = addon("reconstruct.card")
    assert card.lacks(item, "none") == card.lacks(item, "shading") == []
    assert card.lacks(item, "folder") == ["No folder of delit pictures is chosen."]
    item.delight.folder = "/delit"
    assert card.lacks(item, "folder") == []
    assert "There is no key. Get one at switchlight-api.beeble.ai" in words(addon)
    addon("preferences").get().switchlight_key = KEY
    assert "There is no key" not in words(addon) and KEY not in words(addon)
    bpy.context.preferences.system.use_online_access = False
    assert card.lacks(item, "switchlight") == ["Blender is set to work offline (Preferences, System, Network)."]


def test_nothing_leaves_before_the_artist_agreed_to_these_frames(addon, item, capture, online):
    folder = addon("captures").folder(item)
    assert "2 frames would go to Beeble for 2 credits" in words(addon) and not addon("status").of(item).agreed
    operator = addon("reconstruct.sending").WILDCAP_OT_allow_sending
    told = " ".join(operator.tell(type("Dialog", (), {})()))
    for part in (
        "2 frames",
        "a person's face",
        "Beeble, a company, at sdk.beeble.ai",
        "2 credits",
        "not be used to train",
    ):
        assert part in told
    bpy.ops.wildcap.allow_sending()
    assert "You agreed: 2 frames go to Beeble for 2 credits." in words(addon) and addon("status").of(item).agreed
    assert set(json.loads(folder.consent.read_text())["frames"]) == {"00000.jpg", "00002.jpg"}
    item.delight.switchlight_preview = True
    assert "would go to Beeble for 1 credit." in words(addon), "other pictures come back, at another price"
    item.delight.switchlight_preview = False
    (capture / "frames" / "00000.jpg").write_bytes(standin.plain((1, 2, 3)))
    (capture / "frames" / "frames.json").touch()
    assert "would go" in words(addon)
    bpy.ops.wildcap.allow_sending()
    bpy.ops.wildcap.withdraw_consent()
    assert "would go" in words(addon) and not folder.consent.exists()


def test_the_dialog_shows_the_very_pictures_that_would_be_sent(addon, item, capture, online):
    sending, icons = addon("reconstruct.sending"), addon("frame_icons")
    dialog = type("Dialog", (), {})()
    sending.WILDCAP_OT_allow_sending.tell(dialog)
    assert len(dialog.icons) == len(dialog.sending_plan.frames) == 2
    assert {str(capture / "frames" / name) for name in dialog.sending_plan.frames} <= set(icons._icons)


def test_the_dialog_asks_again_where_the_frames_changed_meanwhile(addon, item, capture, online):
    sending = addon("reconstruct.sending")
    dialog = type("Dialog", (), {})()
    sending.WILDCAP_OT_allow_sending.tell(dialog)
    (capture / "frames" / "00000.jpg").write_bytes(standin.plain((1, 2, 3)))
    with pytest.raises(Exception, match="changed while the question was open"):
        sending.WILDCAP_OT_allow_sending.work(dialog, bpy.context)
    assert not addon("captures").folder(item).consent.exists()


def test_what_cannot_or_need_not_be_agreed_to_is_refused(addon, item, capture):
    bpy.context.preferences.system.use_online_access = False
    with pytest.raises(RuntimeError, match="work offline.*or choose another delighter"):
        bpy.ops.wildcap.allow_sending()
    bpy.context.preferences.system.use_online_access = True
    item.delight.delighter = "none"
    assert not bpy.ops.wildcap.allow_sending.poll()
    item.delight.delighter = "switchlight"
    if not bpy.app.online_access:
        return
    kept = addon("captures").folder(item)
    consent = addon("status").consent
    for content in list(consent.sending(kept, False).frames.values()):
        path = consent.answer(kept, content, False)
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(standin.plain((1, 2, 3)))
    assert "All 2 answers are here. Nothing will be sent or charged." in words(addon)
    with pytest.raises(RuntimeError, match="nothing to send"):
        bpy.ops.wildcap.allow_sending()
    (capture / "frames" / "frames.json").unlink()
    assert "it stops then, and asks" in words(addon)
    with pytest.raises(RuntimeError, match="no frames yet"):
        bpy.ops.wildcap.allow_sending()


def test_the_large_button_asks_for_the_consent_where_the_chain_stopped_for_it(addon):
    next_step, status = addon("next_step"), addon("status")
    before = {
        name: "done" if name in ("frames", "cameras", "scan", "registration") else "to do"
        for name in next_step.BEFORE_MASK
    }
    plan = status.consent.Sending("sdk.beeble.ai", {"00000.jpg": "a"}, 0, False)

    def step(**known):
        found = status.Status(source="face.mp4", stages={**before, "solve": "to do"}, **known)
        return next_step.next_step(next_step.Facts(has_capture=True, has_python=True, status=found))

    assert step().operator == "wildcap.reconstruct"
    assert step(sending=plan).operator == "wildcap.allow_sending" and "Nothing was sent" in step(sending=plan).state
    assert step(sending=plan, agreed=True).operator == "wildcap.reconstruct"
    before["registration"] = "to do"
    assert step(sending=plan).operator == "wildcap.reconstruct", "the head comes first"


def test_the_key_is_told_to_the_worker_of_that_delighter_alone(addon, item, capture, monkeypatch, tmp_path):
    preferences, jobs = addon("preferences"), addon("jobs")
    preferences.get().switchlight_key = KEY
    assert preferences.get().bl_rna.properties["switchlight_key"].subtype == 'PASSWORD'
    started = []
    monkeypatch.setattr(jobs, "Worker", lambda *arguments: started.append(arguments))
    monkeypatch.setattr(jobs, "start_worker", lambda root, goal, worker, then: jobs.Job(goal, worker, then))
    monkeypatch.setattr(preferences, "python", lambda: tmp_path / "python")
    jobs.start(item, "reconstruct")
    offline = {} if bpy.app.online_access else {service.OFFLINE_VARIABLE: "1"}
    assert started[-1][4] == {service.KEY_VARIABLE: KEY, **offline}
    monkeypatch.setenv(service.KEY_VARIABLE, "the machine's own")
    jobs.start(item, "reconstruct")
    assert started[-1][4] == {service.KEY_VARIABLE: "the machine's own", **offline}, (
        "what the machine is set up with comes first"
    )
    found: list = []
    preferences.draw_key(Layout(found), "Key")
    assert "WILDCAP_SWITCHLIGHT_KEY" in found[0][0]
    item.delight.delighter = "shading"
    jobs.start(item, "reconstruct")
    assert started[-1][4] == {}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "face.blend"), compress=False)
    left = [path for path in (*capture.rglob("*"), tmp_path / "face.blend") if path.is_file()]
    assert any(path.name == "job.json" for path in left)
    assert not [path for path in left if KEY.encode() in path.read_bytes()]
    assert KEY not in os.environ.values()
