# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces and people in pictures: MediaPipe's detector, landmarks, eyelids and segmentation, run by OpenCV.

The networks lie in core/weights/face_nets, with their notice (Apache-2.0). Bazarevsky et al., BlazeFace (2019);
Kartynnik et al., Real-time Facial Surface Geometry (2019).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from ..capture import shipped_files
from ..capture.messages import Problem
from .parts import from_centres, to_picture

RIGHT_EYE, LEFT_EYE = (33, 133), (362, 263)
"""Landmarks at the outer and inner corner of the person's right eye, and the inner and outer of the left: they stay put
when the lids close."""
BROW, CHIN, NOSE = 9, 152, 1
LIP_LINE = (61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291, 409, 270, 269, 267, 0, 37, 39, 40, 185)
BROW_LINES = ((276, 283, 282, 295, 285, 336, 296, 334, 293, 300), (46, 53, 52, 65, 55, 107, 66, 105, 63, 70))
EYE_LINES = (
    (263, 249, 390, 373, 374, 380, 381, 382, 362, 398, 384, 385, 386, 387, 388, 466),
    (33, 7, 163, 144, 145, 153, 154, 155, 133, 173, 157, 158, 159, 160, 161, 246),
)
"""Closed outlines in landmarks; of brows and lids the person's left and right."""
EYE_CROP_EYE_WIDTHS = 2.3  # side of the eye network's square, in distances between the eye's corners
NEAR_DEG, FAR_DEG = 50.0, 25.0
"""Maximum turn of the head for marks of the eye on the near side of the nose to hold, and of the one beyond it."""
AS_OPEN_SHARE = 0.3
"""Maximum deviation of an eye's opening from its usual one, as a share: beyond is a blink or a look down."""
DATA_FILES = (
    "weights/face_nets/face_detection_short_range.tflite",
    "weights/face_nets/face_landmark.tflite",
    "weights/face_nets/iris_landmark.tflite",
    "weights/face_nets/selfie_segmentation.tflite",
)
_SHORT_RANGE, _LANDMARK, _EYE, _SEGMENTATION = (Path(__file__).resolve().parents[1] / name for name in DATA_FILES)


@dataclass(frozen=True)
class Face:
    """Face in a picture.

    box (x0, y0, x1, y1) of its landmarks [px]; landmarks float32 [468, 3] (x, y in pixels, centres at +0.5; z towards
    the scene behind, relative, same scale); score in [0, 1].
    """

    box: tuple[float, float, float, float]
    landmarks: np.ndarray
    score: float

    @property
    def width(self) -> float:
        """Width of the box in pixels."""
        return self.box[2] - self.box[0]

    @property
    def yaw_deg(self) -> float:
        """Turn of the head in degrees: 0 faces the camera, positive turns to the picture's right."""
        across = self.landmarks[list(LEFT_EYE)].mean(0) - self.landmarks[list(RIGHT_EYE)].mean(0)
        return float(np.degrees(np.arctan2(across[2], np.linalg.norm(across[:2]))))


@dataclass(frozen=True)
class Eye:
    """Eye in a picture, in pixels (centres at +0.5).

    Upper and lower edge of its lids [9, 2], both from the outer corner to the inner one; centre [2] and radius of the
    iris.
    """

    upper: np.ndarray
    lower: np.ndarray
    iris: np.ndarray
    iris_radius: float

    @property
    def opening(self) -> float:
        """Height over width between the lids."""
        width = np.linalg.norm(self.upper[-1] - self.upper[0])
        return float(np.linalg.norm(self.upper[3:6] - self.lower[3:6], axis=1).mean() / max(width, 1e-6))

    def is_open_as(self, usual: float) -> bool:
        """Return True if the eye is about as open as one of this `opening`."""
        return abs(self.opening / usual - 1) < AS_OPEN_SHARE

    def scaled(self, scale: np.ndarray) -> Eye:
        """Return the eye in the picture at another size; scale [2] is new over old width and height, nearly alike."""
        return Eye(self.upper * scale, self.lower * scale, self.iris * scale, self.iris_radius * float(np.mean(scale)))


def detect(srgb: np.ndarray, last: Face | None = None) -> Face | None:
    """Find the most prominent face (large and central) of an sRGB picture [H, W, 3] in [0, 1], or None.

    `last`, the face of the frame before, is followed first: turned heads stay found where the detector alone loses
    them. Raises Problem where the networks are missing.
    """
    image = np.clip(np.asarray(srgb, np.float32), 0, 1)
    if last is not None:
        face = _landmarks(image, _region_of_landmarks(last.landmarks))
        if face is not None and face.score > 0.6:
            return face
    for margin in (0.0, 0.5):  # a face that fills the picture is found at a smaller size
        # the most prominent may not be a face: a print on a shirt
        face = next(filter(None, (_landmarks(image, region) for region in _detect_regions(image, margin))), None)
        if face is not None:
            return _landmarks(image, _region_of_landmarks(face.landmarks)) or face
    return None


