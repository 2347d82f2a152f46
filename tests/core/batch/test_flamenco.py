# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Flamenco's job type, run by Duktape, an engine of ES5.1, against stand-ins for the functions that Flamenco documents.
The Manager itself is not run."""

import json
import re
from itertools import pairwise

import dukpy
import pytest

from core.batch.gate import accept_mask
from core.batch.groups import GATE, GROUPS
from core.batch.lines import PARTS
from tests.conftest import ROOT
from tests.fixtures.tiny_batch import core, finish, make

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


def test_a_batch_is_a_job_for_each_face_up_to_its_mask_and_from_there(code, tmp_path):
    batch = make(tmp_path, "ab", None, "--gate", "artist")

    def list_jobs() -> list[dict]:
        listed = core(code, "batch", "commands", batch.root, "--flamenco")
        assert listed.returncode == 0, listed.stderr
        return [json.loads(line) for line in listed.stdout.splitlines()]

    jobs = list_jobs()
    assert [(job["type"], job["settings"]["part"]) for job in jobs] == [("wildcap", "to the masks")] * 2
    assert jobs[0]["settings"]["batch"] == str(batch.root)
    finish(batch.face("a"), "shadow_mask")
    assert list_jobs() == [jobs[1]], "its mask waits"
    accept_mask(batch.face("a").capture)
    job, other = list_jobs()
    assert other == jobs[1] and job["settings"].items() >= {"faces": "a", "part": "from the masks"}.items()
    assert [task["name"] for task in compiled(**job["settings"])] == ["a.solve", "a.deliver"]
