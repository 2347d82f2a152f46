# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a setting is: a field with metadata, by which its value is checked, made from text and said in words.

Ground floor: standard library only. A `name` is how people call a setting: STAGE.NAME, or the name alone for what all
stages share.
"""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

from ..capture.messages import Problem

SWITCH = {"on": True, "true": True, "yes": True, "1": True, "off": False, "false": False, "no": False, "0": False}
"""What a switch may be called in text, in any case of the letters."""
PATHS = {"file": "a file", "folder": "a folder", "file_or_folder": "a file or a folder"}
"""The kinds of places on the disk that a setting may name (its `path`), in words."""


def setting(default, **metadata):
    """A field whose type is that of its default (bool, int, float or str).

    A number has `min` and `max`, and may have a `unit`. A text has `choices`, or is a `path` ("file", "folder" or
    "file_or_folder"), or has a `form` (how it is written, in a few words) and the function that reads it, `parse`,
    which raises Problem. A path may say `when` it is used, a function of the stage's settings, whether it is `required`
    then, and what a folder `holds`: names of files. `label` is its name in Blender where the one
    made of the field's does not do, `titles` are those of choices whose own does not do, `flag` is its short option of
    `core run` (of `core deliver` for what delivers). `per_face` is True for what a quality leaves as it is, as it
    leaves every path; `affects_result` is False for what no result depends on.
    """
    return dataclasses.field(default=default, metadata=metadata)


def check_value(name: str, field: dataclasses.Field, value):
    """The value as the setting keeps it: a whole number becomes a float where one is wanted.

    Raises Problem for a wrong type, for what is none of its choices or not of its form, and for what lies outside of
    its range (not-a-number does).
    """
    expected, limits = type(field.default), field.metadata
    whole_for_float = expected is float and type(value) is int
    if type(value) is not expected and not whole_for_float:
        raise Problem(
            f"{name} is {value!r}, which is not a {expected.__name__}.",
            f"{advise_values(field)} Its default is {field.default!r}.",
        )
    if "choices" in limits and value not in limits["choices"]:
        raise Problem(f"{name} is {value!r}.", advise_values(field))
    if "min" in limits and not limits["min"] <= value <= limits["max"]:
        raise Problem(f"{name} is {value}.", advise_values(field))
    if "parse" in limits:
        limits["parse"](value)
    return float(value) if whole_for_float else value


def value_from_text(name: str, field: dataclasses.Field, text: str, folder: Path | None = None):
    """The value that a text means, by the type of the field.

    Parameters
    ----------
    name : of the setting, for the Problem
    field : of the settings' dataclass
    text : as it was typed
    folder : from which a path is made absolute, None: the working directory

    Raises
    ------
    Problem
        For a text that means none of the setting's values.
    """
    kind = type(field.default)
    if "path" in field.metadata:
        return absolute_path(text, folder)
    text = text.strip()
    if kind is bool:
        if text.lower() not in SWITCH:
            raise Problem(f"{name} is {text!r}.", advise_values(field))
        return SWITCH[text.lower()]
    try:
        value = kind(text)
    except ValueError:
        raise Problem(
            f"{name} is {text!r}, which is not a {'whole ' if kind is int else ''}number.", advise_values(field)
        ) from None
    return check_value(name, field, value)


def absolute_path(text: str, folder: Path | None = None) -> str:
    """A path with ~ expanded, from `folder` on where it is relative (None: the working directory); '' stays ''."""
    return str(Path(folder or "", os.path.expanduser(text)).absolute()) if text else ""


def describe_values(field: dataclasses.Field) -> str:
    """What a setting may be, in a few words: its choices, its range with the unit, what it names, or the form of its
    text."""
    limits = field.metadata
    unit = f" {limits['unit']}" if "unit" in limits else ""
    if "choices" in limits:
        return ", ".join(limits["choices"]) + unit
    if isinstance(field.default, bool):
        return "on or off"
    if "min" in limits:
        return " to ".join(str(limits[end]).removesuffix(".0") for end in ("min", "max")) + unit
    return PATHS[limits["path"]] if "path" in limits else limits["form"]


def advise_values(field: dataclasses.Field) -> str:
    """The same as a sentence."""
    words = "Choose one of" if "choices" in field.metadata else "It goes from" if "min" in field.metadata else "It is"
    return f"{words} {describe_values(field)}."


def value_to_text(value) -> str:
    """A value as `value_from_text` reads it."""
    return ("on" if value else "off") if isinstance(value, bool) else str(value)
