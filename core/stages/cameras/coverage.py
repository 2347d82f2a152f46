# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sides from which the face was filmed, and those that are missing, in an artist's words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

SIDE_DEG = 35.0
"""A side is missing if no camera stands so far round on it; the ears come into view at about twice that."""
WANTED_DEG = 60.0
GAP_DEG = 30.0
"""Wider steps between neighbouring cameras than this leave holes and tear matching."""
LEVEL_DEG = 5.0  # range of the cameras' heights below which all count as level


def spread_evenly(members: Sequence, most: int) -> list:
    """Return at most `most` of the members, evenly spread, the first and the last among them."""
    return (
        [members[i] for i in np.unique(np.linspace(0, len(members) - 1, min(most, len(members))).round().astype(int))]
        if members
        else []
    )


def angles(centres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return azimuth [N] and elevation [N] of camera centres [N, 3] in the head's world, in degrees.

    Azimuth is 0 in front, positive on the person's left.
    """
    x, y, z = centres.T
    return np.degrees(np.arctan2(x, -y)), np.degrees(np.arctan2(z, np.hypot(x, y)))


def widest_deg(centres: np.ndarray) -> float:
    """Return the widest angle between two camera centres [N, 3] around the head (the origin), in degrees."""
    directions = centres / np.linalg.norm(centres, axis=1, keepdims=True)
    return float(np.degrees(np.arccos(np.clip(directions @ directions.T, -1, 1)).max()))


def missing(centres: np.ndarray) -> list[tuple[str, str]]:
    """Return (problem, remedy) for each side without cameras, for gaps between them, and for a single height."""
    azimuth, elevation = angles(centres)
    azimuth = np.sort(azimuth)
    findings = []
    for side, reach in (("left", azimuth[-1]), ("right", -azimuth[0])):
        if reach >= WANTED_DEG:
            continue
        other = "right" if side == "left" else "left"
        where = (
            f"{_degrees(reach)} to the person's {side} of the nose"
            if reach > 1
            else f"before the nose, on the person's {other}"
        )
        findings.append(
            (
                f"{'Nothing' if reach < SIDE_DEG else 'Little'} was seen from the person's {side} side: the "
                f"pictures end {where}.",
                f"Go on around the face until the person's {side} ear is in the middle of the picture; "
                "otherwise that side is guessed.",
            )
        )
    for low, high in zip(azimuth[:-1], azimuth[1:], strict=True):
        if high - low > GAP_DEG:
            findings.append(
                (
                    f"Between {_place(low)} and {_place(high)} there is no picture: a gap of {high - low:.0f} degrees.",
                    "Take a picture at least every 15 degrees on the way around the face.",
                )
            )
    if len(centres) >= 6 and np.ptp(elevation) < LEVEL_DEG:
        findings.append(
            (
                "All pictures were taken from one height: under the chin and the nose little was seen.",
                "Go around the face once more from a little below, or move the camera up and down on the way.",
            )
        )
    return findings


def _degrees(angle: float) -> str:
    return f"{angle:.0f} degrees"


def _place(azimuth: float) -> str:
    return (
        "the front"
        if abs(azimuth) < 3
        else f"{_degrees(abs(azimuth))} to the person's {'left' if azimuth > 0 else 'right'}"
    )
