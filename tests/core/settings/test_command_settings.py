# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings on the command line: --set and --settings reach every one, flags are theirs, the order among them holds, and
what cannot be is refused."""

import json
from dataclasses import replace

import pytest

from core.__main__ import main
from core.capture.capture import Capture
from core.settings.setting_values import value_from_text
from core.settings.settings import Settings, find_setting, known_settings, preset
from core.worker import terminal
from core.worker.job import read_job

COMMANDS = {
    command: [name for name in known_settings() if name.startswith("deliver.") == (command == "deliver")]
    for command in ("run", "deliver")
}


@pytest.fixture
def capture(tmp_path, monkeypatch) -> Capture:
    """A capture whose jobs are written and not run; the working directory is beside it."""
    monkeypatch.setattr(terminal, "follow", lambda *_: 0)
    monkeypatch.chdir(tmp_path)
    found = Capture(tmp_path / "Zoë.wildcap")
    found.set_source("")
    return found


def job(capture: Capture, *words, command: str = "run") -> Settings:
    """The settings of the job that a command line writes."""
    source = ["-"] if command == "run" else []
    assert main([command, *source, str(capture.root), *map(str, words)]) == 0
    return read_job(capture.job).settings


def value(settings: Settings, name: str):
    stage, _, own = name.rpartition(".")
    return getattr(getattr(settings, stage) if stage else settings, own)


def other(name: str) -> tuple[str, object]:
    """A valid value of a setting that is not its default: as text, and as it is kept but for a path."""
    field = find_setting(name)
    limits = field.metadata
    if isinstance(field.default, bool):
        return "off" if field.default else "on", not field.default
    if "min" in limits:
        found = limits["max"] if field.default != limits["max"] else limits["min"]
        return str(found), found
    found = next(choice for choice in limits.get("choices", ("0.6,0.5,0.4",)) if choice != field.default)
    return ("mine/é", "mine/é") if "path" in limits else (found, found)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_setting_can_be_set(capture, command, tmp_path):
    texts = {name: other(name) for name in COMMANDS[command] if name != "deliver.whole"}  # the command's own choice
    words = [word for name, (text, _) in texts.items() for word in ("--set", f"{name}={text}")]
    settings = job(capture, *words, command=command)
    for name, (_, kept) in texts.items():
        kept = str(tmp_path / "mine" / "é") if "path" in find_setting(name).metadata else kept
        assert value(settings, name) == kept and type(value(settings, name)) is type(kept), name


def test_the_terminal_delivers_the_mesh_as_well(capture, capsys):
    assert job(capture, "--set", "deliver.whole=yes", command="deliver").deliver.whole
    assert main(["deliver", str(capture.root), "--set", "deliver.whole=no"]) == 2
    assert "deliver.whole" in capsys.readouterr().err


NEEDED = {
    "delight.folder": ["--delighter", "folder"],
    "delight.checkpoint": ["--delighter", "opendelight"],
    "delight.switchlight_preview": ["--delighter", "switchlight"],
    "registration.new_atlas": ["--template", "mine.obj"],
}


@pytest.mark.parametrize(
    ("command", "names"),
    [
        *(
            (command, [name for name in names if "flag" in find_setting(name).metadata and name not in NEEDED])
            for command, names in COMMANDS.items()
        ),
        *(("run", [name]) for name in NEEDED),
    ],
    ids=str,
)
def test_a_flag_says_the_same_as_set(capture, command, names):
    flags, assignments = list(NEEDED.get(names[0], [])), list(NEEDED.get(names[0], []))
    for name in names:
        text, field = other(name)[0], find_setting(name)
        flags += [field.metadata["flag"]] if isinstance(field.default, bool) else [field.metadata["flag"], text]
        assignments += ["--set", f"{name}={text}"]
    assert job(capture, *flags, command=command) == job(capture, *assignments, command=command)


@pytest.mark.parametrize(("words", "state"), [("on true YES 1", True), ("off False no 0", False)])
def test_a_switch_has_many_words(words, state):
    field = find_setting("upscale.hair")
    assert {value_from_text("upscale.hair", field, word) for word in words.split()} == {state}


def test_a_file_lies_over_the_quality_and_set_and_flags_over_the_file(capture, tmp_path):
    (tmp_path / "mine.json").write_text(
        '\ufeff{"seed": 3, "solve": {"steps": 7, "size": 256, "skin_tone": "0.5,0.4,0.3"}, '
        '"deliver": {"preset": "unreal"}}',
        encoding="utf-8",
    )
    words = "--quality draft --settings mine.json --set solve.size=128 --set solve.grid_cells=8 --skin-tone auto"
    settings = job(capture, *words.split())
    expected = {"steps": 7, "size": 128, "grid_cells": 8, "skin_tone": "auto"}
    assert settings.seed == 3 and settings.solve == replace(preset("draft").solve, **expected)
    assert json.loads(capture.job.read_text(encoding="utf-8"))["quality"] == "draft"
    assert job(capture, "--settings", "mine.json", command="deliver").deliver.preset == "unreal"
    kept = job(capture, "--settings", "mine.json", "--pictures", "png8", command="deliver")
    assert kept.deliver.pictures == "png8" and kept.deliver.whole and kept.deliver.format == "obj"
    assert kept.seed == settings.seed, "the last run's stay"


def test_paths_begin_where_they_are_written(capture, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "studio").mkdir()
    places = {
        "delight": {"delighter": "folder", "folder": "delit"},
        "solve": {"prior": "~/authors"},
        "registration": {"template": ""},
        "cameras": {"import_from": str(tmp_path / "rig.json")},
    }
    (tmp_path / "studio" / "mine.json").write_text(json.dumps(places), encoding="utf-8")
    (tmp_path / "home").mkdir()
    words = ["--set", "texture.perceptual_network=vgg", "--softened", "~/soft"]
    settings = job(capture, "--settings", "~/../studio/mine.json", *words)
    assert settings.delight.folder == str(tmp_path / "studio" / "delit")
    assert settings.solve.prior == str(tmp_path / "home" / "authors")
    assert settings.registration.template == "" and settings.cameras.import_from == str(tmp_path / "rig.json")
    assert settings.texture.perceptual_network == str(tmp_path / "vgg")
    assert settings.shadow_mask.softened == str(tmp_path / "home" / "soft")
    chosen = job(capture, "--settings", "studio/mine.json", "--folder", "mine")
    assert chosen.delight.folder == str(tmp_path / "mine"), "the file says that it is for folder"
    assert job(capture, "--settings", "studio/mine.json", "--set", "delight.folder=").delight.folder == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--set", "solve.steps"], "--set solve.steps=VALUE"),
        (["--set", "solve.stps=5"], "Did you mean solve.steps?"),
        (["--set", "solve.steps=many"], "4 to 600"),
        (["--set", "solve.steps=5.5"], "whole number"),
        (["--set", "solve.steps=3"], "4 to 600"),
        (["--set", "scan.voxel_mm=wide"], "0.3 to 5 mm"),
        (["--set", "upscale.hair=perhaps"], "on or off"),
        (["--set", "scan.method=magic"], "auto, stereo, splats"),
        (["--seed", "-1"], "0 to 2147483647"),
        (["--set", "seed=1", "--seed", "2"], "two values of seed"),
        (["--set", "scan.pairs=5", "--set", "scan.pairs=6"], "two values of scan.pairs"),
        (["--set", "deliver.preset=unreal"], "`core deliver`"),
        (["--new-atlas"], "--template"),
        (["--folder", "x", "--delighter", "none"], "--delighter folder"),
        (["--checkpoint", "x"], "--delighter opendelight"),
        (["--preview"], "--delighter switchlight"),
    ],
)
def test_what_cannot_be_is_refused(capture, words, said, capsys):
    assert main(["run", "-", str(capture.root), *words]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 2 and said in " ".join(lines) and not capture.job.exists()


def test_a_delivery_takes_its_own_settings_only(capture, capsys):
    assert main(["deliver", str(capture.root), "--set", "solve.steps=5"]) == 2
    assert "`core deliver` has no use for solve.steps." in capsys.readouterr().err


def test_two_words_for_one_value_are_no_contradiction(capture):
    assert job(capture, "--seed", "2", "--set", "seed=2", "--set", "scan.pairs=5", "--set", " scan.pairs = 5").seed == 2
    assert job(capture, "--skin-tone", "").solve.skin_tone == "auto", "an empty variable of a script says nothing"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "mine.json cannot be read"),
        (b"{", "cannot be read"),
        (b"\xff\xfe\x00", "cannot be read"),
        (b"[1]", "object"),
        (b'{"solve": [5]}', "stage solve"),
        (b'{"slove": {}}', "Did you mean solve?"),
    ],
)
def test_a_settings_file_that_is_none_is_refused(capture, tmp_path, content, said, capsys):
    if content is not None:
        (tmp_path / "mine.json").write_bytes(content)
    for words in (["run", "-"], ["deliver"]):
        assert main([*words, str(capture.root), "--settings", str(tmp_path / "mine.json")]) == 2
        assert said in capsys.readouterr().err and not capture.job.exists()


def test_all_settings_are_listed(capsys):
    assert main(["settings"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(" = ")[0] for line in lines if not line.startswith(" ")] == list(known_settings())
    assert "scan.voxel_mm = 1.0; 0.3 to 5 mm" in lines and "upscale.hair = on; on or off" in lines
    assert "solve.white_point = auto; R,G,B or auto  (run --white-point R,G,B)" in lines
    assert "    Sampling steps" in lines
    assert "deliver.size = 4096; 4096, 2048, 1024 px  (deliver --size VALUE)" in lines
