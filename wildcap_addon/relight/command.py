# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Terminal commands for a capture's renders: relight, contact_sheet, turntable."""

from pathlib import Path

from ..terminal import Command
from . import headless


def _relight(options) -> list[Path]:
    return headless.render_relit(options.capture, options.lights or headless.ALL, **_picture(options))


def _contact_sheet(options) -> list[Path]:
    return [headless.render_contact_sheet(options.capture, **_picture(options))]


def _turntable(options) -> list[Path]:
    folder = headless.render_turntable(
        options.capture,
        options.light,
        options.turns.upper(),
        options.frames,
        options.film,
        **_picture(options),
    )
    return [folder]


def _picture(options) -> dict:
    return {name: getattr(options, name) for name in ("resolution", "samples", "view", "exposure")}


def _add_picture(parser) -> None:
    parser.add_argument("capture", type=Path)
    parser.add_argument("--resolution", type=int, default=512, help="side in pixels")
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--view", choices=("Standard", "AgX"), default="Standard", help="view transform")
    parser.add_argument("--exposure", type=float, default=0.0, metavar="STOPS", help="brighten the pictures")


def _add_relight(parser) -> None:
    _add_picture(parser)
    choices = f"{', '.join(headless.ALL)}, or one of Blender's worlds; default: all presets"
    parser.add_argument("lights", nargs="*", metavar="LIGHT", help=choices)


def _add_turntable(parser) -> None:
    _add_picture(parser)
    parser.add_argument("--light", default=headless.ALL[0])
    parser.add_argument("--turns", choices=("head", "light"), default="head")
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--film", action="store_true", help="one MP4, not PNG frames")


COMMANDS = (
    Command("relight", "a picture and a linear EXR per light", _add_relight, _relight),
    Command("contact_sheet", "all lights in one picture", _add_picture, _contact_sheet),
    Command("turntable", "the head or the light once around", _add_turntable, _turntable),
)
