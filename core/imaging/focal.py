# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Focal length of a photograph by its EXIF, as far as the picture itself and sense bear the tags out.

Tags are claims: cameras write wrong ones, and programs that resize or crop a picture keep what then no longer holds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from .exif import FOCAL_35MM, FOCAL_LENGTH, HEIGHT, MAKE, PLANE_RESOLUTION, PLANE_UNIT, WIDTH

DIAGONAL_35MM = 43.267
"""Of a frame of 35 mm film, 36 x 24 mm; pictures of other shapes are compared by their diagonal (CIPA DCG-001)."""
FILM, SENSOR = "35 mm equivalent", "lens and sensor"
LEAST_MM35, MOST_MM35 = 8.0, 1200.0
"""Focal lengths in mm of 35 mm film of which a straight picture of a face is conceivable: 139 and 2 degrees of view."""
LEAST_CROP, MOST_CROP = 0.4, 15.0
"""Ratio of the equivalent to the lens's own focal length: of the largest and the smallest sensors that were built."""
ASPECT_SLACK = 0.015
"""Relative difference of two aspects that count as one: rounding, and the borders of a raw picture."""
FRAMES_MM = (
    (53.4, 40.0),
    (48.5, 36.4),
    (43.9, 32.9),
    (36.0, 24.0),
    (28.7, 19.1),
    (23.6, 15.7),
    (22.3, 14.9),
    (20.7, 13.8),
    (18.7, 14.0),
    (17.3, 13.0),
    (13.2, 8.8),
)
"""Sensors from one inch up: medium formats, 35 mm film, APS-H, APS-C, Canon's APS-C, Foveon, 1.5 inch, four thirds, one
inch."""
CANON, NOT_CANON_MM = "canon", 23.6
"""Canon builds no sensor of that width; the 6D Mark II, of 35.9 mm, states one."""
FRAME_SLACK = 0.03
SMALL_MM, SMALL_PITCH_MM, SMALL_PIXELS = 12.0, 0.0036, 2.5e6
"""Smaller sensors are of any size, but have small pixels and many: a few large ones are left of a larger sensor's
picture that was resized."""
SIGMA_LOG, UNSURE_SIGMA_LOG = 0.03, 0.06
"""Deviation of the log of a stated focal length: whole millimetres, and focusing changes it; and where the picture was
resized or no recorded size shows that it is whole."""


@dataclass(frozen=True)
class Focal:
    """Focal length in mm of 35 mm film, by the diagonal; None if no tag is believed.

    source: FILM or SENSOR; deviation: of its log; doubt: why a tag was not believed, '' if there is none.
    """

    mm35: float | None = None
    source: str = ""
    deviation: float = 0.0
    doubt: str = ""


def read(tags: Mapping[int, float | str], width: int, height: int) -> Focal:
    """Return the focal length that EXIF tags tell of a picture of this size."""
    if min(width, height) < 1 or not {FOCAL_35MM, PLANE_RESOLUTION} & tags.keys():
        return Focal()
    recorded = sorted((_number(tags, WIDTH), _number(tags, HEIGHT)))
    real = sorted((width, height))
    if recorded[0] > 0 and abs(recorded[1] / recorded[0] / (real[1] / real[0]) - 1) > ASPECT_SLACK:
        return Focal(doubt=f"the picture was cropped from {recorded[1]:.0f} x {recorded[0]:.0f} pixels")
    whole = recorded[0] > 0 and abs(recorded[1] / real[1] - 1) < ASPECT_SLACK
    deviation = SIGMA_LOG if whole else UNSURE_SIGMA_LOG
    size = recorded if recorded[0] > 0 else real
    doubts = []
    for source, told in ((FILM, _by_film(tags)), (SENSOR, _by_sensor(tags, *size))):
        if isinstance(told, float):
            return Focal(told, source, deviation, "; ".join(doubts))
        doubts += [told] if told else []
    return Focal(doubt="; ".join(doubts))


def to_pixels(mm35: float, width: int, height: int) -> float:
    """Return a focal length in pixels of a picture of this size."""
    return mm35 / DIAGONAL_35MM * math.hypot(width, height)


def to_film(pixels: float, width: int, height: int) -> float:
    """Return a focal length in mm of 35 mm film, by the diagonal, of one in pixels."""
    return pixels * DIAGONAL_35MM / math.hypot(width, height)


def _number(tags: Mapping, tag: int) -> float:
    value = tags.get(tag, 0.0)
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else 0.0


def _by_film(tags: Mapping) -> float | str:
    """Return the stated equivalent, or why it cannot be, '' if none is stated (0 is EXIF's word for unknown)."""
    mm35, lens = _number(tags, FOCAL_35MM), _number(tags, FOCAL_LENGTH)
    if mm35 == 0:
        return ""
    if not LEAST_MM35 <= mm35 <= MOST_MM35:
        return f"{mm35:g} mm of 35 mm film is no lens for a face"
    if lens > 0 and not LEAST_CROP <= mm35 / lens <= MOST_CROP:
        return f"a lens of {lens:g} mm is none of {mm35:g} mm of 35 mm film"
    return mm35


def _by_sensor(tags: Mapping, short: float, long: float) -> float | str:
    """Return the equivalent by lens and sensor, of a picture of short x long pixels, or why it cannot be."""
    resolution, lens = _number(tags, PLANE_RESOLUTION), _number(tags, FOCAL_LENGTH)
    unit = {2: 25.4, 3: 10.0, 4: 1.0}.get(int(_number(tags, PLANE_UNIT) or 2))
    if min(resolution, lens) <= 0:
        return ""
    if not unit:
        return "the sensor's resolution has no unit"
    pitch = unit / resolution
    width, height = long * pitch, short * pitch
    if width < SMALL_MM:
        possible = pitch <= SMALL_PITCH_MM and long * short >= SMALL_PIXELS
    else:
        is_canon = str(tags.get(MAKE, "")).lower().startswith(CANON)
        possible = any(
            abs(width / frame - 1) < FRAME_SLACK
            and height < side * (1 + FRAME_SLACK)
            and not (is_canon and frame == NOT_CANON_MM)
            for frame, side in FRAMES_MM
        )
    if not possible:
        return f"no camera has a sensor of {width:.3g} x {height:.3g} mm with {long:.0f} x {short:.0f} pixels"
    mm35 = DIAGONAL_35MM * lens / math.hypot(width, height)
    if not LEAST_MM35 <= mm35 <= MOST_MM35:
        return f"{mm35:.3g} mm of 35 mm film is no lens for a face"
    return mm35
