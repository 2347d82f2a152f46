# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Planning a batch: tables as spreadsheets write them, folders of films, rows that cannot be used, and records that are
none."""

import json

import pytest

from core.__main__ import main
from core.batch.record import read_batch
from core.batch.shots import read_faces
from core.capture.messages import Problem
from core.capture.tone_choice import read_choice, write_choice


@pytest.fixture
def folder(tmp_path):
    """Films with an accent and a space, and a folder of photographs."""
    films = tmp_path / "Ma série"
    films.mkdir()
    for name in ("anna.mp4", "zoë b.mov", "anna.avi"):
        (films / name).write_bytes(name.encode())
    (films / "carl").mkdir()
    (films / "carl" / "1.jpg").write_bytes(b"1")
    (films / "notes.txt").write_text("no video")
    return films


def plan(folder, text: str, encoding="utf-8", **shared):
    table = folder / "shots.csv"
    table.write_bytes(text.encode(encoding))
    return read_faces(table, folder / "batch", "standard", shared)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("start", ["", "\ufeff"])
def test_a_table_as_spreadsheets_write_it(folder, separator, start):
    rows = (
        ("Video", "name", "tone", "white", "colour", "quality"),
        ("anna.mp4", "Anna", '"0.8,0.6,0.5"', "auto", "", ""),
        ("", "", "", "", "", ""),
        ("zoë b.mov", "", "", "", "v_log", "draft"),
    )
    faces, faults = plan(folder, start + "\r\n".join(separator.join(row) for row in rows) + "\r\n")
    assert faults == [] and [(face.name, face.source, face.root.name, face.quality) for face in faces] == [
        ("Anna", folder / "anna.mp4", "Anna.wildcap", "standard"),
        ("zoë b", folder / "zoë b.mov", "zoë b.wildcap", "draft"),
    ]
    assert faces[0].settings == {"solve": {"skin_tone": "0.8,0.6,0.5", "white_point": "auto"}}
    assert faces[1].settings == {"frames": {"colour": "v_log"}}


def test_a_rows_settings_lie_over_the_files_and_those_over_the_shared_ones(folder):
    (folder / "own.json").write_text(
        '{"solve": {"steps": 30, "skin_tone": "0.1,0.1,0.1"}, "registration": {"template": "head.obj"}}'
    )
    (folder / "head.obj").write_text("v 0 0 0")
    faces, _ = plan(
        folder,
        'video,settings,tone\nanna.mp4,own.json,"0.7,0.6,0.5"\ncarl,,\n',
        solve={"steps": 9, "size": 256},
        seed=4,
    )
    assert faces[0].settings == {
        "solve": {"steps": 30, "size": 256, "skin_tone": "0.7,0.6,0.5"},
        "seed": 4,
        "registration": {"template": str(folder / "head.obj")},
    }
    assert faces[1].settings == {"solve": {"steps": 9, "size": 256}, "seed": 4}, "one row's values reach no other"


def test_a_tone_that_the_table_changes_is_the_choice_until_the_artist_makes_another(folder):
    table, batch = folder / "shots.csv", folder / "batch"

    def tones(cell: str) -> list[str]:
        table.write_text(f'video,tone\nanna.mp4,{cell}\ncarl,\n', encoding="utf-8")
        assert main(["batch", "plan", str(table), str(batch)]) == 0
        return [face.chosen().solve.skin_tone for face in read_batch(batch).faces]

    assert tones("6") == ["6", "auto"]
    anna = read_batch(batch).face("anna").capture
    anna.claim()
    assert tones('"0.7,0.6,0.5"') == ["0.7,0.6,0.5", "auto"] and read_choice(anna) == "0.7,0.6,0.5"
    write_choice(anna, "4")
    assert tones('"0.7,0.6,0.5"') == ["4", "auto"], "the table says nothing new"
    assert read_batch(batch).face("anna").wanted()["solve"] == {"skin_tone": "4"}
    assert tones("") == ["auto", "auto"] and read_choice(anna) == "auto"


def test_a_name_that_a_disk_may_take_for_another_one_is_refused(folder, capsys):
    """Both faces would get one capture on the disks of Windows and macOS."""
    table, batch = folder / "shots.csv", folder / "batch"
    table.write_text("video,name\nanna.mp4,Anna\nzoë b.mov,Zo\u00eb\n", encoding="utf-8")
    assert main(["batch", "plan", str(table), str(batch)]) == 0
    table.write_text("video,name\nanna.avi,ANNA\nzoë b.mov,Zoe\u0308\ncarl,\n", encoding="utf-8")
    assert main(["batch", "plan", str(table), str(batch)]) == 2
    told = capsys.readouterr().err
    assert "Line 2: The name ANNA was planned before as Anna" in told and "Line 3: " in told
    assert [face.name for face in read_batch(batch).faces] == ["Anna", "Zo\u00eb", "carl"]
    faces, faults = plan(folder, "video,name\nanna.mp4,Zo\u00eb\nanna.avi,Zoe\u0308\n")
    assert len(faces) == 1 and "is taken by Line 2" in faults[0].problem


@pytest.mark.parametrize(
    "row, said",
    [
        (",x,,,,", "names no video"),
        ("gone.mp4,,,,,", "no video or folder at"),
        ("anna.mp4,a/b,,,,", "cannot be the name"),
        ("anna.mp4,-h,,,,", "cannot be the name"),
        ("anna.mp4,CARL,,,,", "The name CARL is taken by Line 2"),
        ('anna.mp4,,"0.8,nan,0.5",,,', "is not a colour"),
        ("anna.mp4,,,white,,", "is not a colour"),
        ("anna.mp4,,,,head.obj,", "no file or folder at"),
        ("anna.mp4,,,,,shots.csv", "cannot be read"),
        ("anna.mp4,,0.8,0.6,0.5,,", "more cells than there are columns"),
    ],
)
def test_a_row_that_cannot_be_used_is_told_by_its_line_and_the_rest_is_planned(folder, row, said):
    faces, faults = plan(folder, f"video,name,tone,white,template,settings\ncarl,,,,,\n{row}\nzoë b.mov,,,,,\n")
    assert [face.name for face in faces] == ["carl", "zoë b"]
    (fault,) = faults
    assert fault.problem.startswith("Line 3: ") and said in fault.problem and fault.remedy.endswith(".")


@pytest.mark.parametrize(
    "content, said",
    [
        (b"", "names no video"),
        (b"video\n", "names no video"),
        (b"film,name\na,b\n", "'film'"),
        (b"name\nb\n", "no column video"),
        (b"video,video\na,b\n", "a column twice"),
        (b"video\n\0\n", "not a text file"),
        ("video\nzoë.mov\n".encode("latin-1"), "UTF-8"),
        (b"video\n" + b"x" * 200_000, "cannot be read as a table"),
        (None, "no table or folder"),
    ],
)
def test_a_table_that_is_none_is_refused(folder, content, said):
    if content is not None:
        (folder / "shots.csv").write_bytes(content)
    with pytest.raises(Problem, match=said) as refused:
        read_faces(folder / "shots.csv", folder / "batch", "standard", {})
    assert refused.value.remedy.endswith(".")


def test_a_folder_of_films(folder, capsys):
    (folder / "old.wildcap").mkdir()
    (folder / "old.wildcap" / "capture.json").write_text("{}")
    words = "batch", "plan", str(folder), str(folder / "batch"), "--quality", "draft", "--set", "solve.steps=9"
    assert main(list(words)) == 0
    assert "4 faces planned" in capsys.readouterr().out
    batch = read_batch(folder / "batch")
    assert [face.name for face in batch.faces] == ["anna.avi", "anna.mp4", "carl", "zoë b"]
    assert batch.faces[0].settings == {"solve": {"steps": 9}}
    assert batch.faces[0].chosen().solve.steps == 9 and batch.faces[0].chosen().solve.size == 512


def test_planned_again_it_takes_in_what_is_new(folder, capsys):
    table = folder / "shots.csv"
    table.write_text("video,name\nanna.mp4,Anna\n")
    assert main(["batch", "plan", str(table), str(folder / "batch")]) == 0
    table.write_text("video,name,quality\nanna.mp4,Anna,draft\ncarl,,\ngone.mp4,,\n")
    before = (folder / "batch" / "batch.json").read_bytes()
    assert main(["batch", "plan", str(table), str(folder / "batch"), "--gate", "artist"]) == 2
    said = capsys.readouterr()
    assert "Line 4: There is no video" in said.err and "2 faces planned" in said.out and "1 left out" in said.out
    batch = read_batch(folder / "batch")
    assert [(face.name, face.quality) for face in batch.faces] == [("Anna", "draft"), ("carl", "standard")]
    assert batch.gate == "artist"
    assert (folder / "batch" / "batch.json").read_bytes() != before


def test_planned_again_it_keeps_the_options_that_are_left_out(folder):
    def plan(*options):
        assert main(["batch", "plan", str(folder), str(folder / "batch"), *options]) == 0
        batch = read_batch(folder / "batch")
        return batch.gate, batch.deliver, batch.blender

    out = str(folder / "out")
    assert plan() == ("automatic", None, "")
    wanted = ("artist", {"preset": "unreal", "folder": out}, "/opt/blender")
    words = "--gate", "artist", "--deliver", "unreal", "--to", out, "--blender", "/opt/blender"
    assert plan(*words) == wanted and plan() == wanted
    assert plan("--deliver", "unity_hdrp") == ("artist", {"preset": "unity_hdrp", "folder": out}, "/opt/blender")
    assert plan("--to", str(folder / "in"))[1] == {"preset": "unity_hdrp", "folder": str(folder / "in")}
    assert plan("--gate", "automatic", "--deliver", "none", "--blender", "none") == ("automatic", None, "")


def test_what_is_no_batch_is_left_alone(folder, capsys):
    new = ["plan", str(folder), str(folder / "b")]
    for words, said in (
        (["plan", str(folder), str(folder)], "is not a batch"),
        ([*new, "--to", "x"], "--deliver only"),
        ([*new, "--deliver", "lunch"], "deliver.preset"),
        (["status", str(folder)], "no batch at"),
    ):
        assert main(["batch", *words]) == 2
        assert said in capsys.readouterr().err
    assert not (folder / "b").exists()


@pytest.mark.parametrize(
    "change, said",
    [
        (lambda told: "{", "cannot be read"),
        (lambda told: {**told, "format": 9}, "newer version"),
        (lambda told: {**told, "gate": "door"}, "not a batch record"),
        (lambda told: {**told, "faces": told["faces"] * 2}, "twice"),
        (lambda told: {**told, "faces": [{**told["faces"][0], "name": "../x"}]}, "not a batch record"),
        (lambda told: {**told, "faces": [{**told["faces"][0], "settings": {"solve": {"steps": "x"}}}]}, "steps"),
        (lambda told: {**told, "faces": [{"name": "a"}]}, "not a batch record"),
        (lambda told: {**told, "deliver": 3}, "the stage deliver have to be an object"),
        (lambda told: {**told, "faces": [{**told["faces"][0], "source": 3}]}, "not a batch record"),
    ],
)
def test_a_record_that_is_damaged_is_refused_and_kept(folder, change, said):
    main(["batch", "plan", str(folder), str(folder / "batch")])
    path = folder / "batch" / "batch.json"
    changed = change(json.loads(path.read_text()))
    path.write_text(changed if isinstance(changed, str) else json.dumps(changed))
    with pytest.raises(Problem) as refused:
        read_batch(folder / "batch")
    assert said in refused.value.problem and refused.value.remedy.endswith(".") and path.is_file()
