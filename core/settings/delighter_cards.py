# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The card of each delighter: where it runs, what leaves the machine and what it costs.

Shown by the add-on beside the choice, by `python -m core delighters`, and in docs/delighters.md.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from ..capture import switchlight_api as service
from .settings import DelightSettings

NOTHING = "Nothing."


@dataclass(frozen=True)
class Card:
    """Whole sentences for an artist.

    `settings` are the fields of DelightSettings that only this delighter uses; `needed` has (field, sentence) of those
    that must not stay empty.
    """

    title: str
    what: str
    best_for: str
    runs: str
    weights: str
    licence: str
    leaves: str = NOTHING
    costs: str = NOTHING
    shadows: str = "No."
    settings: tuple[str, ...] = ()
    needed: tuple[tuple[str, str], ...] = ()

    @property
    def sends(self) -> bool:
        """True if anything leaves the machine."""
        return self.leaves != NOTHING


FACTS = (
    ("best_for", "Best for"),
    ("runs", "Where it runs"),
    ("leaves", "What leaves your machine"),
    ("costs", "What it costs"),
    ("shadows", "Finds shadows"),
    ("weights", "Weights"),
    ("licence", "Licence"),
)
"""Rows of a card: field and label."""

CARDS = {
    "network": Card(
        "Network",
        "Our own network looks at each frame and at the head's shape, and takes light and shadow out of it.",
        best_for="Most captures: ordinary light, with or without hard shadows.",
        runs="On your machine, on the processor or on a GPU.",
        shadows="Yes: it says of every pixel how much of the main light is blocked there.",
        weights="Come with the extension.",
        licence="GPL-3.0-or-later, code and weights; trained on synthetic faces of our own, with some painted skins "
        "(MIT) and panoramas (CC0).",
    ),
    "shading": Card(
        "Shading",
        "Takes the light of the surroundings out of every frame by the head's own shape. No network is involved, so "
        "nothing can be invented.",
        best_for="Soft light. Hard shadows are left to the mask and the solver.",
        runs="On your machine, on the processor; seconds per frame.",
        shadows="Yes, where there is a sun: those of the head itself, and of what stands beside it.",
        weights="None.",
        licence="GPL-3.0-or-later.",
    ),
    "switchlight": Card(
        "SwitchLight",
        f"A paid service of the company {service.COMPANY} that answers each frame with one without light. It is what "
        "the paper uses.",
        best_for="Those who have an account there, and the permission of the person who was filmed.",
        runs=f"On the machines of {service.COMPANY}, at {service.BASE.split('/')[2]}; about five seconds per frame, "
        "three at a time.",
        leaves="The chosen frames, which show a person's face, and your key. Only after you agreed to it for this "
        "capture.",
        costs=f"Per frame {service.amount(service.CREDITS_PER_PICTURE)} of your account, or "
        f"{service.amount(service.CREDITS_PER_PREVIEW)} for a small picture "
        f"of {service.PREVIEW_PX} px at most. An answer that has come is never paid for again.",
        weights="None on your machine.",
        licence=f"{service.COMPANY}'s terms ({service.WEBSITE}): what comes back may not be used to train a model.",
        settings=("switchlight_preview",),
    ),
    "opendelight": Card(
        "OpenDelight",
        "The published delighting network of the paper OpenDelight, where you have its weights.",
        best_for="Comparing, if you have the weights.",
        runs="On your machine; a GPU helps a lot.",
        weights="You provide them: the folder with the authors' two files. It was not verified on real weights.",
        licence="Our code GPL-3.0-or-later; the weights are under their authors' terms.",
        settings=("checkpoint",),
        needed=(("checkpoint", "The folder with OpenDelight's two files is not chosen."),),
    ),
    "folder": Card(
        "Folder",
        "Takes pictures that another program has delit, for instance a relighting network.",
        best_for="Using the best model that you have access to. Name the pictures like the frames; neither crop nor "
        "turn them.",
        runs="Wherever you made the pictures.",
        costs="Nothing here.",
        weights="None here.",
        licence="You have to keep to the licence of the program that made the pictures.",
        settings=("folder",),
        needed=(("folder", "No folder of delit pictures is chosen."),),
    ),
    "none": Card(
        "None",
        "Leaves the frames as they were shot.",
        best_for="A face that was filmed under an overcast sky or in a light tent; and to see what the others are "
        "worth.",
        runs="On your machine, at once.",
        weights="None.",
        licence="GPL-3.0-or-later.",
    ),
}


def choices() -> tuple[str, ...]:
    """Return the delighters in the order of the menu."""
    return next(f for f in fields(DelightSettings) if f.name == "delighter").metadata["choices"]


def missing(settings, delighter: str) -> list[str]:
    """Return sentences on the settings that a delighter needs and that are empty."""
    return [why for name, why in CARDS[delighter].needed if not getattr(settings, name)]


def text() -> str:
    """Format all cards for a terminal."""
    width = max(len(label) for _, label in FACTS)
    cards = []
    for name, card in CARDS.items():
        rows = [f"  {label:{width}}  {getattr(card, field)}" for field, label in FACTS]
        cards.append("\n".join([f"{name}: {card.what}", *rows]))
    return "\n\n".join(cards)


def markdown() -> str:
    """Format all cards for docs/delighters.md."""
    cards = []
    for name, card in CARDS.items():
        rows = [f"| {label} | {getattr(card, field)} |" for field, label in FACTS]
        cards.append("\n".join([f"### {card.title} (`{name}`)", "", card.what, "", "| | |", "| --- | --- |", *rows]))
    return "\n\n".join(cards) + "\n"
