# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Solved cameras against known ones: `python -m research.benchmarks.head.cameras_against_truth CAPTURE TRUTH`.

TRUTH holds cameras.json: {"focal_px", "width", "cameras": [{"frame", "matrix_world"}]}, Blender's camera-to-world.
Centres are compared after a similarity fit, as shares of the mean distance from the cameras to what they look at. A
film of a head that sways has the cameras with respect to the head there: what counts is then how far points of the face
lie from where they were filmed, face_off_px, after the similarity that makes them lie best in all frames.
"""

import json
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from core.capture.capture import Capture
from core.capture.frame_records import read_frames
from core.geometry.views import View, read_views

BLENDER_TO_COLMAP = np.diag([1.0, -1.0, -1.0])
FACE = np.array(
    [
        [0, 0, 0],
        [0, -0.03, -0.04],
        [0.06, 0.03, -0.03],
        [-0.06, 0.03, -0.03],
        [0.03, 0, 0.03],
        [-0.03, 0, 0.03],
        [0, -0.01, -0.09],
    ]
)
"""Points about a face [N, 3], metres in the head's world: between the eyes, nose, sides, forehead, chin."""


def compare(capture: Capture, truth: Path) -> dict:
    """Return the figures of a capture's cameras against a truth folder's."""
    record = json.loads((truth / "cameras.json").read_text(encoding="utf-8"))
    true = {camera["frame"]: np.array(camera["matrix_world"]) for camera in record["cameras"]}
    views, matrices = _paired(capture, true)
    centres, true_centres = np.array([view.centre for view in views]), matrices[:, :3, 3]
    scale, rotation, translation = similarity(centres, true_centres)
    target = _looked_at(true_centres, -matrices[:, :3, 2])
    distance = np.linalg.norm(true_centres - target, axis=1).mean()
    errors = np.linalg.norm(scale * centres @ rotation.T + translation - true_centres, axis=1) / distance
    cosines = [
        (np.trace(m[:3, :3] @ BLENDER_TO_COLMAP @ v.rotation @ rotation.T) - 1) / 2
        for v, m in zip(views, matrices, strict=True)
    ]
    turned = [np.degrees(np.arccos(np.clip(cosine, -1, 1))) for cosine in cosines]
    off = place_truth(capture, truth)[1]
    up = rotation @ [0, 0, 1]
    forward = rotation @ [0, -1, 0]
    return {
        "frames": len(true),
        "registered": len(views),
        "centre_error_median_percent": 100 * np.median(errors),
        "centre_error_max_percent": 100 * errors.max(),
        "rotation_error_median_deg": np.median(turned),
        "focal_px": views[0].camera.mean_focal_length() * record["width"] / views[0].width,
        "true_focal_px": record["focal_px"],
        "true_units_per_metre": scale,
        "face_off_px_mean": off.mean(),
        "face_off_px_max": off.max(),
        "up_tilt_deg": np.degrees(np.arccos(np.clip(up[2], -1, 1))),
        "facing_off_deg": np.degrees(np.arctan2(forward[0], -forward[1])),
    }


def place_truth(capture: Capture, truth: Path) -> tuple[tuple[float, np.ndarray, np.ndarray], np.ndarray]:
    """Return the similarity that takes the truth's world (m) to the capture's, and its error per frame [V] in px.

    The similarity, (scale, rotation [3, 3], translation [3]), makes points of the face lie where they were filmed.
    """
    record = json.loads((truth / "cameras.json").read_text(encoding="utf-8"))
    views, matrices = _paired(
        capture, {camera["frame"]: np.array(camera["matrix_world"]) for camera in record["cameras"]}
    )
    local = (
        np.einsum("vij,vnj->vni", matrices[:, :3, :3].transpose(0, 2, 1), FACE - matrices[:, None, :3, 3])
        @ BLENDER_TO_COLMAP
    )
    aims = record["focal_px"] * local[..., :2] / local[..., 2:] + np.array([record["width"], record["height"]]) / 2
    aims = aims * (np.array([view.width for view in views]) / record["width"])[:, None, None]
    scale, rotation, translation = similarity(matrices[:, :3, 3], np.array([view.centre for view in views]))

    def placed(change: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        return (
            np.exp(change[6]) * scale,
            Rotation.from_rotvec(change[:3]).as_matrix() @ rotation,
            translation + change[3:6],
        )

    def off(change: np.ndarray) -> np.ndarray:
        size, turn, shift = placed(change)
        return np.array([view.project(size * FACE @ turn.T + shift)[0] for view in views]) - aims

    found = least_squares(lambda change: off(change).ravel(), np.zeros(7), loss="soft_l1").x
    return placed(found), np.linalg.norm(off(found), axis=2).mean(1)


def similarity(source: np.ndarray, target: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return scale, rotation [3, 3], translation [3] that take source [N, 3] to target (Umeyama 1991)."""
    a, b = source - source.mean(0), target - target.mean(0)
    u, s, vt = np.linalg.svd(b.T @ a)
    sign = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    rotation = u @ sign @ vt
    scale = (s * np.diag(sign)).sum() / (a**2).sum()
    return scale, rotation, target.mean(0) - scale * rotation @ source.mean(0)


def _paired(capture: Capture, true: dict) -> tuple[list[View], np.ndarray]:
    frames = read_frames(capture).by_name
    views = [view for view in read_views(capture) if frames[view.name].video_frame in true]
    return views, np.array([true[frames[view.name].video_frame] for view in views])


def _looked_at(centres: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the point nearest to all optical axes."""
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    return np.linalg.solve(across.sum(0), (across @ centres[:, :, None]).sum(0))[:, 0]


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    for name, value in compare(Capture(sys.argv[1]), Path(sys.argv[2])).items():
        print(f"{name:30} {value:.4g}")
