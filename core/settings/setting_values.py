# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A setting: a dataclass field with metadata by which its value is checked, parsed and described.

A `name` is STAGE.NAME, or the name alone for a setting that all stages share.
"""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

from ..capture.messages import Problem

SWITCH = {"on": True, "true": True, "yes": True, "1": True, "off": False, "false": False, "no": False, "0": False}
"""Words for a switch, in upper or lower case."""
PATHS = {"file": "a file", "folder": "a folder", "file_or_folder": "a file or a folder"}
"""The kinds of `path` in words."""


def setting(default, **metadata):
    """Declare a field whose type is that of its default (bool, int, float or str).

    min, max, unit: of a number. choices: of a text. path: the text names a "file", "folder" or "file_or_folder". form,
    parse: syntax of a text in a few words, and its parser, which raises Problem. when: whether a path is used, by the
    stage's settings; required: then it must not be empty; holds: files in the folder. label, titles: names in Blender
    of the setting and its choices. flag: option of `core run` or `core deliver`. per_face: not changed by a quality.
    affects_result: False if no result depends on it. private: the user's own words, which no report or delivery tells.
    """
    return dataclasses.field(default=default, metadata=metadata)


def check_value(name: str, field: dataclasses.Field, value):
    """Return the value, an int as a float if the setting is one. Raises Problem for a wrong type or value, or NaN."""
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
    """Parse a text by the type of the field. A relative path begins at `folder`, or the working directory.

    Raises Problem for a text that is no value of the setting.
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
    """Expand ~, and make a path absolute from `folder` (None: the working directory); '' stays ''."""
    return str(Path(folder or "", os.path.expanduser(text)).absolute()) if text else ""


def describe_values(field: dataclasses.Field) -> str:
    """Describe the values of a setting: choices, range with unit, kind of path, or form."""
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
    """Describe the values of a setting in a sentence."""
    words = "Choose one of" if "choices" in field.metadata else "It goes from" if "min" in field.metadata else "It is"
    return f"{words} {describe_values(field)}."


def value_to_text(value) -> str:
    """Write a value as `value_from_text` reads it."""
    return ("on" if value else "off") if isinstance(value, bool) else str(value)
