# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The renders of a capture from a terminal, without a window:

    blender --command wildcap contact_sheet my_face.wildcap
    blender --command wildcap relight my_face.wildcap three_point sunset --resolution 1024
    blender --command wildcap turntable my_face.wildcap --light overcast --turns light --film
"""

import argparse
import sys
from pathlib import Path

import bpy

from ...core.contract.messages import Problem
from . import headless

NAME = "wildcap"
_handle = None


def execute(words: list[str]) -> int:
    """Renders what the words ask for and prints the files. Returns 0, or 1 after telling what is wrong."""
    asked = parser().parse_args(words)
    size = {"resolution": asked.resolution, "samples": asked.samples}
    try:
        if asked.what == "relight":
            made = headless.render_relit(asked.capture, asked.lights or headless.ALL, **size)
        elif asked.what == "contact_sheet":
            made = [headless.render_contact_sheet(asked.capture, view=asked.view, **size)]
        else:
            made = [headless.render_turntable(asked.capture, asked.light, asked.turns.upper(), asked.frames, asked.film, **size)]
    except Problem as problem:
        print(f"{problem.problem} {problem.remedy}", file=sys.stderr)
        return 1
    print(*made, sep="\n")
    return 0


def parser() -> argparse.ArgumentParser:
    """What can be asked for."""
    whole = argparse.ArgumentParser(prog=f"blender --command {NAME}", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = whole.add_subparsers(dest="what", required=True)
    relight = kinds.add_parser("relight", help="a picture and a linear EXR per light")
    sheet = kinds.add_parser("contact_sheet", help="all lights in one picture")
    table = kinds.add_parser("turntable", help="the head or the light once around")
    for kind in (relight, sheet, table):
        kind.add_argument("capture", type=Path)
        kind.add_argument("--resolution", type=int, default=512, help="side in pixels")
        kind.add_argument("--samples", type=int, default=32)
    relight.add_argument("lights", nargs="*", metavar="LIGHT", help=f"{', '.join(headless.ALL)}, or one of Blender's worlds; default: all presets")
    sheet.add_argument("--view", choices=("Standard", "AgX"), default="Standard")
    table.add_argument("--light", default=headless.ALL[0])
    table.add_argument("--turns", choices=("head", "light"), default="head")
    table.add_argument("--frames", type=int, default=48)
    table.add_argument("--film", action="store_true", help="one MP4, not PNG frames")
    return whole


def register():
    global _handle
    _handle = bpy.utils.register_cli_command(NAME, execute)


def unregister():
    bpy.utils.unregister_cli_command(_handle)
