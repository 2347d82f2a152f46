# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings on the command line: --set and --settings for all, flags for some, and the list of all.

Names, types, choices and help come from the fields in settings/settings.py and settings/stage_settings.py. Standard
library only.
"""

from __future__ import annotations

import argparse
import textwrap
from dataclasses import Field
from pathlib import Path

from ..capture.json_files import read_json
from ..capture.messages import Problem
from ..settings.setting_values import absolute_path, describe_values, value_from_text, value_to_text
from ..settings.settings import STAGE_KINDS, Settings, find_setting, from_json, known_settings, tooltips

METAVARS = {"file": "FILE", "folder": "FOLDER", "file_or_folder": "PATH"}
COMMANDS = {name: "deliver" if name.startswith("deliver.") else "run" for name in known_settings()}
"""Setting -> the command it is for."""
WIDTH = 120  # columns of the terminal


def add_options(parser: argparse.ArgumentParser, command: str) -> None:
    """Add --settings, --set and the flags of a command ('run' or 'deliver') to its parser.

    Without any, the parsed options contain only `settings_file` None and `assignments` [].
    """
    add_assignments(parser, command)
    for name, field in known_settings().items():
        if "flag" in field.metadata and COMMANDS[name] == command:
            parser.add_argument(field.metadata["flag"], dest=name, default=argparse.SUPPRESS, **_argument(name, field))


def add_assignments(parser: argparse.ArgumentParser, command: str) -> None:
    """Add --settings and --set to a parser."""
    example = '{"deliver": {"preset": "unreal"}}'
    if command == "run":
        example = '{"solve": {"steps": 30}, "seed": 1}; its values replace those of the quality'
    parser.add_argument(
        "--settings",
        dest="settings_file",
        metavar="FILE",
        type=Path,
        help=f"a JSON file like {example}; relative paths in it begin at its folder",
    )
    parser.add_argument(
        "--set",
        dest="assignments",
        metavar="STAGE.NAME=VALUE",
        action="append",
        default=[],
        help="any setting that `settings` lists; may be given again for another; replaces the file's "
        "value, as flags do",
    )


def read_options(options: argparse.Namespace, command: str) -> dict:
    """Return the settings of a command line as a job has them: {stage: {name: value}, seed, device}.

    --set and flags lie over the file; paths are absolute. Raises Problem for an invalid setting or value, an unreadable
    file, and two values for one setting.
    """
    settings = read_file(options.settings_file) if options.settings_file else {}
    overrides: dict[str, tuple[str, object]] = {}
    for words, name, value in [*_flags(options), *(_assignment(text, command) for text in options.assignments)]:
        if name in overrides and overrides[name][1] != value:
            raise Problem(f"{overrides[name][0]} and {words} ask for two values of {name}.", "Leave one of them out.")
        overrides[name] = (words, value)
    for name, (_, value) in overrides.items():
        stage, _, own = name.rpartition(".")
        (settings.setdefault(stage, {}) if stage else settings)[own] = value
    from_json(settings)
    return settings


def read_file(path: Path) -> dict:
    """Read the settings of a JSON file; relative paths begin at its folder. Raises Problem."""
    path = Path(absolute_path(str(path)))
    try:
        settings = read_json(path)
    except (OSError, ValueError) as error:
        raise Problem(
            f"The settings file {path} cannot be read ({error}).",
            'It is a JSON file like {"solve": {"steps": 30}, "seed": 1}.',
        ) from error
    from_json(settings)
    for stage in settings.keys() & STAGE_KINDS.keys():
        for name, value in settings[stage].items():
            if "path" in find_setting(f"{stage}.{name}").metadata:
                settings[stage][name] = absolute_path(value, path.parent)
    return settings


def refuse_lone_flags(options: argparse.Namespace, by_stage: dict) -> None:
    """Raise Problem for a flag of `run` without the setting it needs; `by_stage` comes from `read_options`."""
    given = vars(options)
    delighter = by_stage.get("delight", {}).get("delighter")
    for name, wanted in (("delight.folder", "folder"), ("delight.checkpoint", "opendelight")):
        if given.get(name) and delighter != wanted:
            flag = find_setting(name).metadata["flag"]
            raise Problem(
                f"{flag} goes with --delighter {wanted} only.", f"Add --delighter {wanted}, or leave {flag} out."
            )
    if (given.get("delight.switchlight_preview") or options.send_frames) and delighter != "switchlight":
        raise Problem(
            "--preview and --send-frames go with --delighter switchlight only.",
            "Add --delighter switchlight, or leave them out.",
        )
    if given.get("registration.new_atlas") and not by_stage.get("registration", {}).get("template"):
        raise Problem(
            "--new-atlas goes with --template only.", "Name your head mesh with --template, or leave --new-atlas out."
        )


def list_settings() -> str:
    """Describe all settings for a terminal: name, default, values, flag and tooltip."""
    lines = []
    for name, field in known_settings().items():
        flag = f"  ({COMMANDS[name]} {_flag_words(field)})" if "flag" in field.metadata else ""
        lines.append(f"{name} = {value_to_text(field.default) or 'empty'}; {describe_values(field)}{flag}")
        lines += textwrap.wrap(_tooltip(name), WIDTH, initial_indent="    ", subsequent_indent="    ")
    return "\n".join(lines)


def _argument(name: str, field: Field) -> dict:
    """Return the arguments of add_argument for a setting's flag."""
    tooltip = _tooltip(name).replace("%", "%%")
    if isinstance(field.default, bool):
        help_text = f"switches off: {tooltip}" if field.default else tooltip
        return {"action": "store_const", "const": not field.default, "help": help_text}
    choices = field.metadata.get("choices")
    values = {"choices": choices} if choices else {"metavar": _metavar(field)}
    return {"type": type(field.default), "help": tooltip, **values}


def _metavar(field: Field) -> str:
    """Return the placeholder of the value in the help."""
    if "path" in field.metadata:
        return METAVARS[field.metadata["path"]]
    return field.metadata["form"].split()[0] if "form" in field.metadata else "N"


def _flag_words(field: Field) -> str:
    """Return the flag with the placeholder of its value."""
    flag = field.metadata["flag"]
    if isinstance(field.default, bool):
        return flag
    return f"{flag} {'VALUE' if 'choices' in field.metadata else _metavar(field)}"


def _tooltip(name: str) -> str:
    stage, _, own = name.rpartition(".")
    return tooltips(STAGE_KINDS.get(stage, Settings))[own]


def _flags(options: argparse.Namespace) -> list[tuple[str, str, object]]:
    """Return the settings given by flags: (flag, name, value)."""
    given = {name: value for name, value in vars(options).items() if name in known_settings() and value != ""}
    return [
        (field.metadata["flag"], name, absolute_path(given[name]) if "path" in field.metadata else given[name])
        for name, field in known_settings().items()
        if name in given
    ]


def _assignment(text: str, command: str) -> tuple[str, str, object]:
    """Parse the argument of --set: (the words, name, value). Raises Problem."""
    name, equals, value = text.partition("=")
    name = name.strip()
    field = find_setting(name)
    if not equals:
        raise Problem(
            f"--set {text} gives no value.", f"Write --set {name}=VALUE, as {name}={value_to_text(field.default)}."
        )
    if COMMANDS[name] != command:
        raise Problem(f"`core {command}` has no use for {name}.", f"It is a setting of `core {COMMANDS[name]}`.")
    return f"--set {text}", name, value_from_text(name, field, value)
