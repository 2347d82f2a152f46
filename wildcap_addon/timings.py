# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Durations of the stages on this machine, learned from the last runs and kept in the extension's user folder.

A solve scales with its settings: a sampling step costs in proportion to the map's texels, and twice as much with the
gradient through the network. Other stages are expected to take as long as the last time.
"""

import contextlib
import json
from collections.abc import Iterable
from pathlib import Path

from bpy.app.translations import pgettext_iface as iface_

from ..core.capture.files import write_json
from ..core.capture.messages import Problem
from ..core.settings.settings import QUALITIES, Settings, preset
from .extension import user_file

_rates: dict[str, float] = {}  # device -> seconds per million texels and step
_stages: dict[str, float] = {}  # stage -> seconds of the last run
STAGES = "stages"


def minutes(quality: str, device: str) -> float | None:
    """Return the expected minutes of a solve, None before the first one on that device."""
    return _rates[device] * work(preset(quality)) / 60 if device in _rates else None


def describe_minutes(device: str) -> str:
    """Describe the expected minutes of all qualities; '' before the first solve."""
    if device not in _rates:
        return ""
    return ", ".join(f"{quality.title()} {_spoken(minutes(quality, device))}" for quality in QUALITIES)


def record(settings: Settings, seconds: float) -> None:
    """Record a complete solve; other recipes, other priors and edited parts are ignored."""
    if settings.edited_part or settings.solve.recipe != "wildcap" or settings.solve.prior:
        return
    _rates[settings.compute_device] = seconds / work(settings)
    _save()


def record_stage(name: str, seconds: float) -> None:
    """Record a stage that ran."""
    _stages[name] = seconds
    _save()


def of_stages(names: Iterable[str]) -> float | None:
    """Return the seconds that these stages took in all the last time; None if one of them never ran."""
    return sum(_stages[name] for name in names) if all(name in _stages for name in names) else None


def work(settings: Settings) -> float:
    """Return millions of texels times steps; a step through the network's gradient counts twice."""
    solve = settings.solve
    return solve.size**2 / 1e6 * solve.steps * (2 if solve.guidance == "dps" else 1)


def _spoken(minutes: float) -> str:
    return iface_("under 1 min") if minutes < 1 else iface_("about {} min").format(f"{minutes:.0f}")


def _file() -> Path:
    return user_file("timings.json")


def _save() -> None:
    # without a writable folder the durations are learned again the next time
    with contextlib.suppress(Problem, OSError, ValueError):
        write_json(_file(), {**_rates, STAGES: _stages})


def register():
    unregister()
    with contextlib.suppress(OSError, ValueError, TypeError, AttributeError):  # no file yet, or a foreign one
        content = json.loads(_file().read_text(encoding="utf-8"))
        _stages.update({str(name): float(seconds) for name, seconds in content.pop(STAGES, {}).items()})
        _rates.update({str(device): float(rate) for device, rate in content.items()})


def unregister():
    _rates.clear()
    _stages.clear()
