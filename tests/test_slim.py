# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Slimming a face: what goes counts as there, comes back as it was when a stage needs it, and nothing that could not
come back goes."""

import shutil
from pathlib import Path

import pytest

from core.contract import freshness, mask_edit, slimmed, slimming, stages
from core.contract.capture import Capture
from core.contract.files import write_json
from core.contract.messages import Cancelled, Done, Failed, Log, Problem, StageDone
from core.contract.settings import Settings, from_json
from core.worker import runner
from core.worker.job import write_job

from . import finished_face, kept_capture
from .finished_face import pictures, states
from .tiny_chain import follow, start

KEPT = (
    "cameras/a.txt",
    "scan.ply",
    "head.obj",
    "landmarks.json",
    "texture.png",
    "shadow_mask_auto.png",
    "maps/normal.png",
    "maps_4k/normal.png",
    "delivery/a.txt",
    "report.html",
)


@pytest.fixture(scope="module")
def root(tmp_path_factory) -> Path:
    return finished_face.build(tmp_path_factory.mktemp("slim"))


@pytest.fixture(scope="module")
def finished(root, tmp_path_factory) -> Path:
    return finished_face.make(root, tmp_path_factory.mktemp("finished"))


@pytest.fixture
def capture(finished, tmp_path, root, monkeypatch) -> Capture:
    return finished_face.copy(finished, tmp_path / "batch", root, monkeypatch)


def ran(messages) -> list[str]:
    return [message.stage for message in messages if isinstance(message, StageDone) and not message.skipped]


def test_frames_and_delit_frames_go_and_every_stage_stays_done(root, capture):
    before, record = kept_capture.contents(capture.root), capture.read()
    found = slimming.plan(capture, Settings())
    assert set(found.going) == {"frames/a.txt", "delit/a.txt"} and kept_capture.contents(capture.root) == before, (
        "a plan changes nothing"
    )
    assert slimming.slim(capture, Settings()) == found and found.notes == ()
    after = kept_capture.contents(capture.root)
    assert before.keys() - after.keys() == set(found.going) and not capture.frames.exists()
    assert set(KEPT) <= after.keys() and all(after[name] == before[name] for name in after if name != "capture.json")
    assert states(capture) == {"done"}
    finished = {name: entry["finished"] for name, entry in capture.read()["stages"].items()}
    assert finished == {name: entry["finished"] for name, entry in record["stages"].items()}
    messages = follow(start(root, capture))
    assert ran(messages) == [] and isinstance(messages[-1], Done), "a run finds nothing to do"
    assert not capture.frames.exists()


def test_what_a_stage_needs_comes_back_first_and_as_it_was_so_the_others_stay_done(root, capture):
    before, record = pictures(capture), capture.read()["stages"]
    slimming.slim(capture, Settings())
    capture.shadow_mask.write_text("painted")
    messages = follow(start(root, capture))
    assert ran(messages) == ["frames", "delight", "solve"]
    assert any(isinstance(m, Log) and m.text == "Delight: slimmed away, and made again for Solve." for m in messages)
    assert pictures(capture) == before and slimmed.hashes_of(capture.read()) == {}
    assert all(capture.read()["stages"][name] == record[name] for name in stages.NAMES[:7]), "as if they had never gone"
    assert states(capture) == {"done"}


def test_only_what_is_needed_comes_back(root, capture):
    slimming.slim(capture, Settings())
    assert ran(follow(start(root, capture, first="registration", last="registration"))) == ["frames", "registration"]
    assert set(slimmed.hashes_of(capture.read())) == {"delit/"} and states(capture) == {"done"}
    assert ran(follow(start(root, capture, first="upscale", last="upscale"))) == ["upscale"]


def test_a_stage_begun_anew_forgets_what_it_had_lost(root, capture):
    slimming.slim(capture, Settings())
    assert ran(follow(start(root, capture, first="delight"))) == ["frames", "delight", *stages.NAMES[5:]]
    assert slimmed.hashes_of(capture.read()) == {} and states(capture) == {"done"}


def test_it_comes_back_with_the_settings_that_it_was_made_with(root, capture, monkeypatch):
    chosen = {}
    slimming.slim(capture, Settings())
    monkeypatch.setattr(
        runner,
        "_room",
        lambda step: type(
            "Room",
            (),
            {
                "run": staticmethod(
                    lambda capture, settings, report: (
                        chosen.update({step.name: settings}) or write_pictures(capture, step)
                    )
                )
            },
        ),
    )
    path = write_job(capture, first="solve", last="solve", settings={"frames": {"views": 5}, "seed": 3})
    runner.run_job(path)
    assert chosen["frames"].frames.views == Settings().frames.views and chosen["delight"].seed == Settings().seed
    assert chosen["solve"].seed == 3


def write_pictures(capture: Capture, step: stages.Stage) -> None:
    for name in step.writes:
        path = capture.root / name / "a.txt" if name.endswith("/") else capture.root / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("by other code")


def test_where_something_else_comes_back_it_is_said_and_what_was_made_of_it_is_out_of_date(capture, monkeypatch):
    slimming.slim(capture, Settings())
    said = []
    monkeypatch.setattr(
        runner,
        "_room",
        lambda step: type("Room", (), {"run": staticmethod(lambda capture, *_: write_pictures(capture, step))}),
    )
    assert isinstance(runner.run_job(write_job(capture, first="texture", last="texture"), said.append), Done)
    assert [
        m.text
        for m in said
        if isinstance(m, Log) and "not what they were before" in m.text and m.text.startswith("Frames")
    ]
    assert capture.verdict(stages.by_name("cameras"), Settings()).reason() == "frames/ changed"
    assert slimmed.hashes_of(capture.read()) == {} and capture.state(stages.by_name("frames"), Settings()) == "done"


@pytest.mark.parametrize("moment", [0, 1])
def test_killed_in_the_middle_nothing_is_lost_and_it_can_be_asked_for_again(root, capture, monkeypatch, moment):
    before = pictures(capture)
    unlink, left = Path.unlink, iter(range(moment))

    def counted(path, *arguments, **options):
        if path.name == "a.txt" and next(left, None) is None:
            raise KeyboardInterrupt
        unlink(path, *arguments, **options)

    monkeypatch.setattr(Path, "unlink", counted)
    with pytest.raises(KeyboardInterrupt):
        slimming.slim(capture, Settings())
    monkeypatch.setattr(Path, "unlink", unlink)
    assert len(pictures(capture)) == 2 - moment and states(capture) == {"done"}
    again = Capture(shutil.copytree(capture.root, capture.root.with_name("again.wildcap")))
    slimming.slim(again, Settings())
    assert pictures(again) == {} and states(again) == {"done"}
    assert ran(follow(start(root, capture, tool="bring_back"))) == ["frames"] * moment + ["bring_back"], (
        "what is there is not made again"
    )
    assert pictures(capture) == before and states(capture) == {"done"}


def test_cancelled_killed_or_failed_while_it_comes_back_it_still_counts_as_slimmed(root, capture):
    slimming.slim(capture, Settings())
    worker = start(root, capture, {"frames": "slow"}, first="solve", last="solve")
    follow(worker, lambda message: getattr(message, "text", "") == "half written")
    worker.cancel()
    assert isinstance(follow(worker)[-1], Cancelled)
    assert {"frames/", "delit/"} == set(slimmed.hashes_of(capture.read()))
    assert isinstance(follow(start(root, capture, {"frames": "die"}, first="solve", last="solve"))[-1], Failed)
    assert {"frames/", "delit/"} == set(slimmed.hashes_of(capture.read()))
    failed = follow(start(root, capture, {"delight": "full"}, first="solve", last="solve"))[-1]
    assert isinstance(failed, Failed) and "disk is full" in failed.problem
    assert set(slimmed.hashes_of(capture.read())) == {"delit/"}, "the frames are back"
    follow(start(root, capture))
    assert states(capture) == {"done"}


def test_without_its_video_a_face_is_not_slimmed_and_of_a_slim_one_nothing_is_changed(root, capture):
    film = capture.root.parent / "film.mp4"
    film.rename(film.with_name("away.mp4"))
    with pytest.raises(Problem, match="not there any more"):
        slimming.slim(capture, Settings())
    assert len(pictures(capture)) == 2
    film.with_name("away.mp4").rename(film)
    slimming.slim(capture, Settings())
    film.rename(film.with_name("away.mp4"))
    stages_before = capture.read()["stages"]
    assert isinstance(follow(start(root, capture))[-1], Done), "nothing needs it"
    final = follow(start(root, capture, first="solve"))[-1]
    assert isinstance(final, Failed) and "film.mp4 is not there any more" in final.problem
    assert "core run VIDEO" in final.remedy
    assert capture.read()["stages"] == stages_before and states(capture) == {"done"}
    assert capture.read()["stopped"]["stage"] == "solve"
    film.write_bytes(b"another film altogether")
    with pytest.raises(Problem, match="not the video"):
        capture.require_source()
    moved = film.with_name("away.mp4")
    assert isinstance(follow(start(root, capture, source=moved))[-1], Done), "told where it is now, nothing has to run"
    assert ran(follow(start(root, capture, first="solve", last="solve"))) == ["frames", "delight", "solve"]


def test_an_unfinished_a_strange_and_a_busy_face_are_refused(root, capture, tmp_path):
    with pytest.raises(Problem, match="There is no capture"):
        slimming.slim(Capture(tmp_path / "nothing"), Settings())
    assert not (tmp_path / "nothing").exists()
    with pytest.raises(Problem, match="the stage Solve is out of date: solve.steps changed") as caught:
        slimming.slim(capture, from_json({"solve": {"steps": 7}}))
    assert "core run -" in caught.value.remedy
    with capture.locked(), pytest.raises(Problem, match="is working on this capture"):
        slimming.slim(Capture(capture.root), Settings())
    (capture.root / "maps" / "normal.png").unlink()
    with pytest.raises(Problem, match="the stage Solve is still to do"):
        slimming.slim(capture, Settings())
    assert len(pictures(capture)) == 2


def test_what_could_not_come_back_as_it_is_stays_and_is_named(capture, monkeypatch):
    (capture.frames / "a.txt").write_text("retouched")
    (capture.delit / "notes.txt").write_text("mine")
    for name, entry in (record := capture.read())["stages"].items():  # as if all had been made from them
        entry["inputs"] = capture.conditions(stages.by_name(name), Settings())["inputs"]
    write_json(capture.json, record)
    found = slimming.slim(capture, Settings())
    assert found.going == {}
    assert found.notes == (
        "frames/ stays: frames/a.txt is not as WildCap wrote it.",
        "delit/ stays: delit/notes.txt is not as WildCap wrote it.",
    )
    assert (capture.frames / "a.txt").read_text() == "retouched" and "slimmed" not in capture.json.read_text()


@pytest.mark.parametrize(("delighter", "why"), [("switchlight", "paid for"), ("folder", "outside of the capture")])
def test_delit_frames_that_came_from_elsewhere_stay(capture, tmp_path, delighter, why):
    (tmp_path / "pictures").mkdir()
    settings = from_json(
        {"delight": {"delighter": delighter, "folder": str(tmp_path / "pictures") if delighter == "folder" else ""}}
    )
    delight = stages.by_name("delight")
    capture.finish(delight, capture.conditions(delight, settings), 1.0, settings, {}, "0.2.0")
    found = slimming.slim(capture, settings)
    assert (
        set(found.going) == {"frames/a.txt"}
        and why in found.notes[0]
        and states(capture) <= {"done", "stale"}
        and capture.delit.is_dir()
    )


def test_a_solve_of_an_edited_part_still_knows_what_it_goes_on_from(capture):
    before = mask_edit.conditions(capture, Settings())
    slimming.slim(capture, Settings())
    assert mask_edit.conditions(capture, Settings()) == before


def test_made_by_older_code_it_goes_and_that_is_said(capture, monkeypatch):
    monkeypatch.setattr(freshness, "code_key", lambda module: "another version's")
    found = slimming.slim(capture, Settings())
    assert (
        len(found.going) == 2
        and found.notes[0].startswith("Made by older code: Frames, Delight.")
        and states(capture) == {"older"}
    )


def test_an_older_version_sees_stages_to_do_and_the_next_one_is_not_misled_by_what_it_did(capture):
    """0.2.0 read no 'slimmed': it had the stage run, which replaces the stage's whole entry."""
    slimming.slim(capture, Settings())
    frames = stages.by_name("frames")
    capture.forget(["frames"])
    kept_capture.make_frames(capture, "a.txt", text="by the older version")
    capture.finish(frames, capture.conditions(frames, Settings()), 1.0, Settings(), {}, "0.2.0")
    assert set(slimmed.hashes_of(capture.read())) == {"delit/"}
    assert capture.verdict(stages.by_name("cameras"), Settings()).reason() == "frames/ changed"


@pytest.mark.parametrize("wrong", [[], {"frames/": 1}, {"frames/": {"a.jpg": None}}])
def test_a_record_whose_hashes_are_none_is_refused(capture, wrong):
    record = capture.read()
    record["stages"]["frames"]["slimmed"] = wrong
    write_json(capture.json, record)
    with pytest.raises(Problem, match="its stages.frames makes no sense"):
        capture.read()
