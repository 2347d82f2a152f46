# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Flamenco's job type, run by Duktape, an engine of ES5.1, against stand-ins for the functions that Flamenco documents;
its commands, run for real.

What the Manager does with variables is played by `submitted` and `sent`: in the settings, a two-way variable's path
becomes its name; in each argument, names become the worker's values. The Manager itself is not run.
"""

import json
import re
import shlex
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import dukpy
import pytest

from core.batch.gate import accept_mask
from core.batch.groups import GATE, GROUPS
from core.batch.lines import PARTS
from core.batch.record import read_batch
from core.capture.capture import Capture
from tests.conftest import ROOT
from tests.fixtures import tiny_chain

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


def test_the_job_type_is_es5_and_uses_what_is_documented_alone():
    for newer in (
        "let a = 1;",
        "var f = (x) => x;",
        "var a = `b`;",
        "for (var a of []) {}",
        "class A {}",
        "var {a} = {};",
        "compileJob(job); path.join('a')",
    ):
        with pytest.raises(dukpy.JSRuntimeError):  # what this engine does not know would be found
            dukpy.evaljs([STAND_INS, SCRIPT + newer], settings=GIVEN)
    assert not re.search(r"\bconst\b", SCRIPT), "the one newer word that this engine takes"
    compiled()


def test_the_settings_are_what_flamenco_can_show():
    label, settings = dukpy.evaljs([STAND_INS, SCRIPT, "[JOB_TYPE.label, JOB_TYPE.settings]"], settings={})
    assert label and len({setting["key"] for setting in settings}) == len(settings)
    for setting in settings:
        assert setting["type"] == "string" and setting["description"]
        assert set(setting) <= {"key", "type", "subtype", "required", "choices", "default", "description"}
        assert setting.get("required", False) != ("default" in setting)
    assert [setting["choices"] for setting in settings if "choices" in setting] == [list(PARTS)]


def test_a_face_is_the_chain_of_the_batchs_tasks():
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
        ({"faces": ""}, "setting faces is empty"),
        ({"faces": "  "}, "setting faces is empty"),
        ({"faces": "/"}, "no face's name"),
        ({"faces": "Anna//Bert"}, "no face's name"),
        ({"faces": "Anna/ /Bert"}, "no face's name"),
        ({"faces": "--help"}, "no face's name"),
        ({"faces": "shots\\Anna"}, "no face's name"),
        ({"faces": "Anna\nBert"}, "no face's name"),
        ({"faces": "Anna/Bert/Anna"}, "names Anna twice"),
        ({"faces": 7}, "no text"),
        ({"faces": ["Anna"]}, "no text"),
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


@pytest.fixture
def farm(tmp_path):
    """WildCap over tiny rooms, and videos of two faces on storage that the workers see under another name than the
    submitter."""
    program, storage = tiny_chain.build(tmp_path / "pro gram"), tmp_path / "st örage"
    (storage / "films").mkdir(parents=True)
    for name in ("Zoë d'Arc", "Anna"):
        (storage / "films" / f"{name}.mp4").write_text(name, encoding="utf-8")
    return program, storage


def call(program: Path, folder: Path, *words) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, str(program), *map(str, words)], cwd=folder, capture_output=True, text=True, encoding="utf-8"
    )


def moods(batch: Path, **of: dict):
    for face in read_batch(batch).faces:
        face.capture.claim()
        (face.root / "mood.json").write_text(json.dumps(of.get(face.name, {})))


def jobs_of(program: Path, folder: Path, batch: Path) -> list[dict]:
    listed = call(program, folder, "batch", "commands", batch, "--flamenco")
    assert listed.returncode == 0, listed.stderr
    return [json.loads(line) for line in listed.stdout.splitlines()]


def test_the_commands_do_the_work_on_a_machine_that_sees_the_storage_elsewhere(farm, tmp_path):
    program, storage = farm
    assert (
        call(program, tmp_path, "batch", "plan", storage / "films", storage / "batch", "--gate", "artist").returncode
        == 0
    )
    moods(storage / "batch")
    seen = tmp_path / "vol"
    variables = {"shots": (str(storage), str(seen))}
    values = {"wildcap_python": sys.executable, "wildcap": str(program), "shots": str(seen)}

    def work(jobs: list[dict]) -> list[str]:
        """Does the tasks on the other machine, where the submitter's paths lead nowhere; returns their names."""
        ended = []
        storage.rename(seen)
        for job in jobs:
            for task in submitted(job, variables):
                assert set(task["after"]) <= set(ended)
                parameters = task["commands"][0]["parameters"]
                done = subprocess.run(
                    [sent(word, values) for word in (parameters["exe"], *parameters["args"])],
                    cwd=tmp_path,
                    capture_output=True,
                    text=True,
                )
                assert done.returncode == 0, done.stderr
                ended.append(task["name"])
        seen.rename(storage)
        return ended

    to_masks = jobs_of(program, tmp_path, storage / "batch")
    assert [job["settings"]["part"] for job in to_masks] == ["to the masks"] * 2
    assert {job["type"] for job in to_masks} == {"wildcap"}
    assert len(work(to_masks)) == 4 and not jobs_of(program, tmp_path, storage / "batch")
    accept_mask(Capture(storage / "batch" / "Zoë d'Arc.wildcap"))
    from_masks = jobs_of(program, tmp_path, storage / "batch")
    parts = [(job["settings"]["faces"], job["settings"]["part"]) for job in from_masks]
    assert parts == [("Zoë d'Arc", "from the masks")]
    assert work(from_masks) == ["Zoë d'Arc.solve", "Zoë d'Arc.deliver"]
    assert "Zoë d'Arc            done" in call(program, tmp_path, "batch", "status", storage / "batch").stdout
    assert work(from_masks), "submitted again, what is done ends well"


