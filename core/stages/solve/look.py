# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Look of a person in pictures: the colour of the facial skin, and what it is over that of the whites of the eyes.

Skin and whites share one light, so the ratio has neither exposure nor the light's colour in it (Choi and Suk, "The
human sclera and pupil as the calibration targets", 2017). Skin is read where a face's landmarks face the front, as the
eyes do, and a card that is held before them. An eye's white is held against the skin around that eye alone, where a
hard light is most alike and skin shines least. Of a white the brightest part counts, which the lids shade least; where
that is burnt out, a darker one. No head and no camera is needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from ...capture.capture import Capture
from ...capture.frame_records import FrameRecord, read_frames
from ...capture.messages import Reporter
from ...face import eye_reader, faces, parser
from ...face.landmark_model import template_landmarks
from ...face.parts import cut
from ...geometry import raster
from ...imaging import images
from ...settings import colour_values

BURNT_SRGB = 0.98  # sRGB from which a channel has lost its value
LUMINANCE_WEIGHTS = np.array(colour_values.LUMINANCE_WEIGHTS)
FRONT_COSINE = 0.9  # between the front and the built-in head's normal at a landmark, from which it faces the front
SKIN_QUANTILES = 0.1, 0.9  # of luminance, between which skin is averaged
WHITE_BANDS = ((0.85, 0.99), 0.0), ((0.6, 0.85), 0.14), ((0.35, 0.6), 0.32), ((0.1, 0.35), 0.54)
"""Quantiles of an eye's white, from the brightest part down, and the natural log by which each is darker than the
first: the mean over the simulated people of `research.training tones`. What is above the first is catchlights."""
BURNT_SHARE = 0.1  # of such a part, from which it is not read
SMOOTHING_SHARE = 0.01  # deviation over the face's width of the blur at a landmark: pores and noise do not count
SURE_SHARE = 0.9  # of a pixel, from which it counts as skin or as an eye's white
ONE_EYE_LOG = 0.23  # natural log by which two eyes are taken to differ where one is seen: the mean over those people
MIN_EYE_PX = 24  # distance between an eye's corners below which lashes and lids cover its white
AROUND_EYE_WIDTHS = 1.2  # reach from an eye's middle of the skin that is held against its white
MIN_LANDMARKS, MIN_AROUND, MIN_PIXELS = 10, 8, 40  # of skin, of skin around an eye, and of white
MAX_YAW_DEG = 35.0  # of a frame whose eyes are looked at
MAX_PICTURES = 8


@dataclass(frozen=True)
class Eyes:
    """Skin around open eyes over their whites.

    over_white: `to_coordinates` of the skin less those of the whites [3]; unevenness: of the light there, the range of
    the skin's log luminance around an eye, and by how much the two eyes differ; burnt: if the whites are burnt out, and
    therefore brighter than was read.
    """

    over_white: np.ndarray
    unevenness: float
    burnt: bool = False


@dataclass(frozen=True)
class Look:
    """Look of a person.

    skin: its `to_coordinates` [3]; unevenness: of the light, the range of the skin's log luminance; eyes: None without
    open ones.
    """

    skin: np.ndarray
    unevenness: float = 0.0
    eyes: Eyes | None = None


def to_coordinates(linear: np.ndarray) -> np.ndarray:
    """Return ln luminance, ln R/G, ln B/G [..., 3] of linear colours [..., 3]."""
    log = np.log(np.maximum(linear, 1e-4))
    luminance = np.log(np.maximum(linear @ LUMINANCE_WEIGHTS, 1e-4))
    return np.stack([luminance, log[..., 0] - log[..., 1], log[..., 2] - log[..., 1]], -1)


def mean_between(colours: np.ndarray, quantiles: tuple[float, float]) -> np.ndarray:
    """Return the mean [C] of linear colours [N, C], with further channels, of luminance between two quantiles."""
    luminance = colours[:, :3] @ LUMINANCE_WEIGHTS
    low, high = np.quantile(luminance, quantiles)
    return colours[(luminance >= low) & (luminance <= high)].mean(0)


def read_look(capture: Capture, report: Reporter) -> Look | None:
    """Return the look in the frames as they were filmed, the median over those from in front; None without any."""
    looks = []
    records = _frontal(read_frames(capture).records) if capture.frames_json.is_file() else []
    for i, record in enumerate(records):
        report.progress(i, len(records), f"looking at the skin in frame {i + 1} of {len(records)}")
        path = capture.frames / record.name
        if path.is_file():
            looks.append(look_at(images.read_srgb(path)))
    return merge_looks(looks)