def detect_others(srgb: np.ndarray, face: Face) -> list[Face]:
    """Find every other face that both networks are sure of, the most prominent first."""
    image = np.clip(np.asarray(srgb, np.float32), 0, 1)
    x, y = _middle(face)
    others = []
    for region in _detect_regions(image, 0.0):
        if np.hypot(region[0] - x, region[1] - y) > 0.5 * max(face.width, region[2] / 1.5):
            other = _landmarks(image, region)
            sure = other is not None and other.score > 0.8
            if sure and np.hypot(*np.subtract(_middle(other), (x, y))) > 0.5 * face.width:
                others.append(other)
    return others


def prominence(face: Face, width: int, height: int) -> float:
    """Return how much a face is the subject of a picture: its width in pixels, halved towards the corners."""
    return face.width * _centrality(*_middle(face), width, height)


def eye_openness(srgb: np.ndarray, face: Face) -> tuple[float, float]:
    """Return height over width of the opening of the person's right and left eye.

    Open is 0.25 to 0.5, closed about 0.1, seen from the front. By the eye network: the face mesh calls closed lids half
    open.
    """
    right, left = find_eyes(srgb, face)
    return right.opening, left.opening


def shows_eye(yaw_deg: float, side: int) -> bool:
    """Return True if marks of the left (0) or right (1) eye hold on a head turned by so much."""
    away = yaw_deg if side == 0 else -yaw_deg  # positive: the eye is on the far side
    return -NEAR_DEG < away < FAR_DEG


def find_eyes(srgb: np.ndarray, face: Face) -> tuple[Eye, Eye]:
    """Find the person's right and left eye in an sRGB picture [H, W, 3].

    By the eye network: Ablavatski et al., Real-time Pupil Tracking (2020).
    """
    image = np.clip(np.asarray(srgb, np.float32), 0, 1)
    return _find_eye(image, face, RIGHT_EYE, False), _find_eye(image, face, LEFT_EYE[::-1], True)


def _find_eye(image: np.ndarray, face: Face, corners: tuple[int, int], mirrored: bool) -> Eye:
    """Find one eye by its landmarks `corners`, the outer and the inner one."""
    ends = face.landmarks[list(corners), :2].astype(np.float64)
    from_, to = ends[::-1] if mirrored else ends
    side = EYE_CROP_EYE_WIDTHS * max(float(np.linalg.norm(to - from_)), 1.0)
    crop, to_crop = _crop(image, (*((from_ + to) / 2), side, np.arctan2(*(to - from_)[::-1])), 64)
    # the network knows right eyes only
    outputs = {points.size: points.reshape(-1, 3)[:, :2] for points in _run(_EYE, crop[:, ::-1] if mirrored else crop)}
    marks = np.concatenate([outputs[213][:16], outputs[15]])
    if mirrored:
        marks[:, 0] = 64 - marks[:, 0]
    marks = to_picture(marks, to_crop)
    contour = marks[:16]  # 9 below from the outer corner to the inner one, 7 above
    return Eye(
        contour[[0, *range(9, 16), 8]],
        contour[:9],
        marks[16],
        float(np.linalg.norm(marks[17:] - marks[16], axis=1).mean()),
    )


def segment_person(srgb: np.ndarray) -> np.ndarray:
    """Return the certainty [H, W] in [0, 1] that a pixel of an sRGB picture belongs to a person, float32."""
    height, width = srgb.shape[:2]
    small = cv2.resize(np.clip(np.asarray(srgb, np.float32), 0, 1), (256, 256), interpolation=cv2.INTER_AREA)
    mask = _run(_SEGMENTATION, small)[0].reshape(256, 256)
    return np.clip(cv2.resize(mask, (width, height), interpolation=cv2.INTER_LINEAR), 0, 1)


