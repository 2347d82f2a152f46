# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delighter of the paper: SwitchLight, a paid service of Beeble (Kim et al., CVPR 2024). Frames leave the machine.

Nothing is sent without the artist's consent (core/capture/consent.py), and nothing twice: answers are kept in the
capture by the hash of what was sent. They report no shadows. core/capture/switchlight_api.py describes the service.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait

import numpy as np

from ...capture import consent
from ...capture import switchlight_api as service
from ...capture.capture import Capture
from ...capture.hashes import hash_bytes, hash_file
from ...capture.messages import Problem, Reporter
from ...geometry.views import View, read_views
from ...imaging import images
from ...settings.settings import Settings
from .contract import Delit
from .switchlight_calls import MEDIA_TYPES, Account, balance
from .switchlight_line import Parcel, Patience, send

PATIENCE = Patience()


def switchlight(capture: Capture, settings: Settings, report: Reporter) -> Iterator[Delit]:
    """Yield SwitchLight's albedo of the selected frames, at their size.

    Raises Problem without consent, key, credits or a service that answers.
    """
    views, preview = read_views(capture, selected_only=True), settings.delight.switchlight_preview
    plan = consent.sending(capture, preview, [view.name for view in views])
    calls = obtain(capture, plan, report) if plan.frames else 0
    report.figure("switchlight_calls", calls)
    report.figure("switchlight_credits", plan.credits)
    report.figure("switchlight_frames_kept_before", plan.kept)
    for i, view in enumerate(views):
        report.progress(i, len(views), "Reading SwitchLight's answers")
        answer = consent.answer(capture, hash_file(view.path), preview)
        yield Delit(view, fit_answer(images.read_data(answer), view))


def obtain(capture: Capture, plan: consent.Sending, report: Reporter) -> int:
    """Obtain the answers to the frames of a plan, after all checks, and return the number of calls. Raises Problem."""
    if os.environ.get(service.OFFLINE_VARIABLE):
        raise Problem(
            "Blender is set to work offline, and SwitchLight is on the network: nothing was sent.",
            "Allow online access (Preferences, System, Network), or choose another delighter.",
        )
    consent.require(capture, plan)
    account = Account(service.base(), service.key())
    for line in consent.lines(plan):
        report.log(line)
    credits = _run_cancellable(lambda: balance(account), report)
    if credits is None:
        report.log("SwitchLight does not say how many credits are left.")
    elif credits < plan.credits:
        raise Problem(
            f"{service.amount(plan.credits)} are needed, and your SwitchLight account has "
            f"{service.amount(credits)}: nothing was sent.",
            f"Buy some at {service.WEBSITE}, lower Views under Reconstruction, Frames, or take small "
            "pictures at half the credits (--preview).",
        )
    else:
        report.log(f"Your account has {service.amount(credits)}.")
    parcels = [pack_frame(capture, name, content, plan.preview) for name, content in plan.frames.items()]
    return send(account, parcels, plan.preview, report, PATIENCE)


def pack_frame(capture: Capture, name: str, content: str, preview: bool) -> Parcel:
    """Return a frame's file as it is sent, if it still has the hash `content` that consent was given for.

    Raises Problem if the frame has changed, and for a kind of file that the service does not take.
    """
    path = capture.frames / name
    if path.suffix.lower() not in MEDIA_TYPES:
        raise Problem(
            f"SwitchLight does not accept pictures like {name}.", "Run the stage Frames again, which writes JPEG."
        )
    data = path.read_bytes()
    if hash_bytes(data) != content:
        raise Problem(
            f"The frame {name} changed after you agreed to send it: nothing more was sent.",
            "Look at the frames, and click Allow Sending again.",
        )
    return Parcel(name, data, path.suffix.lower(), consent.answer(capture, content, preview))


def _run_cancellable(ask: Callable[[], float | None], report: Reporter) -> float | None:
    """Return or raise what `ask()` does, in a thread, so that the user can cancel meanwhile."""
    answer = Future()

    def work() -> None:
        try:
            answer.set_result(ask())
        except Exception as error:  # raised again by result()
            answer.set_exception(error)

    threading.Thread(target=work, name="switchlight-balance", daemon=True).start()
    while not answer.done():
        report.check()
        wait([answer], 0.1)
    return answer.result()


def fit_answer(answer: np.ndarray, view: View) -> np.ndarray:
    """Return an answer [h, w, 1 to 4] at its frame's size, sRGB [H, W, 3], over the frame's background if it was cut.

    Raises Problem for another shape.
    """
    if abs(answer.shape[1] / answer.shape[0] - view.width / view.height) > 0.01:
        raise Problem(
            f"SwitchLight answered {view.name} with {answer.shape[1]} x {answer.shape[0]} pixels, but the "
            f"frame is {view.width} x {view.height}.",
            "The answer is kept in the capture's folder switchlight; choose another delighter.",
        )
    if answer.shape[:2] != (view.height, view.width):
        answer = images.resize(answer, view.width, view.height).reshape(view.height, view.width, -1)
    colour = answer[..., :3] if answer.shape[2] >= 3 else np.repeat(answer[..., :1], 3, 2)
    if answer.shape[2] in (2, 4):  # OpenImageIO returns colours that are multiplied by alpha
        colour = colour + (1 - np.clip(answer[..., -1:], 0, 1)) * view.read()
    return np.clip(colour, 0, 1)
