# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The renders of a capture as words of the terminal: relight, contact_sheet, turntable."""

from pathlib import Path

from ..terminal import Command
from . import headless


def _relight(arguments) -> list[Path]:
    return headless.render_relit(
        arguments.capture, arguments.lights or headless.ALL, resolution=arguments.resolution, samples=arguments.samples
    )


def _contact_sheet(arguments) -> list[Path]:
    return [
        headless.render_contact_sheet(
            arguments.capture, view=arguments.view, resolution=arguments.resolution, samples=arguments.samples
        )
    ]


def _turntable(arguments) -> list[Path]:
    return [
        headless.render_turntable(
            arguments.capture,
            arguments.light,
            arguments.turns.upper(),
            arguments.frames,
            arguments.film,
            resolution=arguments.resolution,
            samples=arguments.samples,
        )
    ]


def _sized(kind) -> None:
    kind.add_argument("capture", type=Path)
    kind.add_argument("--resolution", type=int, default=512, help="side in pixels")
    kind.add_argument("--samples", type=int, default=32)


def _of_relight(kind) -> None:
    _sized(kind)
    kind.add_argument(
        "lights",
        nargs="*",
        metavar="LIGHT",
        help=f"{', '.join(headless.ALL)}, or one of Blender's worlds; default: all presets",
    )


def _of_contact_sheet(kind) -> None:
    _sized(kind)
    kind.add_argument("--view", choices=("Standard", "AgX"), default="Standard")


def _of_turntable(kind) -> None:
    _sized(kind)
    kind.add_argument("--light", default=headless.ALL[0])
    kind.add_argument("--turns", choices=("head", "light"), default="head")
    kind.add_argument("--frames", type=int, default=48)
    kind.add_argument("--film", action="store_true", help="one MP4, not PNG frames")


COMMANDS = (
    Command("relight", "a picture and a linear EXR per light", _of_relight, _relight),
    Command("contact_sheet", "all lights in one picture", _of_contact_sheet, _contact_sheet),
    Command("turntable", "the head or the light once around", _of_turntable, _turntable),
)
