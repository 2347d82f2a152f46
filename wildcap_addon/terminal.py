# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Command line without a window.

blender --command wildcap run me.mp4 me.wildcap --quality film
blender --command wildcap solve me.wildcap
blender --command wildcap relight me.wildcap three_point sunset --resolution 1024
blender --command wildcap turntable me.wildcap --light overcast --turns light --film
blender --command wildcap deliver me.wildcap --preset metahuman
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass

import bpy

from ..core.capture.messages import Problem

NAME = "wildcap"


@dataclass(frozen=True)
class Command:
    """Subcommand: `options` adds its arguments to a parser, `carry_out` returns the files it made, or an exit code."""

    name: str
    help: str
    options: Callable[[argparse.ArgumentParser], None]
    carry_out: Callable[[argparse.Namespace], list | int]


commands: list[Command] = []
"""Rooms add theirs as they register."""
_handle = None


def forget(leaving: tuple[Command, ...]) -> None:
    """Remove the subcommands of a room."""
    commands[:] = [command for command in commands if command not in leaving]


def execute(words: list[str]) -> int:
    """Run a subcommand, print its files or its problem, and return the exit code."""
    options = parser().parse_args(words)
    try:
        result = options.carry_out(options)
    except Problem as problem:
        print(f"{problem.problem} {problem.remedy}", file=sys.stderr)
        return 1
    if isinstance(result, int):
        return result
    print(*result, sep="\n")
    return 0


def parser() -> argparse.ArgumentParser:
    """Return the parser of all subcommands."""
    whole = argparse.ArgumentParser(
        prog=f"blender --command {NAME}", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    kinds = whole.add_subparsers(dest="what", required=True)
    for command in commands:
        one = kinds.add_parser(command.name, help=command.help)
        command.options(one)
        one.set_defaults(carry_out=command.carry_out)
    return whole


def register():
    global _handle
    _handle = bpy.utils.register_cli_command(NAME, execute)


def unregister():
    bpy.utils.unregister_cli_command(_handle)
