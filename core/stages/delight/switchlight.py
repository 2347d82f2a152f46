# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighter that the paper uses: SwitchLight, a paid service of Beeble (Kim et al., CVPR 2024). The selected frames
leave the machine.

Nothing is sent without the artist's consent (core/capture/consent.py), nothing twice: answers are kept in the capture
by the hash of what was sent. They say nothing about shadows. What is known of the service, and how well, is in
core/capture/switchlight_api.py.
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
    """SwitchLight's albedo of the selected frames, at their size. Raises Problem without consent, key, credits or a
    service that answers."""
    views, preview = read_views(capture, selected_only=True), settings.delight.switchlight_preview
    plan = consent.sending(capture, preview, [view.name for view in views])
    calls = obtain(capture, plan, report) if plan.frames else 0
    report.figure("switchlight_calls", calls)
    report.figure("switchlight_credits", plan.credits)
    report.figure("switchlight_frames_kept_before", plan.kept)
    for i, view in enumerate(views):
        report.progress(i, len(views), "Reading SwitchLight's answers")
        answer = consent.answer(capture, hash_file(view.path), preview)
        yield Delit(view, fitted(images.read_data(answer), view))


def obtain(capture: Capture, plan: consent.Sending, report: Reporter) -> int:
    """Has the frames of a plan answered, after everything that could forbid it was asked; the number of calls. Raises
    Problem."""
    if os.environ.get(service.OFFLINE_VARIABLE):
        raise Problem(
            "Blender is set to work offline, and SwitchLight is on the network: nothing was sent.",
            "Allow online access (Preferences, System, Network), or choose another delighter.",
        )
    consent.require(capture, plan)
    account = Account(service.base(), service.key())
    for line in consent.lines(plan):
        report.log(line)
    left = _listening(report, lambda: balance(account))
    if left is not None and left < plan.credits:
        raise Problem(
            f"{service.amount(plan.credits)} are needed, and your SwitchLight account has "
            f"{service.amount(left)}: nothing was sent.",
            f"Buy some at {service.WEBSITE}, lower Views under Reconstruction, Frames, or take small "
            "pictures at half the credits (--preview).",
        )
    report.log(
        "SwitchLight does not say how many credits are left."
        if left is None
        else f"Your account has {service.amount(left)}."
    )
    return send(
        account,
        [pack_frame(capture, name, content, plan.preview) for name, content in plan.frames.items()],
        plan.preview,
        report,
        PATIENCE,
    )


def pack_frame(capture: Capture, name: str, content: str, preview: bool) -> Parcel:
    """A frame as it is sent: its file as it is, and as it was agreed to.

    Parameters
    ----------
    capture : that consent was given for
    name : of the frame
    content : hash of the frame that was agreed to
    preview : whether small pictures are asked for, at half the credits

    Raises
    ------
    Problem
        Where the frame has changed, and for a kind that the service does not take.
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


def _listening(report: Reporter, ask: Callable[[], float | None]) -> float | None:
    """What `ask()` gives or raises, asked in a thread, so that a cancel is heard meanwhile."""
    with_answer = Future()

    def work() -> None:
        try:
            with_answer.set_result(ask())
        except Exception as error:  # raised again by result()
            with_answer.set_exception(error)

    threading.Thread(target=work, name="switchlight-balance", daemon=True).start()
    while not with_answer.done():
        report.check()
        wait([with_answer], 0.1)
    return with_answer.result()


def fitted(answer: np.ndarray, view: View) -> np.ndarray:
    """An answer [h, w, 1 to 4] as its frame, sRGB [H, W, 3]: where the service cut the background away, the frame's own
    shows. Raises Problem where it is another section."""
    if abs(answer.shape[1] / answer.shape[0] - view.width / view.height) > 0.01:
        raise Problem(
            f"SwitchLight answered {view.name} with {answer.shape[1]} x {answer.shape[0]} pixels, but the "
            f"frame is {view.width} x {view.height}.",
            "The answer is kept in the capture's folder switchlight; choose another delighter.",
        )
    if answer.shape[:2] != (view.height, view.width):
        answer = images.resize(answer, view.width, view.height).reshape(view.height, view.width, -1)
    colour = answer[..., :3] if answer.shape[2] >= 3 else np.repeat(answer[..., :1], 3, 2)
    if answer.shape[2] in (2, 4):  # OpenImageIO hands out colours that are multiplied by alpha
        colour = colour + (1 - np.clip(answer[..., -1:], 0, 1)) * view.read()
    return np.clip(colour, 0, 1)
