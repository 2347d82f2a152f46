# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of the delighter: all of them, and the card, settings and needs of the chosen one."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture import switchlight_api as service
from ...core.settings import delighter_cards
from .. import preferences, problems, status

COLUMNS = 3
LOOKS = {
    "best_for": 'CHECKMARK',
    "leaves": 'HIDE_OFF',
    "costs": 'DISC',
    "runs": 'MEMORY',
    "shadows": 'LIGHT_SUN',
    "weights": 'FILE_BLANK',
    "licence": 'TEXT',
}
FOLDED = ("runs", "shadows", "weights", "licence")
"""Facts of a card that only the unfolded card shows."""


def draw(layout, item, width: int) -> None:
    """Draw the Delighter panel up to the wipe; delighters that lack something are greyed."""
    delighter = item.delight.delighter
    torch = layout.split(factor=0.3)
    torch.label(text="Torch")
    torch.row(align=True).prop(item.delight, "torch", expand=True)
    capture_status = status.of(item)
    if capture_status is not None and capture_status.torch_percent is not None:
        text = iface_("{} % of the light came from a torch. It was taken out.").format(capture_status.torch_percent)
        problems.draw_text(layout, text, width, 'LIGHT_SPOT')
    if item.delight.torch == "on":
        return
    grid = layout.grid_flow(columns=COLUMNS, row_major=True, even_columns=True, align=True)
    for name in delighter_cards.choices():
        cell = grid.row(align=True)
        cell.active = name == delighter or not lacks(item, name)
        cell.prop_enum(item.delight, "delighter", name)
    card = delighter_cards.CARDS[delighter]
    box = layout.box()
    problems.draw_text(box, card.what, width)
    _draw_facts(box, card, width, folded=False)
    header, more = layout.panel("wildcap_card", default_closed=True)
    header.label(text="Details")
    if more:
        _draw_facts(more, card, width, folded=True)
    column = layout.column()
    for name in card.settings:
        column.prop(item.delight, name)
    if delighter == "switchlight":
        preferences.draw_key(column, "Key")
        _draw_sending(column, item, width)
    for reason in lacks(item, delighter):
        problems.draw_text(layout.column(), iface_(reason).format(service.WEBSITE), width, 'ERROR')


def lacks(item, name: str) -> list[str]:
    """Return why a delighter cannot run, a sentence each, {} for the service's website; does not touch the disk."""
    reasons = list(delighter_cards.missing(item.delight, name))
    if name == "switchlight" and not preferences.switchlight_key():
        reasons.append("There is no key. Get one at {}, and enter it above.")
    if name == "switchlight" and not bpy.app.online_access:
        reasons.append("Blender is set to work offline (Preferences, System, Network).")
    return reasons


def _draw_facts(layout, card: delighter_cards.Card, width: int, folded: bool) -> None:
    for field, label in delighter_cards.FACTS:
        if (field in FOLDED) == folded:
            text = iface_("{}: {}").format(iface_(label), iface_(getattr(card, field)))
            problems.draw_text(layout, text, width, LOOKS[field])


def _draw_sending(layout, item, width: int) -> None:
    """Draw whether the frames may leave the machine, and the button that allows or forbids it."""
    capture_status = status.of(item)
    plan = capture_status.sending if capture_status is not None else None
    if plan is None:
        text = "Which frames are sent is known once Reconstruct has chosen them: it stops then, and asks."
        problems.draw_text(layout, text, width, 'INFO')
        return
    if not plan.frames:
        text = iface_("All {} answers are here. Nothing will be sent or charged.").format(plan.kept)
        problems.draw_text(layout, text, width, 'CHECKMARK')
        return
    words, icon, button = (
        ("You agreed: {} frames go to {} for {}.", 'UNLOCKED', ("wildcap.withdraw_consent", 'X'))
        if capture_status.agreed
        else (
            "{} frames would go to {} for {}. Nothing is sent before you agree.",
            'LOCKED',
            ("wildcap.allow_sending", 'UNLOCKED'),
        )
    )
    text = iface_(words).format(len(plan.frames), service.COMPANY, service.amount(plan.credits))
    problems.draw_text(layout, text, width, icon)
    layout.operator(button[0], icon=button[1])