def _detect_regions(image: np.ndarray, margin: float) -> list[tuple]:
    """Return detections as square regions (centre x, y, side [px], angle [rad]), the most prominent first.

    `margin` pads the picture by that share of its long side.
    """
    height, width = image.shape[:2]
    side = max(height, width) * (1 + 2 * margin)
    scale = 128 / side
    move = np.array([[scale, 0, 64 - scale * width / 2], [0, scale, 64 - scale * height / 2]], np.float32)
    shrunk = cv2.resize(
        image, (max(1, round(width * scale)), max(1, round(height * scale))), interpolation=cv2.INTER_AREA
    )
    square = np.zeros((128, 128, 3), np.float32)
    top, left = (128 - shrunk.shape[0]) // 2, (128 - shrunk.shape[1]) // 2
    square[top : top + shrunk.shape[0], left : left + shrunk.shape[1]] = shrunk
    scores, boxes = _run(_SHORT_RANGE, square * 2 - 1)
    scores, boxes = scores.reshape(-1), boxes.reshape(-1, 16)
    sure = scores > 0  # logit of 0.5
    # every pair but width and height is relative to the anchor
    boxes = boxes[sure] + np.tile(_anchors()[sure], 8) * (np.arange(16) // 2 != 1)
    weight = 1 / (1 + np.exp(-np.clip(scores[sure], -100, 100)))
    regions = []
    while len(boxes):
        # the most prominent, not merely the surest
        best = np.argmax(weight * np.sqrt(np.abs(boxes[:, 2] * boxes[:, 3])))
        distance = np.linalg.norm(boxes[:, :2] - boxes[best, :2], axis=1) / boxes[best, 2]
        # blended, as MediaPipe's weighted suppression
        box = np.average(boxes[distance < 0.4], axis=0, weights=weight[distance < 0.4])
        right_eye, left_eye = box[4:6], box[6:8]
        angle = np.arctan2(*(left_eye - right_eye)[::-1])
        x, y = (box[:2] - move[:, 2]) / scale
        regions.append(
            (weight[best] * box[2] * _centrality(x, y, width, height), (x, y, 1.5 * max(box[2], box[3]) / scale, angle))
        )
        boxes, weight = boxes[distance >= 0.7], weight[distance >= 0.7]
    return [region for _, region in sorted(regions, key=lambda scored: -scored[0])]


def _middle(face: Face) -> tuple[float, float]:
    return (face.box[0] + face.box[2]) / 2, (face.box[1] + face.box[3]) / 2


def _centrality(x: float, y: float, width: int, height: int) -> float:
    """Return 1 in the middle of a picture, 0.5 in its corners."""
    return 1 - 0.5 * min(1.0, float(np.hypot(x - width / 2, y - height / 2) / np.hypot(width / 2, height / 2)))


def _region_of_landmarks(landmarks: np.ndarray) -> tuple:
    """Return the square region to read a face mesh from: 1.5 times as large as the mesh, eyes level."""
    across = landmarks[LEFT_EYE[1], :2] - landmarks[RIGHT_EYE[0], :2]
    angle = np.arctan2(across[1], across[0])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    level = landmarks[:, :2] @ turn.T
    low, high = level.min(0), level.max(0)
    return (*(turn.T @ ((low + high) / 2)), 1.5 * (high - low).max(), angle)


def _landmarks(image: np.ndarray, region: tuple) -> Face | None:
    """Read the face mesh in a region of the picture; None without a face."""
    side = region[2]
    if not 8 < side < 20 * max(image.shape[:2]):
        return None
    crop, to_crop = _crop(image, region, 192)
    score, points = _run(_LANDMARK, crop, ("conv2d_31", "conv2d_21"))
    score = float(1 / (1 + np.exp(-score.ravel()[0])))
    if score < 0.5:
        return None
    points = points.reshape(468, 3)
    landmarks = np.empty((468, 3), np.float32)
    landmarks[:, :2] = to_picture(points[:, :2], to_crop)
    landmarks[:, 2] = points[:, 2] * side / 192
    low, high = landmarks[:, :2].min(0), landmarks[:, :2].max(0)
    return Face((float(low[0]), float(low[1]), float(high[0]), float(high[1])), landmarks, score)


def _crop(image: np.ndarray, region: tuple, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Cut a square region at `size` x `size`, eyes level; and the map [2, 3] to it in pixel-edge coordinates."""
    x, y, side, angle = region
    scale = size / side
    c, s = np.cos(angle) * scale, np.sin(angle) * scale
    to_crop = np.array([[c, s, size / 2 - c * x - s * y], [-s, c, size / 2 + s * x - c * y]])
    source = image
    if scale < 0.5:  # warpAffine would alias
        blur = 0.5 / scale
        source = cv2.GaussianBlur(image, (0, 0), blur / 2) if blur < 4 else cv2.blur(image, (int(blur), int(blur)))
    return cv2.warpAffine(source, from_centres(to_crop), (size, size), flags=cv2.INTER_LINEAR), to_crop


@cache
def _anchors() -> np.ndarray:
    """Return centres of the 896 anchors [896, 2] in pixels of 128 x 128.

    Two per cell of 16 x 16, six per cell of 8 x 8.
    """
    anchors = []
    for cells, per_cell in ((16, 2), (8, 6)):
        middles = (np.arange(cells) + 0.5) * 128 / cells
        anchors.append(np.stack(np.meshgrid(middles, middles), -1).reshape(-1, 2).repeat(per_cell, 0))
    return np.concatenate(anchors)


def _run(network: Path, image: np.ndarray, outputs: tuple | None = None) -> list[np.ndarray]:
    """Return a network's outputs for a picture [S, S, 3] already in its range."""
    net = _net(network)
    net.setInput(np.ascontiguousarray(image.transpose(2, 0, 1)[None], np.float32))
    return net.forward(outputs or net.getUnconnectedOutLayersNames())


@cache
def _net(path: Path):
    shipped_files.require_whole(path)
    try:
        # by content: OpenCV may not open a path with accents
        return cv2.dnn.readNetFromTFLite(np.fromfile(path, np.uint8))
    except cv2.error as error:
        raise Problem(
            f"OpenCV {cv2.__version__} cannot read the network {path.name}.",
            "Click Install Solver again to install a compatible OpenCV.",
        ) from error
