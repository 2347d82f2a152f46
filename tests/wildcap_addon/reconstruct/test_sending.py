# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The choice of the delighter in Blender: its card and what it lacks, the consent before a frame leaves the machine,
and the key's way to the worker."""

import json
import os
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from core.capture import switchlight_api as service
from core.settings import delighter_cards
from tests.fixtures import standin
from tests.fixtures.drawn import Layout, drawn
from tests.fixtures.refused import refuses
from tests.fixtures.switchlight_server import KEY

bpy = pytest.importorskip("bpy")


@pytest.fixture
def item(item, addon, capture, monkeypatch):
    """A capture with two selected frames of three, SwitchLight chosen, and Blender online where this one can be."""
    standin.add_evidence(capture)
    monkeypatch.delenv(service.KEY_VARIABLE, raising=False)
    bpy.context.preferences.system.use_online_access = True
    item.delight.delighter = "switchlight"
    addon("status").refresh(bpy.context)
    yield item
    addon("preferences").get().switchlight_key = ""
    bpy.context.preferences.system.use_online_access = False


@pytest.fixture
def online(item):
    if not bpy.app.online_access:
        pytest.skip("this Blender cannot go online")


@pytest.fixture
def words(addon):
    """Function that tells all that the panel says."""

    def words() -> str:
        addon("status").refresh(bpy.context)
        return " ".join(text for text, _ in drawn(addon("reconstruct.panel").WILDCAP_PT_delighter))

    return words


@pytest.fixture
def dialog(addon, item, online):
    """The question as it stands on the screen, and what it says."""
    dialog = SimpleNamespace()
    dialog.lines = " ".join(addon("reconstruct.sending").WILDCAP_OT_allow_sending.tell(dialog))
    return dialog


def test_every_delighter_shows_its_card_and_its_own_settings_alone(addon, item, words):
    fields = {name for card in delighter_cards.CARDS.values() for name in card.settings}
    for name in delighter_cards.choices():
        item.delight.delighter, card = name, delighter_cards.CARDS[name]
        text = "".join(words().split())
        for line in (card.what, card.runs, card.leaves, card.costs, card.shadows, card.weights, card.licence):
            assert "".join(line.split()) in text, (name, line)
        addon("reconstruct.card").draw(layout := Layout(), item, 300)
        assert fields & set(layout.arguments("prop", 1)) == set(card.settings), name


def test_what_a_delighter_lacks_is_said_beside_it(addon, item, words):
    lacks = addon("reconstruct.card").lacks
    assert lacks(item, "none") == lacks(item, "shading") == []
    assert lacks(item, "folder") == ["No folder of delit pictures is chosen."]
    item.delight.folder = "/delit"
    assert lacks(item, "folder") == []
    assert "There is no key. Get one at switchlight-api.beeble.ai" in words()
    addon("preferences").get().switchlight_key = KEY
    assert "There is no key" not in words() and KEY not in words()
    bpy.context.preferences.system.use_online_access = False
    assert len(lacks(item, "switchlight")) == 1 and "offline" in lacks(item, "switchlight")[0]


def test_nothing_leaves_before_the_artist_agreed_to_these_frames(addon, item, capture, dialog, words):
    folder, status, click = addon("captures").folder(item), addon("status"), bpy.ops.wildcap
    assert "2 frames would go to Beeble for 2 credits" in words() and not status.of(item).agreed
    for part in ("2 frames", "Beeble, a company, at sdk.beeble.ai", "2 credits"):
        assert part in dialog.lines
    click.allow_sending()
    assert "You agreed: 2 frames" in words() and status.of(item).agreed
    assert set(json.loads(folder.consent.read_text())["frames"]) == {"00000.jpg", "00002.jpg"}
    item.delight.switchlight_preview = True
    assert "would go to Beeble for 1 credit." in words(), "other pictures come back, at another price"
    item.delight.switchlight_preview = False
    (capture / "frames" / "00000.jpg").write_bytes(standin.plain((1, 2, 3)))
    (capture / "frames" / "frames.json").touch()
    assert "would go" in words()
    click.allow_sending()
    click.withdraw_consent()
    assert "would go" in words() and not folder.consent.exists()


def test_the_dialog_shows_the_very_pictures_and_asks_again_where_they_changed_meanwhile(addon, item, capture, dialog):
    frames = dialog.sending_plan.frames
    assert len(dialog.icons) == len(frames) == 2
    assert {str(capture / "frames" / name) for name in frames} <= set(addon("frame_icons")._icons)
    (capture / "frames" / "00000.jpg").write_bytes(standin.plain((1, 2, 3)))
    work = addon("reconstruct.sending").WILDCAP_OT_allow_sending.work
    refuses("changed while the question was open", work, dialog, bpy.context)
    assert not addon("captures").folder(item).consent.exists()


def test_what_cannot_or_need_not_be_agreed_to_is_refused(addon, item, capture, words):
    allow, consent = bpy.ops.wildcap.allow_sending, addon("status").consent
    bpy.context.preferences.system.use_online_access = False
    refuses("work offline.*or choose another delighter", allow)
    bpy.context.preferences.system.use_online_access = True
    item.delight.delighter = "none"
    assert not allow.poll()
    item.delight.delighter = "switchlight"
    if not bpy.app.online_access:
        return
    kept = addon("captures").folder(item)
    for content in list(consent.sending(kept, False).frames.values()):
        path = consent.answer(kept, content, False)
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(standin.plain((1, 2, 3)))
    assert "All 2 answers are here" in words()
    refuses("nothing to send", allow)
    (capture / "frames" / "frames.json").unlink()
    assert "it stops then, and asks" in words()
    refuses("no frames to send yet", allow)


def test_the_key_is_told_to_the_worker_of_that_delighter_alone(addon, item, capture, monkeypatch, tmp_path):
    preferences, jobs = addon("preferences"), addon("jobs")
    preferences.get().switchlight_key = KEY
    assert preferences.get().bl_rna.properties["switchlight_key"].subtype == 'PASSWORD'
    monkeypatch.setattr(jobs, "Worker", worker := Mock())
    monkeypatch.setattr(jobs, "start_worker", Mock())
    monkeypatch.setattr(preferences, "python", lambda: tmp_path / "python")

    def environment() -> dict:
        jobs.start(item, "reconstruct")
        return worker.call_args.args[4]

    offline = {} if bpy.app.online_access else {service.OFFLINE_VARIABLE: "1"}
    assert environment() == {service.KEY_VARIABLE: KEY, **offline}
    monkeypatch.setenv(service.KEY_VARIABLE, "the machine's own")
    assert environment() == {service.KEY_VARIABLE: "the machine's own", **offline}, "that comes first"
    preferences.draw_key(layout := Layout(), "Key")
    assert service.KEY_VARIABLE in layout.texts[0][0]
    item.delight.delighter = "shading"
    assert environment() == {}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "face.blend"), compress=False)
    left = [path for path in (*capture.rglob("*"), tmp_path / "face.blend") if path.is_file()]
    assert any(path.name == "job.json" for path in left) and KEY not in os.environ.values()
    assert not [path for path in left if KEY.encode() in path.read_bytes()]
