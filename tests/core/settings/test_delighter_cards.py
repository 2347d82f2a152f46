# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighters' cards: one for each, true to the code, and the same in the terminal and in the docs."""

from core.__main__ import main
from core.settings import delighter_cards
from core.settings.settings import DelightSettings
from tests.conftest import ROOT

CARDS = delighter_cards.CARDS


def test_only_the_paid_one_sends():
    assert [name for name, card in CARDS.items() if card.sends] == ["switchlight"]


def test_what_is_missing_is_said_of_the_settings_that_may_not_stay_empty():
    assert len(delighter_cards.missing(DelightSettings(), "folder")) == 1
    assert delighter_cards.missing(DelightSettings(folder="/pictures"), "folder") == []
    assert delighter_cards.missing(DelightSettings(), "none") == []


def test_the_docs_and_the_terminal_have_the_cards_as_they_are(capsys):
    page = (ROOT / "docs" / "delighters.md").read_text(encoding="utf-8")
    cards = page.partition("<!-- cards -->")[2].partition("<!-- end of cards -->")[0]
    assert main(["delighters", "--markdown"]) == 0
    assert capsys.readouterr().out.strip() == cards.strip(), "`delighters --markdown` prints what belongs there"
    assert main(["delighters"]) == 0
    text = capsys.readouterr().out
    assert all(card.what in text and card.leaves in text for card in CARDS.values())
