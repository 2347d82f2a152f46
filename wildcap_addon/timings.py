# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How long stages take on this machine: learned from the last ones that ran here, kept in the extension's user folder.

Of a solve by its settings: a sampling step costs in proportion to the map's texels, and twice as much with the gradient
through the network. Of the others as they last took.
"""

import contextlib
import json
from collections.abc import Iterable
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core.capture.files import write_json
from ..core.capture.messages import Problem
from ..core.settings.settings import QUALITIES, Settings, preset
from . import extension

_rates: dict[str, float] = {}  # device -> seconds per million texels and step
_stages: dict[str, float] = {}  # stage -> seconds it took the last time
STAGES = "stages"


def minutes(quality: str, device: str) -> float | None:
    """Expected minutes of a solve at a quality, None before the first one on that device."""
    return _rates[device] * work(preset(quality)) / 60 if device in _rates else None


def describe_minutes(device: str) -> str:
    """All qualities in one line; '' before the first solve."""
    return (
        ", ".join(f"{quality.title()} {_spoken(minutes(quality, device))}" for quality in QUALITIES)
        if device in _rates
        else ""
    )


def record(settings: Settings, seconds: float) -> None:
    """Takes note of a solve that ran from its first step to its last, by the default recipe; others are no measure of
    it."""
    if settings.edited_part or settings.solve.recipe != "wildcap" or settings.solve.prior:
        return
    _rates[settings.compute_device] = seconds / work(settings)
    _keep()


def record_stage(name: str, seconds: float) -> None:
    """Takes note of a stage that ran."""
    _stages[name] = seconds
    _keep()


def of_stages(names: Iterable[str]) -> float | None:
    """Seconds that these stages took together the last time; None where one of them never ran here."""
    return sum(_stages[name] for name in names) if all(name in _stages for name in names) else None


def _keep() -> None:
    # a folder that cannot be written: it is learned again the next time
    with contextlib.suppress(Problem, OSError, ValueError):
        write_json(_file(), {**_rates, STAGES: _stages})


def work(settings: Settings) -> float:
    """Millions of texels times steps; a step through the network's gradient counts for two."""
    solve = settings.solve
    return solve.size**2 / 1e6 * solve.steps * (2 if solve.guidance == "dps" else 1)


def _spoken(minutes: float) -> str:
    return iface_("under 1 min") if minutes < 1 else iface_("about {} min").format(f"{minutes:.0f}")


def _file() -> Path:
    return Path(bpy.utils.extension_path_user(extension.NAME, create=True)) / "timings.json"


def register():
    unregister()
    with contextlib.suppress(OSError, ValueError, TypeError, AttributeError):  # none yet, or not ours
        kept = json.loads(_file().read_text(encoding="utf-8"))
        _stages.update({str(name): float(seconds) for name, seconds in kept.pop(STAGES, {}).items()})
        _rates.update({str(device): float(rate) for device, rate in kept.items()})


def unregister():
    _rates.clear()
    _stages.clear()
