# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of all stages: found by name, checked, combined and written, and the presets of quality.

stage_settings.py declares those of each stage.
"""

from __future__ import annotations

import ast
import difflib
import inspect
import os
from dataclasses import MISSING, Field, asdict, dataclass, field, fields, replace
from functools import cache

from ..capture.messages import Problem
from .setting_values import check_value, setting
from .stage_settings import (
    CamerasSettings,
    DelightSettings,
    DeliverSettings,
    FramesSettings,
    RegistrationSettings,
    RetouchSettings,
    ScanSettings,
    ShadowMaskSettings,
    SolveSettings,
    TextureSettings,
    TransferSettings,
    UpscaleSettings,
)


@dataclass(frozen=True)
class Settings:
    """Settings of all stages, and those that they share."""

    seed: int = setting(0, min=0, max=2**31 - 1, flag="--seed")
    """The same seed gives the same maps"""
    device: str = setting("auto", choices=("auto", "cpu", "cuda", "mps"), flag="--device")
    """Where the solver computes; auto: where a pass of its network has been shown to run, and faster than on the CPU"""
    edited_part: bool = setting(False, flag="--edited-part", affects_result=False)
    """Solve only what a mask edit touched since the last solve, where that can be done"""
    frames: FramesSettings = field(default_factory=FramesSettings)
    cameras: CamerasSettings = field(default_factory=CamerasSettings)
    scan: ScanSettings = field(default_factory=ScanSettings)
    registration: RegistrationSettings = field(default_factory=RegistrationSettings)
    delight: DelightSettings = field(default_factory=DelightSettings)
    texture: TextureSettings = field(default_factory=TextureSettings)
    shadow_mask: ShadowMaskSettings = field(default_factory=ShadowMaskSettings)
    solve: SolveSettings = field(default_factory=SolveSettings)
    upscale: UpscaleSettings = field(default_factory=UpscaleSettings)
    retouch: RetouchSettings = field(default_factory=RetouchSettings)
    transfer: TransferSettings = field(default_factory=TransferSettings)
    deliver: DeliverSettings = field(default_factory=DeliverSettings)

    @property
    def compute_device(self) -> str:
        """Device by name; a worker replaces auto by a tested one before a stage runs, else it is the CPU."""
        return "cpu" if self.device == "auto" else self.device


STAGE_KINDS = {f.name: f.default_factory for f in fields(Settings) if f.default_factory is not MISSING}
"""Stage, or the tool deliver -> class of its settings."""
SYNTAX = 'Settings are written as {"solve": {"steps": 30}, "seed": 1}.'
CARDS = {"grey": 0.18, "white": 0.88}
"""Reflectance of a grey card and of white paper, to measure a white point on."""
QUALITIES = ("draft", "standard", "film")
_PRESETS = {
    "draft": {"solve": {"size": 512, "steps": 30, "guidance": "proximal"}, "scan": {"pairs": 16}},
    "standard": {},
    "film": {"scan": {"pairs": 48}},
}


def preset(quality: str) -> Settings:
    """Return the settings of a quality. Raises Problem for an unknown name."""
    if quality not in _PRESETS:
        raise Problem(f"There is no quality named {quality!r}.", f"Choose one of {', '.join(QUALITIES)}.")
    return from_json(_PRESETS[quality])


def to_json(settings: Settings) -> dict:
    """Return settings as `from_json` reads them."""
    return asdict(settings)


@cache
def known_settings() -> dict[str, Field]:
    """Return the field of every setting by name, STAGE.NAME; the shared ones come first."""
    shared = {f.name: f for f in fields(Settings) if f.name not in STAGE_KINDS}
    return {**shared, **{f"{stage}.{f.name}": f for stage, kind in STAGE_KINDS.items() for f in fields(kind)}}


def result_settings(stage_settings) -> dict:
    """Return the settings of one stage that its result depends on: name -> value."""
    return {
        f.name: getattr(stage_settings, f.name)
        for f in fields(stage_settings)
        if f.metadata.get("affects_result", True)
    }


def result_paths(stage_settings) -> dict[str, str]:
    """Return the files and folders that the result of one stage depends on: name -> path with ~ expanded."""
    paths = [f.name for f in fields(stage_settings) if "path" in f.metadata]
    return {
        name: os.path.expanduser(value)
        for name, value in result_settings(stage_settings).items()
        if name in paths and value
    }


def quality_settings(kind: type) -> list[str]:
    """List the settings of one stage's class that a quality sets: none about the face, and no path."""
    return [f.name for f in fields(kind) if not f.metadata.get("per_face") and "path" not in f.metadata]


def from_json(by_stage: dict, base: Settings | None = None) -> Settings:
    """Apply `by_stage` (stage -> {name: value}, and shared name -> value) to `base` or the defaults.

    Raises Problem for another object, an unknown name, a wrong type, or a value out of its range.
    """
    settings = base or Settings()
    if not isinstance(by_stage, dict):
        raise Problem(f"The settings have to be a JSON object, not {by_stage!r:.60}.", SYNTAX)
    for name, value in by_stage.items():
        if "." in name:
            raise Problem(f"There is no key {name!r} in the settings: each stage has an object of its own.", SYNTAX)
        if name not in STAGE_KINDS:
            value = check_value(name, find_setting(name), value)
        elif not isinstance(value, dict):
            raise Problem(f"The settings of the stage {name} have to be an object, not {value!r:.60}.", SYNTAX)
        else:
            value = replace(
                getattr(settings, name),
                **{k: check_value(f"{name}.{k}", find_setting(f"{name}.{k}"), v) for k, v in value.items()},
            )
        settings = replace(settings, **{name: value})
    return settings


def find_setting(name: str) -> Field:
    """Return the field of a setting. Raises Problem for an unknown name, and suggests the nearest."""
    if name not in known_settings():
        near = difflib.get_close_matches(name, [*known_settings(), *STAGE_KINDS], 1, 0.5)
        raise Problem(
            f"There is no setting named {name!r}.",
            f"{f'Did you mean {near[0]}? ' if near else ''}`python -m core settings` lists all of this "
            "version; a newer one may have more.",
        )
    return known_settings()[name]


@cache
def tooltips(kind: type) -> dict[str, str]:
    """Return field name -> the docstring below it, in one line, from the class's source."""
    body = ast.parse(inspect.getsource(kind)).body[0].body
    docstrings = {}
    for node, following in zip(body, body[1:], strict=False):
        described = isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)
        if isinstance(node, ast.AnnAssign) and described:
            docstrings[node.target.id] = " ".join(following.value.value.split())
    return docstrings
