# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighters' cards: one for each, whole sentences, true to the code, and the same in the terminal and in the
docs."""

import subprocess
import sys
from dataclasses import fields

from core.capture import switchlight_api as service
from core.settings import delighter_cards
from core.settings.settings import DelightSettings
from tests.conftest import ROOT

CARDS = delighter_cards.CARDS


def test_every_delighter_has_a_card_of_whole_sentences():
    assert set(delighter_cards.choices()) <= set(CARDS)
    order = [name for name in CARDS if name in delighter_cards.choices()]
    assert order == list(delighter_cards.choices()), "in the order they are offered"
    for name, card in CARDS.items():
        for text in (
            card.what,
            *(getattr(card, field) for field, _ in delighter_cards.FACTS),
            *(why for _, why in card.needed),
        ):
            assert text[0].isupper() and text.endswith((".", ".)")) and "  " not in text, (name, text)


def test_the_cards_are_those_of_the_delighters_there_are():
    from core.stages.delight import DELIGHTERS

    assert set(DELIGHTERS) == set(delighter_cards.choices())


def test_every_setting_of_the_stage_stands_on_a_card():
    own = {name for card in CARDS.values() for name in card.settings}
    assert {f.name for f in fields(DelightSettings)} - {"delighter"} <= own
    for name in delighter_cards.choices():
        assert set(CARDS[name].settings) >= {needed for needed, _ in CARDS[name].needed}


def test_what_leaves_the_machine_and_what_it_costs_is_said_of_the_paid_one_alone():
    assert [name for name, card in CARDS.items() if card.sends] == ["switchlight"]
    card = CARDS["switchlight"]
    assert (
        "face" in card.leaves
        and service.COMPANY in card.runs
        and "1 credit of" in card.costs
        and "0.5 credits" in card.costs
    )


def test_what_is_missing_is_said_of_the_settings_that_may_not_stay_empty():
    assert delighter_cards.missing(DelightSettings(), "folder") == ["No folder of delit pictures is chosen."]
    assert delighter_cards.missing(DelightSettings(folder="/pictures"), "folder") == []
    assert delighter_cards.missing(DelightSettings(), "none") == []


def test_the_docs_have_the_cards_as_they_are():
    page = (ROOT / "docs" / "delighters.md").read_text(encoding="utf-8")
    told = page[page.index("<!-- cards -->\n") + len("<!-- cards -->\n") : page.index("<!-- end of cards -->")]
    assert told.strip() == delighter_cards.markdown().strip(), (
        "python -m core delighters --markdown prints what belongs there"
    )


def test_the_terminal_has_them():
    shown = subprocess.run(
        [sys.executable, "-B", "-m", "core", "delighters"], cwd=ROOT, capture_output=True, text=True, timeout=60
    ).stdout
    for name in delighter_cards.choices():
        assert CARDS[name].what in shown and CARDS[name].leaves in shown
