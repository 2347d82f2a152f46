# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What comes with WildCap is as it was shipped, or is named: by the doctor, and by whoever needs it. And errors that
nobody foresaw have an id."""

import importlib
import os
import shutil
from pathlib import Path

import pytest

from core.__main__ import main
from core.capture import shipped_files, unforeseen
from core.capture.messages import Problem
from core.face import faces, template
from core.stages.solve import prior_files
from core.stages.upscale import enlarge, whole_head
from core.worker import doctor
from research.training import manifest
from tests.fixtures.refused import refuses

network = importlib.import_module("core.stages.delight.network")  # the room has a function of that name


@pytest.fixture
def core(tmp_path, monkeypatch) -> Path:
    """Links to the shipped files, in the place of ours."""
    for folder in manifest.FOLDERS:
        shutil.copytree(shipped_files.CORE / folder, tmp_path / "core" / folder, copy_function=os.symlink)
    monkeypatch.setattr(shipped_files, "CORE", tmp_path / "core")
    return tmp_path / "core"


def rewrite(path: Path, change=lambda content: content[:-1]) -> Path:
    """Puts a file with other content in the place of a link; by default one that is cut."""
    content = path.read_bytes()
    path.unlink()
    path.write_bytes(change(content))
    return path


def test_the_manifest_is_that_of_the_files():
    assert shipped_files.read_manifest() == manifest.make_manifest(), "run `python -m research.training.manifest`"


def test_every_shipped_file_that_is_cut_changed_or_gone_is_named(core):
    """One in three of each."""
    damages = {}
    for i, name in enumerate(shipped_files.read_manifest()["core"]):
        path = core / name
        if i % 3 == 0:
            path.unlink()
        else:
            rewrite(path, (lambda c: c[: len(c) // 2]) if i % 3 == 1 else (lambda c: c[:-1] + bytes([c[-1] ^ 1])))
        damages[path] = "damaged" if i % 3 else "missing"
        with pytest.raises(Problem, match=damages[path]) as refusal:
            shipped_files.require_whole(path)
        assert str(path) in refusal.value.problem and refusal.value.remedy == shipped_files.AGAIN
    faults = shipped_files.find_faults(core)
    assert len(faults) == len(damages)
    assert all(
        str(path) in fault and word in fault for fault, (path, word) in zip(faults, damages.items(), strict=True)
    )
    (core / "head.obj").write_text("somebody else's")
    shipped_files.require_whole(core / "head.obj")


def test_line_ends_of_a_checkout_are_no_damage(core):
    rewrite(core / "weights" / "prior.json", lambda content: content.replace(b"\n", b"\r\n"))
    assert shipped_files.find_faults(core) == []


@pytest.mark.parametrize(
    ("module", "name", "load"),
    [
        (network, "delighter", lambda path: network.load_network("cpu")),
        (enlarge, "upscaler", enlarge.load_network),
        (prior_files, "prior", prior_files._load_ours),
        (whole_head, "prior", lambda path: whole_head.usual_skin(8)),
    ],
)
def test_damaged_weights_are_named_by_what_needs_them(core, monkeypatch, module, name, load):
    path = rewrite(core / "weights" / f"{name}.safetensors", lambda content: content[:100_000])
    for constant in ("WEIGHTS", "MEAN_FACE"):
        monkeypatch.setattr(module, constant, path, raising=False)
    refuses(f"{path.name} is damaged", load, path)


def test_a_damaged_head_is_named(core, monkeypatch):
    monkeypatch.setattr(template, "ASSETS", core / "assets")
    rewrite(core / "assets" / "head.obj")
    refuses("head.obj is damaged", template.load.__wrapped__)


def test_damaged_face_nets_are_named(core):
    path = rewrite(core / faces.DATA_FILES[1])
    refuses("is damaged", faces._net.__wrapped__, path)


def test_the_doctor_names_a_cut_network(monkeypatch, capsys, tmp_path):
    faults = ["/x/prior.safetensors is damaged: it is not as it was shipped."]
    versions = doctor.environment.required(shipped_files.CORE.parent / "requirements")
    answer = {"python": (3, 11), "versions": versions, "opencv": [], "errors": {}, "device": "cpu", "reason": ""}
    monkeypatch.setattr(doctor.environment, "survey", lambda *_: answer)
    assert main(["doctor"]) == 0 and "Nothing is missing." in capsys.readouterr().out
    monkeypatch.setattr(doctor.shipped_files, "find_faults", lambda core: faults)
    assert main(["doctor"]) == 2
    said = capsys.readouterr().out
    assert faults[0] in said and shipped_files.AGAIN in said and "Nothing is missing" not in said


def test_the_same_fault_has_the_same_id_and_its_traceback_is_in_the_log_alone(tmp_path, capsys, monkeypatch):
    def fail(text):
        raise ValueError(text)

    said = []
    for number in (1, 2):
        try:
            fail(f"no. {number}")
        except ValueError as error:
            said.append(unforeseen.explain(error, "the trial", tmp_path / "logs" / "trial.log"))
            said.append(unforeseen.identify(error))
    assert said[1] == said[3] and said[1] in said[0].problem and "no. 2" in said[2].problem
    log = (tmp_path / "logs" / "trial.log").read_text()
    assert (
        log.count(said[1]) == 2
        and "Traceback" in log
        and "Traceback" not in str(said[0])
        and "What was finished is kept" in said[0].remedy
    )
    monkeypatch.setattr("core.__main__.stages.STAGES", None)
    assert main(["stages"]) == 2
    told = capsys.readouterr().err
    assert "Traceback" not in told and "WC-" in told and len(told.splitlines()) == 2