def merge_looks(looks: list[Look | None]) -> Look | None:
    """Return the median of the looks that pictures show, None without any. Burnt whites count where all are burnt."""
    looks = [look for look in looks if look is not None]
    if not looks:
        return None
    eyes = [look.eyes for look in looks if look.eyes is not None]
    eyes = [each for each in eyes if not each.burnt] or eyes
    return Look(
        np.median([look.skin for look in looks], 0),
        float(np.median([look.unevenness for look in looks])),
        Eyes(
            np.median([each.over_white for each in eyes], 0),
            float(np.median([each.unevenness for each in eyes])),
            eyes[0].burnt,
        )
        if eyes
        else None,
    )


def _frontal(records: tuple[FrameRecord, ...]) -> list[FrameRecord]:
    """Return up to MAX_PICTURES frames that show the face from in front with open eyes, else from where they do."""
    shown = [record for record in records if record.face_box]
    frontal = [r for r in shown if abs(r.yaw_deg) <= MAX_YAW_DEG and not r.blink] or shown
    frontal.sort(key=lambda record: abs(record.yaw_deg))
    return frontal[:: max(1, len(frontal) // MAX_PICTURES)][:MAX_PICTURES]


def look_at(srgb: np.ndarray) -> Look | None:
    """Return the look of the person in an sRGB picture [H, W, 3]; None without a face or with too little skin."""
    face = faces.detect(srgb)
    if face is None:
        return None
    linear = images.srgb_to_linear(srgb).astype(np.float32)
    whole = (srgb.max(-1) < BURNT_SRGB).astype(np.float32)
    bare = parser.parse(srgb, face.landmarks).of("skin") * whole
    marks = face.landmarks[_front_landmarks(), :2]
    marks = marks[raster.sample(bare, marks) > SURE_SHARE]
    colours = raster.sample(cv2.GaussianBlur(linear, (0, 0), SMOOTHING_SHARE * face.width), marks)
    above = marks[:, 1] < face.landmarks[faces.NOSE, 1]  # below, a beard's colour is not the skin's
    if above.sum() < MIN_LANDMARKS:
        return None
    skin, unevenness = _read_skin(colours[above])
    readings = []
    for outer, inner, left in ((*faces.RIGHT_EYE, False), (*faces.LEFT_EYE[::-1], True)):
        corners = face.landmarks[[outer, inner], :2]
        width = np.linalg.norm(corners[1] - corners[0])
        white = _read_white(srgb, linear, corners, left) if width >= MIN_EYE_PX else None
        if white is not None:
            near = np.linalg.norm(marks - corners.mean(0), axis=1) < AROUND_EYE_WIDTHS * width
            around, range_ = _read_skin(colours[near]) if near.sum() >= MIN_AROUND else (skin, unevenness)
            readings.append(Eyes(around - white[0], range_, white[1]))
    return Look(skin, unevenness, _merge_eyes(readings) if readings else None)


def _read_skin(colours: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the coordinates [3] of skin that shows linear colours [N, 3], and the range of its log luminance."""
    low, high = np.quantile(to_coordinates(colours)[:, 0], SKIN_QUANTILES)
    return to_coordinates(mean_between(colours, SKIN_QUANTILES)), float(high - low)


def _read_white(
    srgb: np.ndarray, linear: np.ndarray, corners: np.ndarray, left: bool
) -> tuple[np.ndarray, bool] | None:
    """Return the coordinates [3] of an eye's white, and if all of it is burnt out; None if too little is seen."""
    eye = eye_reader.read_eye(srgb, corners, left)
    colours = cut(linear, eye.move, len(eye.ball))[eye.ball * (1 - eye.iris) > SURE_SHARE]
    if len(colours) < MIN_PIXELS:
        return None
    whole = (colours.max(-1) < images.srgb_to_linear(BURNT_SRGB)).astype(np.float32)
    parts = [mean_between(np.column_stack([colours, whole]), quantiles) for quantiles, _ in WHITE_BANDS]
    unburnt = [k for k, part in enumerate(parts) if part[3] > 1 - BURNT_SHARE]
    chosen = unburnt[0] if unburnt else len(parts) - 1
    return to_coordinates(parts[chosen][:3]) + [WHITE_BANDS[chosen][1], 0, 0], not unburnt


def _merge_eyes(readings: list[Eyes]) -> Eyes:
    """Return the mean of both eyes, or of the one whose white is not burnt out."""
    readings = [each for each in readings if not each.burnt] or readings
    over = np.array([each.over_white for each in readings])
    apart = np.ptp(over[:, 0]) if len(over) == 2 else ONE_EYE_LOG
    unevenness = np.mean([each.unevenness for each in readings]) + apart
    return Eyes(over.mean(0), float(unevenness), readings[0].burnt)


@cache
def _front_landmarks() -> np.ndarray:
    """Return the landmarks [N] that face the way that the face looks."""
    return np.flatnonzero(template_landmarks().normals @ [0, -1, 0] > FRONT_COSINE)
