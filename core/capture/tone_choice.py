# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Skin tone that the artist chose for a capture, and the gain that brings solved maps to it.

The choice is a text as settings.solve.skin_tone has it, in skin_tone.json, so a copy of the capture has it too. A solve
uses it and records the tone of its maps in capture.json. Maps keep that tone: if another one is chosen later, what is
shown and delivered is their skin times a gain (toned_albedo.py). No stage imports this module, so changing it makes no
stage older.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..settings.colour_values import TONE_DECIMALS, Colour, parse_skin_tone, to_linear
from ..settings.skin_swatches import is_unsure, make_swatches
from .capture import Capture
from .files import write_json
from .json_files import is_number, read_json
from .messages import Problem

KEY = "skin_tone"
MEASURED = "maps"
"""Source of a tone that was measured on maps without a record."""
ODD_SOURCES = "no colour", "strange colours"
"""Sources of an estimate that is a guess whatever its deviation says."""
SAME = 10.0**-TONE_DECIMALS
"""Difference of sRGB channels up to which two tones are one."""


@dataclass(frozen=True)
class SolvedTone:
    """Tone of the solved maps, and the pictures' estimate: tones in sRGB, deviation of L*; None for what is unknown."""

    solved: Colour
    estimate: Colour | None
    deviation: float | None
    source: str


@dataclass(frozen=True)
class ToneChange:
    """A tone that was chosen after the solve, both in sRGB."""

    solved: Colour
    chosen: Colour

    @property
    def gain(self) -> Colour:
        """Linear factors [3] for the albedo of skin."""
        return tuple(b / a for a, b in zip(to_linear(self.solved), to_linear(self.chosen), strict=True))


def read_choice(capture: Capture) -> str | None:
    """Return the choice as a setting has it, None if none was ever made. Raises Problem for a damaged file."""
    try:
        text = read_json(capture.skin_tone)[KEY]
        parse_skin_tone(text)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, Problem) as error:
        raise Problem(
            f"{capture.skin_tone} cannot be used ({error}).", "Delete this file, and choose the skin tone again."
        ) from error
    return text


def write_choice(capture: Capture, text: str) -> None:
    """Record a choice, if it is another one. Raises Problem if it is no tone, or cannot be written."""
    parse_skin_tone(text)
    if text != (read_choice(capture) or "auto"):
        write_json(capture.skin_tone, {KEY: text})


def read_solved_tone(record: dict) -> SolvedTone | None:
    """Return the tone of the maps by the content of capture.json; None before a solve, and from very old ones."""
    figures = record["stages"].get("solve", {}).get("figures", {})
    solved = _colour(figures.get("skin_tone_srgb"))
    if solved is None:
        return None
    source = figures.get("skin_tone_source")
    estimate = solved if source not in ("given", "earlier solve") else _colour(figures.get("skin_tone_estimate_srgb"))
    deviation = figures.get("skin_tone_deviation_l")
    return SolvedTone(solved, estimate, float(deviation) if is_number(deviation, 0) else None, str(source or ""))


def read_estimate(record: dict) -> SolvedTone | None:
    """Return the estimated tone with its deviation, by the solve or by an earlier stage; None if none is known."""
    stages = record["stages"]
    for name in ("solve", *(name for name in stages if name != "solve")):
        tone = read_solved_tone({"stages": {"solve": stages.get(name, {})}})
        if tone is not None and tone.estimate is not None and tone.deviation is not None:
            return tone
    return None


def is_open(deviation: float, source: str) -> bool:
    """Return whether an estimate of this deviation and source leaves so much open that the artist is to choose."""
    return is_unsure(deviation) or source in ODD_SOURCES


def find_chosen(choice: str, tone: SolvedTone) -> Colour:
    """Return the colour of a choice after the solve: a swatch in the person's hue; auto is the estimate.

    Raises Problem if the choice is no tone.
    """
    chosen = parse_skin_tone(choice)
    if chosen is None:
        return tone.estimate or tone.solved
    return chosen if isinstance(chosen, tuple) else make_swatches(tone.estimate or tone.solved)[chosen - 1]


def find_change(record: dict, choice: str, measure: Callable[[], Colour] | None = None) -> ToneChange | None:
    """Return what a choice changes in the solved maps, None if nothing. Raises Problem if it is no tone.

    `measure` returns the tone of maps that have none on record.
    """
    tone = read_solved_tone(record)
    if tone is None and measure is not None and parse_skin_tone(choice) is not None:
        tone = SolvedTone(measure(), None, None, MEASURED)
    if tone is None:
        return None
    chosen = find_chosen(choice, tone)
    same = all(abs(a - b) <= SAME for a, b in zip(chosen, tone.solved, strict=True))
    return None if same else ToneChange(tone.solved, chosen)


def asks_for_choice(record: dict, choice: str) -> bool:
    """Return whether the estimate of a capture spans more than three swatches, and nobody has chosen a tone."""
    estimate = read_estimate(record) if parse_skin_tone(choice) is None else None
    return estimate is not None and is_open(estimate.deviation, estimate.source)


def _colour(value) -> Colour | None:
    """Return a figure of three channels in (0, 1], else None."""
    sound = isinstance(value, Sequence) and len(value) == 3 and all(is_number(v, 0, 1) and v > 0 for v in value)
    return tuple(map(float, value)) if sound else None
