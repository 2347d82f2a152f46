# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The choice of the delighter as it is drawn: all of them with those greyed that lack something, the card of the chosen
one, its own settings and needs."""

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
"""Facts of a card that are shown when it is unfolded."""


def draw(layout, item, width: int) -> None:
    """Everything of the Delighter panel but the wipe."""
    chosen = item.delight.delighter
    grid = layout.grid_flow(columns=COLUMNS, row_major=True, even_columns=True, align=True)
    for name in delighter_cards.choices():
        cell = grid.row(align=True)
        cell.active = name == chosen or not lacks(item, name)
        cell.prop_enum(item.delight, "delighter", name)
    card = delighter_cards.CARDS[chosen]
    box = layout.box()
    problems.draw_text(box, card.what, width)
    _draw_facts(box, card, width, folded=False)
    header, more = layout.panel("wildcap_card", default_closed=True)
    header.label(text="More About It")
    if more:
        _draw_facts(more, card, width, folded=True)
    column = layout.column()
    for name in card.settings:
        column.prop(item.delight, name)
    if chosen == "switchlight":
        preferences.draw_key(column, "Key")
        _draw_sending(column, item, width)
    for why in lacks(item, chosen):
        problems.draw_text(layout.column(), iface_(why).format(service.WEBSITE), width, 'ERROR')


def lacks(item, name: str) -> list[str]:
    """Why a delighter cannot run as things are, one sentence each, {} for the service's website; asks no disk."""
    reasons = list(delighter_cards.missing(item.delight, name))
    if name == "switchlight" and not preferences.has_switchlight_key():
        reasons.append("There is no key. Get one at {}, and enter it above.")
    if name == "switchlight" and not bpy.app.online_access:
        reasons.append("Blender is set to work offline (Preferences, System, Network).")
    return reasons


def _draw_facts(layout, card: delighter_cards.Card, width: int, folded: bool) -> None:
    for field, label in delighter_cards.FACTS:
        if (field in FOLDED) == folded:
            problems.draw_text(
                layout, iface_("{}: {}").format(iface_(label), iface_(getattr(card, field))), width, LOOKS[field]
            )


def _draw_sending(layout, item, width: int) -> None:
    """Whether the frames may leave the machine, and the button that says yes."""
    known = status.of(item)
    plan = known.sending if known is not None else None
    if plan is None:
        problems.draw_text(
            layout,
            "Which frames are sent is known once Reconstruct has chosen them: it stops then, and asks.",
            width,
            'INFO',
        )
    elif not plan.frames:
        problems.draw_text(
            layout,
            iface_("All {} answers are here. Nothing will be sent or charged.").format(plan.kept),
            width,
            'CHECKMARK',
        )
    else:
        words = (
            "You agreed: {} frames go to {} for {}."
            if known.agreed
            else "{} frames would go to {} for {}. Nothing is sent before you agree."
        )
        text = iface_(words).format(len(plan.frames), service.COMPANY, service.amount(plan.credits))
        problems.draw_text(layout, text, width, 'UNLOCKED' if known.agreed else 'LOCKED')
        layout.operator(
            "wildcap.withdraw_consent" if known.agreed else "wildcap.allow_sending",
            icon='X' if known.agreed else 'UNLOCKED',
        )
