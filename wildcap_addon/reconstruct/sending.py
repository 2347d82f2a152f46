# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: consent to sending frames of this capture to a paid service, and withdraw it."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture import consent
from ...core.capture.messages import Problem
from .. import captures, frame_icons, preferences, properties
from ..base_operator import CaptureOperator, Dialog

COLUMNS, ICON_SCALE = 6, 4.0
"""Pictures in the dialog: number per row, and height in buttons."""


class WILDCAP_OT_allow_sending(Dialog, bpy.types.Operator):
    """Agree to send the chosen frames of this capture to SwitchLight.

    A dialog first shows what leaves your machine, who gets it, and what it costs.
    """

    bl_idname = "wildcap.allow_sending"
    bl_label = "Allow Sending"

    sending_plan: consent.Sending | None = None
    icons: tuple[int, ...] = ()

    @classmethod
    def poll(cls, context):
        return cls.with_capture(context) and cls.allowed(
            captures.active(context).delight.delighter == "switchlight",
            "Only SwitchLight sends anything: choose it as the delighter first",
        )

    def tell(self) -> tuple[str, ...]:
        item = captures.require(bpy.context)
        self.sending_plan = plan(item)
        self.icons = tuple(frame_icons.load(captures.folder(item).frames / name) for name in self.sending_plan.frames)
        return tuple(consent.lines(self.sending_plan, iface_))

    def draw(self, context):
        super().draw(context)
        grid = self.layout.grid_flow(row_major=True, columns=COLUMNS, even_columns=True, align=True)
        for icon in self.icons:
            grid.template_icon(icon_value=icon, scale=ICON_SCALE)

    def work(self, context):
        item = captures.require(context)
        now = plan(item)
        if self.sending_plan is not None and now != self.sending_plan:
            raise Problem(
                "The frames changed while the question was open.",
                "Click Allow Sending again, and look at what would be sent now.",
            )
        consent.give(captures.folder(item), now)


class WILDCAP_OT_withdraw_consent(CaptureOperator, bpy.types.Operator):
    """Withdraw your consent: no more frames of this capture are sent. SwitchLight's answers stay in the capture."""

    bl_idname = "wildcap.withdraw_consent"
    bl_label = "Withdraw Consent"

    def work(self, context):
        consent.withdraw(captures.folder(captures.require(context)))


def plan(item) -> consent.Sending:
    """Return the frames to send. Raises Problem if there are none, or Blender is offline."""
    preferences.require_online("choose another delighter")
    sending = consent.sending(captures.folder(item), properties.settings(item).delight.switchlight_preview)
    if not sending.frames:
        raise Problem("There is nothing to send: every chosen frame has its answer.", "Click Reconstruct to go on.")
    return sending


CLASSES = (WILDCAP_OT_allow_sending, WILDCAP_OT_withdraw_consent)