def test_a_film_that_stops_fails_its_own_job_alone(farm, tmp_path):
    program, storage = farm
    call(program, tmp_path, "batch", "plan", storage / "films", storage / "batch")
    moods(storage / "batch", Anna={"frames": "finding"})
    jobs = jobs_of(program, tmp_path, storage / "batch")
    parts = [(job["settings"]["faces"], job["settings"]["part"]) for job in jobs]
    assert parts == [(name, "all") for name in ("Anna", "Zoë d'Arc")]
    values = {"wildcap_python": sys.executable, "wildcap": str(program)}
    task = submitted(jobs[0], {})[0]["commands"][0]["parameters"]
    stopped = subprocess.run(
        [sent(word, values) for word in (task["exe"], *task["args"])], cwd=tmp_path, capture_output=True, text=True
    )
    assert stopped.returncode == 2 and "The face is not there.\nFilm it." in stopped.stderr


def test_the_lines_of_commands_run_in_any_folder_and_end_the_batch(farm, tmp_path):
    program, storage = farm
    call(program, tmp_path, "batch", "plan", storage / "films", storage / "batch")
    moods(storage / "batch")
    lines = [
        line.split("\t") for line in call(program, tmp_path, "batch", "commands", storage / "batch").stdout.splitlines()
    ]
    assert len(lines) == 2 * len(GROUPS)
    assert [after for _, after, _ in lines][:4] == ["", "Anna.head", "Anna.mask", "Anna.solve"]
    for _, _, command in lines[:4]:
        assert subprocess.run(command, shell=True, cwd="/", capture_output=True).returncode == 0
    assert "Anna                 done" in call(program, tmp_path, "batch", "status", storage / "batch").stdout
    elsewhere = call(
        program, tmp_path, "batch", "commands", storage / "batch", "--python", "py", "--wildcap", "/opt/wild cap"
    ).stdout.splitlines()
    assert shlex.split(elsewhere[0].split("\t")[2])[:2] == ["py", "/opt/wild cap"] and len(elsewhere) == len(GROUPS)


def test_a_name_that_would_be_an_option_is_refused(farm, tmp_path):
    program, storage = farm
    (storage / "films" / "-h.mp4").write_text("")
    told = call(program, tmp_path, "batch", "plan", storage / "films", storage / "batch")
    assert (
        told.returncode == 2
        and "'-h' cannot be the name of a folder." in told.stderr
        and "2 faces planned" in told.stdout
    )
