# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's consent to send frames to a paid service: consent.json, valid for these pictures in this place only.

The record names the capture's place, the receiving machine, the credits and every picture by its content, so a copied
or moved capture, or changed frames, need a new consent. Answers are kept in switchlight/, named by what was sent.
"""

from __future__ import annotations

import os
import time
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from . import switchlight_api as service
from .capture import Capture
from .files import storage_problems, write_json
from .frame_records import read_frames
from .hashes import hash_file, hash_value
from .json_files import read_json
from .messages import Problem

GIVEN_VARIABLE = "WILDCAP_SWITCHLIGHT_CONSENT"
"""Environment variable by which the terminal's --send-frames reaches the worker: the place of the capture."""
NOTICE = (
    "{pictures} of this capture leave your machine: they show a person's face. Ask that person first.",
    "They are sent to {company}, a company, at {host}, with your key and nothing else. Its terms are at {website}.",
    "{company} charges your account with {credits}.",
    "Its terms forbid training a model on what comes back.",
)
"""Shown before anything is sent."""
NOTICE_KEPT = "{kept} more have their answer already and are not paid again."


@dataclass(frozen=True)
class Sending:
    """Frames to send, name -> content hash, and the number of those `kept` that have an answer already."""

    host: str
    frames: dict[str, str]
    kept: int
    preview: bool

    @property
    def credits(self) -> float:
        return service.price(len(self.frames), self.preview)


def sending(capture: Capture, preview: bool, names: Collection[str] | None = None) -> Sending:
    """Plan to send those of the frames `names` (None: the selected ones) that have no answer yet.

    Raises Problem if there are no frames.
    """
    names = selected(capture) if names is None else names
    hashes = {name: hash_file(capture.frames / name) for name in sorted(names) if (capture.frames / name).is_file()}
    missing = {name: content for name, content in hashes.items() if not answer(capture, content, preview).is_file()}
    return Sending(service.host(), missing, len(hashes) - len(missing), preview)


def selected(capture: Capture) -> list[str]:
    """Return the frames that the texture is made from. Raises Problem if there are none yet."""
    try:
        names = [frame.name for frame in read_frames(capture).records if frame.selected]
    except Problem:
        names = []
    if not names:
        raise Problem("This capture has no frames to send yet.", "Reconstruct first: it stops before anything is sent.")
    return names


def answer(capture: Capture, content: str, preview: bool) -> Path:
    """Return the path of the answer to a picture of that content hash, named by the hash of all that was sent."""
    return capture.switchlight / f"{hash_value([content, service.form(preview)])}.png"


def lines(plan: Sending, translated=str) -> list[str]:
    """Return the sentences to show before sending; `translated` translates a template."""
    fields = {
        "pictures": f"{len(plan.frames)} frame{'' if len(plan.frames) == 1 else 's'}",
        "company": service.COMPANY,
        "host": plan.host,
        "website": service.WEBSITE,
        "credits": service.amount(plan.credits),
        "kept": plan.kept,
    }
    return [translated(line).format(**fields) for line in (*NOTICE, *([NOTICE_KEPT] if plan.kept else []))]


def give(capture: Capture, plan: Sending) -> None:
    """Record the artist's consent."""
    write_json(
        capture.consent,
        {
            "capture": _place(capture),
            "company": service.COMPANY,
            "host": plan.host,
            "credits": plan.credits,
            "preview": plan.preview,
            "frames": plan.frames,
            "given": time.strftime("%Y-%m-%dT%H:%M:%S"),
        },
    )


def withdraw(capture: Capture) -> None:
    """Withdraw the consent: nothing more is sent. Answers stay."""
    with storage_problems(capture.consent):
        capture.consent.unlink(missing_ok=True)


def is_given(capture: Capture, plan: Sending) -> bool:
    """Return whether the consent covers a plan: these pictures, this place and machine, and no more credits."""
    try:
        record = read_json(capture.consent)
        return (
            record["capture"] == _place(capture)
            and record["host"] == plan.host
            and record["preview"] is plan.preview
            and plan.credits <= record["credits"]
            and plan.frames.items() <= record["frames"].items()
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False


def require(capture: Capture, plan: Sending) -> None:
    """Raise Problem without a consent, recorded or by the terminal's flag, which this records."""
    if os.environ.get(GIVEN_VARIABLE) == _place(capture):
        give(capture, plan)
    if not is_given(capture, plan):
        raise Problem(
            f"SwitchLight waits for your consent: {len(plan.frames)} frames that show a person's face would "
            f"go to {service.COMPANY} ({plan.host}) "
            f"for {service.amount(plan.credits)}. Nothing was sent.",
            "Click Allow Sending beside the delighter, or add --send-frames in the terminal; or choose "
            "another delighter, which sends nothing.",
        )


def by_flag(capture: Capture) -> dict[str, str]:
    """Return the environment of a worker that the terminal's flag allows to send this capture's frames."""
    return {GIVEN_VARIABLE: _place(capture)}


def _place(capture: Capture) -> str:
    return str(capture.root.resolve())
