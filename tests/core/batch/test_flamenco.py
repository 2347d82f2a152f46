# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Flamenco's job type, run by Duktape, an engine of ES5.1, against stand-ins for the functions that Flamenco documents;
its commands, run for real.

What the Manager does with variables is played by `submitted` and `sent`: in the settings, a two-way variable's path
becomes its name; in each argument, names become the worker's values. The Manager itself is not run.
"""

import json
import re
import subprocess
import sys
from itertools import pairwise

import dukpy
import pytest

from core.batch.gate import accept_mask
from core.batch.groups import GATE, GROUPS
from core.batch.lines import PARTS
from core.batch.record import read_batch
from core.capture.capture import Capture
from tests.conftest import ROOT
from tests.fixtures.tiny_batch import core, set_mood

SCRIPT = (ROOT / "farm" / "flamenco" / "wildcap.js").read_text(encoding="utf-8")
STAND_INS = """
var made = [];
function need(text, name) { if (typeof text !== "string" || text.trim() === "") { throw new Error(name + " is required"); } return text.trim(); }
var author = {
    Task: function (name, type) {
        var task = {name: need(name, "name"), type: need(type, "type"), commands: [], after: []};
        task.addCommand = function (command) { task.commands.push(command); };
        task.addDependency = function (other) { task.after.push(other.name); };
        return task;
    },
    Command: function (name, parameters) { return {name: need(name, "name"), parameters: parameters}; }
};
var job = {name: "faces", settings: dukpy["settings"], addTask: function (task) { made.push(JSON.parse(JSON.stringify(task))); }};
"""
GIVEN = {"batch": "{shots}/batch", "faces": "Anna"}


def compiled(**settings) -> list[dict]:
    """The tasks that the job type makes of these settings; those that are None are left out."""
    known = {key: value for key, value in {**GIVEN, **settings}.items() if value is not None}
    return dukpy.evaljs([STAND_INS, SCRIPT, "compileJob(job); made"], settings=known)


def test_a_face_is_the_chain_of_the_batchs_tasks():
    assert not re.search(r"\bconst\b", SCRIPT), "the one word newer than ES5 that this engine takes"
    made = compiled(gpu_task_type="cuda", task_type="")
    assert [task["name"] for task in made] == [f"Anna.{group.name}" for group in GROUPS]
    assert [task["type"] for task in made] == ["cuda" if group.on_device else "misc" for group in GROUPS]
    assert made[0]["after"] == [] and all(task["after"] == [before["name"]] for before, task in pairwise(made))
    for task, group in zip(made, GROUPS, strict=True):
        assert task["commands"] == [
            {
                "name": "exec",
                "parameters": {
                    "exe": "{wildcap_python}",
                    "args": ["{wildcap}", "batch", "task", "{shots}/batch", "Anna", group.name],
                },
            }
        ]


def test_faces_do_not_wait_for_each_other_and_the_gate_parts_the_chain():
    names = [group.name for group in GROUPS]
    gate = names.index(GATE)
    for part, asked in zip(PARTS, (names, names[:gate], names[gate:]), strict=True):
        made = compiled(faces="Anna/Bert", part=part)
        assert [task["name"] for task in made] == [f"{face}.{name}" for face in ("Anna", "Bert") for name in asked]
        assert [task["name"] for task in made if not task["after"]] == [f"Anna.{asked[0]}", f"Bert.{asked[0]}"]
        assert all(
            other.partition(".")[0] == task["name"].partition(".")[0] for task in made for other in task["after"]
        )


@pytest.mark.parametrize("name", ["Zoë d'Arc", 'the "tall" one', "Smith, John", " blank ", "a;b & c $HOME", "脸"])
def test_names_and_paths_reach_the_command_as_they_are(name):
    args = compiled(faces=f"Anna/{name}", batch=f"S:\\new shots\\{name}")[-1]["commands"][0]["parameters"]["args"]
    assert args[3:] == [f"S:\\new shots\\{name}", name, "deliver"]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"faces": None}, "setting faces is empty"),
        ({"faces": "  "}, "setting faces is empty"),
        ({"faces": "Anna//Bert"}, "no face's name"),
        ({"faces": "Anna/ /Bert"}, "no face's name"),
        ({"faces": "--help"}, "no face's name"),
        ({"faces": "shots\\Anna"}, "no face's name"),
        ({"faces": "Anna\nBert"}, "no face's name"),
        ({"faces": "Anna/Bert/Anna"}, "names Anna twice"),
        ({"faces": 7}, "no text"),
        ({"batch": None}, "setting batch is empty"),
        ({"part": "half"}, "all, to the masks, from the masks"),
    ],
)
def test_settings_that_make_no_sense_are_refused_with_a_sentence(settings, words):
    with pytest.raises(dukpy.JSRuntimeError, match=re.escape(words)):
        compiled(**settings)


def submitted(job: dict, variables: dict[str, tuple[str, str]]) -> list[dict]:
    """The tasks of a job as the Manager keeps them; `variables` are the two-way ones: name -> the path on the
    submitter's platform and on the worker's."""
    settings = {}
    for key, value in job["settings"].items():
        for name, (here, _) in variables.items():
            value = f"{{{name}}}{value[len(here) :]}" if value.startswith(here) else value
        settings[key] = value
    return compiled(**{key: None for key in GIVEN} | settings)


def sent(argument: str, values: dict[str, str]) -> str:
    """What the worker gets of an argument."""
    for name, value in values.items():
        argument = argument.replace(f"{{{name}}}", value)
    return argument


def test_the_commands_do_the_work_on_a_machine_that_sees_the_storage_elsewhere(code, tmp_path):
    """Two faces, one of which stops and fails its own job alone, up to its mask and from there to the end."""
    storage, seen = tmp_path / "st örage", tmp_path / "vol"
    (storage / "films").mkdir(parents=True)
    for name in ("Zoë d'Arc", "Anna"):
        (storage / "films" / f"{name}.mp4").write_text(name, encoding="utf-8")
    core(code, "batch", "plan", storage / "films", storage / "batch", "--gate", "artist")
    for face in read_batch(storage / "batch").faces:
        set_mood(face.capture, {"frames": "finding"} if face.name == "Anna" else {})
    values = {"wildcap_python": sys.executable, "wildcap": str(code), "shots": str(seen)}

    def list_jobs() -> list[dict]:
        listed = core(code, "batch", "commands", storage / "batch", "--flamenco")
        assert listed.returncode == 0, listed.stderr
        return [json.loads(line) for line in listed.stdout.splitlines()]

    def work(job: dict) -> list[tuple[str, int]]:
        """Does the tasks on the other machine, where the submitter's paths lead nowhere, until one fails."""
        ended: dict[str, int] = {}
        storage.rename(seen)
        for task in submitted(job, {"shots": (str(storage), str(seen))}):
            assert all(ended[other] == 0 for other in task["after"])
            parameters = task["commands"][0]["parameters"]
            words = [sent(word, values) for word in (parameters["exe"], *parameters["args"])]
            done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
            ended[task["name"]] = done.returncode
            if done.returncode:
                assert "The face is not there.\nFilm it." in done.stderr
                break
        seen.rename(storage)
        return list(ended.items())

    jobs = list_jobs()
    assert [(job["type"], job["settings"]["part"]) for job in jobs] == [("wildcap", "to the masks")] * 2
    assert work(jobs[0]) == [("Anna.head", 2)]
    assert work(jobs[1]) == [("Zoë d'Arc.head", 0), ("Zoë d'Arc.mask", 0)]
    accept_mask(Capture(storage / "batch" / "Zoë d'Arc.wildcap"))
    again, job = list_jobs()
    assert again == jobs[0] and job["settings"].items() >= {"faces": "Zoë d'Arc", "part": "from the masks"}.items()
    assert work(job) == [("Zoë d'Arc.solve", 0), ("Zoë d'Arc.deliver", 0)]
    assert list_jobs() == [again]
