# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours as settings write them: a skin tone and a white point."""

from __future__ import annotations

import re

from ..capture.messages import Problem

TONE_DECIMALS = 4
"""Decimals of a skin tone's sRGB channels everywhere: typing a tone that was shown gives the same maps."""
SWATCHES = 10
"""Swatches of skin that a tone may be chosen from by number: 1 is the lightest (skin_swatches.py)."""
LUMINANCE_WEIGHTS = (0.2126, 0.7152, 0.0722)
"""Of linear sRGB (Rec.709)."""
Colour = tuple[float, float, float]


def parse_skin_tone(text: str) -> Colour | int | None:
    """Parse three shares (0.69,0.54,0.46), three 8-bit values (176,138,118), #B08A76, B08A76, or a swatch (6).

    Returns encoded sRGB in (0, 1], rounded to TONE_DECIMALS, or the swatch's number from 1 to SWATCHES, whose colour
    depends on the person's hue; None for auto. Raises Problem for anything else.
    """
    text = text.strip()
    if text == "auto":
        return None
    if re.fullmatch("[0-9]{1,2}", text) and 1 <= int(text) <= SWATCHES:
        return int(text)
    if re.fullmatch("#?[0-9a-fA-F]{6}", text):
        channels = [byte / 255 for byte in bytes.fromhex(text.removeprefix("#"))]
    else:
        channels = _numbers(text)
        if max(channels, default=0) > 1 and all(channel.is_integer() for channel in channels):
            channels = [channel / 255 for channel in channels]
    channels = [round(channel, TONE_DECIMALS) for channel in channels]
    if len(channels) != 3 or not all(0 < channel <= 1 for channel in channels):
        raise Problem(
            f"The skin tone {text!r} is not a colour.",
            "Write it in sRGB as 0.69,0.54,0.46, as 176,138,118 or as #B08A76, as the number of a swatch from "
            f"1 (light) to {SWATCHES} (dark), or write auto.",
        )
    return tuple(channels)


def format_skin_tone(srgb) -> str:
    """Write encoded sRGB, three numbers, as `parse_skin_tone` reads it."""
    return ",".join(f"{channel:.{TONE_DECIMALS}f}" for channel in srgb)


def to_linear(colour) -> Colour:
    """Decode three channels of sRGB to linear light."""
    return tuple(v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in colour)


def describe_estimate(deviation: float | None) -> tuple[str, str]:
    """Describe an estimated skin tone, and advise on it; `deviation` in L*, None if it is not known any more."""
    return f"Skin tone: estimated{'' if deviation is None else f', ±{deviation:.0f}'}.", "Choose it if it looks wrong."


def parse_white_point(text: str) -> Colour | None:
    """Parse linear R, G and B of a white surface, each between 0.001 and 100; None for auto.

    Raises Problem for anything else.
    """
    if text.strip() == "auto":
        return None
    channels = _numbers(text)
    if len(channels) != 3 or not all(1e-3 < channel < 100 for channel in channels):
        raise Problem(
            f"The white point {text!r} is not a colour.",
            "Give three numbers above 0 as linear light, as `core white` prints them, or auto.",
        )
    return tuple(channels)


def _numbers(text: str) -> list[float]:
    try:
        return [float(number) for number in text.split(",")]
    except ValueError:
        return []
